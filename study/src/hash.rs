//! When two runs are the same.

use selvedge_scene::file::Parsed;
use selvedge_yarn_model::Draft;
use selvedge_yarn_model::chart::BUILT_IN_CHARTS;
use serde_json::Value;

use crate::StudyError;
use crate::plan::Perturbation;

/// Keys that change neither the result nor its cost.
const IRRELEVANT: [&str; 3] = ["name", "description", "output."];

/// BLAKE3 of all that a run's result depends on: the effective settings, the
/// contents of the files that the scene names, the perturbation of its start
/// and the program's version.
///
/// # Errors
/// [`StudyError::Read`] for a file that cannot be read.
pub fn content_hash(
    parsed: &Parsed,
    perturbation: Option<&Perturbation>,
    version: &str,
) -> Result<String, StudyError> {
    let mut hasher = blake3::Hasher::new();
    // Lengths keep neighbours apart.
    let mut add = |bytes: &[u8]| {
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    };
    add(version.as_bytes());
    let effective = parsed.scene.effective();
    let mut settings: Vec<(&String, &Value)> =
        effective.as_object().into_iter().flatten().collect();
    settings.sort_by_key(|(key, _)| *key);
    for (key, value) in settings {
        if IRRELEVANT
            .iter()
            .any(|k| key == k || (k.ends_with('.') && key.starts_with(k)))
        {
            continue;
        }
        add(key.as_bytes());
        match value {
            Value::String(name) => match names(key) {
                Names::File => add(&contents(parsed, name)?),
                Names::FileOr(built_in) => {
                    // The ending tells knitout files from charts.
                    add(value.to_string().as_bytes());
                    // One that is not there fails its run, which names it.
                    if !built_in.contains(&name.as_str()) && parsed.scene.resolve(name).is_file() {
                        add(&contents(parsed, name)?);
                    }
                }
                Names::Nothing => add(value.to_string().as_bytes()),
            },
            value => add(value.to_string().as_bytes()),
        }
    }
    if let Some(p) = perturbation {
        add(b"perturbation");
        add(&p.size_m.to_le_bytes());
        add(&p.seed.to_le_bytes());
    }
    Ok(hasher.finalize().to_hex()[..32].to_owned())
}

/// What the text of a key stands for.
enum Names {
    /// Itself.
    Nothing,
    /// An input file.
    File,
    /// One of these built-in things, or an input file.
    FileOr(&'static [&'static str]),
}

/// What the text of a key of [`effective`](selvedge_scene::file::SceneFile::effective)
/// stands for.
fn names(key: &str) -> Names {
    match key.split('.').collect::<Vec<_>>()[..] {
        ["cloth", _, "chart"] => Names::FileOr(&BUILT_IN_CHARTS),
        ["cloth", _, "draft"] => Names::FileOr(&Draft::NAMES),
        // Panels have names of their own.
        [.., table, "file"] if !table.starts_with("panel_") => Names::File,
        _ => Names::Nothing,
    }
}

fn contents(parsed: &Parsed, file: &str) -> Result<Vec<u8>, StudyError> {
    let path = parsed.scene.resolve(file);
    std::fs::read(&path).map_err(|e| StudyError::Read {
        path,
        reason: e.to_string(),
    })
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use selvedge_scene::file;

    use super::*;

    const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n";

    fn hash(scene: &Path, set: &[(&str, &str)], perturbed: bool, version: &str) -> String {
        let set: Vec<(String, String)> = set
            .iter()
            .map(|(k, v)| ((*k).to_owned(), (*v).to_owned()))
            .collect();
        let p = Perturbation {
            size_m: 1e-9,
            seed: 1,
        };
        let parsed = file::read(scene, &set).unwrap();
        content_hash(&parsed, perturbed.then_some(&p), version).unwrap()
    }

    /// A setting, an input file, the perturbation and the version count;
    /// names, comments, the way a value is written and output do not.
    #[test]
    fn what_counts() {
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("a.toml");
        let mesh = folder.path().join("m.obj");
        let text = "[[cloth]]\nkind = \"mesh\"\nfile = \"m.obj\"\n";
        fs::write(&mesh, OBJ).unwrap();
        fs::write(&scene, text).unwrap();
        let base = hash(&scene, &[], false, "1");
        let same = |set: &[(&str, &str)]| hash(&scene, set, false, "1") == base;
        assert!(same(&[("name", "other")]));
        assert!(same(&[("output.frame_rate", "7")]));
        assert!(same(&[("solver.tolerance", "0.010")]));
        assert!(!same(&[("solver.tolerance", "1.1e-2")]));
        assert!(!same(&[("cloth.0.center", "[0, 1e-9, 0]")]));
        assert_ne!(hash(&scene, &[], true, "1"), base);
        assert_ne!(hash(&scene, &[], false, "2"), base);
        let commented = folder.path().join("b.toml");
        fs::write(&commented, format!("# remark\n{text}")).unwrap();
        assert_eq!(hash(&commented, &[], false, "1"), base);
        fs::write(&mesh, OBJ.replace("v 1 0 0", "v 1.5 0 0")).unwrap();
        assert_ne!(hash(&scene, &[], false, "1"), base);
        fs::write(&mesh, OBJ).unwrap();
        assert_eq!(hash(&scene, &[], false, "1"), base);
    }

    /// Charts, knitout files and drafts count by their contents; what is built
    /// in is a name, whatever lies beside the scene.
    #[test]
    fn charts_and_drafts_count() {
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("a.toml");
        let knit = "[[cloth]]\nkind = \"knit\"\nyarn = \"sweater\"\nchart = ";
        let woven = "[[cloth]]\nkind = \"woven\"\nyarn = \"weaving\"\ndraft = ";
        for (text, name, built_in) in [
            (knit, "my.chart", false),
            (knit, "my.k", false),
            (woven, "my.draft", false),
            (knit, "stockinette", true),
            (woven, "plain", true),
        ] {
            fs::write(&scene, format!("{text}\"{name}\"\n")).unwrap();
            let file = folder.path().join(name);
            let with = |contents: &str| {
                fs::write(&file, contents).unwrap();
                hash(&scene, &[], false, "1")
            };
            let missing = hash(&scene, &[], false, "1");
            let (one, two) = (with("row 1 RS: *k*\n"), with("row 1 RS: *p*\n"));
            assert_eq!(one == two, built_in, "{name}");
            assert_eq!(one == missing, built_in, "{name}");
            assert_eq!(with("row 1 RS: *k*\n"), one, "{name}");
        }
    }

    /// A panel may be called as it likes.
    #[test]
    fn panels_are_not_files() {
        let all = ["cloth.0.file", "body.1.file", "fabric.x.file"];
        assert!(all.iter().all(|k| matches!(names(k), Names::File)));
        let panels = ["cloth.0.panel_fabric.file", "cloth.0.panel_fabric.chart"];
        assert!(panels.iter().all(|k| matches!(names(k), Names::Nothing)));
    }
}
