use crate::vec3::{Mat3, Vec3, add_tangent, axpy, dot, scale};

/// Penalty stick and slip with an anchor that is dragged along.
///
/// ```text
/// f* = -(k_t u + d_t v_t)                       trial
/// f  = f*  if |f*| ≤ μ f_n,   μ f_n f*/|f*|  otherwise
/// u  ← -(f + d_t v_t)/k_t                       on an accepted slipping step
/// ```
/// After \[YamaneNakamura2006\]. `u` tangential displacement from the anchor
/// \[m\], `v_t` tangential relative velocity [m/s], `f_n` normal force \[N\].
///
/// With `f_n` and the tangent plane held fixed, and `v_t` following from the
/// end position, the force is the gradient of a convex potential (quadratic
/// up to the cap, linear beyond), which is what the energy reports and whose
/// second derivative is the curvature. `f_n` is that of the same evaluation
/// point, not of the iterate before: an evaluation stays a pure function, which
/// line searches and repeated steps rely on, and the converged step is the
/// same. `∂f_n/∂x` is left out of the matrix in either case, since it is not
/// symmetric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionAnchored {
    /// Coefficient `μ` \[1\].
    pub coefficient: f64,
    /// Anchor stiffness `k_t` relative to the contact stiffness \[1\].
    pub stiffness_ratio: f64,
    /// Anchor damping relative to critical, `d_t = 2 ζ √(k_t m)` \[1\], with
    /// `1/m = Σ wᵢ²/mᵢ`. Below one, anchors overshoot and creep.
    pub damping_ratio: f64,
}

/// What one anchor feels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnchorState {
    /// Displacement from the anchor \[m\], tangential.
    pub displacement: [f64; 3],
    /// Relative velocity [m/s], tangential.
    pub velocity: [f64; 3],
    /// Unit normal of the contact.
    pub normal: [f64; 3],
    /// Normal force \[N\].
    pub normal_force: f64,
    /// Anchor stiffness `k_t` [N/m].
    pub stiffness: f64,
    /// Anchor damping `d_t` [N·s/m].
    pub damping: f64,
}

/// What friction answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnchorResponse {
    /// Friction force \[N\].
    pub force: [f64; 3],
    /// Whether the trial force was capped.
    pub slipping: bool,
    /// Displacement from the anchor after the step was accepted \[m\].
    pub displacement: [f64; 3],
    /// Value of the step's potential \[J\].
    pub energy: f64,
    /// `-∂f/∂u` is this times the stiffness, `-∂f/∂v` times the damping: 1
    /// when sticking, `μ f_n / |f*|` when slipping.
    pub share: f64,
    /// Direction of slip, when slipping.
    pub direction: Option<[f64; 3]>,
}

impl FrictionAnchored {
    /// Critically damped anchors as stiff as the contact.
    pub fn new(coefficient: f64) -> Self {
        Self {
            coefficient,
            stiffness_ratio: 1.0,
            damping_ratio: 1.0,
        }
    }

    /// Force of one anchor in a step of length `dt` \[s\].
    #[inline]
    pub fn respond(&self, s: &AnchorState, dt: f64) -> AnchorResponse {
        let trial = axpy(scale(-s.stiffness, s.displacement), -s.damping, s.velocity);
        let size = dot(trial, trial).sqrt();
        let cap = self.coefficient * s.normal_force;
        let kappa = s.stiffness + s.damping / dt;
        if size <= cap {
            let energy = if kappa > 0.0 {
                0.5 * size * size / kappa
            } else {
                0.0
            };
            return AnchorResponse {
                force: trial,
                slipping: false,
                displacement: s.displacement,
                energy,
                share: 1.0,
                direction: None,
            };
        }
        let direction = scale(1.0 / size, trial);
        let force = scale(cap, direction);
        let dragged = axpy(force, s.damping, s.velocity);
        AnchorResponse {
            force,
            slipping: true,
            displacement: scale(-1.0 / s.stiffness, dragged),
            energy: cap * (size - 0.5 * cap) / kappa,
            share: cap / size,
            direction: Some(direction),
        }
    }
}

impl AnchorResponse {
    /// Adds `-∂f/∂x` of an end position, `share (k_t + d_t/dt)(T - τ τᵀ)`, to
    /// `k` [N/m].
    #[inline]
    pub(crate) fn add_curvature(&self, s: &AnchorState, dt: f64, k: &mut Mat3) {
        let stiffness = self.share * (s.stiffness + s.damping / dt);
        add_tangent(k, stiffness, s.normal, self.direction);
    }
}

/// `d_t = 2 ζ √(k_t m)` from the sum of `wᵢ²/mᵢ`; 0 for two immovable sides.
#[inline]
pub(crate) fn anchor_damping(ratio: f64, stiffness: f64, inverse_mass: f64) -> f64 {
    if inverse_mass > 0.0 {
        2.0 * ratio * (stiffness / inverse_mass).sqrt()
    } else {
        0.0
    }
}

/// Two numbers of a tangent vector in the frame `t`, `n × t`.
#[inline]
pub(crate) fn to_frame(u: Vec3, t: Vec3, n: Vec3) -> [f64; 2] {
    [dot(u, t), dot(u, crate::vec3::cross(n, t))]
}

/// Inverse of [`to_frame`].
#[inline]
pub(crate) fn from_frame(o: [f64; 2], t: Vec3, n: Vec3) -> Vec3 {
    axpy(scale(o[0], t), o[1], crate::vec3::cross(n, t))
}
