use serde_json::Value;

use super::error::{positive, value};
use super::{BendingRigidity, Fabric, FabricError, MembraneModuli};

/// Tables of a fabric measured after Wang, O'Brien and Ramamoorthi 2011
/// (*Data-driven elastic models for cloth*), as ARCSim stores them in JSON.
///
/// - `stretching`: six rows `c_11, c_12, c_22, c_33` \[N/m\]. Row 0 is the tensor
///   at zero strain; rows 1 to 5 belong to a principal stretch of about 1/6
///   along 0°, 22.5°, 45°, 67.5° and 90° to the warp.
/// - `bending`: three rows (0°, 45° and 90° to the warp) of five rigidities
///   \[N·m\] at growing curvature.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredFabric {
    /// Areal density [kg/m²].
    pub density: f64,
    /// Membrane table [N/m].
    pub stretching: [[f64; 4]; 6],
    /// Bending table [N·m].
    pub bending: [[f64; 5]; 3],
}

impl MeasuredFabric {
    /// The linear orthotropic fabric of small strain and small curvature.
    ///
    /// ```text
    /// k_u = c_11,  k_v = c_22,  k_uv = c_12,  k_s = c_33 / 2          (row 0)
    /// B_u = bending[0][0],  B_b = bending[1][0],  B_v = bending[2][0]
    /// ```
    /// The table is read as the law `σ = C ε` with the *tensor* shear strain
    /// `ε_uv = γ_uv / 2`, hence the half. Dropped: stiffening with strain (rows
    /// 1 to 5), the rise of rigidity with curvature (columns 1 to 4). ARCSim
    /// itself doubles the membrane table when it samples it, and takes the
    /// bending row by the direction of the hinge's edge; neither is done here.
    /// Thickness, damping, drag and friction are not in the table and get their
    /// defaults.
    ///
    /// # Errors
    /// [`FabricError::Value`] when the small-strain row is not positive
    /// definite or a rigidity is not positive.
    pub fn to_fabric(&self, name: impl Into<String>) -> Result<Fabric, FabricError> {
        let [warp, coupling, weft, shear] = self.stretching[0];
        let membrane = MembraneModuli::direct(warp, weft, 0.5 * shear, coupling)?;
        let bending =
            BendingRigidity::new(self.bending[0][0], self.bending[2][0], self.bending[1][0])?;
        Fabric::new(name, self.density, membrane, bending)
    }
}

/// Reads a measured fabric in ARCSim's JSON: `density` \[kg/m²\], `stretching`
/// (6 × 4, N/m) and `bending` (3 × 5, N·m). `origin` is the file's name in
/// messages.
///
/// # Errors
/// [`FabricError::Syntax`] for text that is not JSON, otherwise the key that is
/// absent, of the wrong shape or out of range.
pub fn read_measured(text: &str, origin: &str) -> Result<MeasuredFabric, FabricError> {
    let root: Value = serde_json::from_str(text).map_err(|e| FabricError::Syntax {
        origin: origin.to_owned(),
        line: e.line(),
        column: e.column(),
        message: e.to_string(),
    })?;
    let density = number(&root, origin, "density")?;
    positive("density", density)?;
    Ok(MeasuredFabric {
        density,
        stretching: table(&root, origin, "stretching")?,
        bending: table(&root, origin, "bending")?,
    })
}

fn wrong(origin: &str, key: &str, expected: String, found: Option<&Value>) -> FabricError {
    FabricError::WrongType {
        origin: origin.to_owned(),
        line: 0,
        column: 0,
        key: key.to_owned(),
        expected,
        found: match found {
            None => "nothing".to_owned(),
            Some(Value::Array(a)) => format!("a list of {}", a.len()),
            Some(Value::Object(_)) => "a table".to_owned(),
            Some(other) => other.to_string(),
        },
    }
}

fn number(root: &Value, origin: &str, key: &str) -> Result<f64, FabricError> {
    let found = root.get(key);
    found
        .and_then(Value::as_f64)
        .ok_or_else(|| wrong(origin, key, "a number".to_owned(), found))
}

fn table<const R: usize, const C: usize>(
    root: &Value,
    origin: &str,
    key: &str,
) -> Result<[[f64; C]; R], FabricError> {
    let found = root.get(key);
    let rows = found
        .and_then(Value::as_array)
        .filter(|rows| rows.len() == R)
        .ok_or_else(|| wrong(origin, key, format!("{R} rows of {C} numbers"), found))?;
    let mut out = [[0.0; C]; R];
    for (i, row) in rows.iter().enumerate() {
        let entries = row.as_array().filter(|r| r.len() == C).ok_or_else(|| {
            let key = format!("{key}[{i}]");
            wrong(origin, &key, format!("{C} numbers"), Some(row))
        })?;
        for (j, entry) in entries.iter().enumerate() {
            let key = format!("{key}[{i}][{j}]");
            let x = entry
                .as_f64()
                .ok_or_else(|| wrong(origin, &key, "a number".to_owned(), Some(entry)))?;
            if !x.is_finite() {
                return Err(value(&key, x, "finite"));
            }
            out[i][j] = x;
        }
    }
    Ok(out)
}
