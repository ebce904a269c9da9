//! What single values cannot show: references, files, sizes that do not go
//! together.

mod geometry;
mod hold;
mod settings;
mod trim;

use std::collections::BTreeMap;
use std::path::Path;

use selvedge_shell_model::fabric::{FabricError, library};

use super::locate::Locations;
use super::model::SceneFile;
use super::suggest::did_you_mean;
use crate::diagnostic::{Diagnostics, Finding};

/// Adds all findings about the scene as a whole.
pub(crate) fn check(scene: &SceneFile, locations: &Locations, findings: &mut Diagnostics) {
    let mut check = Check {
        scene,
        locations,
        findings,
    };
    check.names();
    check.fabrics();
    check.cloths();
    check.layers();
    check.yarns();
    check.cuts();
    check.bodies();
    check.holds();
    check.trims();
    check.settings();
}

struct Check<'a> {
    scene: &'a SceneFile,
    locations: &'a Locations,
    findings: &'a mut Diagnostics,
}

impl Check<'_> {
    /// An error at `path`, unless the value there has been refused already.
    fn error(
        &mut self,
        code: &'static str,
        path: &str,
        message: impl Into<String>,
        help: impl Into<String>,
    ) {
        let finding = self.locations.error(code, path, message);
        self.push(path, finding.help(help));
    }

    /// A warning at `path`, with the same exception.
    fn warning(
        &mut self,
        code: &'static str,
        path: &str,
        message: impl Into<String>,
        help: impl Into<String>,
    ) {
        let finding = self.locations.warning(code, path, message);
        self.push(path, finding.help(help));
    }

    fn push(&mut self, path: &str, finding: Finding) {
        if !self.locations.is_broken(path) {
            self.findings.push(finding);
        }
    }

    /// A name that has to be one of `known`.
    fn reference(&mut self, path: &str, what: &str, name: &str, known: &[&str]) {
        if known.contains(&name) {
            return;
        }
        let help = if known.is_empty() {
            format!("the scene has no {what}")
        } else {
            let list = known.join(", ");
            format!("{}known: {list}", did_you_mean(name, known.iter().copied()))
        };
        self.error(
            "scene::unknown-name",
            path,
            format!("`{path}`: there is no {what} {name:?}"),
            help,
        );
    }

    fn names(&mut self) {
        let scene = self.scene;
        if scene.cloth.is_empty() && !self.locations.is_broken("cloth") {
            let file = self
                .locations
                .error("scene::no-cloth", "cloth", "the scene has no cloth");
            self.findings.push(file.help(
                "add `[[cloth]]` with `kind = \"sheet\"`, \"mesh\", \"pattern\", \"knit\" or \
                     \"woven\"",
            ));
        }
        if scene.name.is_empty()
            || scene.name.contains(['/', '\\'])
            || [".", ".."].contains(&scene.name.as_str())
        {
            let message = format!("`name` = {:?} cannot name a folder", scene.name);
            self.error(
                "scene::value",
                "name",
                message,
                "use letters, digits and dashes",
            );
        }
        let cloths = scene.cloth.iter().map(|c| c.name.as_str());
        self.distinct("cloth", cloths.collect());
        let bodies = scene.body.iter().map(|b| b.name.as_str());
        self.distinct("body", bodies.collect());
    }

    fn distinct(&mut self, kind: &str, names: Vec<&str>) {
        let mut first = BTreeMap::new();
        for (i, name) in names.into_iter().enumerate() {
            if let Some(before) = first.insert(name, i) {
                self.error(
                    "scene::duplicate-name",
                    &format!("{kind}.{i}.name"),
                    format!("`{kind}.{i}` has the name of `{kind}.{before}`, {name:?}"),
                    "give it a name of its own",
                );
            }
        }
    }

    fn fabrics(&mut self) {
        let scene = self.scene;
        for (name, entry) in &scene.fabric {
            let path = format!("fabric.{name}");
            if entry.library.is_some() && entry.file.is_some() {
                self.error(
                    "scene::value",
                    &format!("{path}.file"),
                    format!("`{path}` has two bases, `library` and `file`"),
                    "remove one of them",
                );
                continue;
            }
            if let Some(file) = &entry.file
                && !self.input_file(&format!("{path}.file"), file)
            {
                continue;
            }
            if let Err(e) = entry.resolve(name, &scene.folder) {
                self.fabric_error(&path, e);
            }
        }
        let mut known: Vec<&str> = scene.fabric.keys().map(String::as_str).collect();
        known.extend(library::names());
        for (i, cloth) in scene.cloth.iter().enumerate() {
            self.reference(
                &format!("cloth.{i}.fabric"),
                "fabric",
                &cloth.fabric,
                &known,
            );
            if let super::model::ClothShape::Pattern { panel_fabric, .. } = &cloth.shape {
                for (panel, fabric) in panel_fabric {
                    let path = format!("cloth.{i}.panel_fabric.{panel}");
                    self.reference(&path, "fabric", fabric, &known);
                }
            }
        }
    }

    /// Says what is wrong with a fabric at the key that is to blame.
    fn fabric_error(&mut self, path: &str, error: FabricError) {
        match error {
            FabricError::Value {
                field,
                value,
                allowed,
            } => {
                let key = match field.as_str() {
                    "membrane_damping" => "damping.membrane",
                    "bending_damping" => "damping.bending",
                    "drag" => "damping.drag",
                    other => other,
                };
                let path = format!("{path}.{key}");
                let value = super::suggest::show(value);
                let message = format!("`{path}` = {value} is impossible");
                self.error(
                    "scene::value",
                    &path,
                    message,
                    format!("it has to be {allowed}"),
                );
            }
            FabricError::UnknownFabric { name, .. } => {
                let known = library::names();
                self.reference(&format!("{path}.library"), "library fabric", &name, &known);
            }
            FabricError::MissingKey { key, help, .. } => {
                let message = format!("`{path}` lacks `{key}`");
                self.error(
                    "scene::missing-key",
                    &format!("{path}.{key}"),
                    message,
                    help,
                );
            }
            other => {
                let message = format!("the fabric cannot be read: {other}");
                let help = "correct that file";
                self.error("scene::fabric-file", &format!("{path}.file"), message, help);
            }
        }
    }

    /// Whether `file` can be read and has something in it; adds a finding if not.
    fn input_file(&mut self, path: &str, file: &Path) -> bool {
        if self.locations.is_broken(path) {
            return false;
        }
        let full = self.scene.resolve(file);
        let shown = full.display();
        let (message, help) = match std::fs::metadata(&full) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => (
                format!("there is no file {shown}"),
                "paths are relative to the folder of the scene file",
            ),
            Err(e) => (format!("cannot read {shown}: {e}"), "check its permissions"),
            Ok(meta) if !meta.is_file() => (
                format!("{shown} is not a file"),
                "name a file, not a folder",
            ),
            Ok(meta) if meta.len() == 0 => (
                format!("the file {shown} is empty"),
                "write or copy it again",
            ),
            Ok(_) => return true,
        };
        self.error("scene::file", path, message, help);
        false
    }
}
