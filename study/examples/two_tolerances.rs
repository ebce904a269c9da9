//! A sheet on two pins with three tolerances: prints distance and time, and
//! checks that the tightest one is the reference itself.

use std::error::Error;
use std::sync::atomic::AtomicBool;

use selvedge_study::{
    Axis, Clock, Entry, InProcess, Job, Observer, Plan, Results, Shard, Store, StudySpec, run,
};

const SCENE: &str = r#"
[simulation]
duration = 0.1
[[cloth]]
size = [0.3, 0.3]
points = [13, 13]
fabric = "linen"
[[pin]]
select = { corner = "top-left" }
[[pin]]
select = { corner = "top-right" }
"#;

struct Print;

impl Observer for Print {
    fn begins(&self, number: usize, count: usize, job: &Job) {
        println!("[{number}/{count}] {}", job.label);
    }
    fn ended(&self, _: usize, _: usize, _: &Job, _: &Entry) {}
    fn note(&self, text: &str) {
        println!("{text}");
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::temp_dir().join(format!("selvedge-study-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let scene = folder.join("sheet.toml");
    std::fs::write(&scene, SCENE)?;
    let key = "integrator.newton_tolerance".to_owned();
    let plan = Plan::new(StudySpec {
        axes: vec![Axis::parse(&format!("{key}=1e-7,1e-3,1e-1"))?],
        plain_reference: true,
        reference: vec![(key, "1e-7".to_owned())],
        ..StudySpec::new(scene, "example")
    })?;
    let store = Store::open(&folder, &plan, Shard::WHOLE, true)?;
    let executor = InProcess::new(store.scratch(), "example");
    let go_on = AtomicBool::new(false);
    run(&plan, &store, Shard::WHOLE, &executor, 1, &Print, &go_on)?;

    let results = Results::of_folder(&folder, &plan, Clock::Wall)?;
    println!("floor: {:.1e} m", results.floor_m());
    for row in &results.rows {
        let error = row.error(results.measure).unwrap_or(f64::NAN);
        let time = row.seconds(Clock::Wall).unwrap_or(f64::NAN);
        println!("{}: {error:.1e} m in {time:.2} s", row.settings.join(" "));
    }
    assert_eq!(results.rows[0].error(results.measure), Some(0.0));
    assert!(results.floor_m() > 0.0);
    assert!(results.rows[2].error(results.measure) > Some(results.floor_m()));
    std::fs::remove_dir_all(&folder)?;
    Ok(())
}
