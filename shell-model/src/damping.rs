//! How internal friction enters an energy, chosen by type so that an undamped
//! material pays nothing.

/// A law of internal friction with viscous moduli `β ×` the elastic ones.
///
/// | type | strain rate `ε̇` | conservative |
/// |---|---|---|
/// | [`Undamped`] | none | yes |
/// | [`RateDamping`] | `J(q) v`, `v = (q − q_start)/dt` | no |
/// | [`IncrementalDamping`] | `(ε(q) − ε(q_start))/dt` | yes: gradient of `dt Φ(ε̇)` |
///
/// Every energy adds the force `−Jᵀ D ε̇` with `D = β C` (Rayleigh dissipation
/// potential `Φ = ½ ε̇ᵀ D ε̇`, \[SanchezBanderas2018\]): no force on rigid
/// motions, momentum kept, power `−2Φ ≤ 0`.
pub trait Damping:
    sealed::Sealed + Copy + Default + std::fmt::Debug + Send + Sync + 'static
{
    /// The law as a value.
    const KIND: DampingKind;
}

/// The laws of internal friction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum DampingKind {
    /// No internal friction.
    Off,
    /// [`RateDamping`].
    #[default]
    Rate,
    /// [`IncrementalDamping`].
    Incremental,
}

/// No internal friction.
#[derive(Clone, Copy, Debug, Default)]
pub struct Undamped;

/// Friction on the strain rate at the end of the step.
///
/// The value of the energy is the elastic part alone, and the term is not
/// conservative. The second derivative keeps `Jᵀ D J/dt` and
/// `Σ (D ε̇)_k ∇²ε_k`, both symmetric; `Jᵀ D ∂(J v)/∂q` at fixed `v`, which is
/// neither symmetric nor large in a short step, is left out. Converged steps
/// do not depend on it.
#[derive(Clone, Copy, Debug, Default)]
pub struct RateDamping;

/// Friction on the increment of strain over the step; derivatives are exact
/// and the value contains the dissipation potential of the step.
#[derive(Clone, Copy, Debug, Default)]
pub struct IncrementalDamping;

impl Damping for Undamped {
    const KIND: DampingKind = DampingKind::Off;
}

impl Damping for RateDamping {
    const KIND: DampingKind = DampingKind::Rate;
}

impl Damping for IncrementalDamping {
    const KIND: DampingKind = DampingKind::Incremental;
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::Undamped {}
    impl Sealed for super::RateDamping {}
    impl Sealed for super::IncrementalDamping {}
}
