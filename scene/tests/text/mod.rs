//! Scenes from text.

use selvedge_integrator::Simulation;
use selvedge_scene::build::BuiltScene;
use selvedge_scene::diagnostic::Diagnostics;
use selvedge_scene::file;

/// A scene from its text, with keys changed; all findings where it is refused.
pub fn build(text: &str, overrides: &[(&str, &str)]) -> Result<BuiltScene, String> {
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).map_err(|e| e.to_string())?;
    let overrides: Vec<(String, String)> = overrides
        .iter()
        .map(|(k, v)| ((*k).to_owned(), (*v).to_owned()))
        .collect();
    let told = |findings: Diagnostics| {
        let all = findings.findings().iter().map(ToString::to_string);
        all.collect::<Vec<_>>().join("\n")
    };
    let parsed = file::read(&path, &overrides).map_err(told)?;
    BuiltScene::new(parsed).map_err(told)
}

/// The drape of a scene.
pub fn simulation(built: &BuiltScene) -> Simulation {
    let made = built.simulation(built.geometry.start(), &built.drape_stage());
    match made {
        Ok(made) => made.simulation,
        Err(findings) => panic!("{:?}", findings.findings()[0].to_string()),
    }
}
