//! Evaluation of terms in chunks, and the scatter of their derivatives.

mod bordered;
mod elements;
mod mass;
mod options;
mod points;
mod schedule;
mod work;

pub(crate) use bordered::{Patterns, Values};
pub use mass::MassEvaluation;
pub use options::{AssemblyOptions, Scatter};

use std::time::Instant;

use bordered::{BorderedBlocks, Slots, touched};
use points::{PointBlocks, slots};
use schedule::Schedule;
use selvedge_energy::{Curvature, EnergyBatch, MassBatch};
use selvedge_linsolve::{Pattern, Real};
pub(crate) use work::Stencils;
use work::{ForceWork, MatrixWork, Nowhere};

use crate::sink::Plain;
use crate::{Evaluation, Ledger, PlanError, Term};

/// Energy of one term [J], in the plan's order.
#[derive(Clone, Debug, PartialEq)]
pub struct TermEnergy {
    /// Name of the term.
    pub name: String,
    /// Energy [J].
    pub value: f64,
}

/// Evaluates the terms of a plan in parallel.
pub struct Assembler {
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

    /// Has `evaluate` run the schedule of every term with that term's number
    /// and forces, and writes the energies.
    fn each_term(
        &mut self,
        e: &Evaluation<'_>,
        energies: &mut [f64],
        mut evaluate: impl FnMut(usize, ForceWork<'_>, &mut Schedule),
    ) {
        let all = e.terms.iter().zip(&mut self.schedules).zip(energies);
        for (k, ((term, schedule), energy)) in all.enumerate() {
            let factor = if term.relaxed { e.stiffness } else { 1.0 };
            let forces = ForceWork {
                batch: term.batch.as_ref(),
                at: &e.at,
                factor,
            };
            evaluate(k, forces, schedule);
            *energy = factor * schedule.sum();
        }
    }

    /// Adds `−dt · factor · gradient` of every term to `impulse` [N·s] and
    /// writes the energies [J].
    pub(crate) fn add_impulse(
        &mut self,
        e: &Evaluation<'_>,
        impulse: &mut [f64],
        energies: &mut [f64],
        ledger: &mut Ledger,
    ) {
        let options = self.options;
        self.each_term(e, energies, |_, work, schedule| {
            let start = Instant::now();
            if options.alone() {
                let mut out = Plain(&mut *impulse);
                schedule.run_alone(|range, scratch| work.run(range, scratch, &mut out));
            } else {
                let out = options.shared(impulse);
                schedule.run(|range, scratch| work.run(range, scratch, &mut out.clone()));
            }
            ledger.book("forces", start.elapsed());
        });
    }

    /// As [`add_impulse`](Self::add_impulse), and adds `dt² · factor · hessian`
    /// [kg] to the blocks in `values` on and below the diagonal.
    pub(crate) fn add_matrix<T: Real>(
        &mut self,
        e: &Evaluation<'_>,
        curvature: Curvature,
        (pattern, values): (&Pattern, &mut [T]),
        impulse: &mut [f64],
        energies: &mut [f64],
        ledger: &mut Ledger,
    ) {
        let options = self.options;
        self.each_term(e, energies, |_, forces, schedule| {
            let start = Instant::now();
            let work = MatrixWork { forces, curvature };
            let slots = std::mem::take(&mut schedule.slots);
            if options.alone() {
                let mut out = Plain(&mut *impulse);
                let mut matrix = PointBlocks {
                    pattern,
                    slots: &slots,
                    values: Plain(&mut *values),
                };
                schedule
                    .run_alone(|range, scratch| work.run(range, scratch, &mut out, &mut matrix));
            } else {
                let out = options.shared(impulse);
                let matrix = PointBlocks {
                    pattern,
                    slots: &slots,
                    values: options.shared(&mut *values),
                };
                schedule.run(|range, scratch| {
                    work.run(range, scratch, &mut out.clone(), &mut matrix.clone())
                });
            }
            schedule.slots = slots;
            ledger.time_term("assembly", work.forces.batch.name(), start.elapsed());
        });
    }

    /// As [`add_matrix`](Self::add_matrix) for terms of points and scalars, and
    /// all of the symmetric matrix.
    pub(crate) fn add_mixed<T: Real>(
        &mut self,
        e: &Evaluation<'_>,
        curvature: Curvature,
        (patterns, mut values): (Patterns<'_>, Values<'_, T>),
        impulse: &mut [f64],
        energies: &mut [f64],
        ledger: &mut Ledger,
    ) {
        let options = self.options;
        self.each_term(e, energies, |_, forces, schedule| {
            let start = Instant::now();
            let work = MatrixWork { forces, curvature };
            let slots = std::mem::take(&mut schedule.mixed);
            if options.alone() {
                let mut out = Plain(&mut *impulse);
                let mut matrix = BorderedBlocks {
                    patterns,
                    slots: &slots,
                    values: values.each_mut().map(Plain),
                };
                schedule
                    .run_alone(|range, scratch| work.run(range, scratch, &mut out, &mut matrix));
            } else {
                let out = options.shared(impulse);
                let matrix = BorderedBlocks {
                    patterns,
                    slots: &slots,
                    values: values.each_mut().map(|v| options.shared(v)),
                };
                schedule.run(|range, scratch| {
                    work.run(range, scratch, &mut out.clone(), &mut matrix.clone())
                });
            }
            schedule.mixed = slots;
            ledger.time_term("assembly", work.forces.batch.name(), start.elapsed());
        });
    }

    /// Adds the inertia's part of the residual to `impulse` [N·s].
    pub(crate) fn add_mass_impulse(
        &mut self,
        mass: &MassEvaluation<'_>,
        impulse: &mut [f64],
        ledger: &mut Ledger,
    ) {
        let Some(schedule) = &mut self.mass else {
            return;
        };
        let start = Instant::now();
        let out = self.options.shared(impulse);
        schedule.run(|range, scratch| mass.run(range, scratch, &mut out.clone(), &mut Nowhere));
        ledger.book("forces: inertia", start.elapsed());
    }

    /// As [`add_mass_impulse`](Self::add_mass_impulse), and adds the inertia's
    /// matrix [kg].
    pub(crate) fn add_mass<T: Real>(
        &mut self,
        mass: &MassEvaluation<'_>,
        impulse: &mut [f64],
        (patterns, mut values): (Patterns<'_>, Values<'_, T>),
        ledger: &mut Ledger,
    ) {
        let Some(schedule) = &mut self.mass else {
            return;
        };
        let start = Instant::now();
        let slots = std::mem::take(&mut schedule.mixed);
        if self.options.alone() {
            let mut out = Plain(impulse);
            let mut matrix = BorderedBlocks {
                patterns,
                slots: &slots,
                values: values.each_mut().map(Plain),
            };
            schedule.run_alone(|range, scratch| mass.run(range, scratch, &mut out, &mut matrix));
        } else {
            let out = self.options.shared(impulse);
            let matrix = BorderedBlocks {
                patterns,
                slots: &slots,
                values: values.each_mut().map(|v| self.options.shared(v)),
            };
            schedule.run(|range, scratch| {
                mass.run(range, scratch, &mut out.clone(), &mut matrix.clone())
            });
        }
        schedule.mixed = slots;
        ledger.book("assembly: inertia", start.elapsed());
    }

    pub(crate) fn heap_bytes(&self) -> usize {
        let schedules = self.schedules.iter().chain(&self.mass);
        schedules.map(Schedule::heap_bytes).sum()
    }
}
