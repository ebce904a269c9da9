//! The command line.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

pub use crate::commands::StudyArgs;

/// Cloth simulation that is accurate first and then fast.
#[derive(Debug, Parser)]
#[command(name = "selvedge", version, about, max_term_width = 100)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// Write events and results as JSON lines to standard output.
    #[arg(long, global = true)]
    pub json: bool,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Simulate a scene; writes run.mcap, final.obj, summary.json, report.html.
    Run(RunArgs),
    /// Put a sewing pattern on a body and let it come to rest.
    Drape(DrapeArgs),
    /// Look for mistakes in a scene and everything it names.
    Check(SceneArgs),
    /// List every effect of a scene: on or off, why, and what it costs.
    Plan(SceneArgs),
    /// Distances between two results (run.mcap or .obj).
    Compare {
        /// A result: a recording, an OBJ file or a folder with one.
        a: PathBuf,
        /// The other result.
        b: PathBuf,
    },
    /// Hand a recording over to other programs.
    Export {
        /// A recording, or a folder with one.
        run: PathBuf,
        /// File format.
        #[arg(long, value_enum)]
        format: Format,
        /// File or folder to write; beside the recording by default.
        #[arg(short, long)]
        output: Option<PathBuf>,
        /// Only the last frame.
        #[arg(long)]
        last: bool,
    },
    /// Write the report of a recording again and say where it is.
    View {
        /// A recording, or a folder with one.
        run: PathBuf,
    },
    /// The fabric library.
    Fabric {
        /// What to do with it.
        #[command(subcommand)]
        command: FabricCommand,
    },
    /// Describe the scene file format.
    Schema {
        /// As a page of text instead of a JSON schema.
        #[arg(long)]
        markdown: bool,
    },
    /// Accuracy against time: many runs of a scene beside a reference.
    Study(Box<StudyArgs>),
    /// One run of a study, as described on standard input.
    #[command(hide = true)]
    StudyJob,
    /// Time components and whole steps.
    Bench(BenchArgs),
    /// Run the catalogue of hard cases.
    Hard(HardArgs),
}

/// A scene file and changes to it.
#[derive(Clone, Debug, Args)]
pub struct SceneArgs {
    /// Scene file.
    pub scene: PathBuf,
    /// Change a key of the scene, for example `solver.tolerance=1e-3`.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
}

/// A scene to run.
#[derive(Clone, Debug, Args)]
pub struct RunArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Folder of the results; `out/<scene name>` by default.
    #[arg(short, long)]
    pub output: Option<PathBuf>,
    /// Go on from the last checkpoint in the folder.
    #[arg(long)]
    pub resume: bool,
    /// How wrong the result may be, or how wrong it is.
    #[command(flatten)]
    pub accuracy: AccuracyArgs,
}

/// A pattern to drape.
#[derive(Clone, Debug, Args)]
pub struct DrapeArgs {
    /// Sewing pattern in GarmentCode's JSON format.
    pub pattern: PathBuf,
    /// Body as a closed OBJ mesh in metres; the built-in mannequin by default.
    #[arg(long)]
    pub body: Option<PathBuf>,
    /// Fabric of the library, or a fabric file.
    #[arg(long, default_value = "cotton-jersey")]
    pub fabric: String,
    /// Edge length of the mesh [m].
    #[arg(long, default_value_t = 0.01, allow_negative_numbers = true)]
    pub edge_length: f64,
    /// Label of edges that stay attached to the body; may be repeated. `auto`
    /// is the waist of skirts and trousers and the edge of a strapless top;
    /// `--hold ""` attaches nothing.
    #[arg(long, default_value = "auto")]
    pub hold: Vec<String>,
    /// Longest simulated time [s].
    #[arg(long, default_value_t = 3.0, allow_negative_numbers = true)]
    pub duration: f64,
    /// Folder of the results; `out/<pattern name>` by default.
    #[arg(short, long)]
    pub output: Option<PathBuf>,
    /// Change a key of the scene that is made for the pattern.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Go on from the last checkpoint in the folder.
    #[arg(long)]
    pub resume: bool,
    /// How wrong the result may be, or how wrong it is.
    #[command(flatten)]
    pub accuracy: AccuracyArgs,
}

/// How wrong the result may be, or how wrong it is.
#[derive(Clone, Debug, Args)]
pub struct AccuracyArgs {
    /// Tell how wrong the result is, from a few cheaper runs of the scene.
    #[arg(long)]
    pub estimate_error: bool,
    /// Choose mesh, steps and tolerances so that the points are within this
    /// distance in the mean, for example `2mm`; a number alone is in metres.
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    pub target_error: Option<f64>,
    /// Points of the finest mesh that --target-error may choose.
    #[arg(long, default_value_t = 200_000, requires = "target_error")]
    pub max_points: usize,
}

/// A length with its unit [m].
fn length(text: &str) -> Result<f64, String> {
    const UNITS: [(&str, f64); 4] = [("um", 1e-6), ("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)];
    let text = text.trim();
    let unit = UNITS.iter().find(|(unit, _)| text.ends_with(unit));
    let (number, factor) = match unit {
        Some((unit, factor)) => (&text[..text.len() - unit.len()], *factor),
        None => (text, 1.0),
    };
    let value: f64 = number
        .trim()
        .parse()
        .map_err(|_| "not a length: write a number with um, mm, cm or m, as in 2mm".to_owned())?;
    let value = value * factor;
    if (1e-6..=1.0).contains(&value) {
        Ok(value)
    } else {
        Err("it has to be between 1um and 1m".to_owned())
    }
}

/// What to do with the fabric library.
#[derive(Clone, Debug, Subcommand)]
pub enum FabricCommand {
    /// Names, weights and bending lengths.
    List,
    /// A fabric file with the source of every number.
    Show {
        /// Fabric of the library.
        name: String,
    },
    /// Energy of a state of strain [J/m²] with stresses, moments and tangents, as JSON.
    Eval {
        /// Fabric of the library, or a fabric file.
        material: String,
        /// Green strain xx,xy,yy [1] along warp (x) and weft (y), then, if
        /// wanted, the curvatures x,y [1/m].
        #[arg(long, value_name = "XX,XY,YY[,LX,LY]", allow_hyphen_values = true)]
        strain: String,
    },
}

/// Benchmarks to run.
#[derive(Clone, Debug, Args)]
pub struct BenchArgs {
    /// Names; all by default.
    pub names: Vec<String>,
    /// Points along one side of the sheet.
    #[arg(long, default_value_t = 101)]
    pub points: usize,
    /// Steps that are timed.
    #[arg(long, default_value_t = 20)]
    pub steps: usize,
}

/// Hard cases to run.
#[derive(Clone, Debug, Args)]
pub struct HardArgs {
    /// Names or numbers; the quick cases by default.
    pub cases: Vec<String>,
    /// List the cases with set-up and acceptance, without running them.
    #[arg(long)]
    pub list: bool,
    /// Run every case, the slow ones included.
    #[arg(long, conflicts_with = "cases")]
    pub all: bool,
    /// Run the slow cases too.
    #[arg(long)]
    pub slow: bool,
    /// Also run each case with every solver, preconditioner, precision,
    /// storage and broad phase it depends on.
    #[arg(long)]
    pub matrix: bool,
    /// Write the reports to a file, also as `--json FILE`: a list of case,
    /// status, figures, seconds. `--json` without a file prints them.
    #[arg(long = "report", value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Write the results as a page of text.
    #[arg(long, value_name = "FILE")]
    pub document: Option<PathBuf>,
    /// Cases that run at the same time.
    #[arg(long, default_value_t = 1)]
    pub jobs: usize,
    /// Wall time that one simulation of a case may take [s].
    #[arg(long, default_value_t = 120.0)]
    pub budget: f64,
    /// Change a key of every case's scenes.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
}

/// File formats to export to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Wavefront OBJ, one file a frame.
    Obj,
    /// PLY, one file a frame.
    Ply,
    /// Binary glTF with a morph target for every frame.
    Gltf,
    /// USD as text, with time samples.
    Usd,
    /// Point cache 2.
    Pc2,
    /// What every step reports as a table: energies, forces of pins.
    Csv,
}

/// The arguments with `--json FILE` of `hard` as `--report FILE`: everywhere
/// else `--json` stands alone.
pub fn arguments(given: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut all: Vec<OsString> = given.collect();
    let command = all
        .iter()
        .skip(1)
        .position(|a| !a.to_string_lossy().starts_with('-'));
    let Some(hard) = command.map(|i| i + 1).filter(|i| all[*i] == "hard") else {
        return all;
    };
    for i in hard..all.len().saturating_sub(1) {
        let file = !all[i + 1].to_string_lossy().starts_with('-');
        if all[i] == "--json" && file {
            all[i] = "--report".into();
        }
    }
    all
}

pub(crate) fn key_value(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => {
            Ok((key.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err("expected KEY=VALUE, for example solver.tolerance=1e-3".to_owned()),
    }
}
