//! Detection finds every pair that can touch, once, and nothing excluded.

mod common;

use std::collections::BTreeSet;

use common::{Random, add_sheet};
use selvedge_collision::narrow::{closest_edge_edge, closest_point_triangle};
use selvedge_collision::{
    Aabb, BroadPhase, BruteForce, BvhParry, Candidates, CollisionBackend, CollisionError,
    CollisionMesh, HashGrid, ProximityBackend,
};

fn point(q: &[f64], i: u32) -> [f64; 3] {
    [0, 1, 2].map(|k| q[3 * i as usize + k])
}

/// Two crumpled layers and a start and an end of their motion.
fn crumple(seed: u64) -> (CollisionMesh, Vec<f64>, Vec<f64>) {
    let mut random = Random(seed);
    let (mut q, mut triangles) = (Vec::new(), Vec::new());
    add_sheet(&mut q, &mut triangles, 7, 6, 0.01, 0.0);
    add_sheet(&mut q, &mut triangles, 6, 7, 0.01, 0.003);
    let mesh = CollisionMesh::from_positions(&q, triangles, &[[3, 60], [10, 80]], 1e-3).unwrap();
    let start: Vec<f64> = q.iter().map(|x| 0.5 * x + 4e-3 * random.next()).collect();
    let end = start.iter().map(|x| x + 2e-3 * random.next()).collect();
    (mesh, start, end)
}

/// All pairs closer than `reach` at `q` that the mesh does not exclude.
fn close_pairs(mesh: &CollisionMesh, q: &[f64], reach: f64) -> Candidates {
    let mut out = Candidates::default();
    for v in 0..mesh.points() as u32 {
        for (t, c) in mesh.triangles().iter().enumerate() {
            let x = [point(q, v), point(q, c[0]), point(q, c[1]), point(q, c[2])];
            if !mesh.excludes_vertex_triangle(v, t as u32)
                && closest_point_triangle(&x).distance.abs() <= reach
            {
                out.vertex_triangle.push([v, t as u32]);
            }
        }
    }
    let edges = mesh.edges();
    for b in 0..edges.len() {
        for a in 0..b {
            let ends = [edges[a][0], edges[a][1], edges[b][0], edges[b][1]];
            let x = ends.map(|i| point(q, i));
            if !mesh.excludes_edge_edge(a as u32, b as u32)
                && closest_edge_edge(&x).distance.abs() <= reach
            {
                out.edge_edge.push([a as u32, b as u32]);
            }
        }
    }
    out
}

/// Nothing that comes within reach anywhere in the boxes of motion is missing;
/// every pair comes once, in order, and none is excluded.
#[test]
fn finds_every_close_pair() {
    for seed in 0..6 {
        let (mesh, start, end) = crumple(seed);
        let reach = 1.5e-3;
        let mut backend = ProximityBackend::new(BvhParry::new());
        let mut found = Candidates::default();
        backend
            .detect(&mesh, &start, &end, reach, &mut found)
            .unwrap();
        assert!(found.vertex_triangle.is_sorted_by(|a, b| a < b));
        assert!(found.edge_edge.is_sorted_by(|a, b| a < b));
        assert!(found.edge_edge.iter().all(|p| p[0] < p[1]));
        assert!(
            found
                .vertex_triangle
                .iter()
                .all(|p| !mesh.excludes_vertex_triangle(p[0], p[1]))
        );
        assert!(
            found
                .edge_edge
                .iter()
                .all(|p| !mesh.excludes_edge_edge(p[0], p[1]))
        );
        let vt: BTreeSet<_> = found.vertex_triangle.iter().collect();
        let ee: BTreeSet<_> = found.edge_edge.iter().collect();
        let mut random = Random(100 + seed);
        let mut met = 0;
        for k in 0..6 {
            let q: Vec<f64> = (0..start.len())
                .map(|i| {
                    let t = if k < 3 {
                        0.5 * f64::from(k)
                    } else {
                        0.5 + 0.5 * random.next()
                    };
                    start[i] + t * (end[i] - start[i])
                })
                .collect();
            let close = close_pairs(&mesh, &q, reach);
            met += close.len();
            for p in &close.vertex_triangle {
                assert!(
                    vt.contains(p),
                    "seed {seed}: vertex-triangle pair {p:?} is missing"
                );
            }
            for p in &close.edge_edge {
                assert!(
                    ee.contains(p),
                    "seed {seed}: edge-edge pair {p:?} is missing"
                );
            }
        }
        assert!(met > 1000, "the scene must have contacts, not {met}");
        // The distance test keeps the list tight.
        assert!(
            found.len() < 12 * met / 6,
            "{} candidates for {met} / 6 pairs",
            found.len()
        );
    }
}

/// Single precision changes nothing: the candidates are the pairs that pass the
/// tests in double precision, near the origin and far from it, and no bound is
/// above its distance.
#[test]
fn candidates_are_those_of_double_precision() {
    let reach = 1.5e-3;
    for (seed, shift) in [(1, 0.0), (2, 40.0), (3, 3e4)] {
        let (mesh, mut start, mut end) = crumple(seed);
        start.iter_mut().chain(&mut end).for_each(|x| *x += shift);
        let mut backend = ProximityBackend::new(BvhParry::new());
        let mut found = Candidates::default();
        backend
            .detect(&mesh, &start, &end, reach, &mut found)
            .unwrap();
        let way = |p: u32| {
            let (a, b) = (point(&start, p), point(&end, p));
            (0..3).map(|k| (b[k] - a[k]).powi(2)).sum::<f64>().sqrt()
        };
        let swept = |points: &[u32]| {
            let all = points
                .iter()
                .flat_map(|p| [point(&start, *p), point(&end, *p)]);
            Aabb::of_points(&all.collect::<Vec<_>>())
        };
        let longest = |points: &[u32]| points.iter().map(|p| way(*p)).fold(0.0, f64::max);
        let passes = |a: &[u32], b: &[u32], distance: f64| {
            swept(a).inflate(reach).overlaps(&swept(b))
                && distance.abs() <= (reach + longest(a) + longest(b)) * (1.0 + 1e-9)
        };
        let least = |k: usize| f64::from(found.least[k]);
        let (mut n, mut close) = (0, 0);
        for v in 0..mesh.points() as u32 {
            for (t, c) in mesh.triangles().iter().enumerate() {
                let pair = [v, t as u32];
                let x = [v, c[0], c[1], c[2]].map(|p| point(&start, p));
                let distance = closest_point_triangle(&x).distance.abs();
                let expected =
                    !mesh.excludes_vertex_triangle(v, t as u32) && passes(&[v], c, distance);
                assert_eq!(found.vertex_triangle.get(n) == Some(&pair), expected);
                if expected {
                    assert!(least(n) <= distance, "{} m, {distance} m", least(n));
                    close += usize::from(least(n) > distance - 1e-5);
                    n += 1;
                }
            }
        }
        assert_eq!(n, found.vertex_triangle.len());
        let mut m = 0;
        for a in 0..mesh.edges().len() as u32 {
            for b in a + 1..mesh.edges().len() as u32 {
                let (ea, eb) = (mesh.edges()[a as usize], mesh.edges()[b as usize]);
                let x = [ea[0], ea[1], eb[0], eb[1]].map(|p| point(&start, p));
                let distance = closest_edge_edge(&x).distance.abs();
                let expected = !mesh.excludes_edge_edge(a, b) && passes(&ea, &eb, distance);
                assert_eq!(found.edge_edge.get(m) == Some(&[a, b]), expected);
                if expected {
                    assert!(least(n + m) <= distance);
                    close += usize::from(least(n + m) > distance - 1e-5);
                    m += 1;
                }
            }
        }
        assert_eq!((m, n + m), (found.edge_edge.len(), found.least.len()));
        assert!(
            100 * close > 95 * (n + m),
            "{close} good bounds of {}",
            n + m
        );
    }
}

/// The candidates are the same bits whatever the broad phase and its past.
#[test]
fn broad_phase_does_not_matter() {
    fn run<B: BroadPhase>(b: B, scenes: &[u64]) -> Vec<Candidates> {
        let mut backend = ProximityBackend::new(b);
        scenes
            .iter()
            .map(|s| {
                let (mesh, start, end) = crumple(*s);
                let mut out = Candidates::default();
                backend
                    .detect(&mesh, &start, &end, 1.5e-3, &mut out)
                    .unwrap();
                out
            })
            .collect()
    }
    let brute = run(BruteForce, &[1, 2, 3]);
    assert_eq!(brute, run(BvhParry::new(), &[1, 2, 3]));
    assert_eq!(brute, run(HashGrid::new(), &[1, 2, 3]));
    assert_eq!(brute[2..], run(BvhParry::new(), &[3]));
}

/// Bad input is an error with numbers, not a panic; an empty mesh has no pairs.
#[test]
fn bad_input_is_refused() {
    let mut backend = ProximityBackend::new(BvhParry::new());
    let mut out = Candidates::default();
    let (mesh, mut start, end) = crumple(0);
    start[17] = f64::NAN;
    let e = backend
        .detect(&mesh, &start, &end, 1e-3, &mut out)
        .unwrap_err();
    assert!(
        matches!(e, CollisionError::NotFinitePosition { point: 5 }),
        "{e}"
    );
    let e = backend
        .detect(&mesh, &end[3..], &end, 1e-3, &mut out)
        .unwrap_err();
    assert!(matches!(e, CollisionError::Length { .. }), "{e}");
    let e = backend
        .detect(&mesh, &end, &end, f64::NAN, &mut out)
        .unwrap_err();
    assert!(matches!(e, CollisionError::Parameter { .. }), "{e}");
    let empty = CollisionMesh::from_positions(&[], vec![], &[], 1e-3).unwrap();
    backend.detect(&empty, &[], &[], 1e-3, &mut out).unwrap();
    assert!(out.is_empty());
    assert_eq!(empty.shortest_edge(), f64::INFINITY);

    let q = [0.0; 9];
    let e = CollisionMesh::from_positions(&q, vec![[0, 1, 3]], &[], 1e-3).unwrap_err();
    assert!(
        matches!(e, CollisionError::PointOutOfRange { point: 3, .. }),
        "{e}"
    );
    let e = CollisionMesh::from_positions(&q, vec![[0, 1, 1]], &[], 1e-3).unwrap_err();
    assert!(
        matches!(e, CollisionError::RepeatedPoint { point: 1, .. }),
        "{e}"
    );
    let e = CollisionMesh::from_positions(&q, vec![], &[[0, 9]], 1e-3).unwrap_err();
    assert!(
        matches!(e, CollisionError::PointOutOfRange { point: 9, .. }),
        "{e}"
    );
    let e = CollisionMesh::from_positions(&q, vec![], &[], 0.0).unwrap_err();
    assert!(matches!(e, CollisionError::Parameter { .. }), "{e}");
}

/// A flat sheet at rest, however thick its cloth, has no pair with itself
/// within the thickness: rest neighbours are excluded.
#[test]
fn flat_sheet_does_not_touch_itself() {
    for thickness in [1e-3, 4e-3, 9e-3, 15e-3] {
        let (mut q, mut triangles) = (Vec::new(), Vec::new());
        add_sheet(&mut q, &mut triangles, 12, 9, 0.01, 0.0);
        let mesh = CollisionMesh::from_positions(&q, triangles, &[], thickness).unwrap();
        assert!((mesh.recommended_thickness() - 2.5e-3).abs() < 1e-15);
        let close = close_pairs(&mesh, &q, thickness);
        assert!(close.is_empty(), "{} pairs at {thickness} m", close.len());
    }
}
