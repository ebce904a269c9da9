//! From the fabrics a scene names to their numbers.

use selvedge_shell_model::fabric::{
    BendingRigidity, Fabric, FabricError, MembraneModuli, library, read_fabric_file,
};
use std::path::Path;

use super::model::{BendingEntry, FabricEntry, MembraneEntry, SceneFile};

impl SceneFile {
    /// The fabric called `name`: one of the scene, else one of the library.
    ///
    /// # Errors
    /// [`FabricError`] when there is no such fabric, its file cannot be read, or
    /// its numbers are impossible.
    pub fn fabric_named(&self, name: &str) -> Result<Fabric, FabricError> {
        match self.fabric.get(name) {
            Some(entry) => entry.resolve(name, &self.folder),
            None => library::get(name),
        }
    }
}

impl FabricEntry {
    /// The numbers of this fabric; `folder` is where relative paths start.
    ///
    /// # Errors
    /// [`FabricError`] when the base cannot be read, something is missing, or
    /// the numbers are impossible.
    pub fn resolve(&self, name: &str, folder: &Path) -> Result<Fabric, FabricError> {
        let base = match (&self.library, &self.file) {
            (Some(library_name), _) => Some(library::get(library_name)?),
            (None, Some(file)) => Some(read_fabric_file(&folder.join(file))?),
            (None, None) => None,
        };
        let membrane = membrane(self.membrane, base.as_ref(), name)?;
        let bending = bending(self.bending, base.as_ref(), name)?;
        let mut fabric = match base {
            Some(base) => base,
            None => {
                let density = need(self.density, None, name, "density")?;
                Fabric::new(name, density, membrane, bending)?
            }
        };
        fabric.name = name.to_owned();
        fabric.membrane = membrane;
        fabric.bending = bending;
        let set = |target: &mut f64, value: Option<f64>| {
            if let Some(value) = value {
                *target = value;
            }
        };
        set(&mut fabric.density, self.density);
        set(&mut fabric.thickness, self.thickness);
        set(&mut fabric.friction, self.friction);
        set(&mut fabric.drag, self.damping.drag);
        set(&mut fabric.membrane_damping, self.damping.membrane);
        set(&mut fabric.bending_damping, self.damping.bending);
        fabric.validate()?;
        Ok(fabric)
    }
}

fn need(
    value: Option<f64>,
    base: Option<f64>,
    fabric: &str,
    key: &str,
) -> Result<f64, FabricError> {
    value.or(base).ok_or_else(|| missing(fabric, key))
}

fn missing(fabric: &str, key: &str) -> FabricError {
    FabricError::MissingKey {
        origin: format!("fabric `{fabric}`"),
        key: key.to_owned(),
        help: "give it, or a base to start from: `library = \"cotton-poplin\"`",
    }
}

fn membrane(
    entry: Option<MembraneEntry>,
    base: Option<&Fabric>,
    fabric: &str,
) -> Result<MembraneModuli, FabricError> {
    let base = base.map(|b| b.membrane);
    let get = |value: Option<f64>, from: fn(&MembraneModuli) -> f64, key: &str| {
        need(value, base.as_ref().map(from), fabric, key)
    };
    match (entry, base) {
        (None, Some(base)) => Ok(base),
        (None, None) => Err(missing(fabric, "membrane")),
        (
            Some(MembraneEntry::Direct {
                warp,
                weft,
                shear,
                coupling,
            }),
            base,
        ) => MembraneModuli::direct(
            get(warp, |m| m.warp, "membrane.warp")?,
            get(weft, |m| m.weft, "membrane.weft")?,
            get(shear, |m| m.shear, "membrane.shear")?,
            coupling.or(base.map(|m| m.coupling)).unwrap_or(0.0),
        ),
        (
            Some(MembraneEntry::Moduli {
                warp,
                weft,
                bias,
                poisson,
            }),
            base,
        ) => MembraneModuli::from_moduli(
            get(warp, |m| m.modulus(0.0), "membrane.warp")?,
            get(
                weft,
                |m| m.modulus(std::f64::consts::FRAC_PI_2),
                "membrane.weft",
            )?,
            get(
                bias,
                |m| m.modulus(std::f64::consts::FRAC_PI_4),
                "membrane.bias",
            )?,
            poisson.or(base.map(|m| m.poisson())).unwrap_or(0.0),
        ),
        (Some(MembraneEntry::Isotropic { stiffness, poisson }), _) => MembraneModuli::isotropic(
            need(stiffness, None, fabric, "membrane.stiffness")?,
            poisson.unwrap_or(0.0),
        ),
    }
}

fn bending(
    entry: Option<BendingEntry>,
    base: Option<&Fabric>,
    fabric: &str,
) -> Result<BendingRigidity, FabricError> {
    let base = base.map(|b| b.bending);
    match (entry, base) {
        (None, Some(base)) => Ok(base),
        (None, None) => Err(missing(fabric, "bending")),
        (Some(BendingEntry::Direct { warp, weft, bias }), base) => {
            let u = need(warp, base.map(|b| b.warp), fabric, "bending.warp")?;
            let v = need(weft, base.map(|b| b.weft), fabric, "bending.weft")?;
            let b = bias.or(base.map(|b| b.bias)).unwrap_or(0.25 * (u + v));
            BendingRigidity::new(u, v, b)
        }
        (Some(BendingEntry::Isotropic { rigidity }), _) => {
            BendingRigidity::isotropic(need(rigidity, None, fabric, "bending.rigidity")?)
        }
    }
}
