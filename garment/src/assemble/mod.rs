//! Closing the seams and wrapping the garment around the body by geometry
//! alone, before any dynamics.

mod prolong;
mod relax;
mod repel;
mod sheet;
mod trunk;

use crate::place::{BodyField, BodyGuard};
use crate::{GarmentMesh, MeshSettings};
pub use prolong::prolong;
use relax::{Hang, Hold, Relax, Relaxed};
use repel::Repel;
use sheet::Sheet;
use trunk::Trunk;

/// How a garment is assembled.
#[derive(Clone, Debug, PartialEq)]
pub struct AssembleSettings {
    /// Distance kept from the body [m].
    pub clearance: f64,
    /// Distance that each panel keeps beyond that, for layers over others
    /// [m]; none where there is no entry. Points of several panels keep the
    /// largest.
    pub panel_clearance: Vec<f64>,
    /// Stop when no edge is stretched more than this [1].
    pub target_strain: f64,
    /// Edge length of the coarsest level [m].
    pub coarsest: f64,
    /// Iterations of the coarsest level; each finer one gets half of them.
    pub iterations: usize,
    /// Progress of the mean strain over ten iterations that counts [1].
    pub stagnation: f64,
    /// How many times ten iterations without progress end a level.
    pub patience: usize,
    /// Labels of panels that hang: on the coarsest level they fall, past the
    /// arms, before they close around the body.
    pub hanging: Vec<String>,
    /// Labels of edges that keep the height they have found while panels hang
    /// (a waist, a strapless top).
    pub held: Vec<String>,
    /// Labels of edges that keep their height in the pattern.
    pub kept: Vec<String>,
}

impl Default for AssembleSettings {
    fn default() -> Self {
        Self {
            clearance: 0.005,
            panel_clearance: Vec::new(),
            target_strain: 0.1,
            coarsest: 0.04,
            iterations: 600,
            stagnation: 1e-3,
            patience: 5,
            hanging: vec!["leg".to_owned()],
            held: vec!["lower_interface".to_owned(), "strapless_top".to_owned()],
            kept: Vec::new(),
        }
    }
}

/// One level of the assembly.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelReport {
    /// Edge length of its mesh [m].
    pub edge_length: f64,
    /// Its points.
    pub points: usize,
    /// Iterations spent.
    pub iterations: usize,
    /// Reached the target strain.
    pub converged: bool,
}

/// What the assembly reached. Strains are those of every triangle's edges
/// against its own panel, `l / L − 1`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AssembleReport {
    /// Levels, coarse to fine.
    pub levels: Vec<LevelReport>,
    /// Largest stretch [1].
    pub stretch_max: f64,
    /// Largest compression, positive [1].
    pub compression_max: f64,
    /// Mean of the absolute strain [1].
    pub strain_mean: f64,
    /// Absolute strain that half, 90 %, 99 % of the edges stay below [1].
    pub strain_percentiles: [f64; 3],
    /// Points inside the body.
    pub points_inside: usize,
    /// Largest depth inside the body [m].
    pub depth_max: f64,
}

/// Assembles a garment around a body: positions for
/// [`GarmentMesh::triangles`], and what they reach.
///
/// Position-based relaxation, coarse to fine: on meshes of the same pattern
/// of (by default) 4, 2, … times the edge length down to the garment's own,
///
/// ```text
/// x ← x + 0.9 (x − x_before)                     heavy-ball acceleration
/// x_i, x_j ← ± ½ k (l − L) d        edges: k = 0.8 stretched, 0.3 compressed;
///                                   corners across an edge: k = 0.25 below 0.85 L
/// |x − x_before| ≤ ¼ edge length    so that nothing passes through a limb
/// x ← x + (clearance − φ) ∇φ        where φ(x) < clearance, that of its panel's layer
/// ```
/// until no edge is stretched by more than the target, or nothing improves.
/// Over gathered seams the shorter side's length counts. Where an arm is in
/// the way of panels that hang, they first fall without feeling it, held at
/// the edges in [`AssembleSettings::held`]. Where much stretch is left, as of a
/// hem that closed around a foot, nothing goes below the ankles if that helps.
/// Points of different layers repel each other. The result has the same bits every time.
///
/// Fields that are not finite count as far away.
pub fn preassemble(
    garment: &GarmentMesh,
    body: BodyField<'_>,
    settings: &AssembleSettings,
) -> (Vec<[f64; 3]>, AssembleReport) {
    // Coarser meshes of the same pattern; a level that does not mesh (an
    // outline too fine for it) is left out.
    let mut coarse: Vec<GarmentMesh> = Vec::new();
    let mut h = 2.0 * garment.settings.edge_length;
    while h <= settings.coarsest * 1.001 {
        let level = MeshSettings {
            edge_length: h,
            ..garment.settings
        };
        coarse.extend(GarmentMesh::build(&garment.pattern, &level));
        h *= 2.0;
    }
    coarse.reverse();
    let levels: Vec<&GarmentMesh> = coarse.iter().chain([garment]).collect();
    let free = attempt(&levels, body, settings);
    if free.0.iter().all(|p| p[1] > ANKLE) {
        return free;
    }
    let above_the_feet = |p: [f64; 3]| {
        let (distance, normal) = body(p);
        let above = p[1] - ANKLE;
        if above < distance {
            (above, [0.0, 1.0, 0.0])
        } else {
            (distance, normal)
        }
    };
    let mut lifted = attempt(&levels, &above_the_feet, settings);
    if lifted.1.stretch_max > MUCH_BETTER * free.1.stretch_max {
        return free;
    }
    let budget = settings.iterations >> (levels.len() - 1);
    relax_level(garment, &mut lifted.0, body, settings, budget);
    measure(garment, &lifted.0, body, &mut lifted.1);
    lifted
}

/// Height of the ankles above the ground, `y = 0` [m].
const ANKLE: f64 = 0.08;
/// Largest stretch above the feet, against that without this, below which it
/// is taken.
const MUCH_BETTER: f64 = 0.5;

fn attempt(
    levels: &[&GarmentMesh],
    body: BodyField<'_>,
    settings: &AssembleSettings,
) -> (Vec<[f64; 3]>, AssembleReport) {
    let mut report = AssembleReport::default();
    let mut x = levels[0].points_initial.clone();
    for (i, mesh) in levels.iter().enumerate() {
        if i > 0 {
            x = prolong(levels[i - 1], &x, mesh);
        }
        let budget = (settings.iterations >> i).max(50);
        let mut iterations = 0;
        if i == 0 {
            iterations = fall(mesh, &mut x, body, settings, budget);
        }
        let mut done = relax_level(mesh, &mut x, body, settings, budget);
        done.iterations += iterations;
        report.levels.push(LevelReport {
            edge_length: mesh.settings.edge_length,
            points: mesh.points_initial.len(),
            iterations: done.iterations,
            converged: done.converged,
        });
    }
    measure(levels[levels.len() - 1], &x, body, &mut report);
    (x, report)
}

fn relax_level(
    mesh: &GarmentMesh,
    x: &mut [[f64; 3]],
    body: BodyField<'_>,
    settings: &AssembleSettings,
    budget: usize,
) -> Relaxed {
    let extra = point_clearance(mesh, settings);
    let field = |i: usize, p: [f64; 3]| further_out(body(p), &extra, i);
    let mut guard = BodyGuard::new(x, &field, settings.clearance);
    let work = Relax {
        sheet: &Sheet::new(mesh),
        settings,
        hang: None,
        hold: &Hold::new(mesh, &settings.kept, &mesh.points_initial),
    };
    work.run(x, &mut guard, &mut Repel::new(mesh), budget)
}

/// Most rounds of [`untangle`], and how far from a crossing points may pass each
/// other, in edges.
const UNTANGLE_ROUNDS: usize = 300;
const UNTANGLE_PASSING: usize = 4;
/// Rounds without progress after which the rest is left to dynamics.
const UNTANGLE_PATIENCE: usize = 40;

/// Takes cloth that crosses itself apart: turns of `shorten`, which moves the
/// points of crossings towards each other's end and returns them, and of one
/// iteration of [`preassemble`], without repulsion near the crossings.
/// Returns how many points still cross; `x` is that of the best round.
pub fn untangle(
    garment: &GarmentMesh,
    x: &mut Vec<[f64; 3]>,
    body: BodyField<'_>,
    settings: &AssembleSettings,
    shorten: &mut dyn FnMut(&mut [[f64; 3]]) -> Vec<u32>,
) -> usize {
    let sheet = Sheet::new(garment);
    let kept = Hold::new(garment, &settings.kept, &garment.points_initial);
    let extra = point_clearance(garment, settings);
    let field = |i: usize, p: [f64; 3]| further_out(body(p), &extra, i);
    let mut guard = BodyGuard::new(x, &field, settings.clearance);
    let mut repel = Repel::new(garment);
    let work = Relax {
        sheet: &sheet,
        settings,
        hang: None,
        hold: &kept,
    };
    let mut best = (usize::MAX, Vec::new());
    let mut stale = 0;
    for _ in 0..UNTANGLE_ROUNDS {
        let before = x.clone();
        let mut crossed = shorten(x);
        crossed.sort_unstable();
        crossed.dedup();
        if crossed.len() < best.0 {
            best = (crossed.len(), before);
            stale = 0;
        }
        stale += 1;
        if crossed.is_empty() || stale > UNTANGLE_PATIENCE {
            break;
        }
        for _ in 0..UNTANGLE_PASSING {
            crossed = sheet.grown(&crossed);
        }
        repel.set_passing(&crossed);
        work.run(x, &mut guard, &mut repel, 1);
    }
    *x = best.1;
    best.0
}

/// Further clearance of every point; empty without any.
fn point_clearance(mesh: &GarmentMesh, settings: &AssembleSettings) -> Vec<f64> {
    let of_panel = &settings.panel_clearance;
    if of_panel.iter().all(|c| *c == 0.0) {
        return Vec::new();
    }
    let mut extra = vec![0.0_f64; mesh.points_initial.len()];
    for (t, &panel) in mesh.triangles.iter().zip(&mesh.panel_of_triangle) {
        let own = of_panel.get(panel as usize).copied().unwrap_or(0.0);
        for &p in t {
            extra[p as usize] = extra[p as usize].max(own);
        }
    }
    extra
}

/// A larger clearance is a body that is as much nearer.
fn further_out(
    (distance, normal): (f64, [f64; 3]),
    extra: &[f64],
    point: usize,
) -> (f64, [f64; 3]) {
    let extra = extra.get(point).copied().unwrap_or(0.0);
    (distance - extra, normal)
}

/// Lets hanging panels fall when a limb is in their way: without the limb,
/// the heights of held edges kept. Returns the iterations spent.
fn fall(
    mesh: &GarmentMesh,
    x: &mut [[f64; 3]],
    body: BodyField<'_>,
    settings: &AssembleSettings,
    iterations: usize,
) -> usize {
    let hang = Hang::new(mesh, &settings.hanging);
    if !hang.any() {
        return 0;
    }
    let Some(trunk) = leg_room(mesh).and_then(|(low, high)| Trunk::new(body, low, high)) else {
        return 0;
    };
    if !hang.must_fall(x, &trunk) {
        return 0;
    }
    let extra = point_clearance(mesh, settings);
    let field = |point: usize, p: [f64; 3]| {
        if hang.falls(point) && trunk.in_limb(p) {
            (CELL_AWAY, [0.0; 3])
        } else {
            further_out(body(p), &extra, point)
        }
    };
    let mut guard = BodyGuard::new(x, &field, settings.clearance);
    let mut repel = Repel::new(mesh);
    let sheet = Sheet::new(mesh);
    let kept = Hold::new(mesh, &settings.kept, &mesh.points_initial);
    // First find the height at which the garment fits, then hold it there.
    let mut work = Relax {
        sheet: &sheet,
        settings,
        hang: None,
        hold: &kept,
    };
    let fitting = work.run(x, &mut guard, &mut repel, iterations / 3);
    let hold = Hold::new(mesh, &settings.held, x).and(&kept);
    (work.hang, work.hold) = (Some(&hang), &hold);
    let falling = work.run(x, &mut guard, &mut repel, iterations);
    fitting.iterations + falling.iterations
}

/// Distance reported near a limb that is to be ignored: within this nothing
/// else of the body is close [m].
const CELL_AWAY: f64 = 0.02;

/// The region below the garment's top where a body's limbs may hang: from
/// the ground (`y = 0`, or the garment's lowest point) up.
fn leg_room(mesh: &GarmentMesh) -> Option<([f64; 3], [f64; 3])> {
    let (mut low, mut high) = mesh.pattern.bounds()?;
    low[1] = low[1].min(0.0);
    for k in [0, 2] {
        low[k] -= 0.1;
        high[k] += 0.1;
    }
    Some((low, high))
}

fn measure(mesh: &GarmentMesh, x: &[[f64; 3]], body: BodyField<'_>, report: &mut AssembleReport) {
    let mut strains = Vec::with_capacity(3 * mesh.triangles.len());
    for (t, m) in mesh.triangles.iter().zip(&mesh.material) {
        for k in 0..3 {
            let j = (k + 1) % 3;
            let rest = crate::math::dist2(m[k], m[j]);
            let now = crate::math::dist(x[t[k] as usize], x[t[j] as usize]);
            let strain = now / rest - 1.0;
            report.stretch_max = report.stretch_max.max(strain);
            report.compression_max = report.compression_max.max(-strain);
            strains.push(strain.abs());
        }
    }
    strains.sort_by(f64::total_cmp);
    if !strains.is_empty() {
        report.strain_mean = strains.iter().sum::<f64>() / strains.len() as f64;
        report.strain_percentiles =
            [0.5, 0.9, 0.99].map(|q| strains[((strains.len() - 1) as f64 * q) as usize]);
    }
    for &p in x {
        let d = body(p).0;
        if d < 0.0 {
            report.points_inside += 1;
            report.depth_max = report.depth_max.max(-d);
        }
    }
}
