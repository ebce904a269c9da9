//! Whole steps of a sheet in contact, by stage and by feature.

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use selvedge_integrator::{Outcome, Simulation, State};
use selvedge_scene::build::BuiltScene;
use selvedge_scene::{driver, file};
use serde_json::{Value, json};

use crate::Failure;
use crate::args::BenchArgs;
use crate::output;

/// `selvedge bench`: prints JSON.
pub fn bench(args: &BenchArgs, json: bool) -> Result<ExitCode, Failure> {
    let known = ["bandwidth", "step", "features"];
    if let Some(name) = args.names.iter().find(|n| !known.contains(&n.as_str())) {
        return Err(Failure::Usage(format!(
            "no benchmark `{name}`; there are {}",
            known.join(", ")
        )));
    }
    if args.points < 3 || args.steps == 0 {
        return Err(Failure::Usage(
            "at least 3 points and 1 step are needed".to_owned(),
        ));
    }
    let wanted = |name: &str| args.names.is_empty() || args.names.iter().any(|n| n == name);
    let mut out = serde_json::Map::new();
    if wanted("bandwidth") {
        out.insert("bandwidth".into(), bandwidth());
    }
    if wanted("step") || wanted("features") {
        let start = settled(args.points)?;
        if wanted("step") {
            out.insert("step".into(), measure(args, &start, &[])?);
        }
        if wanted("features") {
            out.insert("features".into(), features(args, &start)?);
        }
    }
    output::value(&Value::Object(out), json)?;
    Ok(ExitCode::SUCCESS)
}

/// A square metre over a ball, so that most of it is in contact.
fn scene(points: usize, set: &[(&str, &str)]) -> Result<BuiltScene, Failure> {
    let text = format!(
        r#"
name = "bench"
[[cloth]]
kind = "sheet"
size = [1.0, 1.0]
points = [{points}, {points}]
center = [0.0, 0.302, 0.0]
fabric = "bench"
[[body]]
kind = "sphere"
center = [0.0, 0.0, 0.0]
radius = 0.3
[fabric.bench]
density = 0.2
membrane = {{ form = "isotropic", stiffness = 1000.0, poisson = 0.3 }}
bending = {{ form = "isotropic", rigidity = 1e-5 }}
[contact]
self = true
thickness = 0.0005
[relaxation]
enabled = false
[stop]
early = false
"#
    );
    let set: Vec<(String, String)> = set
        .iter()
        .map(|(k, v)| ((*k).to_owned(), (*v).to_owned()))
        .collect();
    Ok(BuiltScene::new(file::parse(
        &text,
        Path::new("bench.toml"),
        &set,
    )?)?)
}

/// Positions and velocities in the scene's order.
type Start = (Vec<[f64; 3]>, Vec<[f64; 3]>);

/// 0.25 s of the default settings: draped over the ball, still moving.
fn settled(points: usize) -> Result<Start, Failure> {
    let built = scene(points, &[("simulation.duration", "0.25")])?;
    in_pool(&built, || {
        let state = built.geometry.start();
        let mut simulation = built.simulation(state, &built.drape_stage())?.simulation;
        advance(&mut simulation, usize::MAX)?;
        let state = simulation.state();
        let scene = |flat: &[f64]| built.geometry.to_scene(flat.as_chunks::<3>().0);
        Ok((scene(&state.q), scene(&state.v)))
    })
}

fn in_pool<R: Send>(
    built: &BuiltScene,
    work: impl FnOnce() -> Result<R, Failure> + Send,
) -> Result<R, Failure> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(driver::threads(built))
        .build()
        .map_err(|e| Failure::Other(e.to_string()))?
        .install(work)
}

fn advance(simulation: &mut Simulation, steps: usize) -> Result<(), Failure> {
    let target = simulation.counters().steps.saturating_add(steps as u64);
    while simulation.counters().steps < target {
        match simulation
            .advance()
            .map_err(|e| Failure::Other(e.to_string()))?
        {
            Outcome::Ended(_) => break,
            Outcome::Accepted { .. } | Outcome::Rejected { .. } => {}
        }
    }
    Ok(())
}

/// Times steps from a given start: two uncounted, then `args.steps`.
fn measure(args: &BenchArgs, start: &Start, set: &[(&str, &str)]) -> Result<Value, Failure> {
    let built = scene(args.points, set)?;
    in_pool(&built, || {
        let order = &built.geometry.order;
        let mut state = State::at_rest(&order.to_new(&start.0));
        state
            .v
            .copy_from_slice(order.to_new(&start.1).as_flattened());
        let mut simulation = built.simulation(state, &built.drape_stage())?.simulation;
        advance(&mut simulation, 2)?;
        let before = simulation.ledger().clone();
        let counters = *simulation.counters();
        let clock = Instant::now();
        advance(&mut simulation, args.steps)?;
        let seconds = clock.elapsed().as_secs_f64();
        let unknowns = simulation.plan().layout.dim() as f64;
        let per = |s: f64| 1e6 * s / args.steps as f64 / unknowns;
        let stages: serde_json::Map<String, Value> = simulation
            .ledger()
            .entries()
            .iter()
            .map(|e| {
                let spent = e.time.as_secs_f64() - before.seconds(&e.name);
                (e.name.clone(), json!(per(spent)))
            })
            .collect();
        let now = simulation.counters();
        let linear = (now.linear_iterations - counters.linear_iterations) as f64;
        let solve = simulation.ledger().seconds("solve") - before.seconds("solve");
        Ok(json!({
            "set": set.iter().map(|(k, v)| format!("{k}={v}")).collect::<Vec<_>>(),
            "points": simulation.plan().layout.points,
            "steps": args.steps,
            "seconds": seconds,
            "us_per_unknown_and_step": per(seconds),
            "us_per_unknown_and_step_by_stage": stages,
            "newton_iterations": now.newton_iterations - counters.newton_iterations,
            "linear_iterations": linear,
            "ns_per_unknown_and_linear_iteration": 1e9 * solve / linear.max(1.0) / unknowns,
            "rejected_steps": now.rejected - counters.rejected,
            "heap_bytes_per_point": simulation.heap_bytes() as f64
                / simulation.plan().layout.points as f64,
        }))
    })
}

/// Each performance feature switched off alone, and all of them.
fn features(args: &BenchArgs, start: &Start) -> Result<Value, Failure> {
    let off: [(&str, &[(&str, &str)]); 8] = [
        ("dual matrix", &[("solver.matrix", "reassembled")]),
        ("mixed precision", &[("solver.precision", "f64")]),
        ("sums in double", &[("solver.precision", "f32")]),
        ("preconditioner", &[("solver.preconditioner", "none")]),
        ("rcm", &[("assembly.reorder", "none")]),
        ("coloured scatter", &[("assembly.scatter", "atomics")]),
        ("threads", &[("assembly.threads", "1")]),
        (
            "all",
            &[
                ("solver.matrix", "reassembled"),
                ("solver.precision", "f64"),
                ("solver.preconditioner", "none"),
                ("assembly.reorder", "none"),
                ("assembly.scatter", "atomics"),
                ("assembly.threads", "1"),
            ],
        ),
    ];
    let seconds = |v: &Value| v["seconds"].as_f64().unwrap_or(f64::NAN);
    let mut rows = Vec::new();
    for (name, set) in off {
        // The pair in turn, so that a drift of the machine hits both.
        let on = measure(args, start, &[])?;
        let without = measure(args, start, set)?;
        rows.push(json!({
            "feature": name,
            "ratio": seconds(&without) / seconds(&on),
            "seconds_on": seconds(&on),
            "seconds_off": seconds(&without),
            "linear_iterations_on": on["linear_iterations"],
            "linear_iterations_off": without["linear_iterations"],
        }));
    }
    Ok(Value::Array(rows))
}

/// Triad `a = b + s c` over arrays far larger than the caches, all cores.
fn bandwidth() -> Value {
    use rayon::prelude::*;
    const LENGTH: usize = 24_000_000;
    let (mut a, b, c) = (
        vec![0.0f64; LENGTH],
        vec![1.0f64; LENGTH],
        vec![2.0f64; LENGTH],
    );
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let clock = Instant::now();
        a.par_chunks_mut(1 << 16)
            .zip(b.par_chunks(1 << 16))
            .zip(c.par_chunks(1 << 16))
            .for_each(|((a, b), c)| {
                for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
                    *a = b + 3.0 * c;
                }
            });
        best = best.min(clock.elapsed().as_secs_f64());
    }
    json!({ "triad_gb_per_s": 24.0 * LENGTH as f64 / best / 1e9, "check": a[LENGTH - 1] })
}
