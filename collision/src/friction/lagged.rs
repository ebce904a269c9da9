use crate::vec3::{Mat3, add_outer, add_tangent, dot, scale};

/// Smoothed Coulomb friction with the normal force of the step's start.
///
/// ```text
/// D = μ λ f₀(|u|),   f₀(y) = -y³/(3e²) + y²/e + e/3  for y < e,   y otherwise,   e = ε h
/// ```
/// \[Li2020\]. `u` tangential displacement within the step \[m\], `λ` normal
/// force, tangent plane and weights those at the start of the step, `ε` creep
/// speed [m/s], `h` step \[s\]. A potential within the step; below the cap it
/// creeps at up to `ε`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionLagged {
    /// Coefficient `μ` \[1\].
    pub coefficient: f64,
    /// Speed below which friction is not fully developed, `ε` [m/s].
    pub creep_speed: f64,
}

/// Value and derivatives of the smoothed potential.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaggedResponse {
    /// `D` \[J\].
    pub energy: f64,
    /// `-∇D` \[N\].
    pub force: [f64; 3],
    /// `∇²D` [N/m], positive semidefinite.
    pub curvature: [[f64; 3]; 3],
}

impl FrictionLagged {
    /// With a creep speed of 1 mm/s.
    pub fn new(coefficient: f64) -> Self {
        Self {
            coefficient,
            creep_speed: 1e-3,
        }
    }

    /// Response to a tangential displacement `u` \[m\] with unit `normal`, under
    /// the normal force `lambda` \[N\], in a step of length `dt` \[s\].
    #[inline]
    pub fn respond(&self, u: [f64; 3], normal: [f64; 3], lambda: f64, dt: f64) -> LaggedResponse {
        let cap = self.coefficient * lambda;
        let e = self.creep_speed * dt;
        let y = dot(u, u).sqrt();
        let mut curvature: Mat3 = [[0.0; 3]; 3];
        if y >= e {
            let t = scale(1.0 / y, u);
            add_tangent(&mut curvature, cap / y, normal, Some(t));
            return LaggedResponse {
                energy: cap * y,
                force: scale(-cap, t),
                curvature,
            };
        }
        // f₁(y)/y is finite at zero; the slope along u is f₁' = f₁/y - y/e².
        let over = (2.0 - y / e) / e;
        add_tangent(&mut curvature, cap * over, normal, None);
        if y > 0.0 {
            add_outer(&mut curvature, -cap / (e * e * y), u);
        }
        let energy = cap * (y * y * (1.0 - y / (3.0 * e)) / e + e / 3.0);
        LaggedResponse {
            energy,
            force: scale(-cap * over, u),
            curvature,
        }
    }
}
