//! Effective values of a scene file, all defaults filled in.

mod body;
mod cloth;
mod fabric;
mod hold;
mod motion;
mod settings;
mod trim;
mod watchdog;
mod yarn;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

pub use body::{Body, BodyShape, Part};
pub use cloth::{Cloth, ClothShape, Grain, Lattice, MeshRest, PanelKnit, RestAngles, RestShape};
pub use fabric::{BendingEntry, FabricDamping, FabricEntry, MembraneEntry};
pub use hold::{Attachment, Corner, Edge, Pin, PinKind, Select, YarnEnd};
pub use motion::{DenseKey, Interpolation, Keyframe, Rotation, dense_keys};
pub use settings::{
    AssembleSettings, AssemblySettings, BroadPhaseKind, ContactSettings, CurvatureKind,
    DampingKind, DampingSettings, ForcingKind, FrictionModel, IntegratorKind, IntegratorSettings,
    LineSearchKind, MatrixKind, MeshSettings, OutputSettings, PotentialKind, Precision,
    PreconditionerKind, ProductKind, RelaxationSettings, Reorder, ResidualNormKind, Scatter,
    SimulationSettings, SolverKind, SolverSettings, StopSettings, Switch,
};
pub use trim::{Button, Buttonhole};
pub use watchdog::{WatchdogAnswer, WatchdogSettings};
pub(crate) use yarn::yarn_named;
pub use yarn::{Cut, TopologySettings, YarnEntry, YarnLibrary};

/// A scene: what to simulate and how, with every default filled in.
///
/// The keys, their units and defaults are described once, in the file format's
/// key reference ([`key_reference`](super::key_reference)); the fields here
/// carry the same names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneFile {
    /// Name of the scene.
    pub name: String,
    /// One sentence.
    pub description: String,
    /// Time and gravity.
    pub simulation: SimulationSettings,
    /// Pieces of cloth.
    pub cloth: Vec<Cloth>,
    /// Obstacles.
    pub body: Vec<Body>,
    /// Points held exactly.
    pub pin: Vec<Pin>,
    /// Points held by springs.
    pub attachment: Vec<Attachment>,
    /// Buttons.
    pub button: Vec<Button>,
    /// Holes by which cloth hangs on buttons.
    pub buttonhole: Vec<Buttonhole>,
    /// Fabrics of the scene, by name.
    pub fabric: BTreeMap<String, FabricEntry>,
    /// Kinds of yarn of the scene, by name.
    pub yarn: BTreeMap<String, YarnEntry>,
    /// Yarns that leave their contacts.
    pub topology: TopologySettings,
    /// Cuts through cloth of yarns.
    pub cut: Vec<Cut>,
    /// Triangulation.
    pub mesh: MeshSettings,
    /// Contact and friction.
    pub contact: ContactSettings,
    /// Dissipation.
    pub damping: DampingSettings,
    /// Time stepping.
    pub integrator: IntegratorSettings,
    /// Gentle start.
    pub relaxation: RelaxationSettings,
    /// Early end.
    pub stop: StopSettings,
    /// Linear systems.
    pub solver: SolverSettings,
    /// Summation of forces and matrices.
    pub assembly: AssemblySettings,
    /// Sewing a garment together.
    pub assemble: AssembleSettings,
    /// Guard over the steps.
    pub watchdog: WatchdogSettings,
    /// Results.
    pub output: OutputSettings,
    /// Folder of the scene file, which its relative paths refer to.
    #[serde(skip)]
    pub folder: PathBuf,
}

impl SceneFile {
    /// The path of an input file that the scene names.
    pub fn resolve(&self, path: impl AsRef<Path>) -> PathBuf {
        self.folder.join(path)
    }

    /// Every effective value under its dotted key, for `summary.json`.
    pub fn effective(&self) -> serde_json::Value {
        let mut flat = serde_json::Map::new();
        if let Ok(tree) = serde_json::to_value(self) {
            flatten(&tree, String::new(), &mut flat);
        }
        serde_json::Value::Object(flat)
    }
}

fn flatten(
    value: &serde_json::Value,
    path: String,
    out: &mut serde_json::Map<String, serde_json::Value>,
) {
    use serde_json::Value;
    let join = |key: &str| {
        if path.is_empty() {
            key.to_owned()
        } else {
            format!("{path}.{key}")
        }
    };
    match value {
        Value::Object(table) => {
            for (key, inner) in table {
                flatten(inner, join(key), out);
            }
        }
        Value::Array(items) if items.iter().any(Value::is_object) => {
            for (i, inner) in items.iter().enumerate() {
                flatten(inner, join(&i.to_string()), out);
            }
        }
        Value::Null => {}
        leaf => {
            out.insert(path, leaf.clone());
        }
    }
}
