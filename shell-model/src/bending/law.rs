//! Strain measures of the hinge angle.

/// A function of the hinge angle, as a type.
pub trait AngleLaw: sealed::Sealed + Copy + std::fmt::Debug + Send + Sync + 'static {
    /// Strain measure `φ(θ)`, `φ'` and `φ''`; the energy is `½ k (φ − φ̄)²`.
    fn measure(angle: f64) -> [f64; 3];
}

/// `φ = θ`.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlainAngle;

/// `φ = 2 tan(θ/2)`: grows without bound as the hinge closes at `±π`, which
/// keeps wings from passing through each other.
#[derive(Clone, Copy, Debug, Default)]
pub struct TangentAngle;

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::PlainAngle {}
    impl Sealed for super::TangentAngle {}
}

impl AngleLaw for PlainAngle {
    #[inline(always)]
    fn measure(angle: f64) -> [f64; 3] {
        [angle, 1.0, 0.0]
    }
}

impl AngleLaw for TangentAngle {
    #[inline(always)]
    fn measure(angle: f64) -> [f64; 3] {
        let t = (0.5 * angle).tan();
        let slope = 1.0 + t * t;
        [2.0 * t, slope, slope * t]
    }
}
