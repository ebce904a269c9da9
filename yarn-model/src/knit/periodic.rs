//! Loops at rest in fabric without borders.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use selvedge_energy::{Batch, Curvature, DofLayout, EnergyBatch, EvalPoint};

use super::{KnitOptions, Knitted, knitted};
use crate::chart::StitchPattern;
use crate::force::LOOSE;
use crate::{
    JammingBending, NodeContact, ParallelYarns, StitchLength, StitchWrapping, YarnError,
    YarnNetwork, YarnStretch,
};

/// Repeats of the sample across and upwards; the middle one counts.
const REPEATS: usize = 5;
/// Largest change of an unknown in one iteration, in yarn radii.
const STRIDE: f64 = 0.1;
/// Iterations of one pass.
const ITERATIONS: usize = 3000;
/// Passes: stiffnesses of yarns side by side follow the lengths found.
const PASSES: usize = 12;
/// Largest force at rest [N].
const AT_REST: f64 = 1e-10;
/// First stiffness added to the matrix [N/m], and the least.
const SHIFT: [f64; 2] = [1e3, 1e-9];
/// Tilt of the wings that picks the sides on which loops come to rest, in yarn
/// radii: flat loops may be balanced.
const TILT: f64 = 1e-3;

/// How loops came to rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoopsAtRest {
    /// Iterations of Newton's method, all passes.
    pub iterations: usize,
    /// Passes.
    pub passes: usize,
    /// Energy of one loop as laid [J].
    pub energy_laid: f64,
    /// Energy of one loop at rest [J].
    pub energy: f64,
    /// Largest unbalanced force [N].
    pub force: f64,
    /// Least stiffness of the repeat but for the motions that cost nothing
    /// [N/m]; negative at a saddle.
    pub stiffness: f64,
}

impl KnitOptions {
    /// Loops of a pattern at rest: a minimum of the energy of its smallest
    /// repeating rectangle in fabric that goes on for ever, flat as a whole.
    ///
    /// Unknowns are the nodes and arc lengths of one repeat and its two side
    /// lengths; all other nodes are images of its own. Rows are taken in pairs,
    /// so that yarns run the same way in every image. Newton's method with
    /// exact second derivatives, a shifted matrix and a line search on the
    /// energy starts from the loops as laid and moves no unknown by more than a
    /// tenth of the yarn's radius at once, so that it ends in the minimum
    /// downhill of them.
    ///
    /// Rest lengths of contacts stay those of `self`, and so does the spacing
    /// of yarns side by side ([`YarnMaterial::spacing`](crate::YarnMaterial)).
    ///
    /// # Errors
    /// [`YarnError::Parameter`] for a pattern that increases or decreases, and
    /// where no rest was found.
    pub fn at_rest(&self, pattern: &StitchPattern) -> Result<(Self, LoopsAtRest), YarnError> {
        let rows = pattern.rows().max(1);
        let repeat = [
            pattern.multiple().max(1),
            if rows.is_multiple_of(2) {
                rows
            } else {
                2 * rows
            },
        ];
        let size = repeat.map(|n| REPEATS * n);
        let chart = pattern
            .chart_of(size[0] + pattern.plus(), size[1])
            .map_err(|_| refused("repeats in the sample of a knit", 0.0))?;
        let mut options = self.clone();
        if options.material.spacing.is_none() {
            let between = LOOSE * self.template.arcs[super::template::HEAD];
            options.material.spacing = Some(between.min(2.0 * self.material.radius));
        }
        let mut report = LoopsAtRest::default();
        loop {
            let Knitted { network, map } = knitted(&chart, &options)?;
            let mut cell = Cell::new(&network, repeat)?;
            let tilt = if report.passes == 0 { TILT } else { 0.0 };
            let laid = cell.start(&network, tilt * self.material.radius);
            let before = report.energy;
            let most = STRIDE * self.material.radius;
            cell.minimise(most, &mut report)?;
            report.passes += 1;
            let loops = (repeat[0] * repeat[1]) as f64;
            report.energy /= loops;
            if report.passes == 1 {
                report.energy_laid = laid / loops;
            }
            let (points, arcs) = cell.places();
            let node = |s: u32| network.strands[s as usize].node;
            options = Self {
                material: options.material.clone(),
                template: self.template.clone(),
                cells: None,
            }
            .measured(&map, repeat, node, points.as_chunks::<3>().0, arcs)?;
            let settled = (report.energy - before).abs() <= 1e-12 * before.abs();
            if settled || report.passes == PASSES {
                return Ok((options, report));
            }
        }
    }
}

fn refused(what: &'static str, value: f64) -> YarnError {
    YarnError::Parameter {
        what,
        value,
        allowed: "one loop to each parent",
    }
}

/// A node or arc length of the sample as an image of one of the repeat: its
/// first unknown, and how many repeats it is away; `None` at the border.
type Image = Option<(usize, [f64; 2])>;

/// The middle repeat of a sample and its images.
struct Cell {
    terms: Vec<(Box<dyn EnergyBatch>, Vec<usize>)>,
    layout: DofLayout,
    points: Vec<Image>,
    scalars: Vec<Image>,
    /// Arc lengths as laid: the unknowns are what they change by [m].
    arcs: Vec<f64>,
    /// Unknowns of the sample.
    q: Vec<f64>,
    /// Unknowns of the repeat: nodes, changes of arc lengths, side lengths.
    y: Vec<f64>,
}

impl Cell {
    fn new(network: &YarnNetwork, [across, up]: [usize; 2]) -> Result<Self, YarnError> {
        let nodes = network.nodes();
        let mut keys: BTreeMap<[usize; 4], usize> = BTreeMap::new();
        let mut image_of = |node: usize| -> Option<(usize, [i64; 2])> {
            let (NodeContact::StitchA(c) | NodeContact::StitchB(c)) = network.contacts[node] else {
                return None;
            };
            let contact = &network.stitches[c as usize];
            let (row, column) = (contact.row as usize, contact.column as usize);
            // The bind-off is no image.
            if row >= REPEATS * up {
                return None;
            }
            let side = usize::from(contact.side > 0);
            let inner = usize::from(contact.b as usize == node);
            let next = keys.len();
            let key = *keys
                .entry([row % up, column % across, side, inner])
                .or_insert(next);
            Some((key, [(column / across) as i64, (row / up) as i64]))
        };
        let middle = (REPEATS / 2) as i64;
        let images: Vec<_> = (0..nodes).map(&mut image_of).collect();
        let own = keys.len();
        // Strands of the repeat's nodes, counted in the middle.
        let mut first = vec![usize::MAX; own];
        let mut count = 3 * own;
        for (node, image) in images.iter().enumerate() {
            if let Some((key, offset)) = image
                && *offset == [middle; 2]
            {
                first[*key] = count;
                count += network.strands_of(node as u32).len();
            }
        }
        if own != 4 * across * up || first.contains(&usize::MAX) {
            return Err(refused("nodes in the repeat of a knit", own as f64));
        }
        let away = |offset: [i64; 2]| offset.map(|o| (o - middle) as f64);
        let points = images.iter().map(|i| i.map(|(k, o)| (3 * k, away(o))));
        let mut scalars: Vec<Image> = vec![None; network.strands.len()];
        for (node, image) in images.iter().enumerate() {
            let Some((key, offset)) = image else { continue };
            for (k, s) in network.strands_of(node as u32).enumerate() {
                scalars[s as usize] = Some((first[*key] + k, away(*offset)));
            }
        }
        let points: Vec<Image> = points.collect();
        let batches: Vec<Box<dyn EnergyBatch>> = vec![
            Box::new(Batch::new("yarn stretch", YarnStretch::new(network))),
            Box::new(Batch::new("yarn bending", JammingBending::new(network))),
            Box::new(Batch::new("stitch wrapping", StitchWrapping::new(network))),
            Box::new(Batch::new("parallel yarns", ParallelYarns::new(network))),
            Box::new(Batch::new("stitch length", StitchLength::new(network))),
        ];
        let terms = batches.into_iter().map(|batch| {
            let mine = |e: &usize| {
                let image = match batch.node_dims()[0] {
                    3 => points[batch.nodes(*e)[0] as usize],
                    _ => scalars[batch.nodes(*e)[0] as usize],
                };
                image.is_some_and(|(_, away)| away == [0.0; 2])
            };
            let own: Vec<usize> = (0..batch.len()).filter(mine).collect();
            (batch, own)
        });
        Ok(Self {
            terms: terms.collect(),
            layout: DofLayout {
                points: nodes,
                scalars: network.strands.len(),
            },
            points,
            scalars,
            arcs: network.arcs(),
            q: Vec::new(),
            y: vec![0.0; count + 2],
        })
    }

    /// Takes the places of the middle repeat and the side lengths of the
    /// sample as laid, heads tilted by `tilt` [m]; returns the energy [J].
    fn start(&mut self, network: &YarnNetwork, tilt: f64) -> f64 {
        let sides = self.y.len() - 2;
        self.q = network.points.as_flattened().to_vec();
        self.q.extend(&self.arcs);
        for (node, image) in self.points.iter().enumerate() {
            let Some((at, away)) = *image else { continue };
            let x = network.points[node];
            if away == [0.0; 2] {
                self.y[at..at + 3].copy_from_slice(&x);
                let inner = matches!(network.contacts[node], NodeContact::StitchB(_));
                self.y[at + 2] += if inner { tilt } else { -tilt };
            }
        }
        for (node, image) in self.points.iter().enumerate() {
            let Some((at, away)) = *image else { continue };
            for k in 0..2 {
                if away[k] == 1.0 && away[1 - k] == 0.0 {
                    self.y[sides + k] = network.points[node][k] - self.y[at + k];
                }
            }
        }
        let y = self.y.clone();
        self.value(&y)
    }

    /// Fills the sample from a repeat.
    fn spread(&mut self, y: &[f64]) {
        let sides = y.len() - 2;
        for (node, image) in self.points.iter().enumerate() {
            let Some((at, away)) = *image else { continue };
            for k in 0..3 {
                let shift = if k < 2 { away[k] * y[sides + k] } else { 0.0 };
                self.q[3 * node + k] = y[at + k] + shift;
            }
        }
        let first = 3 * self.layout.points;
        for (s, image) in self.scalars.iter().enumerate() {
            if let Some((at, _)) = image {
                self.q[first + s] = self.arcs[s] + y[*at];
            }
        }
    }

    fn value(&mut self, y: &[f64]) -> f64 {
        self.spread(y);
        let at = point(self.layout, &self.q);
        let sums = self.terms.iter().map(|(batch, own)| {
            let values = own.iter().map(|e| batch.value(&at, *e..e + 1));
            values.sum::<f64>()
        });
        sums.sum()
    }

    /// Energy, its gradient and second derivative by the unknowns of the
    /// repeat.
    fn evaluate(&mut self, y: &[f64]) -> (f64, DVector<f64>, DMatrix<f64>) {
        self.spread(y);
        let (n, sides) = (y.len(), y.len() - 2);
        let at = point(self.layout, &self.q);
        let (mut value, mut gradient) = (0.0, DVector::zeros(n));
        let mut hessian = DMatrix::zeros(n, n);
        for (batch, own) in &self.terms {
            let m = batch.local_dim();
            let (mut g, mut h) = (vec![0.0; m], vec![0.0; m * m]);
            // Unknowns that a local one depends on, and how.
            let mut depends: Vec<[(usize, f64); 2]> = Vec::with_capacity(m);
            for e in own {
                value += batch.hessians(&at, Curvature::Exact, *e..e + 1, &mut g, &mut h);
                depends.clear();
                for (&node, &dim) in batch.nodes(*e).iter().zip(batch.node_dims()) {
                    let image = match dim {
                        3 => self.points[node as usize],
                        _ => self.scalars[node as usize],
                    };
                    // Nothing of the middle reaches the border.
                    let Some((first, away)) = image else { continue };
                    for k in 0..dim {
                        let side = if dim == 3 && k < 2 { away[k] } else { 0.0 };
                        depends.push([(first + k, 1.0), (sides + k.min(1), side)]);
                    }
                }
                for (i, of_i) in depends.iter().enumerate() {
                    for &(a, wa) in of_i {
                        gradient[a] += wa * g[i];
                        if wa == 0.0 {
                            continue;
                        }
                        for (j, of_j) in depends.iter().enumerate() {
                            for &(b, wb) in of_j {
                                hessian[(a, b)] += wa * wb * h[i * m + j];
                            }
                        }
                    }
                }
            }
        }
        (value, gradient, hessian)
    }

    fn minimise(&mut self, stride: f64, report: &mut LoopsAtRest) -> Result<(), YarnError> {
        let [mut shift, least] = SHIFT;
        let mut y = self.y.clone();
        for _ in 0..ITERATIONS {
            let (value, gradient, hessian) = self.evaluate(&y);
            report.energy = value;
            report.force = gradient.amax();
            if report.force < AT_REST {
                self.y = y.clone();
                self.spread(&y);
                report.stiffness = least_stiffness(hessian);
                return Ok(());
            }
            report.iterations += 1;
            let mut found = false;
            while shift < 1e9 {
                let mut matrix = hessian.clone();
                (0..y.len()).for_each(|i| matrix[(i, i)] += shift);
                let Some(factor) = matrix.cholesky() else {
                    shift *= 4.0;
                    continue;
                };
                let mut step = factor.solve(&gradient);
                let longest = step.amax();
                if longest > stride {
                    step *= stride / longest;
                }
                let tried: Vec<f64> = y.iter().zip(&step).map(|(y, s)| y - s).collect();
                let gain = value - self.value(&tried);
                let foreseen = 0.5 * gradient.dot(&step);
                // Where energies are down to round-off, forces decide.
                let flat = gain.abs() <= 1e-13 * value.abs();
                if gain >= 1e-4 * foreseen
                    || (flat && self.evaluate(&tried).1.amax() < report.force)
                {
                    if flat || gain > 0.5 * foreseen {
                        shift = (shift / 3.0).max(least);
                    }
                    y = tried;
                    self.commit(&y);
                    found = true;
                    break;
                }
                shift *= 4.0;
            }
            if !found {
                break;
            }
        }
        Err(YarnError::NoRest {
            iterations: report.iterations,
            force: report.force,
        })
    }

    /// Lets angles go on from where they are.
    fn commit(&mut self, y: &[f64]) {
        self.spread(y);
        let at = point(self.layout, &self.q);
        for (batch, _) in &mut self.terms {
            batch.commit(&at);
        }
    }

    /// Nodes and arc lengths of the sample.
    fn places(&self) -> (&[f64], &[f64]) {
        self.q.split_at(3 * self.layout.points)
    }
}

/// Least eigenvalue beyond those of motions that cost nothing.
fn least_stiffness(hessian: DMatrix<f64>) -> f64 {
    let mut values: Vec<f64> = hessian
        .symmetric_eigen()
        .eigenvalues
        .iter()
        .copied()
        .collect();
    values.sort_by(f64::total_cmp);
    let scale = values.last().map_or(0.0, |v| 1e-10 * v);
    let real = values.iter().copied().filter(|v| v.abs() > scale);
    real.fold(f64::INFINITY, f64::min)
}

fn point(layout: DofLayout, q: &[f64]) -> EvalPoint<'_> {
    EvalPoint {
        layout,
        q,
        q_start: q,
        dt: 1.0,
    }
}
