//! Simulations in processes of their own: their processor time is theirs alone,
//! and one that ends the process does not end the study.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::executor::{Executor, Halt, InProcess};
use crate::plan::Job;
use crate::record::{Figures, Measured};
use crate::shape::Shape;
use crate::store::whole;

/// How often a process is looked after.
const INTERVAL: Duration = Duration::from_millis(20);

/// Runs every job by a program that reads it from its standard input and calls
/// [`serve`].
pub struct Subprocess {
    /// The program.
    pub program: PathBuf,
    /// Its arguments.
    pub arguments: Vec<String>,
    /// Folder for what is handed over; emptied again.
    pub scratch: PathBuf,
    /// Version of the program.
    pub version: String,
}

/// What a process is told.
#[derive(Serialize, Deserialize)]
struct Order {
    job: Job,
    scratch: PathBuf,
    version: String,
}

impl Executor for Subprocess {
    fn name(&self) -> &str {
        "process"
    }

    fn execute(&self, job: &Job, interrupt: &AtomicBool) -> Result<Measured, Halt> {
        let machine = |e: std::io::Error| Halt::Machine(format!("{}: {e}", self.program.display()));
        let order = Order {
            job: job.clone(),
            scratch: self.scratch.clone(),
            version: self.version.clone(),
        };
        let text = serde_json::to_vec(&order).unwrap_or_default();
        std::fs::create_dir_all(&self.scratch).map_err(machine)?;
        let [figures, shape, dump] = files(&self.scratch, job);
        // What an earlier process left is not the answer of this one.
        for file in [&figures, &shape, &dump] {
            let _ = std::fs::remove_file(file);
        }
        let mut child = Command::new(&self.program)
            .args(&self.arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::inherit())
            .spawn()
            .map_err(machine)?;
        if let Some(mut pipe) = child.stdin.take() {
            // A process that ended early is noticed below.
            let _ = pipe.write_all(&text);
        }
        let status = wait(&mut child, interrupt)?;
        let answer = std::fs::read(&figures).ok();
        let answer = answer.and_then(|t| serde_json::from_slice::<Figures>(&t).ok());
        let bytes = std::fs::read(&shape).ok();
        let stopped = std::fs::read_to_string(&dump).ok();
        for file in [&figures, &shape, &dump] {
            let _ = std::fs::remove_file(file);
        }
        Ok(match answer {
            Some(figures) => Measured {
                figures,
                shape: bytes.and_then(|b| Shape::from_bytes(&b)),
                dump: stopped,
            },
            None if interrupt.load(Ordering::Relaxed) => return Err(Halt::Interrupted),
            None => Measured {
                figures: Figures::failed(format!("its process ended with {status}")),
                shape: None,
                dump: None,
            },
        })
    }
}

fn wait(child: &mut Child, interrupt: &AtomicBool) -> Result<String, Halt> {
    loop {
        match child.try_wait() {
            Ok(Some(status)) => return Ok(status.to_string()),
            Ok(None) if interrupt.load(Ordering::Relaxed) => {
                // It keeps nothing that a gentler end would save.
                let _ = child.kill();
                let _ = child.wait();
                return Err(Halt::Interrupted);
            }
            Ok(None) => std::thread::sleep(INTERVAL),
            Err(e) => return Err(Halt::Machine(e.to_string())),
        }
    }
}

fn files(scratch: &Path, job: &Job) -> [PathBuf; 3] {
    let file = |ending: &str| scratch.join(format!("{}.{ending}", job.hash));
    ["json", "shape", "step"].map(file)
}

/// The other side of a [`Subprocess`]: runs the job described by `order`, the
/// text of its standard input.
///
/// # Errors
/// [`Halt`]; then there is no answer.
pub fn serve(order: &str, interrupt: &AtomicBool) -> Result<(), Halt> {
    let machine = |e: String| Halt::Machine(e);
    let order: Order = serde_json::from_str(order).map_err(|e| machine(e.to_string()))?;
    let executor = InProcess {
        scratch: order.scratch.clone(),
        version: order.version,
        alone: true,
        watch: None,
    };
    let measured = executor.repeated(&order.job, interrupt)?;
    let [figures, shape, dump] = files(&order.scratch, &order.job);
    if let Some(s) = &measured.shape {
        whole(&shape, &s.to_bytes()).map_err(|e| machine(e.to_string()))?;
    }
    if let Some(text) = &measured.dump {
        whole(&dump, text.as_bytes()).map_err(|e| machine(e.to_string()))?;
    }
    let text = serde_json::to_vec(&measured.figures).map_err(|e| machine(e.to_string()))?;
    whole(&figures, &text).map_err(|e| machine(e.to_string()))
}
