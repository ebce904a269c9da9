use std::path::PathBuf;

use clap::{Args, ValueEnum};
use selvedge_study::Clock;

use crate::args::key_value;

/// What to study.
#[derive(Clone, Debug, Args)]
pub struct StudyArgs {
    /// Scene file.
    #[arg(required_unless_present_any = ["collect", "document"])]
    pub scene: Option<PathBuf>,
    /// Vary a key of the scene; may be repeated. KEY=A,B,C, or KEY=LOW..HIGH
    /// for samples.
    #[arg(long, value_name = "KEY=A,B,…")]
    pub vary: Vec<String>,
    /// Run a Latin hypercube of so many points instead of every combination.
    #[arg(long, value_name = "N")]
    pub sample: Option<usize>,
    /// Seed of the sample.
    #[arg(long, default_value_t = 1, requires = "sample")]
    pub seed: u64,
    /// Change a key of the scene for every run.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Change a key for the reference, which else is in double precision with
    /// tight tolerances and a tenth of the step; may be repeated.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub reference: Vec<(String, String)>,
    /// The reference is the scene with the changes of --reference alone.
    #[arg(long)]
    pub plain_reference: bool,
    /// Run every point so often; the median time counts.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    pub repeat: u16,
    /// Repetitions of the reference with displaced starts.
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u16).range(2..))]
    pub floor: u16,
    /// Folder of the results; `out/study-<scene name>` by default.
    #[arg(short, long)]
    pub output: Option<PathBuf>,
    /// Go on with the study in the folder, or add to it: runs that are there
    /// already are not made again.
    #[arg(long)]
    pub resume: bool,
    /// Run part I (from 0) of N; in a Slurm job array by default that of the
    /// task.
    #[arg(long, value_name = "I/N")]
    pub shard: Option<String>,
    /// Simulations at once.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: u16,
    /// Where simulations run; in this process, or each in its own when there
    /// are several at once.
    #[arg(long, value_enum)]
    pub executor: Option<ExecutorKind>,
    /// Time by which points are judged.
    #[arg(long, value_enum, default_value_t = ClockKind::Wall)]
    pub time: ClockKind,
    /// Join the parts of the study in a folder and write its results.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["scene", "vary", "sample", "seed", "set", "reference", "plain_reference", "repeat", "floor", "output", "resume", "shard", "jobs", "executor", "document"])]
    pub collect: Option<PathBuf>,
    /// Fill the figures of studies into a Markdown template; -o names the page.
    #[arg(long, value_name = "TEMPLATE", conflicts_with_all = ["scene", "vary", "sample", "seed", "set", "reference", "plain_reference", "repeat", "floor", "resume", "shard", "jobs", "executor", "time"])]
    pub document: Option<PathBuf>,
}

/// Where simulations run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ExecutorKind {
    /// In this process; several at once have no processor time of their own.
    InProcess,
    /// In a process each.
    Process,
}

/// A time of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ClockKind {
    /// Wall time of the stepping.
    Wall,
    /// Processor time of the stepping.
    Cpu,
}

impl From<ClockKind> for Clock {
    fn from(kind: ClockKind) -> Self {
        match kind {
            ClockKind::Wall => Self::Wall,
            ClockKind::Cpu => Self::Cpu,
        }
    }
}
