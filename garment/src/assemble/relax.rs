//! Position-based relaxation of one level.

use super::AssembleSettings;
use super::repel::Repel;
use super::sheet::{Link, Sheet};
use super::trunk::Trunk;
use crate::GarmentMesh;
use crate::math::{dist, norm, scale, sub};
use crate::place::BodyGuard;

/// Part of the last move that is repeated: heavy-ball acceleration, which
/// spreads corrections over the sheet in a number of iterations proportional
/// to its width instead of its square.
const MOMENTUM: f64 = 0.9;
/// Largest move of a point per iteration, in edge lengths.
const MAX_MOVE: f64 = 0.25;
/// Share of the error that is corrected: stretched and compressed edges, and
/// folded corners. Cloth hardly stretches but buckles.
const STRETCHED: f64 = 0.8;
const COMPRESSED: f64 = 0.3;
const FOLDED: f64 = 0.25;
/// Opposite corners are pushed apart below this part of their flat distance.
const FOLD_LIMIT: f64 = 0.85;
/// Iterations between measurements.
const STRIDE: usize = 10;

/// Fall per iteration of hanging points, in edge lengths; with the momentum
/// they reach ten times this.
const FALL: f64 = 0.006;

/// Points that fall.
pub(super) struct Hang {
    falls: Vec<bool>,
}

impl Hang {
    /// Points of panels with one of these labels and of no other panel.
    pub(super) fn new(mesh: &GarmentMesh, labels: &[String]) -> Self {
        let hangs: Vec<bool> = mesh
            .panels
            .iter()
            .map(|p| p.label.as_ref().is_some_and(|l| labels.contains(l)))
            .collect();
        let mut falls = vec![true; mesh.points_initial.len()];
        for (t, &p) in mesh.triangles.iter().zip(&mesh.panel_of_triangle) {
            if !hangs[p as usize] {
                for &v in t {
                    falls[v as usize] = false;
                }
            }
        }
        Self { falls }
    }

    pub(super) fn any(&self) -> bool {
        self.falls.contains(&true)
    }

    /// Whether a limb is in the way: in front of or behind a placed point.
    pub(super) fn must_fall(&self, points: &[[f64; 3]], trunk: &Trunk) -> bool {
        let mut falling = self.falls.iter().zip(points);
        falling.any(|(&falls, p)| falls && trunk.limb_behind(p[0], p[1]))
    }

    pub(super) fn falls(&self, point: usize) -> bool {
        self.falls[point]
    }
}

/// Points that keep their height.
pub(super) struct Hold {
    heights: Vec<(u32, f64)>,
}

impl Hold {
    /// Points of edges with these labels, at their present height.
    pub(super) fn new(mesh: &GarmentMesh, labels: &[String], x: &[[f64; 3]]) -> Self {
        let mut points: Vec<u32> = labels
            .iter()
            .filter_map(|l| mesh.labels.get(l))
            .flatten()
            .copied()
            .collect();
        points.sort_unstable();
        points.dedup();
        Self {
            heights: points.into_iter().map(|p| (p, x[p as usize][1])).collect(),
        }
    }

    /// Both.
    pub(super) fn and(&self, other: &Self) -> Self {
        let heights = self.heights.iter().chain(&other.heights);
        Self {
            heights: heights.copied().collect(),
        }
    }
}

/// Iterations between repulsions of layers.
const REPEL_STRIDE: usize = 3;

/// How a level ended.
pub(super) struct Relaxed {
    pub iterations: usize,
    pub converged: bool,
}

/// A relaxation and what it heeds.
pub(super) struct Relax<'a> {
    pub sheet: &'a Sheet,
    pub settings: &'a AssembleSettings,
    pub hang: Option<&'a Hang>,
    pub hold: &'a Hold,
}

impl Relax<'_> {
    /// Relaxes `x` in place.
    pub(super) fn run(
        &self,
        x: &mut [[f64; 3]],
        guard: &mut BodyGuard<'_>,
        repel: &mut Repel,
        iterations: usize,
    ) -> Relaxed {
        let Self {
            sheet,
            settings,
            hang,
            hold,
        } = *self;
        let limit = MAX_MOVE * sheet.edge_length;
        let mut previous = x.to_vec();
        let mut best = (f64::MAX, f64::MAX);
        let mut stale = 0;
        for iteration in 0..iterations {
            for i in 0..x.len() {
                let start = x[i];
                for k in 0..3 {
                    x[i][k] += MOMENTUM * (start[k] - previous[i][k]);
                }
                previous[i] = start;
            }
            if let Some(hang) = hang {
                for i in 0..x.len() {
                    if hang.falls[i] {
                        x[i][1] -= FALL * sheet.edge_length;
                    }
                }
            }
            let forward = iteration % 2 == 0;
            sweep(&sheet.edges, x, forward, |l, rest| {
                let error = l - rest;
                error * if error > 0.0 { STRETCHED } else { COMPRESSED }
            });
            sweep(&sheet.across, x, forward, |l, rest| {
                (l - FOLD_LIMIT * rest).min(0.0) * FOLDED
            });
            sweep(&sheet.ties, x, forward, |l, _| 0.5 * l);
            if iteration % REPEL_STRIDE == 0 {
                repel.apply(x);
            }
            for &(i, height) in &hold.heights {
                x[i as usize][1] = height;
            }
            for i in 0..x.len() {
                let step = sub(x[i], previous[i]);
                let length = norm(step);
                if length > limit {
                    let short = scale(step, limit / length);
                    for k in 0..3 {
                        x[i][k] = previous[i][k] + short[k];
                    }
                }
                guard.keep_out(i, &mut x[i]);
            }
            if hang.is_none() && iteration % STRIDE == STRIDE - 1 {
                let strain = tension(&sheet.edges, x);
                if strain.0 < settings.target_strain {
                    return Relaxed {
                        iterations: iteration + 1,
                        converged: true,
                    };
                }
                let progress = 1.0 - settings.stagnation;
                if strain.0 < best.0 * progress || strain.1 < best.1 * progress {
                    stale = 0;
                } else {
                    stale += 1;
                    if stale >= settings.patience {
                        return Relaxed {
                            iterations: iteration + 1,
                            converged: false,
                        };
                    }
                }
                best = (best.0.min(strain.0), best.1.min(strain.1));
            }
        }
        Relaxed {
            iterations,
            converged: false,
        }
    }
}

/// Moves both ends of each link by half of `correction(length, rest)`.
fn sweep(links: &[Link], x: &mut [[f64; 3]], forward: bool, correction: impl Fn(f64, f64) -> f64) {
    let mut apply = |link: &Link| {
        let [i, j] = link.ends.map(|v| v as usize);
        let d = sub(x[j], x[i]);
        let l = norm(d);
        let c = correction(l, link.rest);
        if c == 0.0 || l.is_nan() || l <= 1e-12 {
            return;
        }
        let s = 0.5 * c / l;
        for k in 0..3 {
            x[i][k] += s * d[k];
            x[j][k] -= s * d[k];
        }
    };
    if forward {
        links.iter().for_each(&mut apply);
    } else {
        links.iter().rev().for_each(&mut apply);
    }
}

/// Largest and root-mean-square tensile strain.
fn tension(edges: &[Link], x: &[[f64; 3]]) -> (f64, f64) {
    let (mut largest, mut sum) = (0.0f64, 0.0);
    for e in edges {
        let [i, j] = e.ends.map(|v| v as usize);
        let s = (dist(x[i], x[j]) / e.rest - 1.0).max(0.0);
        largest = largest.max(s);
        sum += s * s;
    }
    (largest, (sum / edges.len().max(1) as f64).sqrt())
}
