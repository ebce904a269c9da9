use super::CollisionMesh;

/// A strip of `n` cells along x, two triangles each.
fn strip(n: u32, a: f64, b: f64) -> (Vec<f64>, Vec<[u32; 3]>) {
    let q = (0..=n)
        .flat_map(|i| [f64::from(i) * a, 0.0, 0.0, f64::from(i) * a, b, 0.0])
        .collect();
    let triangles =
        (0..n).flat_map(|i| [[2 * i, 2 * i + 2, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 1]]);
    (q, triangles.collect())
}

/// Every point and edge is owned by one patch; edges are those of the
/// triangles; local corners name the right points.
#[test]
fn patches_partition_the_mesh() {
    let (q, triangles) = strip(23, 1.0, 1.0);
    let m = CollisionMesh::from_positions(&q, triangles.clone(), &[], 0.1).unwrap();
    let (mut seen_t, mut seen_p, mut edges) = (Vec::new(), Vec::new(), 0);
    for i in 0..m.patches().len() {
        let p = m.patches().get(i);
        assert_eq!(p.first_edge as usize, edges);
        edges += p.ends.len();
        seen_p.extend_from_slice(&p.points[..p.owned]);
        for (t, c) in p.triangles.iter().zip(p.corners) {
            seen_t.push(*t);
            assert_eq!(c.map(|c| p.points[c as usize]), triangles[*t as usize]);
        }
        for (k, e) in p.ends.iter().enumerate() {
            let ends = e.map(|c| p.points[c as usize]);
            assert_eq!(ends, m.edges()[p.first_edge as usize + k]);
        }
    }
    seen_t.sort_unstable();
    seen_p.sort_unstable();
    assert!(seen_t.iter().copied().eq(0..46));
    assert!(seen_p.iter().copied().eq(0..48));
    assert_eq!(m.edges().len(), 24 + 2 * 23 + 23);
}

/// Areas of points and edges add up to that of the mesh, with obtuse triangles.
#[test]
fn areas_add_up() {
    for b in [1.0, 0.2, 5.0] {
        let (mut q, triangles) = strip(6, 1.0, b);
        // Shear, so that angles are obtuse.
        (0..14).for_each(|i| q[3 * i] += 1.3 * q[3 * i + 1]);
        let m = CollisionMesh::from_positions(&q, triangles, &[], 0.1).unwrap();
        let points: f64 = (0..14).map(|i| m.point_area(i)).sum();
        let edges: f64 = (0..m.edges().len() as u32).map(|e| m.edge_area(e)).sum();
        assert!((points - 6.0 * b).abs() < 1e-5 * b, "{points}");
        assert!((edges - 6.0 * b).abs() < 1e-5 * b, "{edges}");
    }
}

/// Rest neighbours within 1.5 thicknesses are excluded, farther ones are not,
/// and a folded position changes nothing.
#[test]
fn exclusion_follows_the_rest_shape() {
    let (q, triangles) = strip(10, 1.0, 10.0);
    let flat =
        |thickness| CollisionMesh::from_positions(&q, triangles.clone(), &[], thickness).unwrap();
    // Vertex 0 at x = 0; triangle 4 spans x in 2..3.
    assert!(!flat(1.3).excludes_vertex_triangle(0, 4));
    assert!(flat(1.4).excludes_vertex_triangle(0, 4));
    // Without any short edge the sets are empty.
    let m = flat(0.25);
    assert!(m.excludes_vertex_triangle(0, 0));
    assert!(!m.excludes_vertex_triangle(0, 2));
    let edge = |a, b| m.edges().iter().position(|e| *e == [a, b]).unwrap() as u32;
    assert!(m.excludes_edge_edge(edge(0, 1), edge(0, 2)));
    assert!(!m.excludes_edge_edge(edge(0, 1), edge(2, 3)));
}

/// A link excludes like a shared point and lets the rest distance pass once.
#[test]
fn links_join_points() {
    let (mut q, mut triangles) = strip(4, 1.0, 1.0);
    let (far, more) = strip(4, 1.0, 1.0);
    triangles.extend(more.iter().map(|t| t.map(|p| p + 10)));
    q.extend(far.iter().map(|x| x + 50.0));
    let m = CollisionMesh::from_positions(&q, triangles, &[[8, 10], [10, 9]], 0.2).unwrap();
    // The first triangle of the second strip holds point 10.
    assert!(m.excludes_vertex_triangle(8, 8));
    assert!(m.excludes_vertex_triangle(9, 8));
    assert!(!m.excludes_vertex_triangle(8, 15));
    assert!(!m.excludes_vertex_triangle(0, 8));
    let edge = |a, b| m.edges().iter().position(|e| *e == [a, b]).unwrap() as u32;
    assert!(m.excludes_edge_edge(edge(6, 8), edge(10, 11)));
    assert!(!m.excludes_edge_edge(edge(0, 1), edge(10, 11)));
    assert!(!m.excludes_edge_edge(edge(8, 9), edge(16, 18)));
}
