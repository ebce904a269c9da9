//! Merging matched points without folding triangles onto each other.

use crate::union_find::UnionFind;

/// Two points of the panels' meshes that a stitch brings together.
pub(super) struct Pair {
    pub a: u32,
    pub b: u32,
    pub stitch: u32,
    /// At an end of the seam.
    pub end: bool,
    pub open: bool,
}

/// Merges the pairs, opening those that would make a triangle lose a corner
/// or fall onto another one (the apex of a cone, a pillow's corner).
pub(super) fn close(total: usize, pairs: &mut [Pair], triangles: &[[u32; 3]]) -> UnionFind {
    loop {
        let mut sets = UnionFind::new(total);
        for p in pairs.iter().filter(|p| !p.open) {
            sets.join(p.a, p.b);
        }
        // Corner sets of triangles that must not stay as they are.
        let mut bad: Vec<Vec<u32>> = Vec::new();
        let mut merged: Vec<([u32; 3], u32)> = Vec::with_capacity(triangles.len());
        for (i, t) in triangles.iter().enumerate() {
            let mut m = t.map(|v| sets.find(v));
            m.sort_unstable();
            if m[0] == m[1] || m[1] == m[2] {
                bad.push(t.to_vec());
            }
            merged.push((m, i as u32));
        }
        merged.sort_unstable();
        for w in merged.windows(2) {
            if w[0].0 == w[1].0 {
                let mut corners = triangles[w[0].1 as usize].to_vec();
                corners.extend(triangles[w[1].1 as usize]);
                bad.push(corners);
            }
        }
        if bad.is_empty() {
            bad = folds(triangles, &mut sets);
        }
        if bad.is_empty() {
            return sets;
        }
        // Opening one pair often cures its neighbours: those wait for the
        // next round.
        let mut opened: Vec<u32> = Vec::new();
        for corners in &bad {
            if corners.iter().any(|c| opened.contains(c)) {
                continue;
            }
            // Pairs within the triangle(s), if possible not at a seam's end
            // where other seams meet; otherwise any pair that touches them.
            let inside = |p: &Pair| corners.contains(&p.a) && corners.contains(&p.b);
            let touching = |p: &Pair| corners.contains(&p.a) || corners.contains(&p.b);
            let rules: [&dyn Fn(&Pair) -> bool; 3] = [&|p| inside(p) && !p.end, &inside, &touching];
            for rule in rules {
                let mut any = false;
                for p in pairs.iter_mut().filter(|p| !p.open && p.a != p.b) {
                    if rule(p) {
                        p.open = true;
                        any = true;
                        opened.extend([p.a, p.b]);
                    }
                }
                if any {
                    break;
                }
            }
        }
        if opened.is_empty() {
            return sets;
        }
    }
}

/// End pairs of edges from one point that merging would lay onto each other
/// while both keep their triangles: a pinch near the tip of a cone.
fn folds(triangles: &[[u32; 3]], sets: &mut UnionFind) -> Vec<Vec<u32>> {
    // (merged ends, own ends), the point that may be shared first or second.
    let mut edges: Vec<([u32; 2], [u32; 2])> = Vec::with_capacity(3 * triangles.len());
    for t in triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            let (ma, mb) = (sets.find(a), sets.find(b));
            edges.push(if ma < mb {
                ([ma, mb], [a, b])
            } else {
                ([mb, ma], [b, a])
            });
        }
    }
    edges.sort_unstable();
    let mut bad = Vec::new();
    for group in edges.chunk_by(|x, y| x.0 == y.0).filter(|g| g.len() > 2) {
        for w in group.windows(2) {
            let ([a, b], [c, d]) = (w[0].1, w[1].1);
            if a == c && b != d {
                bad.push(vec![b, d]);
            } else if b == d && a != c {
                bad.push(vec![a, c]);
            }
        }
    }
    bad
}
