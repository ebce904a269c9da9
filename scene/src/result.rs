//! What a run leaves: figures at the end, and the files.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use selvedge_collision::{ContactResponse, Intersection, self_intersections};
use selvedge_energy::EvalPoint;
use selvedge_integrator::{ScenePlan, Simulation, State, StepReport};
use selvedge_record::export::{Skin, write_obj, write_obj_lines};
use selvedge_record::{RecordError, Surface};
use selvedge_shell_model::strain::{edge_strain, principal_stretches};
use selvedge_yarn_model::NONE;

use crate::build::{BuiltScene, Geometry, YarnCloth, broad_phase};
use crate::driver::RunError;
use crate::effects::EffectRow;
use crate::process;
use crate::summary::{Defect, SUMMARY_SCHEMA, StageSummary, Status, Summary, TopologySummary};
use crate::watchdog::Event;
use crate::yarn_skin::still_skin;

pub(crate) struct Inputs<'a> {
    pub built: &'a BuiltScene,
    pub simulation: &'a Simulation,
    pub status: Status,
    pub reason: String,
    pub effects: Vec<EffectRow>,
    pub topology: Option<TopologySummary>,
    pub assembly: Vec<StageSummary>,
    pub last: &'a StepReport,
    pub watchdog: Vec<Event>,
    pub watchdog_unlisted: u64,
    pub threads: usize,
    pub wall: Duration,
    pub cpu: f64,
    pub version: &'a str,
}

/// Geometric figures of a state, in the solver's order.
pub(crate) struct Figures {
    pub max_penetration: f64,
    pub self_intersections: usize,
    pub max_strain: f64,
    pub mean_strain: f64,
    pub max_seam_gap: f64,
    pub max_drop: Option<f64>,
    pub defects: Vec<Defect>,
}

/// Crossings that are listed with their place; all are counted.
const LISTED_CROSSINGS: usize = 20;

pub(crate) fn figures(built: &BuiltScene, q: &[f64], time: f64) -> Figures {
    let g = &built.geometry;
    let (max_strain, mean_strain) = strains(g, q);
    let q = &q[..3 * g.mesh.points()];
    let (points, _) = q.as_chunks::<3>();
    let (mut deepest, mut deepest_point) = (0.0_f64, 0);
    let mut samples = Vec::new();
    for body in &built.bodies {
        samples.clear();
        body.body.sample_many(points, time, &mut samples);
        for (k, s) in samples.iter().enumerate() {
            if -s.distance > deepest {
                (deepest, deepest_point) = (-s.distance, k);
            }
        }
    }
    // A point's panel is that of the first triangle around it.
    let part =
        |t: usize| g.panel_names[usize::from(g.scene_panel[g.triangle_order[t] as usize])].clone();
    let around = |corners: &[u32]| {
        let mut all = g.mesh.triangles().iter();
        all.position(|t| corners.iter().all(|c| t.contains(c)))
    };
    let penetration = (deepest > 0.0).then(|| Defect {
        kind: "penetration",
        at: points[deepest_point],
        parts: around(&[deepest_point as u32])
            .map(part)
            .into_iter()
            .collect(),
        depth_m: Some(deepest),
    });
    let crossing = |(at, crossed): ([f64; 3], Option<Intersection>)| {
        let parts = crossed.iter().flat_map(|c| {
            let parts = around(&c.edge).into_iter().chain([c.triangle as usize]);
            parts.map(part)
        });
        Defect {
            kind: "self-intersection",
            at,
            parts: parts.collect(),
            depth_m: None,
        }
    };
    let crossings = crossings(built, q);
    let gap = g.spring_seams.iter().map(|&(p, [a, b], w)| {
        let (p, a, b) = (points[p as usize], points[a as usize], points[b as usize]);
        (0..3)
            .map(|i| (p[i] - (1.0 - w) * a[i] - w * b[i]).powi(2))
            .sum::<f64>()
            .sqrt()
    });
    let count = crossings.len();
    let listed = crossings.into_iter().take(LISTED_CROSSINGS);
    Figures {
        max_penetration: deepest,
        self_intersections: count,
        max_strain,
        mean_strain,
        max_seam_gap: gap.fold(0.0, f64::max),
        max_drop: max_drop(built, points),
        defects: penetration
            .into_iter()
            .chain(listed.map(crossing))
            .collect(),
    }
}

/// Where cloth passes through itself: edges through triangles, or yarns that no
/// stitch joins in each other.
fn crossings(built: &BuiltScene, q: &[f64]) -> Vec<([f64; 3], Option<Intersection>)> {
    if built.geometry.yarns.is_some() {
        // Points that are nowhere are in nothing.
        let places = built.passed_into(q).unwrap_or_default();
        return places.into_iter().map(|p| (p, None)).collect();
    }
    let mut broad = broad_phase(built.scene().contact.broad_phase);
    let triangles = built.geometry.mesh.triangles();
    let found = self_intersections(q, triangles, broad.as_mut());
    found.into_iter().map(|c| (c.place, Some(c))).collect()
}

/// Largest and mean magnitude of the strain of edges, or of the segments of
/// yarns.
fn strains(g: &Geometry, q: &[f64]) -> (f64, f64) {
    let Some(yarns) = &g.yarns else {
        let strain = edge_strain(&g.mesh, &q[..3 * g.mesh.points()]);
        return (strain.max_abs, strain.mean_abs);
    };
    let ends = yarns.network.yarns.iter().scan(0, |sum, y| {
        *sum += y.strands as usize;
        Some(*sum - 1)
    });
    let mut ends = ends.peekable();
    let (mut largest, mut sum, mut count) = (0.0_f64, 0.0, 0_usize);
    for (k, strain) in yarn_strains(yarns, q).into_iter().enumerate() {
        if ends.next_if_eq(&k).is_some() {
            continue;
        }
        let strain = strain.abs();
        // NaN wins, so that it is seen.
        if strain > largest || strain.is_nan() {
            largest = strain;
        }
        sum += strain;
        count += 1;
    }
    (largest, sum / count.max(1) as f64)
}

/// Strain `|x_1 − x_0|/Δu − 1` of the segment from every strand to the next,
/// yarn after yarn, with the arc lengths of the state where they slide and
/// those at rest where not; NaN at the end of a yarn.
pub(crate) fn yarn_strains(yarns: &YarnCloth, q: &[f64]) -> Vec<f64> {
    let n = &yarns.network;
    let (points, arcs) = q.split_at(3 * n.nodes());
    let points = points.as_chunks::<3>().0;
    let slid = yarns.sliding && arcs.len() >= n.strands.len();
    let strain = |s: u32| {
        let a = n.strands[s as usize];
        if a.next == NONE {
            return f64::NAN;
        }
        let b = n.strands[a.next as usize];
        let rest = match slid {
            true => arcs[a.next as usize] - arcs[s as usize],
            false => b.arc - a.arc,
        };
        let [x, y] = [a, b].map(|s| points[s.node as usize]);
        (x[0] - y[0]).hypot(x[1] - y[1]).hypot(x[2] - y[2]) / rest - 1.0
    };
    let yarns = 0..n.yarns.len() as u32;
    yarns.flat_map(|y| n.along(y)).map(strain).collect()
}

/// How far the highest point of a garment is below its highest point in the
/// pattern, for the garment that sank most [m].
fn max_drop(built: &BuiltScene, points: &[[f64; 3]]) -> Option<f64> {
    let g = &built.geometry;
    let gravity = built.scene().simulation.gravity;
    let size = gravity.iter().map(|x| x * x).sum::<f64>().sqrt();
    if size == 0.0 {
        return None;
    }
    let height = |p: &[f64; 3]| -(0..3).map(|i| p[i] * gravity[i] / size).sum::<f64>();
    let top = |heights: &mut dyn Iterator<Item = f64>| heights.fold(f64::NEG_INFINITY, f64::max);
    let garments = g.parts.iter().filter_map(|part| {
        let sewn = part.garment.as_ref()?;
        let before = top(&mut sewn
            .mesh
            .points_initial
            .iter()
            .map(|&p| height(&sewn.place(p))));
        let after = top(&mut part
            .points
            .clone()
            .map(|k| height(&points[g.order.new_of_old[k as usize] as usize])));
        Some(before - after)
    });
    garments.reduce(f64::max)
}

/// Values over the cloth at the end, in the scene's order.
pub(crate) struct Maps {
    pub contact_force: Vec<f64>,
    pub stretches: Vec<[f64; 2]>,
    pub body_distance: Vec<f64>,
}

pub(crate) fn maps(built: &BuiltScene, simulation: &mut Simulation) -> Maps {
    let g = &built.geometry;
    let state = simulation.state().clone();
    let (points, _) = state.q[..3 * g.mesh.points()].as_chunks::<3>();
    let mut response = ContactResponse::default();
    let at = EvalPoint {
        layout: state.layout,
        q: &state.q,
        q_start: &state.q,
        dt: simulation.settings().control.max_step,
    };
    for contact in &mut simulation.plan_mut().contacts {
        // A contact that cannot be evaluated leaves its part of the map empty.
        let _ = contact.evaluate(&at, false, &mut response);
    }
    let size = |f: &[f64; 3]| f[0].hypot(f[1]).hypot(f[2]);
    let mut force = vec![0.0; points.len()];
    for ((nodes, weights), f) in response
        .nodes
        .iter()
        .zip(&response.weights)
        .zip(&response.force)
    {
        for (&n, w) in nodes.iter().zip(weights) {
            if *w != 0.0 {
                force[n as usize] += w.abs() * size(f);
            }
        }
    }
    for (&n, f) in response.body_nodes.iter().zip(&response.body_force) {
        force[n as usize] += size(f);
    }
    let mut distance = vec![
        f64::INFINITY;
        if built.bodies.is_empty() {
            0
        } else {
            points.len()
        }
    ];
    let mut samples = Vec::new();
    for body in &built.bodies {
        samples.clear();
        body.body.sample_many(points, state.time, &mut samples);
        for (d, s) in distance.iter_mut().zip(&samples) {
            *d = d.min(s.distance);
        }
    }
    let solver = principal_stretches(&g.mesh, &state.q);
    let mut stretches = vec![[1.0; 2]; solver.len()];
    for (s, &t) in solver.iter().zip(&g.triangle_order) {
        stretches[t as usize] = *s;
    }
    let body_distance = if distance.is_empty() {
        distance
    } else {
        g.recorded(&distance)
    };
    Maps {
        contact_force: g.recorded(&force),
        stretches,
        body_distance,
    }
}

/// Heap memory by owner [bytes].
fn memory(simulation: &Simulation) -> BTreeMap<String, usize> {
    let mut all = BTreeMap::new();
    for (name, bytes) in simulation.memory() {
        *all.entry(name).or_default() += bytes;
    }
    all
}

pub(crate) fn summary(i: Inputs<'_>) -> Summary {
    let state = i.simulation.state();
    let figures = figures(i.built, &state.q, state.time);
    let counters = i.simulation.counters();
    Summary {
        schema: SUMMARY_SCHEMA,
        status: i.status,
        reason: i.reason,
        simulated_s: state.time,
        wall_s: i.wall.as_secs_f64(),
        cpu_s: i.cpu,
        threads: i.threads,
        steps: counters.steps,
        rejected_steps: counters.rejected,
        newton_iterations: counters.newton_iterations,
        linear_iterations: counters.linear_iterations,
        points: i.built.geometry.mesh.points(),
        scalars: state.layout.scalars,
        triangles: i.built.geometry.mesh.triangles().len(),
        peak_memory_bytes: process::peak_memory_bytes(),
        simulation_bytes: i.simulation.heap_bytes(),
        memory: memory(i.simulation),
        max_penetration_m: figures.max_penetration,
        self_intersections: figures.self_intersections,
        max_abs_edge_strain: figures.max_strain,
        mean_abs_edge_strain: figures.mean_strain,
        max_seam_gap_m: figures.max_seam_gap,
        trims: i.built.trims.summary(&i.built.parsed, i.simulation),
        max_drop_m: figures.max_drop,
        topology: i.topology,
        defects: figures.defects,
        kinetic_energy_j: state.kinetic_energy(&i.simulation.plan().inertia.masses),
        residual: i.last.residual,
        error_estimate: None,
        error: None,
        stages: i
            .simulation
            .ledger()
            .entries()
            .iter()
            .map(|e| (e.name.clone(), e.time.as_secs_f64()))
            .collect(),
        watchdog: i.watchdog,
        watchdog_unlisted: i.watchdog_unlisted,
        assembly: i.assembly,
        effects: i.effects,
        settings: i.built.scene().effective(),
        version: i.version.to_owned(),
        final_state_hash: state_hash(&state.q, &state.v),
        warnings: i
            .built
            .warnings
            .findings()
            .iter()
            .map(ToString::to_string)
            .collect(),
    }
}

/// Energies after a step by term, and the kinetic energy [J].
pub(crate) fn energies(last: &StepReport, state: &State, plan: &ScenePlan) -> Vec<(String, f64)> {
    let terms = last.energies.iter().map(|e| (e.name.clone(), e.value));
    let kinetic = state.kinetic_energy(&plan.inertia.masses);
    terms.chain([("kinetic".to_owned(), kinetic)]).collect()
}

/// BLAKE3 of the exact bits of positions and velocities.
pub(crate) fn state_hash(q: &[f64], v: &[f64]) -> String {
    let mut hasher = blake3::Hasher::new();
    for x in q.iter().chain(v) {
        hasher.update(&x.to_le_bytes());
    }
    hasher.finalize().to_hex().to_string()
}

pub(crate) const OBJ: &str = "final.obj";
pub(crate) const SUMMARY: &str = "summary.json";

pub(crate) fn write(
    directory: &Path,
    built: &BuiltScene,
    positions: &[f64],
    summary: &Summary,
) -> Result<(), RunError> {
    let g = &built.geometry;
    if g.yarns.is_some() {
        write_yarns(&directory.join(OBJ), g, positions)?;
        return write_summary(directory, summary);
    }
    let surface = Surface {
        positions,
        points: g.mesh.points(),
        triangles: &g.scene_triangles,
        material: &g.scene_material,
        panels: &g.scene_panel,
        panel_names: &g.panel_names,
    };
    write_obj(&directory.join(OBJ), &surface)?;
    write_summary(directory, summary)
}

/// Writes yarns as tubes, or as lines where these would be too many.
fn write_yarns(path: &Path, g: &Geometry, positions: &[f64]) -> Result<(), RunError> {
    let yarns = g.yarn_paths();
    let points = g.recorded_points();
    let skin = still_skin(&yarns, points).map_err(|e| RecordError::Surface {
        reason: e.to_string(),
    })?;
    let Some(skin) = skin else {
        return Ok(write_obj_lines(path, positions, &yarns, &g.panel_names)?);
    };
    let surface = Surface {
        positions: &skin.positions(positions),
        points: skin.points(),
        triangles: skin.triangles(),
        material: &[],
        panels: skin.panels(),
        panel_names: &g.panel_names,
    };
    Ok(write_obj(path, &surface)?)
}

/// Writes `summary.json` into a folder.
///
/// # Errors
/// [`RunError::Write`] with the file's path.
pub fn write_summary(directory: &Path, summary: &Summary) -> Result<(), RunError> {
    let text = serde_json::to_string_pretty(summary).unwrap_or_default() + "\n";
    write_whole(&directory.join(SUMMARY), text.as_bytes())
}

/// Replaces a file at once: readers see the old or the new contents.
///
/// # Errors
/// [`RunError::Write`] with the file's path.
pub fn write_whole(path: &Path, contents: &[u8]) -> Result<(), RunError> {
    let failed = |source| RunError::Write {
        path: path.to_owned(),
        source,
    };
    let temporary = beside(path, ".new");
    let written =
        std::fs::write(&temporary, contents).and_then(|()| std::fs::rename(&temporary, path));
    if written.is_err() {
        // Nothing half-written stays behind; the first error is the one to tell.
        let _ = std::fs::remove_file(&temporary);
    }
    written.map_err(failed)
}

/// Makes the folder and finds out whether results can be put there under their
/// names, before hours go into them. Files of an earlier run stay as they are.
///
/// # Errors
/// [`RunError::Write`] with the path that is in the way.
pub fn check_results(directory: &Path, names: &[&str]) -> Result<(), RunError> {
    let failed = |path: &Path, source| RunError::Write {
        path: path.to_owned(),
        source,
    };
    std::fs::create_dir_all(directory).map_err(|e| failed(directory, e))?;
    for name in names {
        let path = directory.join(name);
        if path.is_dir() {
            return Err(failed(&path, io::ErrorKind::IsADirectory.into()));
        }
        let probe = beside(&path, ".probe");
        std::fs::write(&probe, [])
            .and_then(|()| std::fs::remove_file(&probe))
            .map_err(|e| failed(&path, e))?;
    }
    Ok(())
}

fn beside(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(suffix);
    path.with_file_name(name)
}
