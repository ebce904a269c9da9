use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use toml::de::DeTable;

use super::tree::{Node, line_column};
use super::{
    BendingRigidity, DEFAULT_BENDING_DAMPING, DEFAULT_DRAG, DEFAULT_FRICTION,
    DEFAULT_MEMBRANE_DAMPING, DEFAULT_THICKNESS, Fabric, FabricError, MembraneModuli,
};

/// How a number came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SourceKind {
    /// Measured on a specimen.
    Measured,
    /// Typical of the kind of fabric, not of one specimen.
    Estimated,
}

/// Where a number comes from.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Provenance {
    /// Publication, laboratory or reasoning.
    pub source: Option<String>,
    /// Year of the source.
    pub year: Option<i64>,
    /// Measured or estimated.
    pub kind: Option<SourceKind>,
}

/// A fabric with what its file says about it.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct FabricRecord {
    /// The numbers.
    pub fabric: Fabric,
    /// One sentence.
    pub description: String,
    /// Where the numbers come from unless [`quantities`](Self::quantities)
    /// says otherwise.
    pub provenance: Provenance,
    /// Provenance of single quantities, by dotted key.
    pub quantities: BTreeMap<String, Provenance>,
}

/// Reads a fabric file (TOML, SI units).
///
/// ```toml
/// name = "my-poplin"
/// description = "Shirting from the corner shop"
/// kind = "measured"                 # or "estimated"; also source = "…", year = …
/// density = 0.115                   # kg/m²
/// thickness = 0.25e-3               # m, default 0.5e-3
/// friction = 0.3                    # 1
/// [membrane]                        # form = "direct" (default), "moduli" or "isotropic"
/// warp = 4000.0                     # N/m
/// weft = { value = 2200.0, kind = "measured", source = "KES-FB1", year = 2024 }
/// shear = 60.0                      # N/m
/// coupling = 300.0                  # N/m, default 0
/// [bending]                         # form = "direct" (default) or "isotropic"
/// warp = 8.8e-6                     # N·m
/// weft = 4.9e-6
/// bias = 4.2e-6                     # default: no twist term
/// [damping]                         # optional
/// drag = 5.0                        # 1/s
/// membrane = 1e-2                   # s
/// bending = 1e-1                    # s
/// ```
/// `form = "moduli"` takes the strip moduli `warp`, `weft`, `bias` \[N/m\] and
/// `poisson`; the isotropic membrane takes `stiffness` (`E h`, N/m) and
/// `poisson`, the isotropic bending `rigidity` \[N·m\]. Any quantity may be a
/// table with `value`, `source`, `year` and `kind`.
///
/// `origin` is the file's name in messages.
///
/// # Errors
/// [`FabricError`] with line and column for text that is not TOML, unknown or
/// missing keys, wrong types and impossible values.
pub fn read_fabric(text: &str, origin: &str) -> Result<FabricRecord, FabricError> {
    let parsed = DeTable::parse(text).map_err(|e| {
        let (line, column) = line_column(text, e.span().map_or(0, |s| s.start));
        FabricError::Syntax {
            origin: origin.to_owned(),
            line,
            column,
            message: e.message().to_owned(),
        }
    })?;
    let root = Node {
        text,
        origin,
        path: String::new(),
        span: parsed.span(),
        table: parsed.get_ref(),
    };
    root.allow(&[
        "name",
        "description",
        "source",
        "year",
        "kind",
        "density",
        "thickness",
        "friction",
        "membrane",
        "bending",
        "damping",
    ])?;
    let mut reader = Reader {
        quantities: BTreeMap::new(),
    };
    let name = root
        .string("name")?
        .ok_or_else(|| root.missing("name", "a name in quotes"))?;
    let density = reader.need(&root, "density", "areal density [kg/m²], for example 0.15")?;
    let thickness = reader.or(&root, "thickness", DEFAULT_THICKNESS)?;
    let friction = reader.or(&root, "friction", DEFAULT_FRICTION)?;
    let membrane = reader.membrane(&root)?;
    let bending = reader.bending(&root)?;
    let mut fabric = Fabric {
        name: name.to_owned(),
        density,
        thickness,
        membrane,
        bending,
        membrane_damping: DEFAULT_MEMBRANE_DAMPING,
        bending_damping: DEFAULT_BENDING_DAMPING,
        friction,
        drag: DEFAULT_DRAG,
    };
    if let Some(damping) = root.child("damping")? {
        damping.allow(&["drag", "membrane", "bending"])?;
        fabric.drag = reader.or(&damping, "drag", DEFAULT_DRAG)?;
        fabric.membrane_damping = reader.or(&damping, "membrane", DEFAULT_MEMBRANE_DAMPING)?;
        fabric.bending_damping = reader.or(&damping, "bending", DEFAULT_BENDING_DAMPING)?;
    }
    fabric
        .validate()
        .map_err(|e| root.at(&place(&root, &e), e))?;
    Ok(FabricRecord {
        fabric,
        description: root.string("description")?.unwrap_or_default().to_owned(),
        provenance: provenance(&root)?,
        quantities: reader.quantities,
    })
}

struct Reader {
    quantities: BTreeMap<String, Provenance>,
}

impl Reader {
    fn get(&mut self, node: &Node<'_>, key: &str) -> Result<Option<f64>, FabricError> {
        let Some(quantity) = node.quantity(key)? else {
            return Ok(None);
        };
        if !quantity.value.is_finite() {
            let error = super::error::value(&node.key(key), quantity.value, "finite");
            return Err(node.at(&quantity.span, error));
        }
        if let Some(about) = &quantity.about {
            self.quantities.insert(node.key(key), provenance(about)?);
        }
        Ok(Some(quantity.value))
    }

    fn need(&mut self, node: &Node<'_>, key: &str, help: &'static str) -> Result<f64, FabricError> {
        self.get(node, key)?.ok_or_else(|| node.missing(key, help))
    }

    fn or(&mut self, node: &Node<'_>, key: &str, default: f64) -> Result<f64, FabricError> {
        Ok(self.get(node, key)?.unwrap_or(default))
    }

    fn membrane(&mut self, root: &Node<'_>) -> Result<MembraneModuli, FabricError> {
        const HELP: &str = "a modulus in N/m";
        let node = root
            .child("membrane")?
            .ok_or_else(|| root.missing("membrane", "a table with warp, weft and shear [N/m]"))?;
        let moduli = match node.choice("form", &["direct", "moduli", "isotropic"])? {
            Some(1) => {
                node.allow(&["form", "warp", "weft", "bias", "poisson"])?;
                MembraneModuli::from_moduli(
                    self.need(&node, "warp", HELP)?,
                    self.need(&node, "weft", HELP)?,
                    self.need(&node, "bias", HELP)?,
                    self.or(&node, "poisson", 0.0)?,
                )
            }
            Some(2) => {
                node.allow(&["form", "stiffness", "poisson"])?;
                MembraneModuli::isotropic(
                    self.need(&node, "stiffness", "Young's modulus times thickness [N/m]")?,
                    self.or(&node, "poisson", 0.0)?,
                )
            }
            _ => {
                node.allow(&["form", "warp", "weft", "shear", "coupling"])?;
                MembraneModuli::direct(
                    self.need(&node, "warp", HELP)?,
                    self.need(&node, "weft", HELP)?,
                    self.need(&node, "shear", HELP)?,
                    self.or(&node, "coupling", 0.0)?,
                )
            }
        };
        moduli.map_err(|e| root.at(&place(root, &e), e))
    }

    fn bending(&mut self, root: &Node<'_>) -> Result<BendingRigidity, FabricError> {
        const HELP: &str = "a flexural rigidity in N·m";
        let node = root
            .child("bending")?
            .ok_or_else(|| root.missing("bending", "a table with warp and weft [N·m]"))?;
        let rigidity = match node.choice("form", &["direct", "isotropic"])? {
            Some(1) => {
                node.allow(&["form", "rigidity"])?;
                BendingRigidity::isotropic(self.need(&node, "rigidity", HELP)?)
            }
            _ => {
                node.allow(&["form", "warp", "weft", "bias"])?;
                let warp = self.need(&node, "warp", HELP)?;
                let weft = self.need(&node, "weft", HELP)?;
                let bias = self.or(&node, "bias", 0.25 * (warp + weft))?;
                BendingRigidity::new(warp, weft, bias)
            }
        };
        rigidity.map_err(|e| root.at(&place(root, &e), e))
    }
}

fn provenance(node: &Node<'_>) -> Result<Provenance, FabricError> {
    let year = match node.table.get("year") {
        None => None,
        Some(value) => Some(
            value
                .get_ref()
                .as_integer()
                .and_then(|i| i64::from_str_radix(i.as_str(), i.radix()).ok())
                .ok_or_else(|| node.wrong("year", value, "a whole number"))?,
        ),
    };
    Ok(Provenance {
        source: node.string("source")?.map(str::to_owned),
        year,
        kind: node
            .choice("kind", &["measured", "estimated"])?
            .map(|i| [SourceKind::Measured, SourceKind::Estimated][i]),
    })
}

/// Where the quantity that `error` names stands in the file; the table that
/// should hold it, or the start, when it is not written there.
fn place(root: &Node<'_>, error: &FabricError) -> Range<usize> {
    let FabricError::Value { field, .. } = error else {
        return root.span.clone();
    };
    // fields of the struct that stand in a table of their own in the file
    let key = match field.as_str() {
        "membrane_damping" => "damping.membrane",
        "bending_damping" => "damping.bending",
        "drag" => "damping.drag",
        other => other,
    };
    let mut table = root.table;
    let mut span = 0..0;
    for part in key.split('.') {
        let Some(value) = table.get(part) else { break };
        span = value.span();
        let Some(inner) = value.get_ref().as_table() else {
            break;
        };
        table = inner;
    }
    span
}

/// Reads the fabric file at `path`: measured tables when its name ends in
/// `.json` (see [`read_measured`](super::read_measured)), else TOML.
///
/// # Errors
/// [`FabricError::Unreadable`] when the file cannot be read, otherwise the
/// errors of the two readers.
pub fn read_fabric_file(path: &Path) -> Result<Fabric, FabricError> {
    let origin = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|e| FabricError::Unreadable {
        path: origin.clone(),
        reason: e.to_string(),
    })?;
    if path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("json"))
    {
        let stem = path.file_stem().unwrap_or_default();
        return super::read_measured(&text, &origin)?.to_fabric(stem.to_string_lossy());
    }
    Ok(read_fabric(&text, &origin)?.fabric)
}
