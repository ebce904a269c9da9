//! How a scene comes to rest, iteration by iteration.
//! `cargo run -p selvedge-scene --example rest SCENE [key=value]...`

use std::error::Error;
use std::time::Instant;

use selvedge_integrator::Outcome;
use selvedge_scene::build::BuiltScene;
use selvedge_scene::file;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let scene = arguments.next().ok_or("a scene is needed")?;
    let mut overrides: Vec<(String, String)> = arguments
        .filter_map(|a| a.split_once('=').map(|(k, v)| (k.into(), v.into())))
        .collect();
    if !overrides.iter().any(|(k, _)| k == "integrator.kind") {
        overrides.push(("integrator.kind".into(), "static".into()));
    }
    let told = |findings: selvedge_scene::diagnostic::Diagnostics| {
        let all = findings.findings().iter().map(ToString::to_string);
        all.collect::<Vec<_>>().join("\n")
    };
    let parsed = file::read(scene.as_ref(), &overrides).map_err(told)?;
    let built = BuiltScene::new(parsed).map_err(told)?;
    let made = built.simulation(built.geometry.start(), &built.drape_stage());
    let mut simulation = made.map_err(told)?.simulation;
    let clock = Instant::now();
    println!("step  newton  cg  halved  projected  force [N]  at point  h [s]  energy [J]");
    let mut last = None;
    loop {
        let outcome = match simulation.advance() {
            Ok(outcome) => outcome,
            Err(e) => {
                println!("{e}");
                break;
            }
        };
        let steps = simulation.counters().steps;
        match outcome {
            Outcome::Accepted { report, .. } => {
                let (point, h) = report.rest.map_or((0, 0.0), |r| (r.point, r.pseudo_step));
                let energy: f64 = report.energies.iter().map(|e| e.value).sum();
                let line = format!(
                    "{steps:5} {:3} {:5} {:3} {:3}  {:.3e}  {point:6}  {h:.1e}  {energy:.9e}",
                    report.newton_iterations,
                    report.linear_iterations,
                    report.halvings,
                    report.projected,
                    report.residual,
                );
                if steps.is_power_of_two() || steps % 50 == 0 {
                    println!("{line}");
                }
                last = Some(line);
            }
            Outcome::Rejected { reason, .. } => println!("{steps:5} refused: {reason}"),
            Outcome::Ended(end) => {
                println!("{}", last.unwrap_or_default());
                println!("{end:?}");
                break;
            }
        }
    }
    println!(
        "{:?} in {:.1} s",
        simulation.counters(),
        clock.elapsed().as_secs_f64()
    );
    Ok(())
}
