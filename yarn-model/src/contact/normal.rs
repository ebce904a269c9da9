use rayon::prelude::*;

use super::compression::GRAIN;
use crate::vec3::V;
use crate::{NONE, YarnNetwork};

/// Share of the plane's larger extent below which its smaller one counts as
/// none.
const THIN: f64 = 1e-3;
/// Product of the eigenvalues' distances from the least one below which it is
/// computed twice.
const CLOSE: f64 = 0.02;
/// Part of `|t_i| |t_j|` that `n·(t_i × t_j)` must reach to decide the sign.
const PARALLEL: f64 = 0.05;

/// Unit normal of the plane that fits points best, of either sign: the
/// direction of least variance about their mean. `None` where the points lie on
/// a line within a thousandth, or are not finite.
pub fn plane_normal(points: &[[f64; 3]]) -> Option<[f64; 3]> {
    let points = points.iter().map(|p| V::from(*p));
    fit(points).map(Into::into)
}

#[inline(always)]
fn fit(points: impl ExactSizeIterator<Item = V> + Clone) -> Option<V> {
    let mean = points.clone().sum::<V>() / points.len() as f64;
    // Upper triangle of the matrix of second moments.
    let [mut xx, mut xy, mut xz, mut yy, mut yz, mut zz] = [0.0; 6];
    for p in points {
        let d = p - mean;
        xx += d.x * d.x;
        xy += d.x * d.y;
        xz += d.x * d.z;
        yy += d.y * d.y;
        yz += d.y * d.z;
        zz += d.z * d.z;
    }
    let trace = xx + yy + zz;
    if !(trace > f64::MIN_POSITIVE && trace.is_finite()) {
        return None;
    }
    let s = 1.0 / trace;
    let c = [xx * s, xy * s, xz * s, yy * s, yz * s, zz * s];
    let (mut n, mut size) = null_vector(c, least_eigenvalue(c));
    if size < CLOSE && size > 0.5 * THIN * THIN {
        // Close eigenvalues are exact to half the digits only; the Rayleigh
        // quotient has twice as many as its vector.
        let [xx, xy, xz, yy, yz, zz] = c;
        let cn = V::new(
            xx * n.x + xy * n.y + xz * n.z,
            xy * n.x + yy * n.y + yz * n.z,
            xz * n.x + yz * n.y + zz * n.z,
        );
        (n, size) = null_vector(c, n.dot(&cn));
    }
    // λ_1 is about 1 where λ_2 is small.
    (size > THIN * THIN).then_some(n)
}

/// Unit vector that `C − λI` takes to zero. The rows of that matrix span the
/// plane; the longest of their cross products, whose length is given too, is
/// `(λ_1 − λ)(λ_2 − λ)` times the largest component of the vector.
#[inline(always)]
fn null_vector([xx, xy, xz, yy, yz, zz]: [f64; 6], least: f64) -> (V, f64) {
    let rows = [
        V::new(xx - least, xy, xz),
        V::new(xy, yy - least, yz),
        V::new(xz, yz, zz - least),
    ];
    let crossed = [
        rows[0].cross(&rows[1]),
        rows[1].cross(&rows[2]),
        rows[2].cross(&rows[0]),
    ];
    let mut best = crossed[0];
    for c in &crossed[1..] {
        if c.norm_squared() > best.norm_squared() {
            best = *c;
        }
    }
    let size = best.norm();
    match size > 0.0 {
        true => (best / size, size),
        false => (best, 0.0),
    }
}

/// Least eigenvalue of a symmetric matrix `xx, xy, xz, yy, yz, zz` of trace 1,
/// by the trigonometric solution of its characteristic equation. The other two
/// may coincide; where the least coincides with one of them, the points have no
/// plane.
#[inline(always)]
fn least_eigenvalue([xx, xy, xz, yy, yz, zz]: [f64; 6]) -> f64 {
    let mean = (xx + yy + zz) / 3.0;
    let (a, b, c) = (xx - mean, yy - mean, zz - mean);
    let off = xy * xy + xz * xz + yz * yz;
    let p = ((a * a + b * b + c * c + 2.0 * off) / 6.0).sqrt();
    if p == 0.0 {
        return mean;
    }
    let determinant = a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz);
    let r = (0.5 * determinant / (p * p * p)).clamp(-1.0, 1.0);
    let angle = r.acos() / 3.0;
    let least = mean + 2.0 * p * (angle + std::f64::consts::TAU / 3.0).cos();
    least.max(0.0)
}

/// Where two neighbouring yarns of a node touch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interface {
    /// Points: the node, then before and after it on the front yarn, then on
    /// the back yarn. Beyond a yarn's end stands the node itself.
    points: [u32; 5],
    /// Sign of `n·(t_i × t_{i+1})` at rest, 0 where it has none.
    sigma: f64,
}

/// Normals of all interfaces of a network.
///
/// Interface `k` of node `v`, between its strands `k` and `k + 1`, has the
/// index `offsets[v] − v + k`. Its normal is that of the plane that fits the
/// node and the nodes before and after it on both yarns best [Cirio2017], and
/// points from yarn `k` to yarn `k + 1`. The side is fixed at rest:
///
/// ```text
/// t   = x_next − x_previous
/// σ   = sign(n·(t_k × t_{k+1})) with n against the front of the cloth
/// n ← ± n  so that  sign(n·(t_k × t_{k+1})) = σ
/// ```
///
/// Where yarns are parallel, `|n·(t_k × t_{k+1})| < 0.05 |t_k| |t_{k+1}|`, the
/// sign is that of the normal before; where the nodes lie on a line, the normal
/// before is kept.
#[derive(Clone, Debug)]
pub(super) struct InterfaceNormals {
    interfaces: Vec<Interface>,
}

impl InterfaceNormals {
    /// Interfaces of a network, and their normals at rest.
    pub fn new(network: &YarnNetwork) -> (Self, Vec<V>) {
        let mut interfaces = Vec::with_capacity(network.strands.len() - network.nodes());
        for node in 0..network.nodes() as u32 {
            let strands = network.strands_of(node);
            for s in strands.start..strands.end - 1 {
                let beside = |s: u32| match s {
                    NONE => node,
                    s => network.strands[s as usize].node,
                };
                let (front, back) = (network.strands[s as usize], network.strands[s as usize + 1]);
                let points = [
                    node,
                    beside(front.prev),
                    beside(front.next),
                    beside(back.prev),
                    beside(back.next),
                ];
                let sigma = 0.0;
                interfaces.push(Interface { points, sigma });
            }
        }
        let mut normals = Vec::with_capacity(interfaces.len());
        for interface in &mut interfaces {
            let place = |node: u32| V::from(network.points[node as usize]);
            let against = -V::from(network.front[interface.points[0] as usize]);
            let x = interface.points.map(place);
            let n = interface.normal(&x, against);
            let side = side(&x, n);
            interface.sigma = if side == 0.0 { 0.0 } else { side.signum() };
            normals.push(n);
        }
        (Self { interfaces }, normals)
    }

    /// Number of interfaces.
    pub fn len(&self) -> usize {
        self.interfaces.len()
    }

    /// Node of an interface.
    #[inline(always)]
    pub fn node(&self, interface: usize) -> usize {
        self.interfaces[interface].points[0] as usize
    }

    /// Normals at flat points, given the ones before.
    pub fn update(&self, points: &[f64], previous: &[f64], normals: &mut [V]) {
        let previous = previous.as_chunks::<3>().0;
        let points = points.as_chunks::<3>().0;
        self.interfaces
            .par_iter()
            .zip(previous)
            .zip(normals)
            .with_min_len(GRAIN)
            .for_each(|((interface, before), normal)| {
                let x = interface.points.map(|p| V::from(points[p as usize]));
                *normal = interface.normal(&x, V::from(*before));
            });
    }

    pub fn heap_bytes(&self) -> usize {
        size_of_val(&self.interfaces[..])
    }
}

/// `n·(t_k × t_{k+1})`, or zero where that decides nothing.
#[inline(always)]
fn side(x: &[V; 5], n: V) -> f64 {
    let (a, b) = (x[2] - x[1], x[4] - x[3]);
    let side = n.dot(&a.cross(&b));
    match side * side >= PARALLEL * PARALLEL * a.norm_squared() * b.norm_squared() {
        true => side,
        false => 0.0,
    }
}

impl Interface {
    #[inline(always)]
    fn normal(&self, x: &[V; 5], before: V) -> V {
        // A yarn's end has no point beyond.
        let ends = [1, 2, 3, 4].map(|k| self.points[k] == self.points[0]);
        let n = match ends.contains(&true) {
            false => fit(x.iter().copied()),
            true => {
                let mut there = [x[0]; 5];
                let mut count = 1;
                for k in 1..5 {
                    if !ends[k - 1] {
                        there[count] = x[k];
                        count += 1;
                    }
                }
                fit(there[..count].iter().copied())
            }
        };
        let Some(n) = n else {
            return before;
        };
        let decided = side(x, n) * self.sigma;
        let agrees = if decided == 0.0 {
            n.dot(&before)
        } else {
            decided
        };
        if agrees < 0.0 { -n } else { n }
    }
}
