//! How a scene comes to rest, iteration by iteration.
//! `cargo run -p selvedge-scene --example rest SCENE [key=value]...`

mod common;

use std::error::Error;
use std::time::Instant;

use selvedge_integrator::Outcome;
use selvedge_scene::file::model::ClothShape;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let scene = arguments.next().ok_or("a scene is needed")?;
    let mut overrides = common::overrides(arguments);
    if !overrides.iter().any(|(k, _)| k == "integrator.kind") {
        overrides.push(("integrator.kind".into(), "static".into()));
    }
    let built = common::build(&scene, &overrides)?;
    let made = built.simulation(built.geometry.start(), &built.drape_stage());
    let mut simulation = made.map_err(common::told)?.simulation;
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
    let start = built.geometry.flat_to_scene(&built.geometry.start().q);
    let end = built.geometry.flat_to_scene(&simulation.state().q);
    let (start, end) = (start.as_chunks::<3>().0, end.as_chunks::<3>().0);
    println!("moved {:.4} mm (root mean square)", 1e3 * moved(start, end));
    let extent: [f64; 3] = std::array::from_fn(|k| {
        let of = end.iter().map(|p| 1e3 * p[k]);
        of.clone().fold(f64::MIN, f64::max) - of.fold(f64::MAX, f64::min)
    });
    println!(
        "extent {:.1} {:.1} {:.1} mm",
        extent[0], extent[1], extent[2]
    );
    let [along, up] = curvature(end);
    println!("curvature along courses {along:.2}, wales {up:.2} 1/m");
    if let Some(yarns) = &built.geometry.yarns
        && let ClothShape::Knit { chart, .. } = &built.scene().cloth[0].shape
    {
        let (points, _) = simulation.state().q.as_chunks::<3>();
        let repeat = [if chart.starts_with("rib") { 4 } else { 1 }, 2];
        for margin in [2, 3, 5] {
            let spread = yarns.network.loop_spread(points, repeat, margin);
            println!("loops {margin} from the border: {spread:?}");
        }
    }
    Ok(())
}

/// Root mean square way of the points about their middle [m].
fn moved(from: &[[f64; 3]], to: &[[f64; 3]]) -> f64 {
    let n = from.len() as f64;
    let way = |k: usize| from.iter().zip(to).map(move |(a, b)| b[k] - a[k]);
    let mean: [f64; 3] = std::array::from_fn(|k| way(k).sum::<f64>() / n);
    let square = |k: usize| way(k).map(|d| (d - mean[k]).powi(2)).sum::<f64>();
    ((0..3).map(square).sum::<f64>() / n).sqrt()
}

/// Curvatures of the quadratic surface over the horizontal plane that is
/// closest to the points, along x and against z [1/m].
fn curvature(points: &[[f64; 3]]) -> [f64; 2] {
    let mut a = nalgebra::DMatrix::<f64>::zeros(6, 6);
    let mut b = nalgebra::DVector::<f64>::zeros(6);
    for p in points {
        let (x, z) = (p[0], p[2]);
        let row = nalgebra::DVector::from_vec(vec![1.0, x, z, 0.5 * x * x, 0.5 * z * z, x * z]);
        a += &row * row.transpose();
        b += row * p[1];
    }
    match a.lu().solve(&b) {
        Some(c) => [c[3], c[4]],
        None => [f64::NAN; 2],
    }
}
