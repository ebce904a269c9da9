//! Steps of a scene and what they cost, by stage.
//! `cargo run --release --example yarn_steps SCENE STEPS [key=value]...`

mod common;

use std::error::Error;

use selvedge_integrator::Outcome;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let scene = arguments.next().ok_or("a scene is needed")?;
    let steps: usize = arguments.next().ok_or("steps")?.parse()?;
    let overrides = common::overrides(arguments);
    let clock = std::time::Instant::now();
    let built = common::build(&scene, &overrides)?;
    eprintln!("built {:?}", clock.elapsed());
    let state = built.geometry.start();
    let options = built.drape_stage();
    let clock = std::time::Instant::now();
    let mut s = built
        .simulation(state, &options)
        .map_err(common::told)?
        .simulation;
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
