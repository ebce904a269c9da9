use super::paths::{PARALLEL, StrandPaths};
use crate::plane_normal;
use crate::vec3::{V, perpendicular};

/// Points of the centre lines of all yarns [m], visit after visit in the order
/// of [`StrandPaths::nodes`].
///
/// The yarns of a stack share a point; here they lie one behind the other
/// [Cirio2017]:
///
/// ```text
/// c_i = x + o_i n,   o_{i+1} − o_i = R_i + R_{i+1},   o_0 + o_last = 0
/// ```
///
/// with the normal `n` of the plane that fits the node and all nodes next to it
/// best, from front to back: on the side where `Σ σ_k n·(t_k × t_{k+1})` is
/// positive. Where that decides nothing (parallel yarns) or there is no plane,
/// the normals of the nodes around it do.
///
/// # Panics
/// If there are fewer points than nodes.
pub fn strand_centres(paths: &StrandPaths, points: &[[f64; 3]]) -> Vec<[f64; 3]> {
    assert!(points.len() >= paths.node_count(), "a point for each node");
    let normals = normals(paths, points);
    let mut centres: Vec<[f64; 3]> = Vec::with_capacity(paths.nodes().len());
    centres.extend(paths.nodes().iter().map(|n| points[*n as usize]));
    let mut radii = vec![0.0; centres.len()];
    for (y, r) in paths.radii().iter().enumerate() {
        radii[paths.visits(y)].fill(*r);
    }
    for node in 0..paths.node_count() as u32 {
        let stack = paths.stack(node);
        let gap = |pair: &[u32]| radii[pair[0] as usize] + radii[pair[1] as usize];
        let mut offset = -0.5 * stack.windows(2).map(gap).sum::<f64>();
        let x = V::from(points[node as usize]);
        for (k, &v) in stack.iter().enumerate() {
            if k > 0 {
                offset += gap(&stack[k - 1..=k]);
            }
            centres[v as usize] = (x + normals[node as usize] * offset).into();
        }
    }
    centres
}

/// Normal of every node, front to back; zero where nothing is stacked.
fn normals(paths: &StrandPaths, points: &[[f64; 3]]) -> Vec<V> {
    let count = paths.node_count();
    let mut normals = vec![V::zeros(); count];
    let mut open: Vec<(u32, Option<V>)> = Vec::new();
    let mut sides = paths.sides().iter();
    for node in 0..count as u32 {
        let stack = paths.stack(node);
        if stack.len() < 2 {
            continue;
        }
        let sides: Vec<f64> = sides
            .by_ref()
            .take(stack.len() - 1)
            .map(|s| f64::from(*s))
            .collect();
        let n = plane_normal(&paths.around(node, points)).map(V::from);
        let side = n.map_or(0.0, |n| {
            let pairs = stack.windows(2).zip(&sides);
            pairs.map(|(p, s)| s * paths.side(p, points, n)).sum()
        });
        match n {
            Some(n) if side >= PARALLEL => normals[node as usize] = n,
            Some(n) if side <= -PARALLEL => normals[node as usize] = -n,
            n => open.push((node, n)),
        }
    }
    // Outwards from the nodes that know their side.
    while !open.is_empty() {
        let mut found: Vec<(u32, V)> = Vec::new();
        open.retain(|&(node, n)| {
            let around = paths.stack(node).iter().flat_map(|&v| paths.beside(v));
            let about: V = around.map(|k| normals[k as usize]).sum();
            if about.norm_squared() == 0.0 {
                return true;
            }
            found.push((node, oriented(paths, points, node, n, about)));
            false
        });
        if found.is_empty() {
            break;
        }
        for (node, n) in found {
            normals[node as usize] = n;
        }
    }
    for (node, n) in open {
        normals[node as usize] = oriented(paths, points, node, n, V::zeros());
    }
    normals
}

/// A fitted normal on the side of another vector; without a fit the vector
/// itself, made perpendicular to the node's first yarn.
fn oriented(paths: &StrandPaths, points: &[[f64; 3]], node: u32, n: Option<V>, about: V) -> V {
    if let Some(n) = n {
        return if n.dot(&about) < 0.0 { -n } else { n };
    }
    let t = paths.direction(paths.stack(node)[0], points);
    let across = about - t * t.dot(&about);
    across
        .try_normalize(1e-9)
        .unwrap_or_else(|| match t == V::zeros() {
            true => V::z(),
            false => perpendicular(t),
        })
}
