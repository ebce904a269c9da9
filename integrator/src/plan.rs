use selvedge_collision::ContactSource;
use selvedge_energy::{DofLayout, EnergyBatch, EvalPoint, MassBatch};
use selvedge_linsolve::BlockFilter;

use crate::assemble::Stencils;
use crate::{NewtonSystem, PlanError};

/// Everything that a scene calls for, and nothing else: an effect that is off
/// is absent.
pub struct ScenePlan {
    /// Shape of the unknowns.
    pub layout: DofLayout,
    /// The point at which each scalar lives, ascending.
    pub owners: Vec<u32>,
    /// Mass and gravity.
    pub inertia: Inertia,
    /// Energies and dissipative terms.
    pub terms: Vec<Term>,
    /// Contact with bodies and with the cloth itself.
    pub contacts: Vec<Box<dyn ContactSource>>,
    /// Prescribed points.
    pub pins: Option<Pins>,
    /// Newton's matrix and its linear solver.
    pub system: Box<dyn NewtonSystem>,
}

/// Masses and the field that pulls on them.
#[derive(Default)]
pub struct Inertia {
    /// Lumped mass of each point [kg]; of a point that stands for a rotation, a
    /// moment of inertia [kg·m²].
    pub masses: Vec<f64>,
    /// Lumped mass of each scalar [kg].
    pub scalar_masses: Vec<f64>,
    /// Inertia that couples unknowns and depends on them. It takes the place of
    /// the lumped masses, which remain the weights of norms and of gravity.
    pub coupled: Option<Box<dyn MassBatch>>,
    /// Damping in proportion to [`coupled`](Self::coupled) inertia, α [1/s] of
    /// each of its stencils; empty: none.
    pub damping: Vec<f64>,
    /// Acceleration of gravity [m/s²].
    pub gravity: [f64; 3],
    /// Points that gravity does not pull: rotation vectors of rigid bodies.
    pub weightless: Vec<u32>,
}

/// One energy of a plan.
pub struct Term {
    /// The energy.
    pub batch: Box<dyn EnergyBatch>,
    /// Whether initial relaxation scales it: the fabric's own stiffness is
    /// scaled, seams, pins and bodies are not.
    pub relaxed: bool,
}

impl Term {
    /// A term of the fabric, which initial relaxation softens.
    pub fn fabric(batch: Box<dyn EnergyBatch>) -> Self {
        Self {
            batch,
            relaxed: true,
        }
    }

    /// A term that keeps its stiffness.
    pub fn fixed(batch: Box<dyn EnergyBatch>) -> Self {
        Self {
            batch,
            relaxed: false,
        }
    }
}

/// Points whose motion is prescribed, in all directions or in some.
pub struct Pins {
    /// Projector on the free directions.
    pub filter: BlockFilter,
    /// The constrained points, in the order of the trajectory's indices.
    pub points: Vec<u32>,
    /// Where they go.
    pub trajectory: Box<dyn Trajectory>,
}

/// Prescribed positions over time.
pub trait Trajectory: Send + Sync {
    /// Position [m] of pin `k` at a time [s]; only its constrained directions
    /// matter.
    fn position(&self, k: usize, time: f64) -> [f64; 3];
}

/// Pins that stay where they are.
#[derive(Clone, Debug)]
pub struct Fixed(pub Vec<[f64; 3]>);

impl Trajectory for Fixed {
    fn position(&self, k: usize, _: f64) -> [f64; 3] {
        self.0[k]
    }
}

impl ScenePlan {
    /// Checks that every part describes the same points.
    ///
    /// # Errors
    /// [`PlanError`] for the first disagreement.
    pub fn validate(&self) -> Result<(), PlanError> {
        let points = self.layout.points;
        if self.inertia.masses.len() != points {
            return Err(PlanError::Length {
                what: "masses",
                found: self.inertia.masses.len(),
                expected: points,
            });
        }
        if self.inertia.scalar_masses.len() != self.layout.scalars {
            return Err(PlanError::Length {
                what: "masses of scalars",
                found: self.inertia.scalar_masses.len(),
                expected: self.layout.scalars,
            });
        }
        let damped = self.inertia.damping.len();
        let coupled = self.inertia.coupled.as_ref().map_or(0, |c| c.len());
        if damped != 0 && damped != coupled {
            return Err(PlanError::Length {
                what: "damping of coupled inertia",
                found: damped,
                expected: coupled,
            });
        }
        if self.inertia.coupled.is_some() && !self.system.couples_masses() {
            return Err(PlanError::CoupledMass {
                system: self.system.name(),
            });
        }
        if let Some(&node) = self
            .inertia
            .weightless
            .iter()
            .find(|p| **p as usize >= points)
        {
            return Err(PlanError::Node {
                term: "weightless points".into(),
                stencil: 0,
                node,
                count: points,
            });
        }
        let scalars = self.inertia.scalar_masses.iter();
        let scalars = scalars.map(|&m| (points, m));
        let masses = self.inertia.masses.iter().copied().enumerate();
        for (point, mass) in masses.chain(scalars) {
            if !(mass > 0.0 && mass.is_finite()) {
                return Err(PlanError::Mass { point, mass });
            }
        }
        for term in &self.terms {
            let batch = term.batch.as_ref();
            check_nodes(batch.name(), &batch, self.layout)?;
        }
        if let Some(pins) = &self.pins {
            for &p in &pins.points {
                if p as usize >= points {
                    return Err(PlanError::Node {
                        term: "pins".into(),
                        stencil: 0,
                        node: p,
                        count: points,
                    });
                }
            }
        }
        Ok(())
    }

    /// Tells the terms where a step begins.
    pub(crate) fn begin_step(&mut self, start: &EvalPoint<'_>) {
        for term in &mut self.terms {
            term.batch.begin_step(start);
        }
    }

    /// Keeps the history of terms and contacts after an accepted step.
    pub(crate) fn commit(&mut self, end: &EvalPoint<'_>) {
        for term in &mut self.terms {
            term.batch.commit(end);
        }
        for contact in &mut self.contacts {
            contact.commit(end);
        }
    }

    /// Heap memory of terms, contacts, masses and the system [bytes].
    pub fn heap_bytes(&self) -> usize {
        self.memory().iter().map(|(_, bytes)| bytes).sum()
    }

    /// [`heap_bytes`](Self::heap_bytes) by owner; a name may come twice.
    pub fn memory(&self) -> Vec<(String, usize)> {
        let terms = self.terms.iter().map(|t| {
            let batch = t.batch.as_ref();
            (batch.name().to_owned(), batch.heap_bytes())
        });
        let contacts = self.contacts.iter().map(|c| {
            let name = c.name().to_owned();
            (name, c.heap_bytes())
        });
        let i = &self.inertia;
        let inertia = size_of_val(i.masses.as_slice())
            + size_of_val(i.scalar_masses.as_slice())
            + size_of_val(i.damping.as_slice())
            + i.coupled.as_ref().map_or(0, |c| c.heap_bytes());
        let owners = size_of_val(self.owners.as_slice());
        let system = self.system.memory();
        let system = system.into_iter().map(|(name, b)| (name.to_owned(), b));
        let mut all: Vec<_> = terms.chain(contacts).chain(system).collect();
        all.push(("inertia".into(), inertia + owners));
        all
    }
}

/// Checks that scalars live on points and that stencils name nodes, all of which
/// exist.
pub(crate) fn check_stencils(
    points: usize,
    owners: &[u32],
    terms: &[Term],
    mass: Option<&dyn MassBatch>,
) -> Result<(), PlanError> {
    if !owners.is_sorted() || owners.last().is_some_and(|&p| p as usize >= points) {
        return Err(PlanError::Owners { points });
    }
    let scalars = owners.len();
    let layout = DofLayout { points, scalars };
    for term in terms {
        let batch = term.batch.as_ref();
        check_nodes(batch.name(), &batch, layout)?;
    }
    mass.map_or(Ok(()), |mass| check_nodes(mass.name(), &mass, layout))
}

fn check_nodes(name: &str, stencils: &impl Stencils, layout: DofLayout) -> Result<(), PlanError> {
    for e in 0..stencils.count() {
        for (&node, &dim) in stencils.stencil(e).iter().zip(stencils.dims()) {
            let count = if dim == 3 {
                layout.points
            } else {
                layout.scalars
            };
            if node as usize >= count {
                return Err(PlanError::Node {
                    term: name.into(),
                    stencil: e,
                    node,
                    count,
                });
            }
        }
    }
    Ok(())
}
