use crate::{
    CurvaturePolicy, Integrator, Ledger, PlanError, RestDetector, ScenePlan, Settings,
    SimulationError, Snapshot, State, StepControl, StepError, StepReport, StepRequest,
};

/// A plan, its state, and the loop around single steps: initial relaxation,
/// step control, end and rest.
pub struct Simulation {
    plan: ScenePlan,
    state: State,
    integrator: Box<dyn Integrator>,
    settings: Settings,
    control: StepControl,
    rest: RestDetector,
    ledger: Ledger,
    counters: Counters,
    ended: Option<EndReason>,
    kinetic: Vec<f64>,
    prescribed: Vec<bool>,
}

/// Running totals of a simulation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counters {
    /// Accepted steps.
    pub steps: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Newton iterations of accepted steps.
    pub newton_iterations: u64,
    /// Iterations of the linear solver in accepted steps.
    pub linear_iterations: u64,
    /// Linear solves that met negative curvature.
    pub negative_curvature: u64,
    /// Iterations repeated with projected curvature.
    pub projected: u64,
}

/// What one call of [`Simulation::advance`] did.
#[derive(Debug)]
pub enum Outcome {
    /// A step was taken.
    Accepted {
        /// Its length [s].
        dt: f64,
        /// What it took.
        report: StepReport,
    },
    /// A step was refused; the next try is shorter.
    Rejected {
        /// Its length [s].
        dt: f64,
        /// Why.
        reason: StepError,
    },
    /// There is nothing left to do.
    Ended(EndReason),
}

/// Why a simulation has nothing left to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndReason {
    /// The simulated time is over.
    Duration,
    /// The cloth came to rest.
    AtRest,
}

impl Simulation {
    /// Checks plan and settings.
    ///
    /// # Errors
    /// [`SimulationError::Plan`] for what does not fit together,
    /// [`SimulationError::Step`] for a state that is not finite.
    pub fn new(
        plan: ScenePlan,
        state: State,
        integrator: Box<dyn Integrator>,
        settings: Settings,
    ) -> Result<Self, SimulationError> {
        settings.validate()?;
        plan.validate()?;
        for (what, array) in [("positions", &state.q), ("velocities", &state.v)] {
            if array.len() != plan.layout.dim() {
                return Err(PlanError::Length {
                    what,
                    found: array.len(),
                    expected: plan.layout.dim(),
                }
                .into());
            }
        }
        if let Some((place, what)) = state.first_not_finite() {
            let point = state.point_of(place, &plan.owners);
            let at = |i: usize| state.q[3 * point + i];
            let source = StepError::NotFinite {
                what,
                point,
                x: at(0),
                y: at(1),
                z: at(2),
                term: None,
                why: None,
            };
            return Err(SimulationError::Step {
                time: state.time,
                source,
            });
        }
        let relaxed = settings.relaxation.duration > state.time;
        let fraction = if relaxed {
            settings.relaxation.step_fraction
        } else {
            1.0
        };
        let mut prescribed = vec![false; plan.layout.points];
        for &p in plan.pins.iter().flat_map(|p| &p.points) {
            prescribed[p as usize] = true;
        }
        Ok(Self {
            control: StepControl::new(settings.control, fraction),
            rest: RestDetector::new(settings.stop),
            plan,
            state,
            integrator,
            settings,
            ledger: Ledger::default(),
            counters: Counters::default(),
            ended: None,
            kinetic: Vec::new(),
            prescribed,
        })
    }

    /// Tries one step.
    ///
    /// # Errors
    /// [`SimulationError::StepUnderflow`] when no step is small enough, with
    /// the state as after the last accepted step.
    pub fn advance(&mut self) -> Result<Outcome, SimulationError> {
        if let Some(end) = self.ended {
            return Ok(Outcome::Ended(end));
        }
        let left = self.settings.duration - self.state.time;
        // A remainder below round-off of the time is no step.
        if left <= 1e-12 * self.settings.duration.max(self.settings.control.max_step) {
            self.ended = Some(EndReason::Duration);
            return Ok(Outcome::Ended(EndReason::Duration));
        }
        let dt = self.control.dt().min(left);
        let relaxation = self.settings.relaxation;
        let in_window = self.state.time < relaxation.duration;
        let stiffness = if in_window {
            relaxation.stiffness(self.state.time)
        } else {
            1.0
        };
        let request = StepRequest { dt, stiffness };
        match self
            .integrator
            .step(&mut self.plan, &mut self.state, request, &mut self.ledger)
        {
            Ok(report) => {
                self.accept(&report, in_window);
                Ok(Outcome::Accepted { dt, report })
            }
            // Repeating it changes nothing.
            Err(source @ StepError::Stalled { .. }) => Err(SimulationError::Step {
                time: self.state.time,
                source,
            }),
            Err(reason) => {
                self.counters.rejected += 1;
                self.rest.reset();
                if self.control.reject() {
                    Ok(Outcome::Rejected { dt, reason })
                } else {
                    Err(SimulationError::StepUnderflow {
                        dt,
                        time: self.state.time,
                        rejections: self.control.rejected_run(),
                        source: reason,
                    })
                }
            }
        }
    }

    fn accept(&mut self, report: &StepReport, in_window: bool) {
        self.control.accept(report.newton_iterations);
        let c = &mut self.counters;
        c.steps += 1;
        c.newton_iterations += report.newton_iterations as u64;
        c.linear_iterations += report.linear_iterations as u64;
        c.negative_curvature += report.negative_curvature as u64;
        c.projected += report.projected as u64;
        if in_window {
            self.state.v.fill(0.0);
            return;
        }
        if let Some(rest) = &report.rest {
            // Nothing moves; forces decide.
            if rest.at_rest() {
                self.ended = Some(EndReason::AtRest);
            }
            return;
        }
        self.kinetic.clear();
        let (v, _) = self.state.v.as_chunks::<3>();
        let all = v
            .iter()
            .zip(&self.plan.inertia.masses)
            .zip(&self.prescribed);
        self.kinetic.extend(
            all.filter(|(_, fixed)| !**fixed)
                .map(|((v, m), _)| 0.5 * m * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])),
        );
        if self.rest.observe(self.state.time, &mut self.kinetic) {
            self.ended = Some(EndReason::AtRest);
        }
    }

    /// The plan.
    pub fn plan(&self) -> &ScenePlan {
        &self.plan
    }

    /// The plan, to change loads or attachments between steps.
    pub fn plan_mut(&mut self) -> &mut ScenePlan {
        &mut self.plan
    }

    /// State after the last accepted step.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The state, to place or push points between steps.
    pub fn state_mut(&mut self) -> &mut State {
        &mut self.state
    }

    /// Settings in use.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Wall time by stage.
    pub fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    /// Running totals.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Length of the next step [s].
    pub fn next_dt(&self) -> f64 {
        self.control.dt()
    }

    /// Replaces the length of the next step [s], within the largest step.
    pub fn set_next_dt(&mut self, dt: f64) {
        self.control.set_dt(dt);
    }

    /// Changes the curvature of Newton's matrix for the next steps; `None`
    /// goes back to that of the settings.
    pub fn force_curvature(&mut self, policy: Option<CurvaturePolicy>) {
        self.integrator.force_curvature(policy);
    }

    /// Fixes the relative tolerance of the linear solves for the next steps;
    /// the system's own is set with it. `tolerance` is that of the settings
    /// again with `forced` false.
    pub fn force_tolerance(&mut self, tolerance: f64, forced: bool) {
        self.plan.system.set_tolerance(tolerance);
        self.integrator.force_tolerance(forced.then_some(tolerance));
    }

    /// Goes on with the plan, the state and the integrator of another
    /// simulation of the same settings: the points or terms have changed.
    /// Step control, counters, times and the search for rest stay.
    pub fn go_on_with(&mut self, other: Self) {
        self.plan = other.plan;
        self.state = other.state;
        self.integrator = other.integrator;
        self.prescribed = other.prescribed;
    }

    /// Percentile of the per-point kinetic energies at the last step [J].
    pub fn rest_energy(&self) -> f64 {
        self.rest.last()
    }

    /// Heap memory of plan, state and work arrays [bytes].
    pub fn heap_bytes(&self) -> usize {
        self.memory().iter().map(|(_, bytes)| bytes).sum()
    }

    /// [`heap_bytes`](Self::heap_bytes) by owner; a name may come twice.
    pub fn memory(&self) -> Vec<(String, usize)> {
        let state = size_of_val(self.state.q.as_slice())
            + size_of_val(self.state.v.as_slice())
            + size_of_val(self.kinetic.as_slice())
            + self.prescribed.len();
        let mut all = self.plan.memory();
        all.push(("state".into(), state));
        all.push(("integrator".into(), self.integrator.heap_bytes()));
        all
    }

    /// All that the next steps depend on.
    pub fn snapshot(&self) -> Snapshot {
        let c = &self.counters;
        let ended = match self.ended {
            None => 0.0,
            Some(EndReason::Duration) => 1.0,
            Some(EndReason::AtRest) => 2.0,
        };
        let mut sections = vec![
            ("time".into(), vec![self.state.time, ended]),
            (
                "counters".into(),
                [
                    c.steps,
                    c.rejected,
                    c.newton_iterations,
                    c.linear_iterations,
                    c.negative_curvature,
                    c.projected,
                ]
                .map(|n| n as f64)
                .to_vec(),
            ),
            ("control".into(), self.control.save()),
            ("rest".into(), self.rest.save()),
            ("q".into(), self.state.q.clone()),
            ("v".into(), self.state.v.clone()),
        ];
        let history = self.integrator.history();
        if !history.is_empty() {
            sections.push(("integrator".into(), history));
        }
        for (i, term) in self.plan.terms.iter().enumerate() {
            sections.push((format!("term {i}"), term.batch.history().to_vec()));
        }
        for (i, contact) in self.plan.contacts.iter().enumerate() {
            sections.push((format!("contact {i}"), contact.history()));
        }
        Snapshot { sections }
    }

    /// Goes back to a snapshot of the same plan.
    ///
    /// # Errors
    /// [`SimulationError::Snapshot`] when a part is missing or has another
    /// length; the simulation must not be used after that.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SimulationError> {
        let section = |name: &str| {
            snapshot
                .section(name)
                .ok_or_else(|| SimulationError::Snapshot {
                    what: format!("it has no section `{name}`"),
                })
        };
        let length = |name: &str, found: usize, expected: usize| {
            if found == expected {
                return Ok(());
            }
            Err(SimulationError::Snapshot {
                what: format!("section `{name}` has {found} values instead of {expected}"),
            })
        };
        for (name, array) in [("q", &mut self.state.q), ("v", &mut self.state.v)] {
            let values = section(name)?;
            length(name, values.len(), array.len())?;
            array.copy_from_slice(values);
        }
        for (i, term) in self.plan.terms.iter_mut().enumerate() {
            let name = format!("term {i}");
            let values = section(&name)?;
            length(&name, values.len(), term.batch.history().len())?;
            term.batch.restore_history(values);
        }
        for (i, contact) in self.plan.contacts.iter_mut().enumerate() {
            let name = format!("contact {i}");
            contact
                .restore_history(section(&name)?)
                .map_err(|e| SimulationError::Snapshot {
                    what: format!("section `{name}`: {e}"),
                })?;
        }
        let time = section("time")?;
        length("time", time.len(), 2)?;
        self.state.time = time[0];
        self.ended = match time[1] as u8 {
            1 => Some(EndReason::Duration),
            2 => Some(EndReason::AtRest),
            _ => None,
        };
        let counters = section("counters")?;
        length("counters", counters.len(), 6)?;
        let count = |i: usize| counters[i] as u64;
        self.counters = Counters {
            steps: count(0),
            rejected: count(1),
            newton_iterations: count(2),
            linear_iterations: count(3),
            negative_curvature: count(4),
            projected: count(5),
        };
        if !self.control.restore(section("control")?) {
            return Err(SimulationError::Snapshot {
                what: "section `control` is broken".into(),
            });
        }
        let history = snapshot.section("integrator").unwrap_or_default();
        if !self.integrator.restore_history(history) {
            return Err(SimulationError::Snapshot {
                what: "section `integrator` is broken".into(),
            });
        }
        if !self.rest.restore(section("rest")?) {
            return Err(SimulationError::Snapshot {
                what: "section `rest` is broken".into(),
            });
        }
        Ok(())
    }
}
