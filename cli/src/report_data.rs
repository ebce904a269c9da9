//! From a run to the data of its report.

mod yarns;

use selvedge_record::{RecordError, Recording, RunHeader};
use selvedge_scene::build::BuiltScene;
use selvedge_scene::driver::RunResult;
use selvedge_shell_model::ShellMesh;
use selvedge_shell_model::strain::principal_stretches;

use crate::report::{
    AssemblyStage, Field, ReportData, ReportFrame, ReportMesh, ReportSurface, Series,
};

/// Frames that a report shows at most; a longer run is thinned out evenly.
const MAX_FRAMES: usize = 240;

/// Collects everything that the report of a finished run shows.
pub fn of_run(built: &BuiltScene, result: &RunResult, scene_text: &str) -> ReportData {
    let g = &built.geometry;
    let recording = result
        .recording
        .as_ref()
        .and_then(|path| Recording::open(path).ok());
    let mut frames = recording.as_ref().map(frames).unwrap_or_default();
    if frames.is_empty() {
        let time = result.summary.simulated_s;
        frames.push(ReportFrame {
            time,
            positions: points(&result.positions),
        });
    }
    let percent = |k: usize| -> Vec<f32> {
        result
            .stretches
            .iter()
            .map(|s| (100.0 * (s[k] - 1.0)) as f32)
            .collect()
    };
    let mut point_fields = vec![Field {
        name: "contact force".into(),
        unit: "mN".into(),
        values: result
            .contact_force
            .iter()
            .map(|f| (1e3 * f) as f32)
            .collect(),
        ..Field::default()
    }];
    if !result.body_distance.is_empty() {
        point_fields.push(Field {
            name: "distance to the body".into(),
            unit: "mm".into(),
            values: result
                .body_distance
                .iter()
                .map(|d| (1e3 * d) as f32)
                .collect(),
            range: Some((0.0, 20.0)),
            ..Field::default()
        });
    }
    let stages = result.summary.assembly.iter().map(|s| AssemblyStage {
        name: s.name.clone(),
        duration_s: s.simulated_s,
        wall_s: s.wall_s,
        max_strain: Some(s.max_abs_edge_strain),
        max_penetration_m: Some(s.max_penetration_m),
        note: format!(
            "{}; mean strain {:.2} %, {} self-intersections, {} steps ({} rejected)",
            s.what,
            100.0 * s.mean_abs_edge_strain,
            s.self_intersections,
            s.steps,
            s.rejected_steps
        ),
    });
    let mut data = ReportData {
        title: built.scene().name.clone(),
        summary: serde_json::to_value(&result.summary).unwrap_or_default(),
        settings: result.summary.settings.clone(),
        scene_text: scene_text.to_owned(),
        mesh: ReportMesh {
            triangles: g.scene_triangles.clone(),
            panel: g.scene_panel.clone(),
            panel_names: g.panel_names.clone(),
        },
        bodies: built
            .bodies
            .iter()
            .map(|b| surface(&b.name, &b.surface.0, &b.surface.1))
            .collect(),
        frames,
        triangle_fields: vec![
            Field {
                name: "largest stretch".into(),
                unit: "%".into(),
                values: percent(0),
                diverging: true,
                ..Field::default()
            },
            Field {
                name: "smallest stretch".into(),
                unit: "%".into(),
                values: percent(1),
                diverging: true,
                ..Field::default()
            },
        ],
        point_fields,
        series: recording.as_ref().map(series).unwrap_or_default(),
        stages: stages.collect(),
        notes: notes(result),
        yarns: None,
    };
    if g.yarns.is_some() {
        let strain = &result.yarn_strain;
        yarns::dress(&mut data, &g.yarn_paths(), g.recorded_points(), strain);
    }
    data
}

/// Warnings, and what the watchdog found.
fn notes(result: &RunResult) -> Vec<String> {
    let s = &result.summary;
    let found = s.watchdog.iter().map(|e| {
        let place = e
            .term
            .as_ref()
            .zip(e.at)
            .map(|(term, [x, y, z])| format!(" (`{term}` at {x:.4}, {y:.4}, {z:.4} m)"));
        format!(
            "watchdog, t = {:.5} s: {}{}",
            e.time_s,
            e.what,
            place.unwrap_or_default()
        )
    });
    s.warnings.iter().cloned().chain(found).collect()
}

fn points(flat: &[f64]) -> Vec<[f32; 3]> {
    flat.as_chunks::<3>()
        .0
        .iter()
        .map(|p| p.map(|x| x as f32))
        .collect()
}

fn surface(name: &str, positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> ReportSurface {
    ReportSurface {
        name: name.to_owned(),
        points: positions.iter().map(|p| p.map(|x| x as f32)).collect(),
        triangles: triangles.to_vec(),
        ..ReportSurface::default()
    }
}

fn frames(recording: &Recording) -> Vec<ReportFrame> {
    let count = recording.frames().len();
    let stride = count.div_ceil(MAX_FRAMES).max(1);
    let mut chosen: Vec<usize> = (0..count).step_by(stride).collect();
    if count > 0 && chosen.last() != Some(&(count - 1)) {
        chosen.push(count - 1);
    }
    chosen
        .into_iter()
        .filter_map(|i| recording.frame(i).ok())
        .map(|f| ReportFrame {
            time: f.time,
            positions: points(&f.positions),
        })
        .collect()
}

fn series(recording: &Recording) -> Vec<Series> {
    let steps: Vec<_> = recording
        .diagnostics()
        .iter()
        .filter(|d| d.accepted)
        .collect();
    let of = |value: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> {
        (0..steps.len())
            .map(|i| (steps[i].time, value(i)))
            .collect()
    };
    let one = |group: &str, name: &str, unit: &str, log: bool, points: Vec<(f64, f64)>| Series {
        group: group.into(),
        name: name.into(),
        unit: unit.into(),
        log,
        points,
    };
    let mut all = Vec::new();
    let names = steps.last().map(|d| &d.energies).into_iter().flatten();
    for (k, (name, _)) in names.enumerate() {
        let energy = of(&|i| steps[i].energies.get(k).map_or(f64::NAN, |e| e.1));
        all.push(one("energy", name, "J", true, energy));
    }
    all.push(one(
        "kinetic",
        "kinetic energy",
        "J",
        true,
        of(&|i| steps[i].kinetic),
    ));
    all.push(one(
        "residual",
        "Newton residual",
        "m/s",
        true,
        of(&|i| steps[i].residual),
    ));
    all.push(one("step", "step", "ms", false, of(&|i| 1e3 * steps[i].dt)));
    let pins = steps.last().map(|d| &d.pins).into_iter().flatten();
    for (k, pin) in pins.enumerate() {
        let force = of(&|i| {
            let force = steps[i].pins.get(k).map_or([f64::NAN; 3], |p| p.force);
            force.map(|f| f * f).iter().sum::<f64>().sqrt()
        });
        all.push(one("pin force", &pin.name, "N", false, force));
    }
    all.push(one(
        "contacts",
        "active contacts",
        "",
        false,
        of(&|i| steps[i].contacts as f64),
    ));
    all.push(one(
        "solver",
        "linear iterations",
        "",
        false,
        of(&|i| f64::from(steps[i].linear_iterations)),
    ));
    all
}

/// Collects what the report of a recording alone can show: no maps of forces,
/// since they are not recorded.
///
/// # Errors
/// [`RecordError`] when no frame can be read.
pub fn of_recording(recording: &Recording) -> Result<ReportData, RecordError> {
    let header = recording.header();
    let frames = frames(recording);
    let mut fields = Vec::new();
    if let Some(count) = recording.frames().len().checked_sub(1) {
        let last = recording.frame(count)?;
        if header.material.len() == header.triangles.len() {
            fields = stretch_fields(header, &last.positions);
        }
    }
    let mut data = ReportData {
        title: header.scene_name.clone(),
        summary: recording.outcome().cloned().unwrap_or_default(),
        settings: header.effective.clone(),
        scene_text: header.scene_text.clone(),
        mesh: ReportMesh {
            triangles: header.triangles.clone(),
            panel: header.panels.clone(),
            panel_names: header.panel_names.clone(),
        },
        bodies: header
            .bodies
            .iter()
            .map(|b| surface(&b.name, &b.points, &b.triangles))
            .collect(),
        frames,
        triangle_fields: fields,
        point_fields: Vec::new(),
        series: series(recording),
        stages: Vec::new(),
        notes: recording.warnings().to_vec(),
        yarns: None,
    };
    if !header.yarns.is_empty() {
        yarns::dress(&mut data, &header.yarns, header.points, &[]);
    }
    Ok(data)
}

fn stretch_fields(header: &RunHeader, positions: &[f64]) -> Vec<Field> {
    let mesh = ShellMesh::with_slivers(
        header.points,
        header.triangles.clone(),
        header.material.clone(),
        vec![0; header.triangles.len()],
    );
    let Ok(mesh) = mesh else { return Vec::new() };
    let stretches = principal_stretches(&mesh, positions);
    let percent = |k: usize| {
        stretches
            .iter()
            .map(|s| (100.0 * (s[k] - 1.0)) as f32)
            .collect()
    };
    let field = |name: &str, values| Field {
        name: name.into(),
        unit: "%".into(),
        values,
        diverging: true,
        ..Field::default()
    };
    vec![
        field("largest stretch", percent(0)),
        field("smallest stretch", percent(1)),
    ]
}
