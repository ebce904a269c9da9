//! Evaluation of terms in chunks, and the scatter of their derivatives.

mod elements;
mod mixed;

pub use mixed::MassEvaluation;
pub(crate) use mixed::{Patterns, Values};

use std::cell::RefCell;
use std::ops::Range;
use std::time::Instant;

use mixed::{MixedWork, Slots, SlotsOf, Stencils, add_local, touched};
use rayon::prelude::*;
use selvedge_energy::{Curvature, EnergyBatch, EvalPoint, MassBatch};
use selvedge_linsolve::{ChunkColouring, Pattern, Real, colour_chunks};

use crate::sink::{Plain, Shared, Sink};
use crate::{Ledger, PlanError, Term};

/// How threads share the arrays that they scatter into.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scatter {
    /// Chunks of stencils that share a point never run together: plain writes,
    /// same bits for any number of threads.
    #[default]
    Coloured,
    /// All chunks at once with atomic additions. The order of the sums depends
    /// on the threads; kept as a baseline.
    Atomics,
}

/// Settings of the assembly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AssemblyOptions {
    /// Scatter method.
    pub scatter: Scatter,
    /// Stencils in a chunk, the unit of parallel work, at least; a term has
    /// 48 chunks at most, since longer ones find more of what they write to in
    /// the cache.
    pub chunk: usize,
}

impl Default for AssemblyOptions {
    fn default() -> Self {
        Self {
            scatter: Scatter::Coloured,
            chunk: 128,
        }
    }
}

impl AssemblyOptions {
    /// Whether nobody else writes: one thread that need not show what atomics
    /// cost.
    fn alone(&self) -> bool {
        self.scatter == Scatter::Coloured && rayon::current_num_threads() == 1
    }

    fn shared<'a, T: Real>(&self, values: &'a mut [T]) -> Shared<'a, T> {
        Shared::new(values, self.scatter == Scatter::Atomics)
    }

    fn shared_matrix<'a, T: Real>(&self, values: Values<'a, T>) -> [Shared<'a, T>; 3] {
        [values.blocks, values.coupling, values.scalars].map(|v| self.shared(v))
    }

    fn validate(&self) -> Result<(), PlanError> {
        if self.chunk == 0 {
            return Err(PlanError::Setting {
                name: "chunk",
                value: 0.0,
                allowed: "at least 1",
            });
        }
        Ok(())
    }
}

/// Chunks of a term at most: enough for the threads of a workstation.
const CHUNKS: usize = 48;

/// Stencils evaluated by one virtual call: their local matrices stay in the
/// first-level cache.
const BLOCK: usize = 16;

/// Energy of one term [J], in the plan's order.
#[derive(Clone, Debug, PartialEq)]
pub struct TermEnergy {
    /// Name of the term.
    pub name: String,
    /// Energy [J].
    pub value: f64,
}

thread_local! {
    static SCRATCH: RefCell<[Vec<f64>; 2]> = const { RefCell::new([Vec::new(), Vec::new()]) };
}

/// Order of work on one term.
struct Schedule {
    colouring: ChunkColouring,
    /// Matrix slots of the pairs of every stencil, see [`slots`].
    slots: Vec<u32>,
    /// The same of stencils of points and scalars.
    mixed: Slots,
    values: Vec<f64>,
}

/// Evaluates the terms of a plan in parallel.
pub(crate) struct Assembler {
    options: AssemblyOptions,
    schedules: Vec<Schedule>,
    /// Inertia that couples unknowns.
    mass: Option<Schedule>,
}

impl Assembler {
    /// Colours the chunks of every term; `pattern` adds their matrix slots.
    pub(crate) fn new(
        points: usize,
        terms: &[Term],
        pattern: Option<&Pattern>,
        options: AssemblyOptions,
    ) -> Result<Self, PlanError> {
        options.validate()?;
        let mut schedules = Vec::with_capacity(terms.len());
        for term in terms {
            let batch = term.batch.as_ref();
            if batch.node_dims().iter().any(|d| *d != 3) {
                return Err(PlanError::Scalars {
                    term: batch.name().into(),
                });
            }
            let stencils = (0..batch.len()).map(|e| batch.nodes(e));
            let slots = pattern.map(|p| slots(batch, p)).unwrap_or_default();
            schedules.push(Schedule::new(points, stencils, slots, options));
        }
        Ok(Self {
            options,
            schedules,
            mass: None,
        })
    }

    /// For terms of points and scalars, and inertia that couples unknowns;
    /// `patterns` add their matrix slots.
    pub(crate) fn mixed(
        terms: &[Term],
        mass: Option<&dyn MassBatch>,
        (points, owners): (usize, &[u32]),
        patterns: Option<Patterns<'_>>,
        options: AssemblyOptions,
    ) -> Result<Self, PlanError> {
        options.validate()?;
        let schedule = |touched: Vec<u32>, width: usize, slots: Option<Slots>| {
            let groups = touched.chunks_exact(width.max(1));
            let mut schedule = Schedule::new(points, groups, Vec::new(), options);
            schedule.mixed = slots.unwrap_or_default();
            schedule
        };
        let of = |s: &dyn EnergyBatch| {
            let slots = patterns.map(|p| Slots::new(&s, p));
            schedule(touched(&s, owners), s.dims().len(), slots)
        };
        let of_mass = |s: &dyn MassBatch| {
            let slots = patterns.map(|p| Slots::new(&s, p));
            schedule(touched(&s, owners), s.dims().len(), slots)
        };
        Ok(Self {
            options,
            schedules: terms.iter().map(|t| of(t.batch.as_ref())).collect(),
            mass: mass.map(of_mass),
        })
    }

    /// Adds the inertia's part of the residual to `impulse`, and its matrix;
    /// returns the kinetic energy at the start of the step [J].
    pub(crate) fn add_mass<T: Real>(
        &mut self,
        mass: &MassEvaluation<'_>,
        impulse: &mut [f64],
        matrix: Option<(Patterns<'_>, Values<'_, T>)>,
        ledger: &mut Ledger,
    ) -> f64 {
        let Some(schedule) = &mut self.mass else {
            return 0.0;
        };
        let start = Instant::now();
        let slots = std::mem::take(&mut schedule.mixed);
        let of = |patterns| {
            Some(SlotsOf {
                slots: &slots,
                patterns,
            })
        };
        let stage = match matrix {
            None => {
                let out = self.options.shared(impulse);
                schedule.run(|range, scratch| {
                    let none = None::<&mut [Plain<'_, T>; 3]>;
                    mass.run(None, range, scratch, &mut out.clone(), none)
                });
                "forces: inertia"
            }
            Some((p, v)) if self.options.alone() => {
                let mut out = Plain(&mut *impulse);
                let mut matrix = [Plain(v.blocks), Plain(v.coupling), Plain(v.scalars)];
                schedule.run_alone(|range, scratch| {
                    mass.run(of(p), range, scratch, &mut out, Some(&mut matrix))
                });
                "assembly: inertia"
            }
            Some((p, v)) => {
                let out = self.options.shared(impulse);
                let matrix = self.options.shared_matrix(v);
                schedule.run(|range, scratch| {
                    let matrix = &mut matrix.clone();
                    mass.run(of(p), range, scratch, &mut out.clone(), Some(matrix))
                });
                "assembly: inertia"
            }
        };
        schedule.mixed = slots;
        ledger.book(stage, start.elapsed());
        schedule.sum()
    }

    /// As [`add_matrix`](Self::add_matrix) for terms of points and scalars.
    #[allow(clippy::too_many_arguments)]
    pub(crate) fn add_mixed<T: Real>(
        &mut self,
        terms: &[Term],
        at: &EvalPoint<'_>,
        curvature: Curvature,
        stiffness: f64,
        (patterns, values): (Patterns<'_>, Values<'_, T>),
        impulse: &mut [f64],
        energies: &mut [f64],
        ledger: &mut Ledger,
    ) {
        for ((term, schedule), energy) in terms.iter().zip(&mut self.schedules).zip(energies) {
            let start = Instant::now();
            let factor = if term.relaxed { stiffness } else { 1.0 };
            let slots = std::mem::take(&mut schedule.mixed);
            let work = MixedWork {
                batch: term.batch.as_ref(),
                at,
                curvature,
                factor,
                slots: Some(SlotsOf {
                    slots: &slots,
                    patterns,
                }),
            };
            let v = Values {
                blocks: &mut *values.blocks,
                coupling: &mut *values.coupling,
                scalars: &mut *values.scalars,
            };
            if self.options.alone() {
                let mut out = Plain(&mut *impulse);
                let mut matrix = [Plain(v.blocks), Plain(v.coupling), Plain(v.scalars)];
                schedule
                    .run_alone(|range, scratch| work.run(range, scratch, &mut out, &mut matrix));
            } else {
                let out = self.options.shared(impulse);
                let matrix = self.options.shared_matrix(v);
                schedule.run(|range, scratch| {
                    work.run(range, scratch, &mut out.clone(), &mut matrix.clone())
                });
            }
            schedule.mixed = slots;
            *energy = factor * schedule.sum();
            ledger.time_term("assembly", term.batch.name(), start.elapsed());
        }
    }

    /// Adds `−dt · factor · gradient` of every term to `impulse` and writes
    /// the energies.
    pub(crate) fn add_impulse(
        &mut self,
        terms: &[Term],
        at: &EvalPoint<'_>,
        stiffness: f64,
        impulse: &mut [f64],
        energies: &mut [f64],
        ledger: &mut Ledger,
    ) {
        for ((term, schedule), energy) in terms.iter().zip(&mut self.schedules).zip(energies) {
            let start = Instant::now();
            let factor = if term.relaxed { stiffness } else { 1.0 };
            let work = ForceWork {
                batch: term.batch.as_ref(),
                at,
                factor,
            };
            if self.options.alone() {
                let mut out = Plain(&mut *impulse);
                schedule.run_alone(|range, scratch| work.run(range, scratch, &mut out));
            } else {
                let out = self.options.shared(impulse);
                schedule.run(|range, scratch| work.run(range, scratch, &mut out.clone()));
            }
            *energy = factor * schedule.sum();
            ledger.book("forces", start.elapsed());
        }
    }

    /// As [`add_impulse`](Self::add_impulse), and adds `dt² · factor · hessian`
    /// to the blocks in `values` on and below the diagonal.
    #[allow(clippy::too_many_arguments)]
    pub(crate) fn add_matrix<T: Real>(
        &mut self,
        terms: &[Term],
        at: &EvalPoint<'_>,
        curvature: Curvature,
        stiffness: f64,
        (pattern, values): (&Pattern, &mut [T]),
        impulse: &mut [f64],
        energies: &mut [f64],
        ledger: &mut Ledger,
    ) {
        for ((term, schedule), energy) in terms.iter().zip(&mut self.schedules).zip(energies) {
            let start = Instant::now();
            let factor = if term.relaxed { stiffness } else { 1.0 };
            let slots = std::mem::take(&mut schedule.slots);
            let work = MatrixWork {
                forces: ForceWork {
                    batch: term.batch.as_ref(),
                    at,
                    factor,
                },
                curvature,
                pattern,
                slots: &slots,
            };
            if self.options.alone() {
                let (mut out, mut matrix) = (Plain(&mut *impulse), Plain(&mut *values));
                schedule
                    .run_alone(|range, scratch| work.run(range, scratch, &mut out, &mut matrix));
            } else {
                let (out, matrix) = (self.options.shared(impulse), self.options.shared(values));
                schedule.run(|range, scratch| {
                    work.run(range, scratch, &mut out.clone(), &mut matrix.clone())
                });
            }
            schedule.slots = slots;
            *energy = factor * schedule.sum();
            ledger.time_term("assembly", term.batch.name(), start.elapsed());
        }
    }

    pub(crate) fn heap_bytes(&self) -> usize {
        self.schedules
            .iter()
            .chain(&self.mass)
            .map(|s| {
                size_of_val(s.slots.as_slice())
                    + s.mixed.heap_bytes()
                    + s.colouring.chunks.len() * (size_of::<Range<u32>>() + 4 + 8)
            })
            .sum()
    }
}

impl Schedule {
    fn new<'a>(
        points: usize,
        stencils: impl ExactSizeIterator<Item = &'a [u32]>,
        slots: Vec<u32>,
        options: AssemblyOptions,
    ) -> Self {
        let chunk = options.chunk.max(stencils.len() / CHUNKS);
        let mut colouring = colour_chunks(points, stencils, chunk);
        if options.scatter == Scatter::Atomics {
            let all = (0..colouring.chunks.len() as u32).collect();
            colouring.colours = vec![all];
        }
        let values = vec![0.0; colouring.chunks.len()];
        Self {
            colouring,
            slots,
            mixed: Slots::default(),
            values,
        }
    }

    /// Runs `work` on every chunk, colour by colour, and keeps what it returns.
    fn run(&mut self, work: impl Fn(Range<usize>, &mut [Vec<f64>; 2]) -> f64 + Sync) {
        let chunks = &self.colouring.chunks;
        for colour in &self.colouring.colours {
            let one = |&c: &u32| {
                let r = &chunks[c as usize];
                let range = r.start as usize..r.end as usize;
                (c, SCRATCH.with_borrow_mut(|scratch| work(range, scratch)))
            };
            // A lone chunk is not worth a thread's wake-up.
            if colour.len() < 2 {
                for c in colour {
                    let (c, value) = one(c);
                    self.values[c as usize] = value;
                }
            } else {
                let done: Vec<(u32, f64)> = colour.par_iter().map(one).collect();
                for (c, value) in done {
                    self.values[c as usize] = value;
                }
            }
        }
    }

    /// The same chunks in the same order, for work that shares nothing.
    fn run_alone(&mut self, mut work: impl FnMut(Range<usize>, &mut [Vec<f64>; 2]) -> f64) {
        for &c in self.colouring.colours.iter().flatten() {
            let r = &self.colouring.chunks[c as usize];
            let range = r.start as usize..r.end as usize;
            self.values[c as usize] = SCRATCH.with_borrow_mut(|scratch| work(range, scratch));
        }
    }

    fn sum(&self) -> f64 {
        self.values.iter().sum()
    }
}

fn blocks(range: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    let end = range.end;
    range
        .step_by(BLOCK)
        .map(move |from| from..(from + BLOCK).min(end))
}

/// Slots below the diagonal of the pairs `a < b` of each stencil, row by row;
/// the diagonal's are found from the pattern.
fn slots(batch: &dyn EnergyBatch, pattern: &Pattern) -> Vec<u32> {
    let n = batch.node_dims().len();
    let mut all = Vec::with_capacity(batch.len() * n * (n - 1) / 2);
    for e in 0..batch.len() {
        let nodes = batch.nodes(e);
        for a in 0..n {
            for b in a + 1..n {
                let (row, column) = (nodes[a].max(nodes[b]), nodes[a].min(nodes[b]));
                let slot = pattern.slot(row, column);
                // The pattern is built from these very stencils.
                all.push(slot.expect("every pair of a stencil is in the pattern"));
            }
        }
    }
    all
}

/// Gradients of the chunks of one term.
struct ForceWork<'a> {
    batch: &'a dyn EnergyBatch,
    at: &'a EvalPoint<'a>,
    factor: f64,
}

impl ForceWork<'_> {
    fn run(
        &self,
        range: Range<usize>,
        [g, _]: &mut [Vec<f64>; 2],
        out: &mut impl Sink<f64>,
    ) -> f64 {
        let m = self.batch.local_dim();
        g.resize(BLOCK * m, 0.0);
        let mut value = 0.0;
        for block in blocks(range) {
            let g = &mut g[..block.len() * m];
            value += self.batch.gradients(self.at, block.clone(), g);
            self.scatter(block, g, out);
        }
        value
    }

    fn scatter(&self, block: Range<usize>, gradients: &[f64], out: &mut impl Sink<f64>) {
        let scale = -self.at.dt * self.factor;
        if self.batch.node_dims().iter().any(|d| *d != 3) {
            let points = self.at.layout.points;
            return add_local(&self.batch, points, block, gradients, scale, out);
        }
        let mut gradients = gradients.as_chunks::<3>().0.iter();
        for e in block {
            for (&node, g) in self.batch.nodes(e).iter().zip(&mut gradients) {
                out.add_point(node as usize, g, scale);
            }
        }
    }
}

/// Gradients and second derivatives of the chunks of one term.
struct MatrixWork<'a> {
    forces: ForceWork<'a>,
    curvature: Curvature,
    pattern: &'a Pattern,
    slots: &'a [u32],
}

impl MatrixWork<'_> {
    fn run<T: Real>(
        &self,
        range: Range<usize>,
        [g, h]: &mut [Vec<f64>; 2],
        out: &mut impl Sink<f64>,
        matrix: &mut impl Sink<T>,
    ) -> f64 {
        let ForceWork { batch, at, factor } = self.forces;
        let m = batch.local_dim();
        let scale = at.dt * at.dt * factor;
        g.resize(BLOCK * m, 0.0);
        h.resize(BLOCK * m * m, 0.0);
        let mut value = 0.0;
        for block in blocks(range) {
            let g = &mut g[..block.len() * m];
            let h = &mut h[..block.len() * m * m];
            value += batch.hessians(at, self.curvature, block.clone(), g, h);
            self.forces.scatter(block.clone(), g, out);
            match m {
                3 => self.scatter::<T>(block, h, (1, 3), scale, matrix),
                6 => self.scatter::<T>(block, h, (2, 6), scale, matrix),
                9 => self.scatter::<T>(block, h, (3, 9), scale, matrix),
                12 => self.scatter::<T>(block, h, (4, 12), scale, matrix),
                _ => self.scatter::<T>(block, h, (m / 3, m), scale, matrix),
            }
        }
        value
    }

    /// The lower half of the local matrices of `n` nodes, `m = 3 n`: constants
    /// where it is called, so that the loops are unrolled.
    #[inline(always)]
    fn scatter<T: Real>(
        &self,
        block: Range<usize>,
        hessians: &[f64],
        (n, m): (usize, usize),
        scale: f64,
        out: &mut impl Sink<T>,
    ) {
        let pairs = n * (n - 1) / 2;
        for (e, h) in block.zip(hessians.chunks_exact(m * m)) {
            let nodes = self.forces.batch.nodes(e);
            let mut slots = self.slots[e * pairs..(e + 1) * pairs].iter();
            // Symmetric: a column of a block is a row of its transpose.
            let columns = |row: usize, column: usize| {
                let at = |c: usize| (3 * column + c) * m + 3 * row;
                let [a, b, c] = [at(0), at(1), at(2)].map(|k| &h[k..k + 3]);
                [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]]
            };
            for a in 0..n {
                let diagonal = self.pattern.diagonal_slot(nodes[a] as usize) as usize;
                out.add_columns(diagonal, &columns(a, a), scale);
                for b in a + 1..n {
                    let slot = slots.next().copied().unwrap_or_default() as usize;
                    let (low, high) = if nodes[a] < nodes[b] { (a, b) } else { (b, a) };
                    out.add_columns(slot, &columns(high, low), scale);
                    if nodes[a] == nodes[b] {
                        out.add_columns(slot, &columns(low, high), scale);
                    }
                }
            }
        }
    }
}
