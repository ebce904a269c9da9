use std::f64::consts::PI;

use super::Sewn;
use crate::vec3::{V, perpendicular};
use crate::{NONE, YarnNetwork};

/// Sharpest turn of a yarn that laying leaves: 105°.
const TURN: f64 = 105.0 / 180.0 * PI;
/// Share of a turn's correction made in a round: less than 1, since turns
/// follow the lengths.
const EASE: f64 = 0.5;
/// Mobility of a rod's node, that of others being 1.
const ROD: f64 = 0.2;
/// Strain of a segment that counts as none \[1\].
const STRAIN: f64 = 5e-4;
/// Shortest arc that a segment at a rod is left with, in yarn radii.
const LEAST_ARC: f64 = 0.25;

/// What settling left.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Settled {
    /// Rounds made.
    pub rounds: usize,
    /// Largest strain of a segment before, in absolute value \[1\].
    pub strain_before: f64,
    /// Largest strain of a segment after, rods left out.
    pub strain: f64,
    /// Turns of a yarn beyond 108° before.
    pub sharp_before: usize,
    /// Turns beyond 108° after.
    pub sharp: usize,
    /// Largest way of a node \[m\].
    pub moved: f64,
}

impl Sewn {
    /// Moves nodes so that every segment has its rest length and no yarn turns
    /// back.
    ///
    /// A surface in space is not isometric to its panels: it is stretched where
    /// it was pulled over a body, and ends of yarns were drawn to rods. A knit
    /// gives way by bending its loops, the yarn itself hardly stretches. So
    /// lengths of segments are projected one after the other, in a fixed order,
    /// from the places as laid:
    ///
    /// ```text
    /// |x_b − x_a| = arc_b − arc_a,      |x_c − x_a|² ≥ l₁² + l₂² + 2 l₁ l₂ cos 105°
    /// ```
    /// In the last third of at most `rounds` rounds only lengths count: where a
    /// border leaves no room for both, a turn stays. Then segments that end at
    /// a rod get the length that they have, and rods theirs times `slack`.
    pub fn settle(&mut self, rounds: usize, slack: f64) -> Settled {
        let mut rods = vec![false; self.network.nodes()];
        for rod in &self.rods {
            for s in self.network.along(rod.yarn) {
                rods[self.network.strands[s as usize].node as usize] = true;
            }
        }
        let own: Vec<u32> = self.rods.iter().map(|r| r.yarn).collect();
        let network = &mut self.network;
        let mut settled = settle(network, &rods, &own, rounds, slack);
        fit_ends(network, &rods, &own, slack);
        let left = network
            .segments()
            .filter(|[a, _]| !own.contains(&network.strands[*a as usize].yarn));
        settled.strain = left.map(|s| strain(network, s)).fold(0.0, f64::max);
        settled
    }
}

fn strain(network: &YarnNetwork, ends: [u32; 2]) -> f64 {
    let [a, b] = ends.map(|s| &network.strands[s as usize]);
    let [x, y] = [a, b].map(|s| V::from(network.points[s.node as usize]));
    ((y - x).norm() / (b.arc - a.arc) - 1.0).abs()
}

fn settle(
    network: &mut YarnNetwork,
    rods: &[bool],
    own: &[u32],
    rounds: usize,
    slack: f64,
) -> Settled {
    let segments: Vec<(usize, usize, f64)> = (network.segments())
        .map(|[a, b]| {
            let [a, b] = [a, b].map(|s| &network.strands[s as usize]);
            let slack = if own.contains(&a.yarn) { slack } else { 1.0 };
            (a.node as usize, b.node as usize, (b.arc - a.arc) / slack)
        })
        .collect();
    let turns: Vec<[usize; 3]> = (network.strands.iter())
        .filter(|s| s.prev != NONE && s.next != NONE)
        .map(|s| {
            let node = |s: u32| network.strands[s as usize].node as usize;
            [node(s.prev), s.node as usize, node(s.next)]
        })
        .collect();
    let mut x: Vec<V> = network.points.iter().map(|p| V::from(*p)).collect();
    let start = x.clone();
    let mobility: Vec<f64> = rods.iter().map(|r| if *r { ROD } else { 1.0 }).collect();
    let mut settled = Settled {
        strain_before: worst_strain(&x, &segments),
        sharp_before: sharp(&x, &turns),
        ..Settled::default()
    };
    for round in 0..rounds {
        let mut worst: f64 = 0.0;
        if 3 * round < 2 * rounds {
            for t in &turns {
                worst = worst.max(ease(&mut x, &mobility, *t));
            }
        }
        for &(i, j, rest) in &segments {
            worst = worst.max(project(&mut x, &mobility, i, j, rest));
        }
        settled.rounds = round + 1;
        if worst < STRAIN {
            break;
        }
    }
    settled.sharp = sharp(&x, &turns);
    let ways = x.iter().zip(&start).map(|(a, b)| (a - b).norm());
    settled.moved = ways.fold(0.0, f64::max);
    for (p, x) in network.points.iter_mut().zip(&x) {
        *p = (*x).into();
    }
    settled
}

/// Gives segments at rods the lengths that they have.
fn fit_ends(network: &mut YarnNetwork, rods: &[bool], own: &[u32], slack: f64) {
    for y in 0..network.yarns.len() as u32 {
        let (is_rod, strands) = (own.contains(&y), network.along(y).collect::<Vec<_>>());
        let material = network.yarns[y as usize].material as usize;
        let least = LEAST_ARC * network.materials[material].radius;
        let (mut shift, mut last) = (0.0, (0.0, 0usize));
        for (k, s) in strands.iter().enumerate() {
            let strand = &network.strands[*s as usize];
            let (arc, node) = (strand.arc, strand.node as usize);
            if k > 0 && (rods[node] || rods[last.1]) {
                let apart = V::from(network.points[node]) - V::from(network.points[last.1]);
                let length = if is_rod { slack } else { 1.0 } * apart.norm();
                shift += length.max(least) - (arc - last.0);
            }
            last = (arc, node);
            network.strands[*s as usize].arc += shift;
        }
    }
}

/// Moves two nodes to their distance; the strain that there was.
fn project(x: &mut [V], mobility: &[f64], i: usize, j: usize, rest: f64) -> f64 {
    let d = x[j] - x[i];
    let length = d.norm();
    if length < 1e-12 {
        return 1.0;
    }
    let over = length - rest;
    let step = d * (over / (length * (mobility[i] + mobility[j])));
    x[i] += mobility[i] * step;
    x[j] -= mobility[j] * step;
    (over / rest).abs()
}

/// Moves the ends of a sharp turn apart; 1 if it was beyond 108°.
fn ease(x: &mut [V], mobility: &[f64], [a, b, c]: [usize; 3]) -> f64 {
    let (d, e) = (x[b] - x[a], x[c] - x[b]);
    let (l, m) = (d.norm(), e.norm());
    if l < 1e-12 || m < 1e-12 || d.dot(&e) >= TURN.cos() * l * m {
        return 0.0;
    }
    let goal = (l * l + m * m + 2.0 * l * m * TURN.cos()).sqrt();
    let apart = x[c] - x[a];
    let length = apart.norm();
    // Folded back upon itself: the ends lie in one place, any way apart does.
    let along = if length > 1e-9 * goal {
        apart / length
    } else {
        perpendicular(d / l)
    };
    let step = along * (EASE * (goal - length) / (mobility[a] + mobility[c]));
    x[a] -= mobility[a] * step;
    x[c] += mobility[c] * step;
    // Slightly beyond is near enough.
    let limit = (0.6 * PI).cos();
    f64::from(u8::from(d.dot(&e) < limit * l * m))
}

fn worst_strain(x: &[V], segments: &[(usize, usize, f64)]) -> f64 {
    let strain = |(i, j, rest): &(usize, usize, f64)| ((x[*j] - x[*i]).norm() / rest - 1.0).abs();
    segments.iter().map(strain).fold(0.0, f64::max)
}

fn sharp(x: &[V], turns: &[[usize; 3]]) -> usize {
    let limit = (0.6 * PI).cos();
    let sharp = |[a, b, c]: &&[usize; 3]| {
        let (d, e) = (x[*b] - x[*a], x[*c] - x[*b]);
        d.dot(&e) < limit * d.norm() * e.norm()
    };
    turns.iter().filter(sharp).count()
}
