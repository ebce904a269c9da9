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
