//! Scenes from the command line.

use selvedge_scene::build::BuiltScene;
use selvedge_scene::diagnostic::Diagnostics;
use selvedge_scene::file;

/// Keys and values of arguments `key=value`.
pub fn overrides(arguments: impl Iterator<Item = String>) -> Vec<(String, String)> {
    arguments
        .filter_map(|a| a.split_once('=').map(|(k, v)| (k.into(), v.into())))
        .collect()
}

/// Reads and builds a scene with keys changed; all findings where it is refused.
pub fn build(scene: &str, overrides: &[(String, String)]) -> Result<BuiltScene, String> {
    let parsed = file::read(scene.as_ref(), overrides).map_err(told)?;
    BuiltScene::new(parsed).map_err(told)
}

/// All findings, one a line.
pub fn told(findings: Diagnostics) -> String {
    let all = findings.findings().iter().map(ToString::to_string);
    all.collect::<Vec<_>>().join("\n")
}
