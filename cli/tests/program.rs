//! The program as a shell sees it: exit status, messages, files.
#![cfg(unix)]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};

const SCENE: &str = r#"
name = "sheet"
[simulation]
duration = 0.05
[stop]
early = false
[[cloth]]
kind = "sheet"
size = [0.2, 0.2]
points = [30, 30]
fabric = "linen"
[output]
frame_rate = 1000
"#;

/// The program in a folder, after some words of a shell.
fn shell(folder: &Path, before: &str, arguments: &str) -> Command {
    let mut command = Command::new("sh");
    let program = env!("CARGO_BIN_EXE_selvedge");
    command
        .current_dir(folder)
        .args(["-c", &format!("{before} exec {program} {arguments}")]);
    command
}

fn output(folder: &Path, before: &str, arguments: &str) -> (Option<i32>, String) {
    let Output { status, stderr, .. } = shell(folder, before, arguments).output().unwrap();
    (status.code(), String::from_utf8(stderr).unwrap())
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("sheet.toml"), SCENE).unwrap();
    folder
}

/// A file size limit ends a run with a message that names the file; results of
/// an earlier run stay.
#[test]
fn file_size_limit() {
    let folder = folder();
    let run = |before: &str| output(folder.path(), before, "run sheet.toml -o out");
    let (code, errors) = run("");
    assert_eq!(code, Some(0), "{errors}");
    let out = folder.path().join("out");
    let earlier = fs::read(out.join("run.mcap")).unwrap();
    // Blocks of 512 bytes: not even the head, then about half of the recording.
    for blocks in [0, earlier.len() / 1024] {
        let (code, errors) = run(&format!("ulimit -f {blocks};"));
        assert_eq!(code, Some(1), "{blocks}: {errors}");
        assert!(errors.contains("File too large"), "{errors}");
        assert!(errors.contains("run.mcap"), "{errors}");
        assert!(fs::read(out.join("run.mcap")).unwrap() == earlier);
        assert!(out.join("summary.json").is_file() && out.join("report.html").is_file());
    }
}

/// Ctrl-C ends a run after a step with status 130 and the command to go on
/// with; that finishes it.
#[test]
fn control_c() {
    let folder = folder();
    let long = "--json run sheet.toml -o out --set simulation.duration=1000";
    let mut child = shell(folder.path(), "", long)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    lines.find(|l| l.as_ref().unwrap().contains(r#""event":"progress""#));
    let kill = format!("kill -INT {}", child.id());
    assert!(
        Command::new("sh")
            .args(["-c", &kill])
            .status()
            .unwrap()
            .success()
    );
    let end = lines.map(Result::unwrap).last().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{end}");
    let end: serde_json::Value = serde_json::from_str(&end).unwrap();
    assert_eq!(end["summary"]["status"], "stopped");
    assert!(
        end["resume"].as_str().unwrap().ends_with("--resume"),
        "{end}"
    );
    for file in ["run.mcap.part", "final.obj", "summary.json", "report.html"] {
        assert!(folder.path().join("out").join(file).is_file(), "{file}");
    }
}

/// A result that cannot be put in its place is told before the simulation.
#[test]
fn results_in_the_way() {
    for name in ["final.obj", "summary.json", "report.html", "run.mcap"] {
        let folder = folder();
        fs::create_dir_all(folder.path().join("out").join(name)).unwrap();
        // Would take hours.
        let endless = "run sheet.toml -o out --set simulation.duration=100000";
        let (code, errors) = output(folder.path(), "ulimit -t 60;", endless);
        assert_eq!(code, Some(1), "{name}: {errors}");
        assert!(errors.contains(name), "{errors}");
        let files = fs::read_dir(folder.path().join("out")).unwrap();
        assert_eq!(files.count(), 1, "{name}");
    }
}

/// Iterations of the linear solver are not among the contacts.
#[test]
fn plots_of_a_run() {
    let folder = folder();
    let (code, errors) = output(folder.path(), "", "run sheet.toml -o out");
    assert_eq!(code, Some(0), "{errors}");
    let page = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    for title in ["Contacts", "Linear solver"] {
        let figure = page
            .split_once(&format!("<figcaption>{title}<"))
            .and_then(|(_, rest)| rest.split_once("</figure>"))
            .unwrap()
            .0;
        let solver = title == "Linear solver";
        assert_eq!(figure.contains("linear iterations"), solver, "{title}");
    }
}

/// Wrong input to a study ends with status 2, says what is allowed, and
/// writes nothing.
#[test]
fn study_mistakes() {
    let folder = folder();
    for (arguments, word) in [
        ("sheet.toml", "nothing to vary"),
        (
            "sheet.toml --vary solver.tolerence=1e-3",
            "did you mean `tolerance`",
        ),
        ("sheet.toml --vary solver.tolerance=", "no values"),
        ("sheet.toml --vary solver.tolerance=1e-3..1e-1", "--sample"),
        (
            "sheet.toml --vary solver.tolerance=1e-3 --shard 5/4",
            "0/4 to 3/4",
        ),
        (
            "sheet.toml --vary solver.tolerance=1e-3 --reference solver.kind=x",
            "--reference",
        ),
        ("--collect .", "no plan.json"),
        (
            "sheet.toml --vary solver.tolerance=1e-3 --time cpu --jobs 2 --executor in-process",
            "--executor process",
        ),
        (
            "--collect . --set solver.tolerance=1",
            "cannot be used with",
        ),
        (
            "--collect . --vary solver.tolerance=1",
            "cannot be used with",
        ),
        ("--collect . --sample 3", "cannot be used with"),
        ("--collect . --reference a=1", "cannot be used with"),
        ("--collect . --plain-reference", "cannot be used with"),
        ("--collect . --repeat 3", "cannot be used with"),
        ("--collect . --floor 3", "cannot be used with"),
        ("--collect . --resume", "cannot be used with"),
        ("--collect . --jobs 2", "cannot be used with"),
        ("--collect . --executor process", "cannot be used with"),
        ("--collect . -o elsewhere", "cannot be used with"),
        ("--document a.md -o b.md --repeat 2", "cannot be used with"),
        ("--document none.md -o page.md", "none.md"),
    ] {
        let (code, errors) = output(folder.path(), "", &format!("study {arguments}"));
        assert_eq!(code, Some(2), "{arguments}: {errors}");
        assert!(errors.contains(word), "{arguments}: {errors}");
        assert_eq!(
            fs::read_dir(folder.path()).unwrap().count(),
            1,
            "{arguments}"
        );
    }
}

/// Parts of a study in processes of their own, joined: a page that needs no
/// network, and the same results as in one process.
#[test]
fn study_in_parts() {
    let folder = folder();
    let study = "study sheet.toml --set simulation.duration=0.01 --plain-reference \
                 --vary solver.tolerance=1e-2,0.5 --vary integrator.newton_tolerance=1e-3,1";
    let run = |arguments: &str| {
        let (code, errors) = output(folder.path(), "", arguments);
        assert_eq!(code, Some(0), "{arguments}: {errors}");
    };
    run(&format!("{study} -o one"));
    run(&format!("{study} -o parts --shard 1/2 --jobs 2"));
    let (code, _) = output(folder.path(), "", "study --collect parts");
    assert_eq!(code, Some(1), "the reference is missing");
    run(&format!("{study} -o parts --shard 0/2"));
    run("study --collect parts");
    let read = |file: &str| fs::read_to_string(folder.path().join(file)).unwrap();
    let hashes = |csv: String| -> Vec<String> {
        let last = |line: &str| line.split(',').rev().nth(1).unwrap().to_owned();
        csv.lines()
            .skip(1)
            .filter(|l| !l.contains('"'))
            .map(last)
            .collect()
    };
    assert_eq!(
        hashes(read("one/study.csv")),
        hashes(read("parts/study.csv"))
    );
    let page = read("parts/study.html");
    assert!(page.contains("repeatability floor") && page.contains("<title>solver.tolerance = "));
    assert!(!page.contains("http:") && !page.contains("https:") && page.contains("default-src"));
    assert!(read("parts/study.json").contains("\"hausdorff_m\""));
    // Of runs in a process each; runs that share one have no peak of their own.
    assert!(!read("parts/index-1-of-2.jsonl").contains("\"peak_memory_bytes\":null"));
    assert!(read("parts/index-0-of-2.jsonl").contains("\"peak_memory_bytes\":null"));
    // Again in the same folder only with --resume.
    let (code, errors) = output(folder.path(), "", &format!("{study} -o one"));
    assert_eq!(code, Some(2));
    assert!(errors.contains("--resume"), "{errors}");
    run(&format!("{study} -o one --resume"));
}

/// A reference that fails ends the study, in a process of its own as well: with
/// its settings, the reason and a step that can be taken again.
#[test]
fn study_without_a_reference() {
    let folder = folder();
    let run = |arguments: &str| output(folder.path(), "", arguments);
    let study = "study sheet.toml --set cloth.0.noise=1e-3 --set integrator.newton_iterations=1 \
                 --set integrator.min_step=1e-4 --plain-reference --reference \
                 integrator.newton_tolerance=1e-30 --vary solver.tolerance=1e-2,1e-1,0.5";
    for (executor, out) in [("process", "a"), ("in-process", "b")] {
        let (code, said) = run(&format!("{study} --executor {executor} -o {out}"));
        assert_eq!(code, Some(1), "{said}");
        let error = said.lines().find(|l| l.starts_with("error: ")).unwrap();
        assert!(
            error.contains("settings: integrator.newton_tolerance=1e-30"),
            "{error}"
        );
        let index = fs::read_to_string(folder.path().join(out).join("index-0-of-1.jsonl"));
        assert_eq!(index.unwrap().lines().count(), 1, "the reference alone");
        let kept = fs::read_dir(folder.path().join(out).join("failed")).unwrap();
        let kept: Vec<_> = kept.map(|e| e.unwrap().file_name()).collect();
        let dump = format!("{out}/failed/{}", kept[0].to_string_lossy());
        assert!(kept.len() == 1 && error.contains(&dump), "{error}");
        assert_eq!(run(&format!("run {dump}")).0, Some(1));
        let (code, said) = run(&format!("study --collect {out}"));
        assert_eq!(code, Some(1));
        assert!(said.contains(&dump), "{said}");
    }
}

/// Hard cases: exit status, the file of reports, the nearest name, and a step
/// that was given up and is taken again.
#[test]
fn hard_cases_and_stopped_steps() {
    let folder = folder();
    let run = |arguments: &str| output(folder.path(), "", arguments);
    assert_eq!(run("hard 13 degenerate-hinge --json cases.json").0, Some(0));
    let text = fs::read_to_string(folder.path().join("cases.json")).unwrap();
    let list: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(list.as_array().unwrap().len(), 2);
    for key in ["case", "status", "figures", "seconds"] {
        assert!(list[0].get(key).is_some(), "{text}");
    }
    let (code, said) = run("hard hinge-swep");
    assert_eq!(code, Some(2));
    assert!(said.contains("`hinge-sweep`"), "{said}");
    assert_eq!(run("hard 13 --json nowhere/cases.json").0, Some(2));
    assert_eq!(run("hard 13 --budget -1").0, Some(2));
    // A setting that does not exist fails the case.
    assert_eq!(run("hard all-pinned --set solver.kid=cg").0, Some(1));

    let failing = "--set cloth.0.noise=1e-3 --set integrator.newton_tolerance=1e-30 --set \
                   integrator.newton_iterations=1 --set integrator.min_step=1e-4";
    let (code, _) = run(&format!("run sheet.toml -o out {failing}"));
    assert_eq!(code, Some(1));
    let dump = folder.path().join("out/stopped-step.json");
    assert!(dump.is_file());
    assert_eq!(run("run out/stopped-step.json").0, Some(1));
    for option in ["--target-error 2mm", "--estimate-error", "-o x", "--resume"] {
        let (code, said) = run(&format!("run out/stopped-step.json {option}"));
        assert_eq!(code, Some(2), "{option}: {said}");
        assert!(
            said.contains("stopped step") && said.contains("leave it out"),
            "{said}"
        );
    }
    let cure = "--set integrator.newton_tolerance=1e-2 --set integrator.newton_iterations=9";
    assert_eq!(run(&format!("run out/stopped-step.json {cure}")).0, Some(0));
    let (code, said) = run("run out/stopped-step.json --set solver.kid=cg");
    assert_eq!(code, Some(2));
    assert!(said.contains("`kind`"), "{said}");
    let text = fs::read_to_string(&dump).unwrap();
    fs::write(&dump, &text[..text.len() - 40]).unwrap();
    assert_eq!(run("run out/stopped-step.json").0, Some(2));
}
