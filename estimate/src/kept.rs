//! What a finished companion leaves for a session that goes on.

use std::path::Path;

use selvedge_scene::driver::RunError;
use selvedge_scene::write_whole;
use serde_json::{Value, json};

const FILE: &str = "companion.json";

/// Where a companion ended.
pub(crate) struct Kept {
    digest: String,
    /// User time of its stepping [s].
    pub cpu_s: f64,
    /// Bits of the final positions.
    bits: Vec<u64>,
}

impl Kept {
    pub fn new(digest: String, cpu_s: f64, positions: &[f64]) -> Self {
        Self {
            digest,
            cpu_s,
            bits: positions.iter().map(|x| x.to_bits()).collect(),
        }
    }

    /// What is kept in a folder of the run with this digest; `None` for
    /// anything else found there.
    pub fn read(folder: &Path, digest: &str) -> Option<Self> {
        let text = std::fs::read_to_string(folder.join(FILE)).ok()?;
        let value: Value = serde_json::from_str(&text).ok()?;
        let kept = Self {
            digest: value.get("digest")?.as_str()?.to_owned(),
            cpu_s: value.get("cpu_s")?.as_f64()?,
            bits: value
                .get("positions")?
                .as_array()?
                .iter()
                .map(Value::as_u64)
                .collect::<Option<_>>()?,
        };
        (kept.digest == digest).then_some(kept)
    }

    pub fn write(&self, folder: &Path) -> Result<(), RunError> {
        let value = json!({
            "digest": self.digest,
            "cpu_s": self.cpu_s,
            "positions": self.bits,
        });
        write_whole(&folder.join(FILE), value.to_string().as_bytes())
    }

    /// Final positions in the scene's order [m].
    pub fn positions(&self) -> Vec<f64> {
        self.bits.iter().map(|b| f64::from_bits(*b)).collect()
    }
}
