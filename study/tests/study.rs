//! Whole studies of a tiny sheet.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use selvedge_study::*;

/// A sheet on two pins, 20 steps.
const SCENE: &str = r#"
[simulation]
duration = 0.04
[integrator]
max_step = 2e-3
[[cloth]]
size = [0.2, 0.2]
points = [9, 9]
fabric = "linen"
[[pin]]
select = { corner = "top-left" }
[[pin]]
select = { corner = "top-right" }
[relaxation]
enabled = false
[stop]
early = false
"#;

struct Quiet;

impl Observer for Quiet {
    fn begins(&self, _: usize, _: usize, _: &Job) {}
    fn ended(&self, _: usize, _: usize, _: &Job, _: &Entry) {}
    fn note(&self, _: &str) {}
}

/// Counts runs, and ends the study after some.
struct Counted<'a> {
    inner: InProcess<'a>,
    runs: AtomicUsize,
    most: usize,
    hashes: Mutex<Vec<String>>,
}

impl Executor for Counted<'_> {
    fn name(&self) -> &str {
        "counted"
    }

    fn execute(&self, job: &Job, interrupt: &AtomicBool) -> Result<Measured, Halt> {
        if self.runs.fetch_add(1, Ordering::Relaxed) >= self.most {
            return Err(Halt::Interrupted);
        }
        self.hashes.lock().unwrap().push(job.hash.clone());
        self.inner.execute(job, interrupt)
    }
}

fn scene(folder: &Path) -> PathBuf {
    let path = folder.join("sheet.toml");
    fs::write(&path, SCENE).unwrap();
    path
}

fn plan(scene: &Path, axes: &[&str], reference: &[(&str, &str)]) -> Plan {
    let own = |(k, v): &(&str, &str)| ((*k).to_owned(), (*v).to_owned());
    Plan::new(StudySpec {
        axes: axes.iter().map(|a| Axis::parse(a).unwrap()).collect(),
        reference: reference.iter().map(own).collect(),
        plain_reference: true,
        ..StudySpec::new(scene, "test")
    })
    .unwrap()
}

/// Runs a part; gives the number of simulations that were made.
fn go(plan: &Plan, folder: &Path, shard: Shard, most: usize) -> usize {
    let store = Store::open(folder, plan, shard, true).unwrap();
    let executor = Counted {
        inner: InProcess::new(store.scratch(), "test"),
        runs: AtomicUsize::new(0),
        most,
        hashes: Mutex::default(),
    };
    let no = AtomicBool::new(false);
    run(plan, &store, shard, &executor, 1, &Quiet, &no).unwrap();
    executor.hashes.into_inner().unwrap().len()
}

/// The table without times.
fn table(plan: &Plan, folder: &Path) -> Vec<BTreeMap<String, String>> {
    let results = Results::of_folder(folder, plan, Clock::Wall).unwrap();
    let table = Table::from_csv(&Table::of(&results).to_csv()).unwrap();
    let timed = |c: &str| {
        ["wall_", "cpu_", "stage: ", "on_front", "recommended"]
            .iter()
            .any(|p| c.starts_with(p))
    };
    let row = |cells: Vec<String>| table.columns.iter().cloned().zip(cells);
    table
        .rows
        .iter()
        .map(|cells| row(cells.clone()).filter(|(c, _)| !timed(c)).collect())
        .collect()
}

const AXES: [&str; 2] = [
    "integrator.newton_tolerance=1e-6,1e-1",
    "solver.tolerance=1e-6,0.5",
];
const REFERENCE: [(&str, &str); 2] = [
    ("integrator.newton_tolerance", "1e-6"),
    ("solver.tolerance", "1e-6"),
];

/// The point with the reference's settings is the reference and has no error;
/// the floor is above zero; JSON comes back as it was.
#[test]
fn end_to_end() {
    let folder = tempfile::tempdir().unwrap();
    let plan = plan(&scene(folder.path()), &AXES, &REFERENCE);
    assert_eq!((plan.points.len(), plan.jobs.len()), (4, 6));
    let out = folder.path().join("out");
    assert_eq!(go(&plan, &out, Shard::WHOLE, 99), 6);
    let results = Results::of_folder(&out, &plan, Clock::Wall).unwrap();
    let floor = results.floor.unwrap();
    assert!(floor.mean_m > 0.0 && floor.mean_m < 1e-6, "{floor:?}");
    assert!(floor.hausdorff_m > 0.0);
    let same = results.rows[0].distances.unwrap();
    assert_eq!((same.vertices.unwrap().max_m, same.hausdorff_m), (0.0, 0.0));
    assert!(results.rows[0].within_floor);
    let loose = results.rows[3].distances.unwrap();
    assert!(loose.vertices.unwrap().mean_m > floor.mean_m && !results.rows[3].within_floor);
    assert!(results.rows[3].energy_differences_j.contains_key("kinetic"));
    assert!(results.recommended.is_some() && !results.front.is_empty());
    assert_eq!(results.missing(), 0);
    let text = serde_json::to_string(&results).unwrap();
    assert_eq!(serde_json::from_str::<Results>(&text).unwrap(), results);
    assert_eq!(table(&plan, &out)[0]["role"], "reference");
    // Another value: the runs that are there are not made again.
    let more = self::plan(
        &plan.spec.scene,
        &[AXES[0], "solver.tolerance=1e-6,0.5,0.1"],
        &REFERENCE,
    );
    assert_eq!(go(&more, &out, Shard::WHOLE, 99), 2);
}

/// A study in parts, and one that is killed and goes on, give the rows of one
/// that runs through; a torn line and a damaged shape cost their run alone.
#[test]
fn parts_and_resumption() {
    let folder = tempfile::tempdir().unwrap();
    let plan = plan(&scene(folder.path()), &AXES[..1], &REFERENCE[..1]);
    let [whole, parts, killed] = ["a", "b", "c"].map(|n| folder.path().join(n));
    assert_eq!(go(&plan, &whole, Shard::WHOLE, 99), 4);
    let expected = table(&plan, &whole);

    for index in [1, 0] {
        go(&plan, &parts, Shard { index, count: 2 }, 99);
    }
    assert_eq!(table(&plan, &parts), expected);

    assert_eq!(go(&plan, &killed, Shard::WHOLE, 2), 2);
    let index = killed.join("index-0-of-1.jsonl");
    let mut text = fs::read(&index).unwrap();
    text.extend_from_slice(br#"{"hash":"torn"#);
    fs::write(&index, text).unwrap();
    let hash = &plan.jobs[0].hash;
    fs::write(killed.join(format!("shapes/{hash}.bin")), b"damaged").unwrap();
    let mut remarks = Vec::new();
    assert_eq!(read_entries(&killed, &mut remarks).unwrap().len(), 1);
    assert_eq!(remarks.len(), 2, "{remarks:?}");
    assert_eq!(go(&plan, &killed, Shard::WHOLE, 99), 3);
    assert_eq!(table(&plan, &killed), expected);
}

/// A run that cannot go on is a row; one of another mesh is measured by its
/// surface.
#[test]
fn failures_and_other_meshes() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene(folder.path());
    let mut plan = plan(&scene, &["cloth.0.points=[9, 9],[6, 6]"], &[]);
    // A tolerance that no step can meet, as a further point.
    let strict = self::plan(&scene, &["integrator.newton_tolerance=1e-300"], &[]);
    let job = plan.jobs.len();
    plan.jobs.extend(strict.jobs.last().cloned());
    let settings = strict.points[0].settings.clone();
    plan.points.push(Point { settings, job });
    let out = folder.path().join("out");
    go(&plan, &out, Shard::WHOLE, 99);
    let results = Results::of_folder(&out, &plan, Clock::Wall).unwrap();
    assert_eq!(results.measure, Measure::Surfaces);
    let other = results.rows[1].distances.unwrap();
    assert!(other.vertices.is_none() && other.hausdorff_m > 0.0);
    assert_eq!(results.rows[2].status, "failed");
    assert!(!results.rows[2].reason.is_empty() && results.rows[2].distances.is_none());
}

/// A line that was edited is left out and its run made again; lines of older
/// versions, without a digest, are read as they are.
#[test]
fn edited_lines() {
    let folder = tempfile::tempdir().unwrap();
    let plan = plan(&scene(folder.path()), &AXES[..1], &REFERENCE[..1]);
    let out = folder.path().join("out");
    assert_eq!(go(&plan, &out, Shard::WHOLE, 99), 4);
    let index = out.join("index-0-of-1.jsonl");
    let text = fs::read_to_string(&index).unwrap();
    let entries = |text: &str| {
        fs::write(&index, text).unwrap();
        let mut remarks = Vec::new();
        let entries = read_entries(&out, &mut remarks).unwrap();
        (entries, remarks)
    };
    let (all, none) = entries(&text);
    assert_eq!((all.len(), none.len()), (4, 0));
    let faster = text.replacen("\"wall_s\":[", "\"wall_s\":[0", 1);
    let faster = faster.replacen("\"wall_s\":[00", "\"wall_s\":[1", 1);
    assert_ne!(faster, text);
    let unsigned: String = text
        .lines()
        .map(|line| line.split_once(",\"digest\":").unwrap().0.to_owned() + "}\n")
        .collect();
    assert_eq!(entries(&unsigned), (all, Vec::new()));
    // A digest that stands elsewhere, or is none, does not fit either.
    for wrong in [
        faster.as_str(),
        &text.replacen("\"}\n", "\" }\n", 1),
        &text.replacen("\"digest\":\"", "\"digest\":\"0", 1),
    ] {
        let (left, remarks) = entries(wrong);
        assert_eq!(left.len(), 3, "{wrong}");
        assert!(
            remarks.len() == 1 && remarks[0].contains("line 1"),
            "{remarks:?}"
        );
    }
    entries(&faster);
    assert_eq!(go(&plan, &out, Shard::WHOLE, 99), 1);
}

/// The step at which a run failed is kept under its hash, is named, and can be
/// taken again; it goes when the run succeeds.
#[test]
fn steps_of_failed_runs_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene(folder.path());
    let plan = plan(&scene, &["integrator.newton_tolerance=1e-300"], &[]);
    let out = folder.path().join("out");
    go(&plan, &out, Shard::WHOLE, 99);
    let results = Results::of_folder(&out, &plan, Clock::Wall).unwrap();
    let row = &results.rows[0];
    let kept = out.join(format!("failed/{}.json", row.hash));
    assert_eq!(row.status, "failed");
    let place = format!("the step is in {}", kept.display());
    assert!(row.reason.ends_with(&place), "{}", row.reason);
    assert_eq!(row.reason.matches("the step is in").count(), 1);
    let dump = selvedge_scene::watchdog::Dump::read(&kept).unwrap();
    assert!(selvedge_scene::watchdog::Dump::is_at(&kept));
    assert_eq!(
        dump.event.dump.as_deref(),
        Some(&*kept.display().to_string())
    );
    assert!(!dump.replay(&kept, &[]).unwrap().accepted);
    assert!(!out.join("running").exists());
    let store = Store::open(&out, &plan, Shard::WHOLE, true).unwrap();
    let figures = results.reference.figures.clone().unwrap();
    let good = Measured {
        figures,
        shape: None,
        dump: None,
    };
    store.keep(&row.hash, &good).unwrap();
    assert!(!kept.exists());
}

/// A study whose reference fails ends there; what is finished is reused with
/// another reference.
#[test]
fn references_that_fail() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene(folder.path());
    let strict = [("integrator.newton_tolerance", "1e-300")];
    let plan = |reference| plan(&scene, &AXES[..1], reference);
    let (bad, good) = (plan(&strict[..]), plan(&REFERENCE[..1]));
    let out = folder.path().join("out");
    let attempt = |plan: &Plan, shard| {
        let store = Store::open(&out, plan, shard, true).unwrap();
        let executor = Counted {
            inner: InProcess::new(store.scratch(), "test"),
            runs: AtomicUsize::new(0),
            most: 99,
            hashes: Mutex::default(),
        };
        let no = AtomicBool::new(false);
        let result = run(plan, &store, shard, &executor, 1, &Quiet, &no);
        (result, executor.hashes.into_inner().unwrap().len())
    };
    for runs in [1, 0] {
        let (result, made) = attempt(&bad, Shard::WHOLE);
        let error = result.unwrap_err();
        assert!(matches!(error, StudyError::Reference { .. }), "{error}");
        let dump = format!("failed/{}.json", bad.jobs[0].hash);
        for part in ["integrator.newton_tolerance=1e-300", "--set", &dump] {
            assert!(error.to_string().contains(part), "{part}: {error}");
        }
        assert_eq!(made, runs);
    }
    // A part without the reference cannot know.
    let parts = folder.path().join("parts");
    let part = Shard { index: 3, count: 4 };
    assert_eq!(go(&bad, &parts, part, 99), 1);
    assert!(attempt(&good, Shard::WHOLE).0.is_ok());
    Results::of_folder(&out, &good, Clock::Wall).unwrap();
}

/// Points without a time of their own are told; the memory of a process is
/// that of one run only where it has one.
#[test]
fn times_and_memory_of_one_s_own() {
    let folder = tempfile::tempdir().unwrap();
    let plan = plan(&scene(folder.path()), &AXES[..1], &REFERENCE[..1]);
    let out = folder.path().join("out");
    let store = Store::open(&out, &plan, Shard::WHOLE, true).unwrap();
    let executor = InProcess {
        alone: false,
        ..InProcess::new(store.scratch(), "test")
    };
    let no = AtomicBool::new(false);
    run(&plan, &store, Shard::WHOLE, &executor, 2, &Quiet, &no).unwrap();
    let by = |clock| Results::of_folder(&out, &plan, clock).unwrap();
    let results = by(Clock::Cpu);
    assert!(results.recommended.is_none() && results.front.is_empty());
    assert!(results.remarks[0].contains("2 of 2 points have no processor time"));
    let results = by(Clock::Wall);
    assert!(results.recommended.is_some() && results.remarks.is_empty());
    let table = Table::of(&results);
    assert_eq!(table.get(0, "peak_memory_bytes"), Some(""));
    let residual: f64 = table.get(0, "residual").unwrap().parse().unwrap();
    assert!(residual > 0.0 && residual < 1e-6, "{residual:e}");
    // As the other side of `Subprocess` hands them over.
    let scratch = folder.path().join("scratch");
    fs::create_dir(&scratch).unwrap();
    let job = &plan.jobs[0];
    let order = serde_json::json!({ "job": job, "scratch": scratch, "version": "test" });
    serve(&order.to_string(), &no).unwrap();
    let text = fs::read(scratch.join(format!("{}.json", job.hash))).unwrap();
    let figures: Figures = serde_json::from_slice(&text).unwrap();
    let own = figures.simulation_bytes as u64;
    assert!(figures.peak_memory_bytes.is_some_and(|b| b > own));
}

/// Folders of another study, parts begun before, and no study at all.
#[test]
fn folders_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene(folder.path());
    let (a, b) = (plan(&scene, &AXES[..1], &[]), plan(&scene, &AXES[1..], &[]));
    let out = folder.path().join("out");
    assert!(matches!(read_plan(&out), Err(StudyError::NotAStudy { .. })));
    let store = Store::open(&out, &a, Shard::WHOLE, false).unwrap();
    let again = |plan, shard, resume| Store::open(&out, plan, shard, resume).err().unwrap();
    assert!(matches!(
        again(&a, Shard::WHOLE, true),
        StudyError::InUse { .. }
    ));
    drop(store);
    assert!(matches!(
        again(&a, Shard::WHOLE, false),
        StudyError::Exists { .. }
    ));
    let part = Shard { index: 1, count: 2 };
    assert!(matches!(again(&b, part, true), StudyError::Other { .. }));
    assert_eq!(read_plan(&out).unwrap(), a);
}

/// A key that no scene has is found before anything runs.
#[test]
fn unknown_keys() {
    let folder = tempfile::tempdir().unwrap();
    let spec = StudySpec {
        axes: vec![Axis::parse("solver.tolerence=1e-3,1e-2").unwrap()],
        ..StudySpec::new(scene(folder.path()), "test")
    };
    let Err(StudyError::Scene(findings)) = Plan::new(spec) else {
        panic!()
    };
    assert!(findings.to_string().contains("tolerance"), "{findings}");
}
