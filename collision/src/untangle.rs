//! Taking crossed cloth apart.
//!
//! Two sheets that cross meet in a curve. Shrinking its length to nothing
//! takes them apart without any notion of inside and outside, which cloth does
//! not have. [Volino2006]
//!
//! An edge with direction `e` that passes through a triangle with normal `n`
//! is an end of one piece of the curve for each triangle beside the edge, with
//! direction `r_i` from the edge into that triangle. When the edge moves by
//! `u` against the triangle, its crossing moves by `u − (u·n)/(e·n) e`, and the
//! length of the curve changes by
//!
//! ```text
//! dL = −u · Σ_i (r_i − (r_i·e)/(e·n) n)
//! ```

use crate::vec3::{cross, dot, norm, sub, unit};
use crate::{BroadPhase, Intersection, self_intersections};

/// Below this part of a right angle between an edge and a triangle the move
/// along the normal is bounded.
const FLATTEST: f64 = 0.1;

/// Shortens the curves along which a mesh crosses itself.
pub struct Untangle {
    triangles: Vec<[u32; 3]>,
    /// Edges by their ends, ascending, with the third corner of a triangle.
    wings: Vec<([u32; 2], u32)>,
    moves: Vec<([f64; 3], u32)>,
}

impl Untangle {
    /// For a mesh with these triangles.
    pub fn new(triangles: &[[u32; 3]]) -> Self {
        let mut wings: Vec<([u32; 2], u32)> = triangles
            .iter()
            .flat_map(|t| {
                [0, 1, 2].map(|k| {
                    let (a, b) = (t[k], t[(k + 1) % 3]);
                    ([a.min(b), a.max(b)], t[(k + 2) % 3])
                })
            })
            .collect();
        wings.sort_unstable();
        Self {
            triangles: triangles.to_vec(),
            wings,
            moves: Vec::new(),
        }
    }

    /// Moves the corners of everything that crosses by at most `step` [m], and
    /// returns what crossed before. Gives the same bits every time.
    pub fn pass(
        &mut self,
        positions: &mut [f64],
        step: f64,
        broad_phase: &mut dyn BroadPhase,
    ) -> Vec<Intersection> {
        let crossings = self_intersections(positions, &self.triangles, broad_phase);
        let (points, _) = positions.as_chunks_mut::<3>();
        self.moves.clear();
        self.moves.resize(points.len(), ([0.0; 3], 0));
        for c in &crossings {
            let Some(gradient) = self.shortening(points, c) else {
                continue;
            };
            let size = norm(gradient);
            let u = gradient.map(|g| 0.5 * step * g / (1.0 + size * size).sqrt());
            let corners = self.triangles[c.triangle as usize];
            let both = [(1.0, &c.edge[..]), (-1.0, &corners[..])];
            for (sign, corners) in both {
                for &p in corners {
                    let (sum, count) = &mut self.moves[p as usize];
                    for k in 0..3 {
                        sum[k] += sign * u[k];
                    }
                    *count += 1;
                }
            }
        }
        for (p, (sum, count)) in points.iter_mut().zip(&self.moves) {
            if *count > 0 {
                for k in 0..3 {
                    p[k] += sum[k] / f64::from(*count);
                }
            }
        }
        crossings
    }

    /// The direction in which the edge shortens the curve fastest.
    fn shortening(&self, x: &[[f64; 3]], c: &Intersection) -> Option<[f64; 3]> {
        let at = |i: u32| x[i as usize];
        let [a, b] = c.edge.map(at);
        let t = self.triangles[c.triangle as usize].map(at);
        let n = unit(cross(sub(t[1], t[0]), sub(t[2], t[0])))?;
        let e = unit(sub(b, a))?;
        let slope = dot(e, n);
        let slope = slope.abs().max(FLATTEST).copysign(slope);
        let first = self.wings.partition_point(|(edge, _)| *edge < c.edge);
        let beside = self.wings[first..]
            .iter()
            .take_while(|(edge, _)| *edge == c.edge);
        let mut sum = [0.0; 3];
        for (_, corner) in beside {
            let to = sub(at(*corner), a);
            let Some(r) = unit(cross(n, cross(e, to))) else {
                continue; // the two triangles lie in one plane
            };
            let along = dot(to, e);
            let inwards: [f64; 3] = std::array::from_fn(|k| to[k] - along * e[k]);
            let r = if dot(r, inwards) < 0.0 {
                r.map(|x| -x)
            } else {
                r
            };
            let lift = dot(r, e) / slope;
            for k in 0..3 {
                sum[k] += r[k] - lift * n[k];
            }
        }
        sum.iter().all(|s| s.is_finite()).then_some(sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BvhParry;

    /// A square of `n` by `n` cells of 1 cm at a height that depends on place;
    /// not in line with any other, since touching edges do not cross.
    fn square(
        n: usize,
        height: impl Fn(f64, f64) -> f64,
        x: &mut Vec<f64>,
        triangles: &mut Vec<[u32; 3]>,
    ) {
        let first = (x.len() / 3) as u32;
        for j in 0..=n {
            for i in 0..=n {
                let shift = 3e-5 * f64::from(first);
                let (u, v) = (0.01 * i as f64 + shift, 0.01 * j as f64 + 0.7 * shift);
                x.extend([u, height(u, v), v]);
            }
        }
        let at = |i: usize, j: usize| first + (j * (n + 1) + i) as u32;
        for j in 0..n {
            for i in 0..n {
                triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }

    /// Length of the curves of self-intersection: each pair of triangles that
    /// cross has one piece, between its two crossings.
    fn curve(x: &[f64], triangles: &[[u32; 3]]) -> f64 {
        let mut ends: std::collections::BTreeMap<[usize; 2], Vec<[f64; 3]>> = Default::default();
        for c in self_intersections(x, triangles, &mut BvhParry::default()) {
            let of_edge =
                (0..triangles.len()).filter(|t| c.edge.iter().all(|e| triangles[*t].contains(e)));
            for t in of_edge {
                let mut pair = [t, c.triangle as usize];
                pair.sort_unstable();
                ends.entry(pair).or_default().push(c.place);
            }
        }
        let pieces = ends.values().filter(|e| e.len() == 2);
        pieces.map(|e| norm(sub(e[0], e[1]))).sum()
    }

    /// A bump through a sheet, and a border that slid under it: the curve of
    /// intersection becomes shorter with every small move.
    #[test]
    fn curves_of_intersection_shrink() {
        let shapes: [fn(f64, f64) -> f64; 2] = [
            |u, v| 0.006 - 0.012 * (-((u - 0.053).powi(2) + (v - 0.047).powi(2)) / 4e-4).exp(),
            |u, v| 0.004 - 0.2 * (u - 0.053).max(0.0) + 0.01 * v,
        ];
        for shape in shapes {
            let (mut x, mut triangles) = (Vec::new(), Vec::new());
            square(10, |_, _| 0.0, &mut x, &mut triangles);
            square(10, shape, &mut x, &mut triangles);
            let mut untangle = Untangle::new(&triangles);
            let first = curve(&x, &triangles);
            assert!(first > 0.05, "{first} m to begin with");
            let mut before = first;
            for _ in 0..5 {
                untangle.pass(&mut x, 2e-4, &mut BvhParry::default());
                let now = curve(&x, &triangles);
                assert!(now < before, "{now} after {before} m");
                before = now;
            }
            println!("{first} to {before} m");
        }
    }

    /// The corner of one triangle comes out of another, both stiff.
    #[test]
    fn a_corner_comes_out() {
        let flat = [[-0.1, 0.0, -0.1], [0.1, 0.0, -0.1], [0.0, 0.0, 0.1]];
        let steep = [[0.0, -0.01, 0.0], [0.02, 0.05, 0.01], [-0.02, 0.05, 0.01]];
        let mut x = [flat, steep].concat().concat();
        let mut untangle = Untangle::new(&[[0, 1, 2], [3, 4, 5]]);
        let mut passes = 0;
        loop {
            let before = x.clone();
            let crossed = untangle.pass(&mut x, 1e-3, &mut BvhParry::default());
            if crossed.is_empty() {
                break;
            }
            passes += 1;
            assert!(passes < 200, "still crossed: {x:?}");
            for (side, was) in x.chunks_exact_mut(9).zip(before.chunks_exact(9)) {
                for k in 0..3 {
                    let moved = (0..3)
                        .map(|c| side[3 * c + k] - was[3 * c + k])
                        .sum::<f64>()
                        / 3.0;
                    for c in 0..3 {
                        side[3 * c + k] = was[3 * c + k] + moved;
                    }
                }
            }
        }
        assert!(passes > 5 && x[10] > x[1], "the corner stayed below");
    }

    #[test]
    fn apart_stays_as_it_is() {
        let (mut x, mut triangles) = (Vec::new(), Vec::new());
        square(3, |_, _| 0.0, &mut x, &mut triangles);
        square(3, |_, _| 0.01, &mut x, &mut triangles);
        let before = x.clone();
        let crossed = Untangle::new(&triangles).pass(&mut x, 1e-3, &mut BvhParry::default());
        assert!(crossed.is_empty() && x == before);
    }
}
