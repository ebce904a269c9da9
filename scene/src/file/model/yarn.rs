use std::collections::BTreeMap;

use selvedge_yarn_model::YarnMaterial;
use serde::{Deserialize, Serialize};

/// Yarn to start from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum YarnLibrary {
    /// Radius 0.75 mm.
    #[default]
    Sweater,
    /// Radius 0.25 mm.
    Shirt,
    /// Radius 1.5 mm.
    Pullover,
    /// Radius 0.25 mm, for woven cloth.
    Weaving,
}

/// A kind of yarn of a scene: one of the library with changes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct YarnEntry {
    /// What it starts from.
    pub library: YarnLibrary,
    /// Radius \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// Density [kg/m³].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// Y \[Pa\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stretch_modulus: Option<f64>,
    /// B \[N\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bending_modulus: Option<f64>,
    /// S \[Pa\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shear_modulus: Option<f64>,
    /// k_w \[N\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wrapping: Option<f64>,
    /// μ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// k_f [N/m].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub anchor_stiffness: Option<f64>,
    /// α [1/s].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass_damping: Option<f64>,
    /// β \[s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness_damping: Option<f64>,
}

/// Contacts that come and go.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TopologySettings {
    /// Whether yarns leave their contacts.
    pub changes: bool,
    /// Length of free ends \[m\].
    pub tail: f64,
}

/// A straight cut through cloth of yarns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cut {
    /// Time at which it happens \[s\].
    pub time: f64,
    /// Name of the cloth.
    pub cloth: String,
    /// Where it begins on the flat cloth \[m\].
    pub from: [f64; 2],
    /// Where it ends on the flat cloth \[m\].
    pub to: [f64; 2],
}

impl YarnLibrary {
    /// Library yarn of a name.
    pub fn named(name: &str) -> Option<Self> {
        serde_json::from_value(serde_json::Value::from(name)).ok()
    }

    /// Its numbers.
    pub fn material(self) -> YarnMaterial {
        match self {
            Self::Sweater => YarnMaterial::sweater(),
            Self::Shirt => YarnMaterial::shirt(),
            Self::Pullover => YarnMaterial::pullover(),
            Self::Weaving => YarnMaterial::weaving(),
        }
    }
}

impl YarnEntry {
    /// Its numbers, under a name.
    pub fn material(&self, name: &str) -> YarnMaterial {
        let mut yarn = self.library.material();
        yarn.name = name.to_owned();
        for (to, from) in [
            (&mut yarn.radius, self.radius),
            (&mut yarn.density, self.density),
            (&mut yarn.stretch_modulus, self.stretch_modulus),
            (&mut yarn.bending_modulus, self.bending_modulus),
            (&mut yarn.shear_modulus, self.shear_modulus),
            (&mut yarn.wrapping, self.wrapping),
            (&mut yarn.friction, self.friction),
            (&mut yarn.anchor_stiffness, self.anchor_stiffness),
            (&mut yarn.mass_damping, self.mass_damping),
            (&mut yarn.stiffness_damping, self.stiffness_damping),
        ] {
            *to = from.unwrap_or(*to);
        }
        yarn
    }
}

/// Yarn of a name: of the scene, else of the library.
pub(crate) fn yarn_named(scene: &BTreeMap<String, YarnEntry>, name: &str) -> Option<YarnMaterial> {
    match scene.get(name) {
        Some(entry) => Some(entry.material(name)),
        None => YarnLibrary::named(name).map(YarnLibrary::material),
    }
}
