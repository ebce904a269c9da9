//! The deepest point of a triangle in a body.

use crate::vec3::{Vec3, add, axpy, cross, dot, norm, scale, sub, tangential, unit};
use crate::{Body, SurfaceSample};

/// Steps of a descent at most.
const STEPS: usize = 32;
/// Tries of one step at most.
const TRIES: usize = 12;
/// Share of the decrease at first order that a step has to reach [1].
const DECREASE: f64 = 1e-4;
/// Steps below this fraction of the triangle's size end a descent [1].
const CLOSE: f64 = 1e-8;
/// Divisions of a triangle into four at most.
const LEVELS: usize = 6;

/// A triangle beside a body.
///
/// ```text
/// φ* = min φ(Σ b_i x_i)   over b_i ≥ 0, Σ b_i = 1
/// ∂φ*/∂x_i = b_i ∇φ       at the minimum
/// ```
/// Where the minimum is inside the triangle `∇φ` is across it, where it is on
/// an edge across that; what an unfinished minimum leaves along them is dropped.
pub(super) struct Face<'a> {
    pub body: &'a dyn Body,
    pub time: f64,
    pub x: [Vec3; 3],
}

/// A point of a triangle and the body's distance there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// Weights of the corners, which sum to one.
    pub weights: Vec3,
    pub sample: SurfaceSample,
}

impl Place {
    pub fn is_corner(&self) -> bool {
        self.weights.iter().filter(|w| **w > 0.0).count() < 2
    }
}

impl Face<'_> {
    pub fn at(&self, weights: Vec3) -> Place {
        let sample = self.body.sample(blend(weights, &self.x), self.time);
        Place { weights, sample }
    }

    /// The lowest corner; the first of equals.
    pub fn lowest_corner(&self) -> (usize, SurfaceSample) {
        let corner = |i: usize| (i, self.body.sample(self.x[i], self.time));
        let mut lowest = corner(0);
        for i in 1..3 {
            let other = corner(i);
            if other.1.distance < lowest.1.distance {
                lowest = other;
            }
        }
        lowest
    }

    /// `∇φ*` with respect to the closest point: the gradient without what the
    /// point could give way to within the triangle.
    pub fn slope(&self, place: &Place) -> Vec3 {
        let g = place.sample.normal;
        let [a, b, c] = self.x;
        let across = match place.weights.map(|w| w > 0.0) {
            [true, true, true] => {
                let normal = unit(cross(sub(b, a), sub(c, a)));
                return normal.map_or(g, |n| scale(dot(g, n), n));
            }
            [true, true, false] => sub(b, a),
            [false, true, true] => sub(c, b),
            [true, false, true] => sub(a, c),
            _ => return g,
        };
        unit(across).map_or(g, |along| tangential(g, along))
    }

    /// A good place to descend from, found by dividing the triangle where the
    /// body may be: a field no steeper than `steepness` is nowhere in a part
    /// lower than at its middle by more than that times its radius. Parts
    /// smaller than `resolution` [m] are not divided. `None` where the whole
    /// triangle is farther than `limit` [m].
    pub fn search(&self, limit: f64, steepness: f64, resolution: f64) -> Option<Vec3> {
        let third = [1.0 / 3.0; 3];
        let middle = blend(third, &self.x);
        let radius = self.x.iter().map(|x| norm(sub(*x, middle)));
        let radius = steepness * radius.fold(0.0, f64::max);
        // A convex field has one minimum, wherever one begins.
        let levels = if self.body.is_convex() { 0 } else { LEVELS };
        let mut parts = [([[0.0; 3]; 3], 0); 3 * LEVELS + 1];
        parts[0].0 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut open = 1;
        let (mut lowest, mut best, mut near) = (f64::INFINITY, third, false);
        while open > 0 {
            open -= 1;
            let (corners, level) = parts[open];
            let weights = blend(third, &corners);
            let distance = self.at(weights).sample.distance;
            if !distance.is_finite() {
                return Some(weights);
            }
            if distance < lowest {
                (lowest, best) = (distance, weights);
            }
            let least = distance - radius * 0.5_f64.powi(level as i32);
            if least > limit || least > lowest {
                continue;
            }
            if level == levels || distance - least <= resolution {
                near = true;
                continue;
            }
            let [a, b, c] = corners;
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| scale(0.5, add(p, q)));
            for part in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
                parts[open] = (part, level + 1);
                open += 1;
            }
        }
        (near || lowest <= limit).then_some(best)
    }

    /// The minimum of the distance that a descent from `weights` ends in, by
    /// Newton's method with a secant (BFGS) matrix along the edges or across
    /// the inside, whichever holds it. Deep inside a body, where its distance
    /// has creases, it may end beside the minimum.
    pub fn descend(&self, weights: Vec3) -> Place {
        let edges = [sub(self.x[1], self.x[0]), sub(self.x[2], self.x[0])];
        let gradient = |p: &Place| edges.map(|e| dot(p.sample.normal, e));
        let metric = [0, 1].map(|i| [0, 1].map(|j| dot(edges[i], edges[j])));
        let size = (metric[0][0] + metric[1][1]).sqrt();
        let mut place = self.at(weights);
        let mut g = gradient(&place);
        // The field of a ball of the size of the distance, to begin with.
        let bend = 1.0 / place.sample.distance.abs().max(1e-3 * size);
        let mut matrix = metric.map(|row| row.map(|m| bend * m));
        let mut fresh = true;
        for _ in 0..STEPS {
            let Some(way) = direction(&place.weights, &g, &matrix) else {
                break;
            };
            let step = [way[1], way[2]];
            let slope = pair(&g, &step);
            if !(slope < 0.0 && form(&metric, &step).sqrt() > CLOSE * size) {
                break;
            }
            let Some((next, t)) = self.line(&place, way, slope) else {
                break;
            };
            let after = gradient(&next);
            let step = step.map(|s| t * s);
            let change = [after[0] - g[0], after[1] - g[1]];
            let bent = pair(&change, &step);
            if bent > 0.0 {
                if std::mem::take(&mut fresh) {
                    let bend = bent / form(&metric, &step);
                    matrix = metric.map(|row| row.map(|m| bend * m));
                }
                update(&mut matrix, &step, &change, bent);
            }
            (place, g) = (next, after);
        }
        place
    }

    /// The first of the steps along `way`, cut where they leave the triangle,
    /// that lowers the distance, and its length.
    fn line(&self, from: &Place, way: Vec3, slope: f64) -> Option<(Place, f64)> {
        let (mut t, mut at_border) = (1.0, None);
        for i in 0..3 {
            if way[i] < 0.0 && from.weights[i] < -t * way[i] {
                (t, at_border) = (-from.weights[i] / way[i], Some(i));
            }
        }
        for _ in 0..TRIES {
            let mut weights = axpy(from.weights, t, way).map(|w| w.max(0.0));
            if let Some(i) = at_border.take() {
                weights[i] = 0.0;
            }
            let next = self.at(weights);
            let gained = from.sample.distance - next.sample.distance;
            if gained >= -DECREASE * t * slope {
                return Some((next, t));
            }
            // The lowest place of the parabola through what is known.
            let guess = 0.5 * slope * t * t / (slope * t + gained);
            t = if guess.is_finite() {
                guess.clamp(0.1 * t, 0.5 * t)
            } else {
                0.5 * t
            };
        }
        None
    }
}

/// `Σ w_i x_i`
pub(super) fn blend(w: Vec3, x: &[Vec3; 3]) -> Vec3 {
    axpy(axpy(scale(w[0], x[0]), w[1], x[1]), w[2], x[2])
}

/// Change of the weights that minimises `g·d + ½ d·B d` over the triangle or,
/// where it holds the point, over one of its edges; `None` at a corner that
/// holds it. `g` and `B` are with respect to the last two weights.
fn direction(w: &Vec3, g: &[f64; 2], matrix: &[[f64; 2]; 2]) -> Option<Vec3> {
    let [[a, b], [_, c]] = *matrix;
    let det = a * c - b * b;
    if det > 1e-14 * a * c {
        let d = [(b * g[1] - c * g[0]) / det, (b * g[0] - a * g[1]) / det];
        let free = [-d[0] - d[1], d[0], d[1]];
        if (0..3).all(|i| w[i] > 0.0 || free[i] >= 0.0) {
            return Some(free);
        }
    }
    let mut best: Option<(f64, Vec3)> = None;
    for i in (0..3).filter(|i| w[*i] <= 0.0) {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let mut along = [0.0; 3];
        (along[j], along[k]) = (-1.0, 1.0);
        let two = [along[1], along[2]];
        let (slope, bend) = (pair(g, &two), form(matrix, &two));
        let length = -slope / bend;
        let leaves = if length > 0.0 { j } else { k };
        let gain = slope * slope / bend;
        if bend > 0.0 && w[leaves] > 0.0 && best.is_none_or(|b| gain > b.0) {
            best = Some((gain, scale(length, along)));
        }
    }
    best.map(|b| b.1)
}

/// Secant update of a symmetric matrix for a step and the change of the
/// gradient along it, `bent` their product.
fn update(matrix: &mut [[f64; 2]; 2], step: &[f64; 2], change: &[f64; 2], bent: f64) {
    let along = matrix.map(|row| pair(&row, step));
    let form = pair(&along, step);
    for i in 0..2 {
        for j in 0..2 {
            matrix[i][j] += change[i] * change[j] / bent - along[i] * along[j] / form;
        }
    }
}

fn pair(a: &[f64; 2], b: &[f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn form(m: &[[f64; 2]; 2], v: &[f64; 2]) -> f64 {
    pair(&m.map(|row| pair(&row, v)), v)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Pose, RoundBox, RoundCone, Union};

    const SHEET: [Vec3; 3] = [[0.0, 0.0, 0.0], [0.02, 0.0, 0.001], [0.003, 0.001, 0.021]];

    fn deepest(body: &dyn Body, x: [Vec3; 3]) -> Place {
        let face = Face { body, time: 0.0, x };
        face.descend(face.search(1.0, 1.0, 1e-3).expect("near"))
    }

    /// Against a fine lattice, for bodies over the inside, edges and corners,
    /// and for one that is not convex.
    #[test]
    fn deepest_is_lowest_of_a_lattice() {
        let ball = |c: Vec3, r: f64| RoundCone::sphere(c, r).expect("a ball");
        let mut bodies: Vec<Box<dyn Body>> = Vec::new();
        for i in 0..14 {
            let (u, v) = (0.0023 * f64::from(i), 0.03 - 0.0031 * f64::from(i));
            bodies.push(Box::new(ball([u, -0.003, v], 1e-3)));
            bodies.push(Box::new(ball([v, 0.2, u], 0.19)));
            let tip = [u, -1e-3, 0.4 * v];
            bodies.push(Box::new(
                RoundCone::new([u, -0.2, v], tip, [1e-3; 2]).expect("a capsule"),
            ));
            let pose = Pose::new([v - 0.01, -0.0165, u], [0.3, 0.1, -0.4]).expect("a pose");
            bodies.push(Box::new(
                RoundBox::new([0.01; 3], 1e-3, pose).expect("a box"),
            ));
            let parts: Vec<Box<dyn Body>> = vec![
                Box::new(ball([0.004, -0.006, 0.003], 2e-3)),
                Box::new(ball([u, -0.004, 0.4 * v], 1e-3)),
            ];
            bodies.push(Box::new(Union::new(parts).expect("a union")));
        }
        for (n, body) in bodies.iter().enumerate() {
            let found = deepest(body, SHEET);
            let face = Face {
                body,
                time: 0.0,
                x: SHEET,
            };
            let mut lowest = f64::INFINITY;
            let count = 400;
            for i in 0..=count {
                for j in 0..=count - i {
                    let (a, b) = (f64::from(i) / 400.0, f64::from(j) / 400.0);
                    lowest = lowest.min(face.at([1.0 - a - b, a, b]).sample.distance);
                }
            }
            let error = found.sample.distance - lowest;
            assert!(error < 1e-9, "body {n}: {error} m above the lattice");
            let sum: f64 = found.weights.iter().sum();
            assert!((sum - 1.0).abs() < 1e-12 && found.weights.iter().all(|w| *w >= 0.0));
        }
    }

    /// What is farther than the limit is left out, and nothing else.
    #[test]
    fn limit_is_kept() {
        let tip = [0.007, -5e-3, 0.008];
        let needle = RoundCone::new([0.007, -0.3, 0.008], tip, [1e-3; 2]).expect("a capsule");
        let parts: Vec<Box<dyn Body>> = vec![Box::new(needle)];
        let body = Union::new(parts).expect("a union");
        let face = Face {
            body: &body,
            time: 0.0,
            x: SHEET,
        };
        let gap = deepest(&body, SHEET).sample.distance;
        assert!((gap - deepest(&needle, SHEET).sample.distance).abs() < 1e-12);
        assert!(face.search(gap + 1e-6, 1.0, 1e-3).is_some());
        assert!(face.search(gap - 2e-3, 1.0, 1e-3).is_none());
    }
}
