//! A made-up drape with everything a report can show.

use selvedge_cli::report::{
    AssemblyStage, Field, Point, ReportData, ReportFrame, ReportMesh, ReportSurface, Series,
};
use serde_json::json;

const RADIUS: f32 = 0.25;

/// `side` × `side` points, `frames` states.
pub fn demo(side: usize, frames: usize) -> ReportData {
    let mesh = grid(side);
    let states: Vec<ReportFrame> = (0..frames)
        .map(|k| {
            let t = if frames > 1 {
                k as f32 / (frames - 1) as f32
            } else {
                1.0
            };
            ReportFrame {
                time: 1.5 * f64::from(t),
                positions: sheet(side, t),
            }
        })
        .collect();
    let strain: Vec<Vec<f32>> = states
        .iter()
        .map(|s| strain(&mesh, &s.positions, side))
        .collect();
    let gap: Vec<Vec<f32>> = states.iter().map(|s| gap(&s.positions)).collect();
    let last = |h: &[Vec<f32>]| h.last().cloned().unwrap_or_default();
    ReportData {
        yarns: None,
        title: "sheet on a ball <demo & test>".into(),
        summary: summary(side),
        settings: settings(),
        scene_text:
            "[mesh]\nedge_length = 0.01 # m\n\n[[body]]\nsphere = { radius = 0.25 } # <m>\n".into(),
        bodies: vec![ball(48)],
        triangle_fields: vec![Field {
            name: "area strain".into(),
            unit: "%".into(),
            values: last(&strain),
            diverging: true,
            history: strain,
            range: None,
        }],
        point_fields: vec![Field {
            name: "distance to the ball".into(),
            unit: "mm".into(),
            values: last(&gap),
            history: Vec::new(),
            ..Field::default()
        }],
        series: series(),
        stages: stages(),
        notes: vec![
            "mesh.edge_length 0.01 m is coarse for bends of radius 0.03 m <check>".into(),
            "contact.thickness was not given: 1.2 mm from the fabric".into(),
        ],
        frames: states,
        mesh,
    }
}

fn grid(side: usize) -> ReportMesh {
    let mut mesh = ReportMesh {
        panel_names: ["centre", "border"].map(String::from).to_vec(),
        ..ReportMesh::default()
    };
    for j in 0..side.saturating_sub(1) {
        for i in 0..side - 1 {
            let a = (j * side + i) as u32;
            let (b, c, d) = (a + 1, a + side as u32, a + side as u32 + 1);
            // Seen from above (+y) with x to the right and z towards the viewer.
            if (i + j) % 2 == 0 {
                mesh.triangles.extend([[a, c, b], [b, c, d]]);
            } else {
                mesh.triangles.extend([[a, c, d], [a, d, b]]);
            }
            let edge = |k: usize| k * 8 < side || (k + 1) * 8 > 7 * side;
            let panel = u16::from(edge(i) || edge(j));
            mesh.panel.extend([panel, panel]);
        }
    }
    mesh
}

/// Falls, then hangs in folds around the ball.
fn sheet(side: usize, t: f32) -> Vec<Point> {
    let fall = (1.0 - t).powi(2);
    let fold = (t * 1.6 - 0.4).clamp(0.0, 1.0);
    (0..side * side)
        .map(|n| {
            let u = (n % side) as f32 / (side - 1) as f32 - 0.5;
            let v = (n / side) as f32 / (side - 1) as f32 - 0.5;
            let (r, phi) = ((u * u + v * v).sqrt(), v.atan2(u));
            let angle = (r / RADIUS).min(1.45);
            let rest = (r - 1.45 * RADIUS).max(0.0);
            let wave = fold * (rest * 3.2).min(0.45) * (8.0 * phi + 0.6).cos() * 0.42;
            let out =
                RADIUS * angle.sin() * 1.012 + rest * (0.12 + 0.25 * fall) + wave * rest.sqrt();
            let y = RADIUS * angle.cos() * 1.012 - rest * (0.95 - 0.5 * fall);
            // The sheet never enters the ball.
            let ball = (RADIUS * RADIUS - y * y).max(0.0).sqrt() + 0.003;
            let out = if y > -RADIUS && fall < 0.6 {
                out.max(ball.min(r))
            } else {
                out
            };
            let bend = (1.0 - fall).max(0.0);
            let flat = [u, RADIUS + 0.25 * fall + 0.004, v];
            let hung = [out * phi.cos(), y + 0.25 * fall, out * phi.sin()];
            std::array::from_fn(|k| flat[k] + bend * (hung[k] - flat[k]))
        })
        .collect()
}

fn strain(mesh: &ReportMesh, p: &[Point], side: usize) -> Vec<f32> {
    let rest = 0.5 / ((side - 1) as f32).powi(2);
    mesh.triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| p[i as usize]);
            let u: Point = std::array::from_fn(|k| b[k] - a[k]);
            let v: Point = std::array::from_fn(|k| c[k] - a[k]);
            let n = [
                u[1] * v[2] - u[2] * v[1],
                u[2] * v[0] - u[0] * v[2],
                u[0] * v[1] - u[1] * v[0],
            ];
            let area = 0.5 * (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
            100.0 * (area / rest - 1.0)
        })
        .collect()
}

/// NaN where the sheet is far from the ball.
fn gap(p: &[Point]) -> Vec<f32> {
    p.iter()
        .map(|p| 1000.0 * ((p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt() - RADIUS))
        .map(|g| if g < 120.0 { g } else { f32::NAN })
        .collect()
}

fn ball(n: usize) -> ReportSurface {
    let mut body = ReportSurface {
        name: "ball".into(),
        ..ReportSurface::default()
    };
    for j in 0..=n {
        for i in 0..2 * n {
            let (a, b) = (
                std::f32::consts::PI * j as f32 / n as f32,
                std::f32::consts::PI * i as f32 / n as f32,
            );
            body.points.push([
                RADIUS * a.sin() * b.cos(),
                RADIUS * a.cos(),
                RADIUS * a.sin() * b.sin(),
            ]);
            let id = |i: usize, j: usize| (j * 2 * n + i % (2 * n)) as u32;
            if j < n {
                body.triangles.push([id(i, j), id(i + 1, j), id(i, j + 1)]);
                body.triangles
                    .push([id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)]);
            }
        }
    }
    body
}

fn series() -> Vec<Series> {
    let make = |group: &str, name: &str, unit: &str, log, f: &dyn Fn(f64) -> f64| Series {
        group: group.into(),
        name: name.into(),
        unit: unit.into(),
        log,
        points: (0..=3000)
            .map(|i| f64::from(i) * 5e-4)
            .map(|t| (t, f(t)))
            .collect(),
    };
    let settle = |t: f64| 1.0 - (-4.0 * t).exp();
    vec![
        make("energy", "membrane", "J", false, &|t| {
            0.021 * settle(t) * (1.0 + 0.1 * (40.0 * t).sin() * (-3.0 * t).exp())
        }),
        make("energy", "bending", "J", false, &|t| 0.0065 * settle(t)),
        make("energy", "gravity", "J", false, &|t| {
            0.06 - 0.05 * settle(t)
        }),
        make("energy", "contact", "J", false, &|t| {
            0.004 * settle(t) * (1.0 + 0.3 * (60.0 * t).cos() * (-4.0 * t).exp())
        }),
        make("kinetic", "kinetic", "J", true, &|t| {
            1e-2 * t * (-8.0 * t).exp() + 1e-9
        }),
        make("residual", "first iteration", "1", true, &|t| {
            10f64.powf(-1.5 + 0.5 * (90.0 * t).sin())
        }),
        make("residual", "last iteration", "1", true, &|t| {
            10f64.powf(-5.0 + 0.8 * (130.0 * t).sin())
        }),
        make("step", "step", "s", true, &|t| {
            if t < 0.5 {
                5e-4
            } else if t < 0.9 {
                2e-3
            } else {
                f64::NAN
            }
        }),
        make("contacts", "body", "1", false, &|t| {
            (4200.0 * settle(t)).round()
        }),
        make("contacts", "self", "1", false, &|t| {
            (900.0 * settle((t - 0.4).max(0.0))).round()
        }),
    ]
}

fn stages() -> Vec<AssemblyStage> {
    [
        ("place panels", 0.0, 0.4, 0.0, 0.0, ""),
        ("sew", 0.8, 21.5, 0.184, 6.1e-4, "seams closed at 0.71 s"),
        ("relax", 0.7, 13.9, 0.041, 1.2e-4, "stopped at rest"),
    ]
    .map(
        |(name, duration_s, wall_s, strain, depth, note)| AssemblyStage {
            name: name.into(),
            duration_s,
            wall_s,
            max_strain: Some(strain),
            max_penetration_m: (wall_s > 1.0).then_some(depth),
            note: note.into(),
        },
    )
    .to_vec()
}

fn summary(side: usize) -> serde_json::Value {
    json!({
        "schema": 1, "status": "converged", "reason": "at rest: kinetic energy below 1e-8 J for 0.1 s",
        "simulated_s": 1.5, "wall_s": 35.8, "cpu_s": 66.1, "threads": 2, "steps": 1340, "rejected_steps": 12,
        "newton_iterations": 3921, "linear_iterations": 151_234, "points": side * side, "scalars": 0,
        "triangles": 2 * (side - 1) * (side - 1), "peak_memory_bytes": 187_345_920,
        "max_penetration_m": 1.2e-4, "self_intersections": 0, "max_abs_edge_strain": 0.041,
        "mean_abs_edge_strain": 0.0063, "kinetic_energy_j": 3.1e-9, "residual": 8.4e-6,
        "error_estimate": 2.3e-3,
        "error": { "space": { "error_m": 1.9e-3, "how": "against coarser meshes" },
            "time": { "error_m": 4e-4, "how": "against shorter steps" } },
        "stages": { "linear solve": 19.2, "assemble": 8.1, "contact detection": 4.4, "contact evaluation": 2.2, "line search": 0.9, "record": 0.3 },
        "effects": [
            { "name": "body contact", "on": true, "reason": "the scene has 1 body", "stencils": 10_000, "bytes": 1_440_000, "seconds": 2.9 },
            { "name": "self-collision", "on": true, "reason": "the sheet can fold onto itself", "stencils": 912, "bytes": 5_240_000, "seconds": 3.7 },
            { "name": "drag", "on": false, "reason": "fabric.drag = 0", "stencils": 0, "bytes": 0, "seconds": 0.0 },
            { "name": "sliding coordinates", "on": false, "reason": "no yarns" },
        ],
        "version": "0.1.0", "final_state_hash": "b3:51f0c2ab99d07c11"
    })
}

fn settings() -> serde_json::Value {
    json!({
        "name": "sheet on a ball",
        "integrator": { "kind": "backward-euler", "max_step": 2e-3, "newton_tolerance": 1e-4, "newton_iterations": 12, "line_search_halvings": 8, "step_splitting": true, "residual_norm": "relative" },
        "solver": { "kind": "mpcg", "preconditioner": "block-jacobi", "tolerance": 1e-3, "max_iterations": 400, "precision": "f64", "matrix": "dual" },
        "assembly": { "scatter": "coloured", "reorder": "rcm", "threads": 2 },
        "contact": { "broad_phase": "bvh", "potential": "quadratic", "stiffness": 1e3, "thickness": 1.2e-3, "friction": 0.3 },
        "mesh": { "edge_length": 0.01 }, "output": { "directory": "out/sheet", "frame_rate": 40 }
    })
}
