//! Fabrics that come with the crate, read from `fabrics/*.toml`.
//!
//! Most numbers are typical of a kind of fabric (`kind = "estimated"`), not
//! measurements of one specimen; each file says what they rest on.

use super::error::nearest;
use super::{Fabric, FabricError, FabricRecord, read_fabric};

macro_rules! fabrics {
    ($($name:literal),* $(,)?) => {
        const FILES: &[(&str, &str)] = &[$((
            $name,
            include_str!(concat!("../../fabrics/", $name, ".toml")),
        )),*];
    };
}

fabrics![
    "ball-floor-cotton",
    "cotton-canvas",
    "cotton-interlock",
    "cotton-jersey",
    "cotton-poplin",
    "cotton-voile",
    "denim-11oz",
    "denim-12oz",
    "denim-14oz",
    "fleece",
    "linen",
    "nappa-leather",
    "polyester-chiffon",
    "polyester-taffeta",
    "rib-knit",
    "silk-charmeuse",
    "silk-organza",
    "test-soft",
    "test-stiff",
    "wool-melton",
    "wool-suiting",
];

/// Names of all fabrics, sorted.
pub fn names() -> Vec<&'static str> {
    FILES.iter().map(|(name, _)| *name).collect()
}

/// The fabric called `name`.
///
/// # Errors
/// [`FabricError::UnknownFabric`] with the most similar name.
pub fn get(name: &str) -> Result<Fabric, FabricError> {
    Ok(record(name)?.fabric)
}

/// The fabric called `name` with its description and provenance.
///
/// # Errors
/// [`FabricError::UnknownFabric`] with the most similar name.
pub fn record(name: &str) -> Result<FabricRecord, FabricError> {
    read_fabric(text(name)?, name)
}

/// The file of the fabric called `name`, a template for one's own.
///
/// # Errors
/// [`FabricError::UnknownFabric`] with the most similar name.
pub fn text(name: &str) -> Result<&'static str, FabricError> {
    let found = FILES.iter().find(|(known, _)| *known == name);
    found
        .map(|(_, text)| *text)
        .ok_or_else(|| FabricError::UnknownFabric {
            name: name.to_owned(),
            nearest: nearest(name, FILES.iter().map(|(known, _)| *known)),
            known: names().join(", "),
        })
}
