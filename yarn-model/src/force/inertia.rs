use std::ops::Range;

use selvedge_energy::{EvalPoint, MassBatch, RatePoint};

use crate::YarnNetwork;
use crate::vec3::{V, get, put_column, set};

/// Mass of an arc length on its own, in units of the mass of a mean segment.
const FLOOR: f64 = 1e-6;

/// Which velocity-quadratic force [`SegmentInertia`] returns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum InertiaForce {
    /// `∂T/∂q − Ṁ q̇`.
    #[default]
    Full,
    /// None: the mass counts as constant during a step.
    ConstantMass,
}

/// Inertia of the segments of yarns whose arc lengths slide.
///
/// With linear interpolation between the nodes the material at arc length `s`
/// moves with `N0 a0 + N1 a1`, `a = ẋ − w u̇`, `w = (x1 − x0)/Δu`:
///
/// ```text
/// M = ρ Δu/6 [2A, A; A, 2A],   A = [I, −w; −wᵀ, wᵀw]   in blocks (x, u)
/// c = ρ Δu/6,   p0 = c (2 a0 + a1),   p1 = c (a0 + 2 a1)
/// T = c (a0·a0 + a0·a1 + a1·a1)
/// Q = ∂T/∂q − Ṁ q̇
/// ```
/// [Cirio2014]. Unknowns: `x0, x1, u0, u1`. `M` is semidefinite of rank 6: a
/// node that moves with its own material, `(w, 1)`, has no inertia. Therefore
/// every arc length gets `1e-6 ρ L` more, `L` the mean segment of its yarn,
/// shared by its segments.
///
/// | symbol | is | unit |
/// |---|---|---|
/// | `ρ` | line density | kg/m |
/// | `Δu` | material between the nodes | m |
#[derive(Clone, Debug)]
pub struct SegmentInertia {
    stencils: Vec<[u32; 4]>,
    density: Vec<f64>,
    /// Mass added to either arc length [kg].
    floor: Vec<[f64; 2]>,
    force: InertiaForce,
}

impl SegmentInertia {
    /// Every segment of a network.
    pub fn new(network: &YarnNetwork, force: InertiaForce) -> Self {
        let node = |s: u32| network.strands[s as usize].node;
        let stencils = network.segments().map(|[a, b]| [node(a), node(b), a, b]);
        let density = network
            .segments()
            .map(|[a, _]| network.material_of(a).line_density());
        let floor = network.segments().map(|ends| {
            ends.map(|s| {
                let yarn = &network.yarns[network.strands[s as usize].yarn as usize];
                let segments = if s == yarn.first || s == yarn.last {
                    1.0
                } else {
                    2.0
                };
                scalar_floor(network, s) / segments
            })
        });
        Self {
            stencils: stencils.collect(),
            density: density.collect(),
            floor: floor.collect(),
            force,
        }
    }
}

/// `ε = 1e-6 ρ L` of a strand's arc length [kg].
fn scalar_floor(network: &YarnNetwork, strand: u32) -> f64 {
    let yarn = &network.yarns[network.strands[strand as usize].yarn as usize];
    let arc = |s: u32| network.strands[s as usize].arc;
    let mean = (arc(yarn.last) - arc(yarn.first)) / f64::from(yarn.strands - 1);
    FLOOR * network.material_of(strand).line_density() * mean
}

/// Half of every adjacent segment at rest, by node [kg].
pub fn lumped_point_masses(network: &YarnNetwork) -> Vec<f64> {
    let mut masses = vec![0.0; network.nodes()];
    for [a, b] in network.segments() {
        let half = half_mass(network, a, b);
        masses[network.strands[a as usize].node as usize] += half;
        masses[network.strands[b as usize].node as usize] += half;
    }
    masses
}

/// Inertia of a strand's arc length when neighbours slide alike on an
/// unstretched yarn [kg]: half of both adjacent segments at rest, plus the
/// `1e-6 ρ L` of [`SegmentInertia`].
pub fn lumped_scalar_masses(network: &YarnNetwork) -> Vec<f64> {
    let strands = 0..network.strands.len() as u32;
    let mut masses: Vec<f64> = strands.map(|s| scalar_floor(network, s)).collect();
    for [a, b] in network.segments() {
        let half = half_mass(network, a, b);
        masses[a as usize] += half;
        masses[b as usize] += half;
    }
    masses
}

fn half_mass(network: &YarnNetwork, a: u32, b: u32) -> f64 {
    let du = network.strands[b as usize].arc - network.strands[a as usize].arc;
    0.5 * network.material_of(a).line_density() * du
}

/// Mass matrix of one segment in the order `x0, x1, u0, u1`.
#[inline(always)]
fn mass(density: f64, q: &[f64; 8], m: &mut [[f64; 8]; 8]) {
    let du = q[7] - q[6];
    let c = density * du / 6.0;
    let w = (get(q, 3) - get(q, 0)) / du;
    let w2 = w.norm_squared();
    *m = [[0.0; 8]; 8];
    for a in 0..2 {
        for b in 0..2 {
            let k = if a == b { 2.0 * c } else { c };
            for i in 0..3 {
                m[3 * a + i][3 * b + i] = k;
            }
            put_column(m, 3 * a, 6 + b, w * -k);
            m[6 + a][6 + b] = k * w2;
        }
    }
}

/// Velocity-quadratic force in the order `x0, x1, u0, u1`, and kinetic energy.
#[inline(always)]
fn rate_force(density: f64, q: &[f64; 8], v: &[f64; 8], f: &mut [f64; 8]) -> f64 {
    let du = q[7] - q[6];
    let w = (get(q, 3) - get(q, 0)) / du;
    let (u0, u1) = (v[6], v[7]);
    let (a0, a1) = (get(v, 0) - w * u0, get(v, 3) - w * u1);
    let c = density * du / 6.0;
    let kinetic = c * (a0.dot(&a0) + a0.dot(&a1) + a1.dot(&a1));
    let (p0, p1) = ((a0 * 2.0 + a1) * c, (a0 + a1 * 2.0) * c);
    // ∂T/∂q
    let by_w: V = -(p0 * u0 + p1 * u1);
    let by_x1 = by_w / du;
    let by_u1 = (kinetic - by_w.dot(&w)) / du;
    // Ṁ q̇
    let (w_rate, growth) = ((a1 - a0) / du, (u1 - u0) / du);
    let p0_rate = p0 * growth - w_rate * (c * (2.0 * u0 + u1));
    let p1_rate = p1 * growth - w_rate * (c * (u0 + 2.0 * u1));
    set(f, 0, -by_x1 - p0_rate);
    set(f, 3, by_x1 - p1_rate);
    f[6] = -by_u1 + (w_rate.dot(&p0) + w.dot(&p0_rate));
    f[7] = by_u1 + (w_rate.dot(&p1) + w.dot(&p1_rate));
    kinetic
}

fn gather<const N: usize, const M: usize>(
    at: &RatePoint<'_>,
    dims: &[usize; N],
    nodes: &[u32; N],
) -> [[f64; M]; 2] {
    let both = EvalPoint {
        layout: at.layout,
        q: at.q,
        q_start: at.v,
        dt: 1.0,
    };
    [both.gather(dims, nodes), both.gather_start(dims, nodes)]
}

const SLIDING: [usize; 4] = [3, 3, 1, 1];

impl MassBatch for SegmentInertia {
    fn name(&self) -> &str {
        "yarn inertia"
    }

    fn len(&self) -> usize {
        self.stencils.len()
    }

    fn node_dims(&self) -> &[usize] {
        &SLIDING
    }

    fn nodes(&self, e: usize) -> &[u32] {
        &self.stencils[e]
    }

    fn masses(&self, at: &RatePoint<'_>, range: Range<usize>, masses: &mut [f64]) {
        let (rows, _) = masses.as_chunks_mut::<8>();
        let (matrices, _) = rows.as_chunks_mut::<8>();
        for (e, m) in range.zip(matrices) {
            let [q, _] = gather::<4, 8>(at, &SLIDING, &self.stencils[e]);
            mass(self.density[e], &q, m);
            m[6][6] += self.floor[e][0];
            m[7][7] += self.floor[e][1];
        }
    }

    fn rate_forces(&self, at: &RatePoint<'_>, range: Range<usize>, forces: &mut [f64]) -> f64 {
        let (forces, _) = forces.as_chunks_mut::<8>();
        let mut kinetic = 0.0;
        for (e, f) in range.zip(forces) {
            let [q, v] = gather::<4, 8>(at, &SLIDING, &self.stencils[e]);
            kinetic += rate_force(self.density[e], &q, &v, f);
            let [f0, f1] = self.floor[e];
            kinetic += 0.5 * (f0 * v[6] * v[6] + f1 * v[7] * v[7]);
            if self.force == InertiaForce::ConstantMass {
                *f = [0.0; 8];
            }
        }
        kinetic
    }

    fn heap_bytes(&self) -> usize {
        size_of_val(&self.stencils[..])
            + size_of_val(&self.density[..])
            + size_of_val(&self.floor[..])
    }
}

/// [`SegmentInertia`] without sliding: the constant mass `ρ Δu/6 [2I, I; I,
/// 2I]` of its points `x0, x1`, and no force.
#[derive(Clone, Debug)]
pub struct LockedInertia {
    stencils: Vec<[u32; 2]>,
    /// `ρ` and the frozen arc lengths.
    data: Vec<[f64; 3]>,
}

impl LockedInertia {
    /// Every segment of a network.
    pub fn new(network: &YarnNetwork) -> Self {
        let strand = |s: u32| &network.strands[s as usize];
        let stencils = network.segments().map(|s| s.map(|s| strand(s).node));
        let data = network.segments().map(|[a, b]| {
            let density = network.material_of(a).line_density();
            [density, strand(a).arc, strand(b).arc]
        });
        Self {
            stencils: stencils.collect(),
            data: data.collect(),
        }
    }

    fn gather(&self, at: &RatePoint<'_>, e: usize) -> [[f64; 8]; 2] {
        let [x, v] = gather::<2, 6>(at, &[3, 3], &self.stencils[e]);
        let [_, u0, u1] = self.data[e];
        let (mut q, mut rate) = ([0.0; 8], [0.0; 8]);
        q[..6].copy_from_slice(&x);
        q[6..].copy_from_slice(&[u0, u1]);
        rate[..6].copy_from_slice(&v);
        [q, rate]
    }
}

impl MassBatch for LockedInertia {
    fn name(&self) -> &str {
        "yarn inertia"
    }

    fn len(&self) -> usize {
        self.stencils.len()
    }

    fn node_dims(&self) -> &[usize] {
        &SLIDING[..2]
    }

    fn nodes(&self, e: usize) -> &[u32] {
        &self.stencils[e]
    }

    fn masses(&self, at: &RatePoint<'_>, range: Range<usize>, masses: &mut [f64]) {
        let (rows, _) = masses.as_chunks_mut::<6>();
        let (matrices, _) = rows.as_chunks_mut::<6>();
        for (e, m) in range.zip(matrices) {
            let mut whole = [[0.0; 8]; 8];
            mass(self.data[e][0], &self.gather(at, e)[0], &mut whole);
            for (row, whole) in m.iter_mut().zip(&whole) {
                row.copy_from_slice(&whole[..6]);
            }
        }
    }

    fn rate_forces(&self, at: &RatePoint<'_>, range: Range<usize>, forces: &mut [f64]) -> f64 {
        let (forces, _) = forces.as_chunks_mut::<6>();
        let mut kinetic = 0.0;
        for (e, f) in range.zip(forces) {
            let [q, v] = self.gather(at, e);
            let mut whole = [0.0; 8];
            kinetic += rate_force(self.data[e][0], &q, &v, &mut whole);
            f.copy_from_slice(&whole[..6]);
        }
        kinetic
    }

    fn heap_bytes(&self) -> usize {
        size_of_val(&self.stencils[..]) + size_of_val(&self.data[..])
    }
}
