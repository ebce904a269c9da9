//! What a cloth is made of: areal density, anisotropic membrane moduli,
//! bending rigidities, damping and friction, with readers for fabric files.
//!
//! Axes: `u` is warp (wale for knits), `v` is weft (course). Everything is SI
//! and already integrated through the thickness: membrane moduli in N/m,
//! flexural rigidities in N·m (per unit width).
//!
//! | symbol | field | unit |
//! |---|---|---|
//! | `ρ` | [`Fabric::density`] | kg/m² |
//! | `k_u, k_v, k_s, k_uv` | [`Fabric::membrane`] | N/m |
//! | `B_u, B_v, B_b` | [`Fabric::bending`] | N·m |
//! | `α` | [`Fabric::drag`] | 1/s |
//! | `β_s`, `β_b` | [`Fabric::membrane_damping`], [`Fabric::bending_damping`] | s |
//! | `μ` | [`Fabric::friction`] | 1 |
//!
//! ```
//! use selvedge_shell_model::fabric::library;
//!
//! let denim = library::get("denim-12oz")?;
//! assert!(denim.bending_length_warp() > 0.02); // m
//! let error = library::get("denim-12-oz").unwrap_err().to_string();
//! assert!(error.contains("denim-12oz"));
//! # Ok::<(), selvedge_shell_model::fabric::FabricError>(())
//! ```

mod bending;
mod error;
mod evaluate;
mod file;
pub mod library;
mod measured;
mod membrane;
mod tree;

pub use bending::BendingRigidity;
pub use error::FabricError;
pub use evaluate::FabricState;
pub use file::{FabricRecord, Provenance, SourceKind, read_fabric, read_fabric_file};
pub use measured::{MeasuredFabric, read_measured};
pub use membrane::MembraneModuli;

/// Default drag coefficient `α` [1/s], from \[Pizana2025\].
pub const DEFAULT_DRAG: f64 = 5.0;
/// Default membrane dissipation `β_s` \[s\], from \[Pizana2025\].
pub const DEFAULT_MEMBRANE_DAMPING: f64 = 1e-2;
/// Default bending dissipation `β_b` \[s\], from \[Pizana2025\].
pub const DEFAULT_BENDING_DAMPING: f64 = 1e-1;
/// Default cloth-cloth friction coefficient \[1\].
pub const DEFAULT_FRICTION: f64 = 0.3;
/// Default fabric thickness \[m\].
pub const DEFAULT_THICKNESS: f64 = 5e-4;
/// Standard gravity [m/s²], for quantities defined by a laboratory test.
pub const STANDARD_GRAVITY: f64 = 9.80665;

/// Material of a sheet of cloth, linear and orthotropic.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Fabric {
    /// Name for messages and reports.
    pub name: String,
    /// Areal density `ρ` [kg/m²].
    pub density: f64,
    /// Thickness \[m\]; used by contact and export only, the moduli already
    /// contain it.
    pub thickness: f64,
    /// Membrane moduli [N/m].
    pub membrane: MembraneModuli,
    /// Flexural rigidities [N·m].
    pub bending: BendingRigidity,
    /// Membrane dissipation `β_s` \[s\]: viscous moduli are `β_s C`.
    pub membrane_damping: f64,
    /// Bending dissipation `β_b` \[s\].
    pub bending_damping: f64,
    /// Coulomb friction coefficient of the fabric on itself \[1\].
    pub friction: f64,
    /// Drag against the still air `α` [1/s]: force `−α m v`.
    pub drag: f64,
}

impl Fabric {
    /// A fabric with default thickness, damping, drag and friction.
    ///
    /// # Errors
    /// [`FabricError::Value`] when a number is outside its range, see
    /// [`validate`](Self::validate).
    pub fn new(
        name: impl Into<String>,
        density: f64,
        membrane: MembraneModuli,
        bending: BendingRigidity,
    ) -> Result<Self, FabricError> {
        let fabric = Self {
            name: name.into(),
            density,
            thickness: DEFAULT_THICKNESS,
            membrane,
            bending,
            membrane_damping: DEFAULT_MEMBRANE_DAMPING,
            bending_damping: DEFAULT_BENDING_DAMPING,
            friction: DEFAULT_FRICTION,
            drag: DEFAULT_DRAG,
        };
        fabric.validate()?;
        Ok(fabric)
    }

    /// Checks every field: density and thickness positive, damping, drag and
    /// friction not negative, moduli positive definite, rigidity positive in
    /// every direction.
    ///
    /// # Errors
    /// [`FabricError::Value`] with the field, its value and what is allowed.
    pub fn validate(&self) -> Result<(), FabricError> {
        error::positive("density", self.density)?;
        error::positive("thickness", self.thickness)?;
        error::not_negative("membrane_damping", self.membrane_damping)?;
        error::not_negative("bending_damping", self.bending_damping)?;
        error::not_negative("friction", self.friction)?;
        error::not_negative("drag", self.drag)?;
        self.membrane.validate()?;
        self.bending.validate()
    }

    /// Bending length of a strip cut along the warp, as in the Peirce
    /// cantilever test \[m\].
    ///
    /// ```text
    /// c = (B_u / (ρ g))^(1/3)
    /// ```
    pub fn bending_length_warp(&self) -> f64 {
        self.bending_length(0.0)
    }

    /// Bending length of a strip cut at `angle` \[rad\] from the warp \[m\].
    pub fn bending_length(&self, angle: f64) -> f64 {
        (self.bending.rigidity(angle) / (self.density * STANDARD_GRAVITY)).cbrt()
    }
}
