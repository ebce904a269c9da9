use std::path::PathBuf;

use selvedge_scene::build::BuiltScene;
use selvedge_scene::file;

use crate::{HardError, Sim};

/// Where a case runs: the choices to run it with, and a folder of its own.
pub struct Bench {
    overrides: Vec<(String, String)>,
    folder: tempfile::TempDir,
    /// Wall time that one simulation of a case may take [s].
    pub budget: f64,
}

impl Bench {
    /// With keys of the scene changed for every simulation of the case.
    ///
    /// # Errors
    /// [`HardError::File`] when there is no place for temporary files.
    pub fn new(overrides: &[(String, String)], budget: f64) -> Result<Self, HardError> {
        Ok(Self {
            overrides: overrides.to_owned(),
            folder: tempfile::tempdir()?,
            budget,
        })
    }

    /// The folder of the case's own files, removed in the end.
    pub fn folder(&self) -> PathBuf {
        self.folder.path().to_owned()
    }

    /// Puts a file beside the scenes of the case.
    ///
    /// # Errors
    /// [`HardError::File`].
    pub fn file(&self, name: &str, text: &str) -> Result<(), HardError> {
        Ok(std::fs::write(self.folder.path().join(name), text)?)
    }

    /// Reads a scene with some keys changed, and then those of the bench.
    ///
    /// # Errors
    /// [`HardError::Scene`].
    pub fn built(&self, text: &str, set: &[(&str, &str)]) -> Result<BuiltScene, HardError> {
        let own = set.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned()));
        let all: Vec<_> = own.chain(self.overrides.iter().cloned()).collect();
        let parsed = file::parse(text, &self.folder.path().join("case.toml"), &all)?;
        Ok(BuiltScene::new(parsed)?)
    }

    /// As [`built`](Self::built), ready to be stepped.
    ///
    /// # Errors
    /// [`HardError::Scene`].
    pub fn sim(&self, text: &str, set: &[(&str, &str)]) -> Result<Sim, HardError> {
        Sim::new(self.built(text, set)?, self.budget)
    }

    /// How a scene is refused; `None` when it is not.
    pub fn refusal(&self, text: &str, set: &[(&str, &str)]) -> Option<String> {
        match self.sim(text, set) {
            Err(e) => Some(e.to_string()),
            Ok(_) => None,
        }
    }
}
