use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// A fabric of a scene: a base with changes, or all of its numbers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FabricEntry {
    /// Library fabric to start from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub library: Option<String>,
    /// Fabric file to start from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// Areal density [kg/m²].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// Thickness \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thickness: Option<f64>,
    /// Friction coefficient \[1\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Membrane moduli.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub membrane: Option<MembraneEntry>,
    /// Flexural rigidities.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bending: Option<BendingEntry>,
    /// Dissipation.
    pub damping: FabricDamping,
}

/// Membrane moduli of a fabric entry.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "form", rename_all = "kebab-case")]
pub enum MembraneEntry {
    /// Entries of the stiffness matrix [N/m]; what is absent comes from the base.
    Direct {
        /// `k_u` [N/m].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        warp: Option<f64>,
        /// `k_v` [N/m].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        weft: Option<f64>,
        /// `k_s` [N/m].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        shear: Option<f64>,
        /// `k_uv` [N/m].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        coupling: Option<f64>,
    },
    /// Moduli of strips.
    Moduli {
        /// `E_u` [N/m].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        warp: Option<f64>,
        /// `E_v` [N/m].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        weft: Option<f64>,
        /// `E_b` [N/m].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        bias: Option<f64>,
        /// Poisson's ratio `ν_uv`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        poisson: Option<f64>,
    },
    /// The same in every direction.
    Isotropic {
        /// Young's modulus times thickness [N/m].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        stiffness: Option<f64>,
        /// Poisson's ratio.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        poisson: Option<f64>,
    },
}

/// Flexural rigidities of a fabric entry.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "form", rename_all = "kebab-case")]
pub enum BendingEntry {
    /// Of strips [N·m]; what is absent comes from the base.
    Direct {
        /// `B_u` [N·m].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        warp: Option<f64>,
        /// `B_v` [N·m].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        weft: Option<f64>,
        /// `B_b` [N·m].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        bias: Option<f64>,
    },
    /// The same in every direction.
    Isotropic {
        /// Rigidity [N·m].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rigidity: Option<f64>,
    },
}

/// Dissipation of a fabric entry.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FabricDamping {
    /// Drag [1/s].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drag: Option<f64>,
    /// Membrane \[s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub membrane: Option<f64>,
    /// Bending \[s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bending: Option<f64>,
}
