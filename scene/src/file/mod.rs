//! Scene files: TOML to [`SceneFile`], with findings that say where, what and
//! what to do.
//!
//! Every key is described once, in `keys`; reading, validation, defaults, the
//! JSON schema ([`json_schema`]) and the key reference ([`key_reference`]) all
//! follow that description. All findings are collected, not only the first.
//!
//! ```
//! use selvedge_scene::file;
//! use std::path::Path;
//!
//! let text = "[[cloth]]\nkind = \"sheet\"\nsize = [0.3, 0.3]\n";
//! let set = [("solver.tolerance".to_string(), "1e-3".to_string())];
//! let parsed = file::parse(text, Path::new("towel.toml"), &set)?;
//! assert_eq!(parsed.scene.name, "towel");
//! assert_eq!(parsed.scene.solver.tolerance, 1e-3);
//! assert_eq!(parsed.scene.integrator.max_step, 1e-3); // a default
//!
//! let text = "[[cloth]]\nkind = \"sheet\"\nsize = [30, 300]\n";
//! let findings = file::parse(text, Path::new("towel.toml"), &[]).unwrap_err();
//! assert_eq!(
//!     findings.findings()[0].to_string(),
//!     "towel.toml:3:13: `cloth.0.size.1` = 300 m is out of range \
//!      (it has to be greater than 0 and at most 100 m; m, not cm or mm)"
//! );
//! # Ok::<(), selvedge_scene::diagnostic::Diagnostics>(())
//! ```

mod check;
mod coarser;
mod derive;
mod fabrics;
mod keys;
mod locate;
pub mod model;
pub mod obj;
mod reference;
mod schema;
mod spec;
mod stand_in;
mod suggest;
mod tree;
mod walk;

use std::path::Path;

use toml::de::DeTable;

use crate::diagnostic::{Diagnostics, Finding, Severity, SourceText};
use tree::{Node, apply_override, override_text};
use walk::Walker;

pub use coarser::coarser;
pub use locate::Locations;
pub use model::SceneFile;
pub use reference::key_reference;
pub use schema::json_schema;

/// A scene file that was read without an error.
#[derive(Clone, Debug)]
pub struct Parsed {
    /// The scene.
    pub scene: SceneFile,
    /// Where its values stand, for findings made later.
    pub locations: Locations,
    /// What is suspicious.
    pub warnings: Diagnostics,
    /// What was read.
    pub source: Source,
}

/// The text of a scene and what the command line changed in it.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Source {
    /// The text.
    pub text: String,
    /// Its file, whose folder relative paths start at.
    pub path: std::path::PathBuf,
    /// Overrides: key and value.
    pub overrides: Vec<(String, String)>,
}

/// Reads the scene file at `path`, see [`parse`].
///
/// # Errors
/// As [`parse`]; also when the file cannot be read.
pub fn read(path: &Path, overrides: &[(String, String)]) -> Result<Parsed, Diagnostics> {
    let name = path.display().to_string();
    let text = std::fs::read(path).map_err(|e| {
        let help = match e.kind() {
            std::io::ErrorKind::NotFound => {
                "check the path; the program looks for it from the \
                 folder it is run in"
            }
            _ => "a scene file is a text file in TOML",
        };
        let message = format!("cannot read the scene: {e}");
        Diagnostics::from(Finding::error("scene::unreadable", &name, message).help(help))
    })?;
    let text = String::from_utf8(text).map_err(|e| {
        let offset = e.utf8_error().valid_up_to();
        let message = format!("not a text file: byte {offset} is not UTF-8");
        let help = "a scene file is a text file in TOML";
        Diagnostics::from(Finding::error("scene::syntax", &name, message).help(help))
    })?;
    parse(&text, path, overrides)
}

/// Reads the text of a scene file.
///
/// `path` names the file in messages, and its folder is what relative paths in
/// the scene refer to. `overrides` are the `--set path=value` of the command
/// line: dotted keys, items of lists by number or by `name`, values in TOML (a
/// bare word counts as text).
///
/// # Errors
/// All findings, when one of them is an error.
pub fn parse(
    text: &str,
    path: &Path,
    overrides: &[(String, String)],
) -> Result<Parsed, Diagnostics> {
    let mut findings = Diagnostics::new();
    let mut sources = vec![SourceText::new(path.display().to_string(), text)];
    if text.trim().is_empty() {
        let finding = Finding::error("scene::empty", sources[0].name(), "the file is empty")
            .help("a scene has at least one piece of cloth: `[[cloth]]`, `kind = \"sheet\"`");
        return Err(finding.into());
    }
    let (parsed, errors) = DeTable::parse_recoverable(text);
    for error in &errors {
        let span = error.span().unwrap_or(0..0);
        let message = format!("not valid TOML: {}", error.message());
        findings.push(Finding::error("scene::syntax", "", message).at(&sources[0], span));
    }
    if !errors.is_empty() {
        // what follows a syntax error may be read wrongly: say nothing about it
        findings.sort();
        return Err(findings);
    }
    let root = toml::Spanned::new(parsed.span(), toml::de::DeValue::Table(parsed.into_inner()));
    let mut root = Node::from_toml(&root, 0, 0);
    for (i, (key, value)) in overrides.iter().enumerate() {
        let (text, _) = override_text(key, value);
        sources.push(SourceText::new(format!("--set {text}"), text));
        if let Err(finding) = apply_override(&mut root, key, value, i + 1, &sources[i + 1]) {
            findings.push(*finding);
        }
    }
    let mut walker = Walker::new(&sources);
    let mut tree = walker.scene(&root);
    findings.extend(std::mem::take(&mut walker.findings));
    let (places, broken) = (walker.places, walker.broken);
    let mut locations = Locations::new(sources, places, broken);
    derive::derive(&mut tree, path, &mut locations, &mut findings);
    let mut scene: SceneFile = match serde_json::from_value(tree.into()) {
        Ok(scene) => scene,
        // cannot happen while the keys and the structs agree, which is tested
        Err(e) => {
            let message = format!("the scene does not fit its description: {e}");
            findings.push(Finding::error(
                "scene::internal",
                path.display().to_string(),
                message,
            ));
            return Err(findings);
        }
    };
    scene.folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
    check::check(&scene, &locations, &mut findings);
    findings.sort();
    if findings.has_errors() {
        return Err(findings);
    }
    debug_assert!(
        findings
            .findings()
            .iter()
            .all(|f| f.severity == Severity::Warning)
    );
    Ok(Parsed {
        scene,
        locations,
        warnings: findings,
        source: Source {
            text: text.to_owned(),
            path: path.to_owned(),
            overrides: overrides.to_owned(),
        },
    })
}
