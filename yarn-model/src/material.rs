use std::f64::consts::PI;

use crate::YarnError;

/// One kind of yarn: size, moduli, friction and damping.
///
/// Energies read the derived stiffnesses, never the moduli.
#[derive(Clone, Debug, PartialEq)]
pub struct YarnMaterial {
    /// Name in messages.
    pub name: String,
    /// Radius R of the yarn [m].
    pub radius: f64,
    /// Density of the yarn as a cylinder, air included [kg/m³].
    pub density: f64,
    /// Stretch modulus Y [Pa].
    pub stretch_modulus: f64,
    /// Bending modulus B as tabulated by [Cirio2017, Table 1] [Pa]; see
    /// [`bending_stiffness`](Self::bending_stiffness).
    pub bending_modulus: f64,
    /// Shear modulus S of woven crossings [Pa].
    pub shear_modulus: f64,
    /// Stitch wrapping stiffness k_w [N].
    pub wrapping: f64,
    /// Coulomb friction coefficient μ between yarns [1].
    pub friction: f64,
    /// Stiffness k_f of the friction anchors [N/m].
    pub anchor_stiffness: f64,
    /// Least length of a knitted yarn between two contacts [m]; `None`: twice
    /// the radius, or 0.95 of the length that is laid there if that is less.
    pub spacing: Option<f64>,
    /// Mass-proportional damping α [1/s].
    pub mass_damping: f64,
    /// Stiffness-proportional damping β [s].
    pub stiffness_damping: f64,
}

impl Default for YarnMaterial {
    fn default() -> Self {
        Self::sweater()
    }
}

impl YarnMaterial {
    /// The yarn of the sweater of [Cirio2017, Table 1].
    pub fn sweater() -> Self {
        Self {
            name: "sweater".into(),
            radius: 0.75e-3,
            density: 650.0,
            stretch_modulus: 1e7,
            bending_modulus: 1e-3,
            shear_modulus: 1e3,
            wrapping: 1e-2,
            friction: 0.3,
            anchor_stiffness: 1e3,
            spacing: None,
            mass_damping: 10.0,
            stiffness_damping: 0.01,
        }
    }

    /// The yarn of the sleeveless shirt of [Cirio2017, Table 1].
    pub fn shirt() -> Self {
        Self {
            name: "shirt".into(),
            radius: 0.25e-3,
            bending_modulus: 3e-4,
            mass_damping: 2.0,
            stiffness_damping: 0.1,
            ..Self::sweater()
        }
    }

    /// The yarn of the pullover of [Cirio2017, Table 1].
    pub fn pullover() -> Self {
        Self {
            name: "pullover".into(),
            radius: 1.5e-3,
            bending_modulus: 3e-4,
            mass_damping: 5.0,
            ..Self::sweater()
        }
    }

    /// A yarn for woven cloth at a spacing of 1 mm: modulus, bending and shear
    /// as in the public reimplementation of [Cirio2014].
    pub fn weaving() -> Self {
        Self {
            name: "weaving".into(),
            radius: 0.25e-3,
            stretch_modulus: 5e5,
            bending_modulus: 1.4e-4,
            shear_modulus: 1e3,
            friction: 0.5,
            mass_damping: 2.0,
            ..Self::sweater()
        }
    }

    /// Checks every parameter.
    ///
    /// # Errors
    /// [`YarnError::Parameter`] for the first value outside its range.
    pub fn validate(&self) -> Result<(), YarnError> {
        let positive = [
            ("radius", self.radius),
            ("density", self.density),
            ("stretch modulus", self.stretch_modulus),
            ("anchor stiffness", self.anchor_stiffness),
        ];
        for (what, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                let allowed = "positive and finite";
                return Err(YarnError::Parameter {
                    what,
                    value,
                    allowed,
                });
            }
        }
        let not_negative = [
            ("bending modulus", self.bending_modulus),
            ("shear modulus", self.shear_modulus),
            ("wrapping stiffness", self.wrapping),
            ("friction", self.friction),
            ("mass damping", self.mass_damping),
            ("stiffness damping", self.stiffness_damping),
        ];
        for (what, value) in not_negative {
            if !(value >= 0.0 && value.is_finite()) {
                let allowed = "zero or positive, and finite";
                return Err(YarnError::Parameter {
                    what,
                    value,
                    allowed,
                });
            }
        }
        if let Some(value) = self.spacing
            && !(value > 0.0 && value.is_finite())
        {
            return Err(YarnError::Parameter {
                what: "spacing",
                value,
                allowed: "positive and finite",
            });
        }
        Ok(())
    }

    /// Line density ρ [kg/m].
    pub fn line_density(&self) -> f64 {
        self.density * PI * self.radius * self.radius
    }

    /// Stretch stiffness `k_s = Y π R²` [N].
    pub fn stretch_stiffness(&self) -> f64 {
        self.stretch_modulus * PI * self.radius * self.radius
    }

    /// Bending stiffness `k_b = B π R²` [N·m²]: the EI of a rod, with the
    /// tabulated number of B as it stands.
    pub fn bending_stiffness(&self) -> f64 {
        self.bending_modulus * PI * self.radius * self.radius
    }

    /// Stiffness of the length of a stitch contact, `k_l = 10 k_s` [N].
    pub fn length_stiffness(&self) -> f64 {
        10.0 * self.stretch_stiffness()
    }
}
