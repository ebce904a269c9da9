use serde::{Deserialize, Serialize};

/// A button sewn to a piece of cloth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Button {
    /// Name.
    pub name: String,
    /// Name of the cloth.
    pub cloth: String,
    /// Panel of a pattern.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub panel: Option<String>,
    /// Place in the panel's or the sheet's own coordinates \[m\].
    pub at: [f64; 2],
    /// Mass \[kg\].
    pub mass: f64,
    /// Radius \[m\].
    pub radius: f64,
    /// Stiffness of its threads together [N/m].
    pub stiffness: f64,
}

/// A hole by which a piece of cloth hangs on a button.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Buttonhole {
    /// Name of the button.
    pub button: String,
    /// Name of the cloth.
    pub cloth: String,
    /// Panel of a pattern.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub panel: Option<String>,
    /// Place in the panel's or the sheet's own coordinates \[m\].
    pub at: [f64; 2],
    /// Stiffness of its hold on the button [N/m].
    pub stiffness: f64,
}
