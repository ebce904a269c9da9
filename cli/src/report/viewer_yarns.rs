//! Yarns in the 3D view: points of the centre lines are embedded, the script
//! builds the tubes.

use serde_json::{Value, json};

use super::data::ReportYarns;
use super::quantise::{base64, base64_len};

/// Bytes that the ways of the yarns take in the page.
pub(super) fn length(yarns: &ReportYarns) -> usize {
    base64_len(4 * yarns.offsets.len())
        + base64_len(4 * yarns.radii.len())
        + base64_len(2 * yarns.panels.len())
        + 512
}

/// Adds the ways to the page and returns how to draw them.
pub(super) fn describe(yarns: &ReportYarns, mut add: impl FnMut(&str, &str)) -> Value {
    let offsets = yarns.offsets.iter().flat_map(|o| o.to_le_bytes());
    add("yarn-offsets", &base64(offsets));
    let radii = yarns.radii.iter().flat_map(|r| r.to_le_bytes());
    add("yarn-radii", &base64(radii));
    let panels = yarns.panels.iter().flat_map(|p| p.to_le_bytes());
    add("yarn-panels", &base64(panels));
    json!({ "sides": yarns.sides, "samples": yarns.samples })
}
