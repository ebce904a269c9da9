//! Runs what a part of a study still lacks.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::StudyError;
use crate::executor::{Executor, Halt};
use crate::plan::{Job, Plan};
use crate::record::{Ending, Entry};
use crate::results::reference_failed;
use crate::shard::Shard;
use crate::store::{Store, read_entries};

/// Listens to a study.
pub trait Observer: Sync {
    /// A run begins; `number` of `count`.
    fn begins(&self, number: usize, count: usize, job: &Job);
    /// A run has ended and is kept.
    fn ended(&self, number: usize, count: usize, job: &Job, entry: &Entry);
    /// Something worth a line.
    fn note(&self, text: &str);
}

/// What became of a part.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Runs of the part.
    pub jobs: usize,
    /// Runs that were there already.
    pub reused: usize,
    /// Runs made now.
    pub made: usize,
    /// Whether it was interrupted.
    pub interrupted: bool,
}

/// Runs the jobs of a part that are not there yet, `at_once` of them at a time.
///
/// # Errors
/// [`StudyError`] when results cannot be read or written, or the machine fails;
/// [`StudyError::Reference`] as soon as a reference of this part has failed,
/// since there is nothing to measure the others against. What is finished is
/// kept, and so are the runs at hand.
pub fn run(
    plan: &Plan,
    store: &Store,
    shard: Shard,
    executor: &dyn Executor,
    at_once: usize,
    observer: &dyn Observer,
    interrupt: &AtomicBool,
) -> Result<Tally, StudyError> {
    let mut remarks = Vec::new();
    let known = read_entries(store.folder(), &mut remarks)?;
    for remark in &remarks {
        observer.note(remark);
    }
    let done = |job: &Job| {
        known.get(&job.hash).is_some_and(|e| {
            let f = &e.figures;
            match f.status {
                // What could not even begin, or lost its process, may be able to now.
                Ending::Failed => f.points > 0,
                _ => f.wall_s.len() >= job.repeats,
            }
        })
    };
    let mine: Vec<&Job> = shard.jobs(plan.jobs.len()).map(|j| &plan.jobs[j]).collect();
    let reference = &plan.jobs[0].hash;
    if let Some(entry) = known.get(reference)
        && mine.iter().any(|j| j.hash == *reference && done(j))
        && entry.figures.status == Ending::Failed
    {
        return Err(reference_failed(plan, &entry.figures));
    }
    let left: Vec<&Job> = mine.iter().copied().filter(|j| !done(j)).collect();
    let reused = mine.len() - left.len();
    let next = AtomicUsize::new(0);
    let made = AtomicUsize::new(0);
    let failure: Mutex<Option<StudyError>> = Mutex::new(None);
    let stop = AtomicBool::new(false);
    let give_up = |e: StudyError| {
        stop.store(true, Ordering::Relaxed);
        let mut failure = failure.lock().unwrap_or_else(PoisonError::into_inner);
        failure.get_or_insert(e);
    };
    let work = || {
        while !stop.load(Ordering::Relaxed) && !interrupt.load(Ordering::Relaxed) {
            let i = next.fetch_add(1, Ordering::Relaxed);
            let Some(job) = left.get(i) else { break };
            let number = reused + i + 1;
            observer.begins(number, mine.len(), job);
            let kept = match executor.execute(job, interrupt) {
                Ok(measured) => store.keep(&job.hash, &measured),
                Err(Halt::Interrupted) => break,
                Err(Halt::Machine(reason)) => Err(StudyError::Write {
                    path: store.folder().to_owned(),
                    source: std::io::Error::other(reason),
                }),
            };
            match kept {
                Ok(entry) => {
                    made.fetch_add(1, Ordering::Relaxed);
                    observer.ended(number, mine.len(), job, &entry);
                    let failed = entry.figures.status == Ending::Failed;
                    if failed && job.hash == *reference {
                        give_up(reference_failed(plan, &entry.figures));
                    }
                }
                Err(e) => give_up(e),
            }
        }
    };
    let threads = at_once.clamp(1, left.len().max(1));
    if threads == 1 {
        work();
    } else {
        std::thread::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(work);
            }
        });
    }
    // Emptied by now, unless other parts use it too.
    let _ = std::fs::remove_dir(store.scratch());
    match failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
        Some(e) => Err(e),
        None => Ok(Tally {
            jobs: mine.len(),
            reused,
            made: made.into_inner(),
            interrupted: interrupt.load(Ordering::Relaxed),
        }),
    }
}
