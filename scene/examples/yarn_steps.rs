//! Steps of a scene and what they cost, by stage.
//! `cargo run --release --example yarn_steps SCENE STEPS [key=value]...`

use selvedge_integrator::Outcome;
use selvedge_scene::build::BuiltScene;
use selvedge_scene::file;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let scene = arguments.next().ok_or("a scene is needed")?;
    let steps: usize = arguments.next().ok_or("steps")?.parse()?;
    let overrides: Vec<(String, String)> = arguments
        .filter_map(|a| a.split_once('=').map(|(k, v)| (k.into(), v.into())))
        .collect();
    let told = |findings: selvedge_scene::diagnostic::Diagnostics| {
        let all = findings.findings().iter().map(ToString::to_string);
        all.collect::<Vec<_>>().join("\n")
    };
    let parsed = file::read(scene.as_ref(), &overrides).map_err(told)?;
    let clock = std::time::Instant::now();
    let built = BuiltScene::new(parsed).map_err(told)?;
    eprintln!("built {:?}", clock.elapsed());
    let state = built.geometry.start();
    let options = built.drape_stage();
    let clock = std::time::Instant::now();
    let mut s = built.simulation(state, &options).map_err(told)?.simulation;
    eprintln!("simulation {:?}", clock.elapsed());
    for _ in 0..steps {
        match s.advance()? {
            Outcome::Accepted { report, .. } => eprintln!(
                "{} its, residual {:.2e} contacts {}",
                report.linear_iterations, report.residual, report.contacts
            ),
            Outcome::Rejected { reason, .. } => eprintln!("rejected {reason}"),
            Outcome::Ended(_) => break,
        }
    }
    for e in s.ledger().entries() {
        eprintln!("{:30} {:8.3} s", e.name, e.time.as_secs_f64());
    }
    let points = s.plan().layout.points;
    for (name, bytes) in s.memory() {
        eprintln!("{name:30} {:8.1} B a point", bytes as f64 / points as f64);
    }
    eprintln!(
        "{} points, {} bytes a point",
        points,
        s.heap_bytes() / points
    );
    Ok(())
}
