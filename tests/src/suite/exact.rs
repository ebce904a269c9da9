//! Closed forms and their numbers, computed where no formula gives them.

/// A clamped elastica, horizontal at its clamp, in units of its length.
///
/// ```text
/// B θ'' = −(w (L − s) + P) cos θ,   θ(0) = 0,   θ'(L) = 0
/// ```
/// `θ` is the angle below the horizontal.
#[derive(Clone, Debug)]
pub struct Elastica {
    angles: Vec<f64>,
    /// Depth of the end below the clamp [1].
    pub depth: f64,
    /// Horizontal distance of the end from the clamp [1].
    pub reach: f64,
}

const STEPS: usize = 4000;

impl Elastica {
    /// With weight `w` in `B/L³` and load at the end `P` in `B/L²`: shooting
    /// for the curvature at the clamp, Runge-Kutta of fourth order.
    pub fn new(weight: f64, load: f64) -> Self {
        let (mut low, mut high) = (0.0, weight + load);
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            if falls_short(&shoot(weight, load, middle).0) {
                low = middle
            } else {
                high = middle
            }
        }
        let (states, [_, _, reach, depth]) = shoot(weight, load, low);
        let angles = states.iter().map(|y| y[0]).collect();
        Self {
            angles,
            depth,
            reach,
        }
    }

    /// Angle at `s` in lengths from the clamp \[rad\].
    pub fn angle(&self, s: f64) -> f64 {
        let at = (s * STEPS as f64).round() as usize;
        self.angles[at.min(STEPS)]
    }
}

/// Whether the curvature at the clamp was too small: the curve turns up before
/// it hangs down. Beyond the vertical it was too large, whatever comes after.
fn falls_short(states: &[[f64; 2]]) -> bool {
    let turn = states
        .iter()
        .find(|[angle, curvature]| *curvature < 0.0 || *angle > std::f64::consts::FRAC_PI_2);
    turn.is_some_and(|[_, curvature]| *curvature < 0.0)
}

/// Angle and curvature along the way; angle, curvature, reach and depth at the
/// end.
fn shoot(weight: f64, load: f64, start: f64) -> (Vec<[f64; 2]>, [f64; 4]) {
    let h = 1.0 / STEPS as f64;
    let slope = |s: f64, y: [f64; 4]| {
        let (sin, cos) = y[0].sin_cos();
        [y[1], -(weight * (1.0 - s) + load) * cos, cos, sin]
    };
    let along = |y: [f64; 4], k: [f64; 4], h: f64| std::array::from_fn(|i| y[i] + h * k[i]);
    let mut y = [0.0, start, 0.0, 0.0];
    let mut states = vec![[0.0, start]];
    for n in 0..STEPS {
        let s = n as f64 * h;
        let k1 = slope(s, y);
        let k2 = slope(s + 0.5 * h, along(y, k1, 0.5 * h));
        let k3 = slope(s + 0.5 * h, along(y, k2, 0.5 * h));
        let k4 = slope(s + h, along(y, k3, h));
        y = std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
        states.push([y[0], y[1]]);
    }
    (states, y)
}

/// First positive zero of the Bessel function `J_ν`, `−1 < ν ≤ 0`, from its
/// power series.
pub fn bessel_zero(order: f64) -> f64 {
    // J_ν without its factor (x/2)^ν / Γ(ν + 1), which has no zero.
    let series = |x: f64| {
        let (mut term, mut sum) = (1.0, 1.0);
        for k in 1..40 {
            let k = f64::from(k);
            term *= -0.25 * x * x / (k * (k + order));
            sum += term;
        }
        sum
    };
    let (mut low, mut high) = (0.0, 0.0);
    while series(high) > 0.0 {
        low = high;
        high += 0.1;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if series(middle) > 0.0 {
            low = middle
        } else {
            high = middle
        }
    }
    low
}

/// `w L³/B` at which a strip that stands on a clamp buckles under its weight,
/// `9/4 z²` with `J_{−1/3}(z) = 0` [TimoshenkoGere1961, § 2.12].
pub fn standing_strip() -> f64 {
    2.25 * bessel_zero(-1.0 / 3.0).powi(2)
}

/// `P L²/√(EI GJ)` at which a cantilever on its edge falls sideways under a
/// load at its end, `2 z` with `J_{−1/4}(z) = 0` [TimoshenkoGere1961, § 6.3].
pub fn lateral_end_load() -> f64 {
    2.0 * bessel_zero(-0.25)
}

/// The same for its own weight, `q L³/√(EI GJ) = 6 z` with `J_{−1/6}(z) = 0`
/// [TimoshenkoGere1961, § 6.3].
pub fn lateral_weight() -> f64 {
    6.0 * bessel_zero(-1.0 / 6.0)
}

/// `(βL)²` of the first bending mode of a cantilever, `cos βL cosh βL = −1`;
/// `ω = (βL)² √(B/(ρ L⁴))`.
pub fn cantilever_mode() -> f64 {
    let (mut low, mut high) = (0.0_f64, std::f64::consts::PI);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if middle.cos() * middle.cosh() > -1.0 {
            low = middle
        } else {
            high = middle
        }
    }
    low * low
}

/// `ω √(L/g)` of the first mode of a hanging chain, `z/2` with `J_0(z) = 0`.
pub fn chain_mode() -> f64 {
    0.5 * bessel_zero(0.0)
}

/// Sag [m] of an elastic catenary of rest length `length` [m] between supports
/// at one height, `span` [m] apart, of weight `weight` [N/m²] and modulus
/// `stiffness` [N/m], both per width.
///
/// ```text
/// x(s) = H s/k + (H/w) asinh(w s/H),   y(s) = w s²/2k + (H/w) (√(1 + (w s/H)²) − 1)
/// x(L/2) = D/2,   sag = y(L/2)
/// ```
/// \[Irvine1981\], `s` from the lowest point, `H` the horizontal tension.
pub fn catenary_sag(span: f64, length: f64, weight: f64, stiffness: f64) -> f64 {
    let half = 0.5 * length;
    let (mut low, mut high) = (1e-6 * weight * length, 1e3 * weight * length);
    for _ in 0..100 {
        let h: f64 = (low * high).sqrt();
        if h * half / stiffness + h / weight * (weight * half / h).asinh() < 0.5 * span {
            low = h
        } else {
            high = h
        }
    }
    let slope = weight * half / low;
    0.5 * weight * half * half / stiffness + low / weight * (slope.hypot(1.0) - 1.0)
}

/// Stretched length [m] of a strip of rest length `length` [m] that hangs
/// under its own weight `weight` [N/m²], Saint Venant-Kirchhoff with modulus
/// `stiffness` [N/m].
///
/// ```text
/// L' = (k / 2w) [¾ (s⁴ − 1) − ½ (s² − 1)],   ½ k (s³ − s) = w L
/// ```
pub fn hanging(stiffness: f64, weight: f64, length: f64) -> f64 {
    let mut s = 1.0_f64;
    for _ in 0..60 {
        let force = 0.5 * stiffness * (s.powi(3) - s) - weight * length;
        s -= force / (0.5 * stiffness * (3.0 * s * s - 1.0));
    }
    0.5 * stiffness / weight * (0.75 * (s.powi(4) - 1.0) - 0.5 * (s * s - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// The shooting against tables made elsewhere, and the limit of small load.
    #[test]
    fn elastica() {
        for (gamma, reach, depth) in [
            (1.0, 0.99125, 0.12347),
            (10.0, 0.65635, 0.70020),
            (100.0, 0.15922, 0.93752),
            (200.0, 0.10742, 0.95677),
        ] {
            let e = Elastica::new(gamma, 0.0);
            assert_relative_eq!(e.reach, reach, epsilon = 6e-6);
            assert_relative_eq!(e.depth, depth, epsilon = 6e-6);
        }
        let e = Elastica::new(0.0, 2.0);
        assert_relative_eq!(1.0 - e.reach, 0.16064, epsilon = 6e-6);
        assert_relative_eq!(e.depth, 0.49346, epsilon = 6e-6);
        let small = Elastica::new(1e-4, 0.0);
        assert_relative_eq!(small.depth, 1e-4 / 8.0, max_relative = 1e-6);
        assert_relative_eq!(e.angle(1.0).to_degrees(), 44.791, epsilon = 1e-3);
    }

    /// Loads of buckling against the figures of the literature.
    #[test]
    fn buckling_loads() {
        assert_relative_eq!(standing_strip(), 7.83735, epsilon = 1e-5);
        assert_relative_eq!(lateral_end_load(), 4.01260, epsilon = 1e-5);
        assert_relative_eq!(lateral_weight(), 12.85376, epsilon = 1e-5);
        // J_{−1/2} is a cosine over a root.
        let half_pi = std::f64::consts::FRAC_PI_2;
        assert_relative_eq!(bessel_zero(-0.5), half_pi, max_relative = 1e-12);
    }

    /// First modes against the figures of the literature.
    #[test]
    fn modes() {
        assert_relative_eq!(cantilever_mode(), 3.51602, epsilon = 1e-5);
        assert_relative_eq!(chain_mode(), 1.20241, epsilon = 1e-5);
    }

    /// Sag at `S/a = 1.2` and 1.25; the stretch of 1 m.
    #[test]
    fn hanging_shapes() {
        let sag = catenary_sag(1.0, 1.2, 2.0, 1e12);
        assert_relative_eq!(sag, 0.292344, epsilon = 1e-6);
        assert_relative_eq!(catenary_sag(0.8, 1.0, 2.0, 1e12), 0.265438, epsilon = 1e-6);
        // Without a span: a cord that hangs in two halves and stretches.
        let stretched = 0.5 + 2.0 * 0.25 / (2.0 * 100.0);
        assert_relative_eq!(
            catenary_sag(1e-5, 1.0, 2.0, 100.0),
            stretched,
            epsilon = 1e-4
        );
        assert_relative_eq!(hanging(100.0, 0.2 * 9.81, 1.0), 1.009_624_7, epsilon = 1e-7);
    }
}
