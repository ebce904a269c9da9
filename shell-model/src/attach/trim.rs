use selvedge_energy::{Curvature, EvalPoint, StencilEnergy};

use super::rotation::{self, Quaternion};
use crate::vec3::{
    Block, add, blend, cross, dot, node, norm, outer, put, put_transposed, scale, set_node, skew,
    sub,
};

/// A rigid trim (a button, a buckle): two points of the layout.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrimBody {
    /// Point that is the centre of mass \[m\].
    pub centre: u32,
    /// Point whose three unknowns are a rotation vector \[rad\]: over a step the
    /// body turns by `exp([q − q_start]×)`, so their rate is the angular
    /// velocity.
    pub spin: u32,
    /// Orientation `(w, x, y, z)` at the start.
    pub orientation: [f64; 4],
}

/// A thread between a place of the cloth and a place on a trim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrimThread {
    /// Corners of a triangle of the cloth.
    pub points: [u32; 3],
    /// Barycentric coordinates `b` of the place, summing to 1; negative ones
    /// extrapolate beyond the triangle.
    pub weights: [f64; 3],
    /// Index of the body.
    pub body: usize,
    /// Place `r_0` on the body, from its centre, in its own axes \[m\].
    pub arm: [f64; 3],
    /// `k` [N/m].
    pub stiffness: f64,
}

/// Threads that hold rigid trims.
///
/// ```text
/// d = Σ b_i x_i − c − r,   r = R r_0,   E = ½ k |d|²,   J = [b_i I, −I, [r]×]
/// ∇E = k Jᵀ d,     ∇²E = k JᵀJ + k ((d·r) I − ½ (r dᵀ + d rᵀ)) on the spin
/// ```
/// The entry of the gradient on the spin is minus the torque `k r × d`, which
/// is what Newton-Euler equations need and what keeps angular momentum; it is
/// the derivative of the value where the step's rotation is small, so the term
/// is not marked conservative. `Exact` is the symmetric part; `Projected`
/// clamps the spin's own block; `GaussNewton` is `k JᵀJ`.
///
/// The orientation at the last accepted step is the term's history (a
/// quaternion per body).
///
/// **What an integrator must supply.** The centre is a point of the body's
/// mass. The spin is a point without weight or drag whose "mass" is the moment
/// of inertia [kg·m²]; for the small, nearly isotropic trims of clothing the
/// mean of the principal moments will do ([`BodyInertia::mean`]), and then
/// gravity has to leave it out and no other code is special. The full tensor with its gyroscopic term is
/// [`BodyInertia::residual`].
#[derive(Clone, Debug)]
pub struct RigidTrims {
    stencils: Vec<[u32; 5]>,
    threads: Vec<(TrimThread, [f64; 3])>,
    bodies: Vec<TrimBody>,
    orientations: Vec<f64>,
}

impl RigidTrims {
    /// Threads between cloth and bodies.
    ///
    /// # Panics
    /// When a thread names a body that does not exist.
    pub fn new(bodies: &[TrimBody], threads: &[TrimThread]) -> Self {
        let stencils = threads
            .iter()
            .map(|t| {
                let ([i, j, k], body) = (t.points, &bodies[t.body]);
                [i, j, k, body.centre, body.spin]
            })
            .collect();
        let mut trims = Self {
            stencils,
            threads: threads.iter().map(|t| (*t, [0.0; 3])).collect(),
            bodies: bodies.to_vec(),
            orientations: bodies
                .iter()
                .flat_map(|b| rotation::normalised(b.orientation))
                .collect(),
        };
        trims.turn_arms();
        trims
    }

    /// Orientations `(w, x, y, z)` of all bodies at the last accepted step.
    pub fn orientations(&self) -> &[[f64; 4]] {
        self.orientations.as_chunks::<4>().0
    }

    fn turn_arms(&mut self) {
        let (orientations, _) = self.orientations.as_chunks::<4>();
        for (thread, arm) in &mut self.threads {
            *arm = rotation::rotate(orientations[thread.body], thread.arm);
        }
    }

    /// Weights of the cloth's points and of the centre in `d`.
    #[inline]
    fn weights(&self, e: usize) -> [f64; 4] {
        let [a, b, c] = self.threads[e].0.weights;
        [a, b, c, -1.0]
    }

    /// `d`, `r` and `k`
    #[inline]
    fn pulled(&self, e: usize, q: &[f64; 15], at: &EvalPoint<'_>) -> ([f64; 3], [f64; 3], f64) {
        let (thread, arm) = &self.threads[e];
        let turn = sub(node(q, 4), at.point_start(self.stencils[e][4]));
        let r = rotation::rotate(rotation::from_vector(turn), *arm);
        let centre = node(q, 3);
        // Differences first: the coordinates sum to one.
        let place = (0..3).fold([0.0; 3], |sum, i| {
            blend(1.0, sum, thread.weights[i], sub(node(q, i), centre))
        });
        (sub(place, r), r, thread.stiffness)
    }
}

impl StencilEnergy<5, 15> for RigidTrims {
    const NODE_DIMS: [usize; 5] = [3; 5];

    fn stencils(&self) -> &[[u32; 5]] {
        &self.stencils
    }

    fn value(&self, e: usize, q: &[f64; 15], at: &EvalPoint<'_>) -> f64 {
        let (d, _, k) = self.pulled(e, q, at);
        0.5 * k * dot(d, d)
    }

    fn gradient(&self, e: usize, q: &[f64; 15], at: &EvalPoint<'_>, g: &mut [f64; 15]) -> f64 {
        let (d, r, k) = self.pulled(e, q, at);
        for (i, w) in self.weights(e).into_iter().enumerate() {
            set_node(g, i, scale(k * w, d));
        }
        set_node(g, 4, scale(-k, cross(r, d)));
        0.5 * k * dot(d, d)
    }

    fn hessian(
        &self,
        e: usize,
        q: &[f64; 15],
        at: &EvalPoint<'_>,
        curvature: Curvature,
        g: &mut [f64; 15],
        h: &mut [[f64; 15]; 15],
    ) -> f64 {
        let value = self.gradient(e, q, at, g);
        let (d, r, k) = self.pulled(e, q, at);
        *h = [[0.0; 15]; 15];
        let w = self.weights(e);
        for i in 0..4 {
            for j in 0..4 {
                for a in 0..3 {
                    h[3 * i + a][3 * j + a] = k * (w[i] * w[j]);
                }
            }
            let turn = skew(r).map(|row| scale(k * w[i], row));
            put(h, i, 4, &turn);
            put_transposed(h, 4, i, &turn);
        }
        let mut spin = outer(r, r).map(|row| scale(-k, row));
        for a in 0..3 {
            spin[a][a] += k * dot(r, r);
        }
        match curvature {
            Curvature::GaussNewton => {}
            Curvature::Exact => spin = sum(&spin, k, &geometric(d, r)),
            Curvature::Projected => spin = sum(&spin, k, &geometric_projected(d, r)),
        }
        put(h, 4, 4, &spin);
        value
    }

    fn is_conservative(&self) -> bool {
        false
    }

    fn commit(&mut self, at: &EvalPoint<'_>) {
        for (body, orientation) in self
            .bodies
            .iter()
            .zip(self.orientations.as_chunks_mut::<4>().0)
        {
            let turn = sub(at.point(body.spin), at.point_start(body.spin));
            let next = rotation::normalised(rotation::multiply(
                rotation::from_vector(turn),
                *orientation,
            ));
            if next.iter().all(|x| x.is_finite()) {
                *orientation = next;
            }
        }
        self.turn_arms();
    }

    fn history(&self) -> &[f64] {
        &self.orientations
    }

    fn restore_history(&mut self, history: &[f64]) {
        self.orientations.copy_from_slice(history);
        self.turn_arms();
    }

    fn heap_bytes(&self) -> usize {
        size_of_val(&self.stencils[..])
            + size_of_val(&self.threads[..])
            + size_of_val(&self.bodies[..])
            + size_of_val(&self.orientations[..])
    }
}

fn sum(a: &Block, k: f64, b: &Block) -> Block {
    std::array::from_fn(|i| blend(1.0, a[i], k, b[i]))
}

/// `(d·r) I − ½ (r dᵀ + d rᵀ)`
fn geometric(d: [f64; 3], r: [f64; 3]) -> Block {
    let mut g = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            g[i][j] = -0.5 * (r[i] * d[j] + d[i] * r[j]);
        }
        g[i][i] += dot(d, r);
    }
    g
}

/// Its positive part: the eigenvalues are `½ (d·r − p)` along `r̂ + d̂`,
/// `½ (d·r + p)` along `r̂ − d̂` and `d·r` across, where `p = |d| |r|`.
fn geometric_projected(d: [f64; 3], r: [f64; 3]) -> Block {
    let (length_d, length_r) = (norm(d), norm(r));
    let p = length_d * length_r;
    if p <= f64::MIN_POSITIVE {
        return [[0.0; 3]; 3];
    }
    let (d1, r1) = (scale(1.0 / length_d, d), scale(1.0 / length_r, r));
    let c = dot(d1, r1).clamp(-1.0, 1.0);
    if c >= 0.0 {
        let v = add(r1, d1);
        sum(
            &geometric(d, r),
            0.25 * p * (1.0 - c) / (1.0 + c),
            &outer(v, v),
        )
    } else {
        let u = sub(r1, d1);
        outer(scale(0.25 * p * (1.0 + c) / (1.0 - c), u), u)
    }
}

/// Moments of inertia of a rigid trim about its principal axes [kg·m²].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyInertia {
    /// Principal moments, along the body's own axes.
    pub principal: [f64; 3],
}

impl BodyInertia {
    /// A round button: mass \[kg\], radius and thickness \[m\], axis along the
    /// body's third axis.
    pub fn disc(mass: f64, radius: f64, thickness: f64) -> Self {
        let across = mass * (0.25 * radius * radius + thickness * thickness / 12.0);
        Self {
            principal: [across, across, 0.5 * mass * radius * radius],
        }
    }

    /// Mean moment, the "mass" of a spin point [kg·m²].
    pub fn mean(&self) -> f64 {
        self.principal.iter().sum::<f64>() / 3.0
    }

    /// `J_w = R J Rᵀ` at an orientation `(w, x, y, z)`.
    pub fn world(&self, orientation: [f64; 4]) -> [[f64; 3]; 3] {
        let q = rotation::normalised(orientation);
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
            .map(|axis| rotation::rotate(q, axis));
        let mut j = [[0.0; 3]; 3];
        for (axis, moment) in axes.into_iter().zip(self.principal) {
            j = sum(&j, moment, &outer(axis, axis));
        }
        j
    }

    /// Change of angular momentum over a step,
    /// `R_1 J R_1ᵀ ω_1 − R_0 J R_0ᵀ ω_0` with `R_1 = exp(dt [ω_1]×) R_0`
    /// [N·m·s], and the matrix `R_1 J R_1ᵀ` that stands for its derivative by
    /// `ω_1` (gyroscopic terms dropped).
    pub fn residual(
        &self,
        orientation_start: [f64; 4],
        omega_start: [f64; 3],
        omega_end: [f64; 3],
        dt: f64,
    ) -> ([f64; 3], [[f64; 3]; 3]) {
        let turn: Quaternion = rotation::from_vector(scale(dt, omega_end));
        let end = self.world(rotation::multiply(turn, orientation_start));
        let start = self.world(orientation_start);
        let change = sub(
            crate::vec3::apply(&end, omega_end),
            crate::vec3::apply(&start, omega_start),
        );
        (change, end)
    }
}
