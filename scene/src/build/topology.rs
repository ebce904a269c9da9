//! Yarns that leave their contacts during a run.

use selvedge_collision::CollisionError;
use selvedge_energy::{DofLayout, EvalPoint};
use selvedge_integrator::{Simulation, State};
use selvedge_shell_model::ShellMesh;
use selvedge_yarn_model::topology::{Change, TopologyEvent, changes};
use selvedge_yarn_model::{FrictionSettings, StitchWrapping, YarnNetwork};

use super::yarns::{Dissipation, YarnCloth};
use super::{Built, BuiltScene, StageOptions};
use crate::diagnostic::{Diagnostics, Finding};
use crate::summary::TopologySummary;

/// Everything that has happened to the yarns of a run.
///
/// The network is that of the scene after all of these events, so that they are
/// all that a checkpoint needs beside the state.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Topology {
    log: Vec<Happened>,
}

/// Events at once.
#[derive(Clone, Debug, PartialEq)]
struct Happened {
    /// Simulated time \[s\].
    time: f64,
    /// Elastic energy that they removed \[J\].
    energy: f64,
    events: Vec<TopologyEvent>,
}

/// Relative difference of depths that rounding makes.
const SAME: f64 = 1e-9;

/// Histories of terms that a change carries over, by the start of their names.
const FRICTION_TERM: &str = "yarn friction";
const WRAPPING_TERM: &str = "stitch wrapping";
/// Contact of yarns that no stitch joins.
const TOUCHING: &str = "self-contact";

impl Topology {
    /// Whether nothing has happened.
    pub fn is_empty(&self) -> bool {
        self.log.is_empty()
    }

    /// Numbers for a checkpoint.
    pub fn section(&self) -> Vec<f64> {
        let mut all = Vec::new();
        for h in &self.log {
            all.extend([h.time, h.energy, h.events.len() as f64]);
            for event in &h.events {
                all.extend(event.encode().map(f64::from));
            }
        }
        all
    }

    /// From the numbers of a checkpoint; `None` if they are something else.
    pub fn of_section(section: &[f64]) -> Option<Self> {
        let mut log = Vec::new();
        let mut rest = section;
        while let Some(([time, energy, count], after)) = rest.split_first_chunk::<3>() {
            let (events, after) = after.split_at_checked(2 * *count as usize)?;
            let event = |e: &[f64; 2]| TopologyEvent::decode(e.map(|x| x as u32));
            log.push(Happened {
                time: *time,
                energy: *energy,
                events: events
                    .as_chunks::<2>()
                    .0
                    .iter()
                    .map(event)
                    .collect::<Option<_>>()?,
            });
            rest = after;
        }
        rest.is_empty().then_some(Self { log })
    }

    /// The scene after all that has happened.
    pub fn replay(&self, start: &BuiltScene) -> Result<BuiltScene, Diagnostics> {
        let mut built = start.clone();
        for h in &self.log {
            let Some(yarns) = &built.geometry.yarns else {
                break;
            };
            let change = Change::new(&yarns.network, &h.events).map_err(|e| built.refused(&e))?;
            built = built.changed(change)?;
        }
        Ok(built)
    }

    /// What happens after a step, until nothing more does: the scene and the
    /// simulation that go on, and a line about it; `None` when nothing happens.
    pub fn after_step(
        &mut self,
        built: &BuiltScene,
        simulation: &Simulation,
        stage: &StageOptions,
    ) -> Result<Option<(BuiltScene, Built, String)>, Diagnostics> {
        let Some(yarns) = &built.geometry.yarns else {
            return Ok(None);
        };
        let state = simulation.state();
        let points = simulation.plan().layout.points;
        let pinned = pinned(simulation);
        let arcs = &state.q[3 * points..];
        let mut events = built.events(&yarns.network, arcs, &pinned, state.time);
        if events.is_empty() {
            return Ok(None);
        }
        let mut work = Work {
            built: built.clone(),
            q: state.q.clone(),
            v: state.v.clone(),
            friction: history(simulation, FRICTION_TERM),
            wrapping: history(simulation, WRAPPING_TERM),
            pinned,
            from: (0..points as u32).collect(),
        };
        let first = self.log.len();
        while !events.is_empty() {
            self.log.push(Happened {
                time: state.time,
                energy: work.happen(&events)?,
                events,
            });
            events = work.more(state.time);
        }
        let next = State {
            layout: work.layout(),
            q: work.q.clone(),
            v: work.v.clone(),
            time: state.time,
        };
        let touching = work.touching(built, simulation)?;
        let mut made = work.built.simulation(next, stage)?;
        let contacts = &mut made.simulation.plan_mut().contacts;
        for contact in contacts.iter_mut().filter(|c| c.name() == TOUCHING) {
            contact
                .restore_history(&touching)
                .map_err(|e| built.refused(&e))?;
        }
        for term in &mut made.simulation.plan_mut().terms {
            let kept = match term.batch.name() {
                name if name.starts_with(FRICTION_TERM) => &work.friction,
                name if name.starts_with(WRAPPING_TERM) => &work.wrapping,
                _ => continue,
            };
            if kept.len() == term.batch.history().len() {
                term.batch.restore_history(kept);
            }
        }
        let told = Self {
            log: self.log[first..].to_vec(),
        };
        Ok(Some((work.built, made, told.line())))
    }

    /// A line about everything.
    fn line(&self) -> String {
        let s = self.summary();
        format!(
            "yarns: {} cut, {} contacts left, {} loops drawn out, {} nodes taken out; {:.3e} J \
             removed",
            s.cut, s.released, s.drawn, s.removed, s.energy_removed_j
        )
    }

    /// Numbers of events and the energy that went with them.
    pub fn summary(&self) -> TopologySummary {
        let mut s = TopologySummary::default();
        for event in self.log.iter().flat_map(|h| &h.events) {
            match event {
                TopologyEvent::Release { .. } => s.released += 1,
                TopologyEvent::Draw { .. } => s.drawn += 1,
                TopologyEvent::Remove { .. } => s.removed += 1,
                TopologyEvent::Cut { .. } => s.cut += 1,
            }
        }
        s.energy_removed_j = self.log.iter().map(|h| h.energy).sum();
        s.first_s = self.log.first().map(|h| h.time);
        s.last_s = self.log.last().map(|h| h.time);
        s
    }
}

/// A scene, its state and its memory under change.
struct Work {
    built: BuiltScene,
    q: Vec<f64>,
    v: Vec<f64>,
    friction: Vec<f64>,
    wrapping: Vec<f64>,
    pinned: Vec<bool>,
    /// What every point was before anything happened.
    from: Vec<u32>,
}

impl Work {
    fn network(&self) -> Option<&YarnNetwork> {
        self.built.geometry.yarns.as_ref().map(|y| &y.network)
    }

    fn layout(&self) -> DofLayout {
        let network = self.network();
        DofLayout {
            points: network.map_or(0, YarnNetwork::nodes),
            scalars: network.map_or(0, |n| n.strands.len()),
        }
    }

    fn more(&self, time: f64) -> Vec<TopologyEvent> {
        let Some(network) = self.network() else {
            return Vec::new();
        };
        let arcs = &self.q[3 * network.nodes()..];
        self.built.events(network, arcs, &self.pinned, time)
    }

    /// History for the contact of yarns that no stitch joins: what a broken contact
    /// held together now overlaps, and parts softly; empty without such contact.
    fn touching(
        &self,
        before: &BuiltScene,
        simulation: &Simulation,
    ) -> Result<Vec<f64>, Diagnostics> {
        let contacts = &simulation.plan().contacts;
        let Some(contact) = contacts.iter().find(|c| c.name() == TOUCHING) else {
            return Ok(Vec::new());
        };
        let all = || -> Result<Vec<f64>, CollisionError> {
            let mut now = self.built.touching()?;
            let mut fresh = now.depths(&self.q)?;
            let depths = before.touching()?.depths(&simulation.state().q)?;
            for (depth, from) in fresh.iter_mut().zip(&self.from) {
                // Places are the same but for rounding.
                if *depth <= depths[*from as usize] * (1.0 + SAME) {
                    *depth = 0.0;
                }
            }
            let time = simulation.state().time;
            now.changed_history(&contact.history(), depths.len(), &self.from, &fresh, time)
        };
        all().map_err(|e| before.refused(&e))
    }

    /// Makes events happen, and returns the energy that they removed \[J\].
    fn happen(&mut self, events: &[TopologyEvent]) -> Result<f64, Diagnostics> {
        let Some(old) = self.network().cloned() else {
            return Ok(0.0);
        };
        let before = elastic(&old, &self.q);
        let change = Change::new(&old, events).map_err(|e| self.built.refused(&e))?;
        let mut pinned: Vec<bool> = change
            .node_from
            .iter()
            .map(|n| self.pinned[*n as usize])
            .collect();
        // New ends are free, whatever is held beside them.
        for s in change.cuts.iter().flat_map(|[end, start, ..]| [end, start]) {
            pinned[change.network.strands[*s as usize].node as usize] = false;
        }
        let (q, v) = change.carry(&old, &self.q, &self.v, |n| pinned[n as usize]);
        let after = elastic(&change.network, &q);
        let settings = FrictionSettings::default();
        self.friction = change.friction_history(&old, settings, &self.friction);
        let fresh = StitchWrapping::new(&change.network);
        self.wrapping = change.wrapping_history(&old, &self.wrapping, &fresh);
        let nodes = change.node_from.iter().map(|n| *n as usize);
        self.from = nodes.map(|n| self.from[n]).collect();
        (self.pinned, self.q, self.v) = (pinned, q, v);
        self.built = self.built.changed(change)?;
        Ok(before - after)
    }
}

/// Elastic energy of yarns that slide [J].
fn elastic(network: &YarnNetwork, q: &[f64]) -> f64 {
    let cloth = YarnCloth {
        network: network.clone(),
        sliding: true,
    };
    let at = EvalPoint {
        layout: DofLayout {
            points: network.nodes(),
            scalars: network.strands.len(),
        },
        q,
        q_start: q,
        dt: 1.0,
    };
    let mut sum = 0.0;
    for mut term in cloth.parts([0.0; 3], Dissipation::ALL).terms {
        if !term.batch.name().starts_with(FRICTION_TERM) {
            term.batch.begin_step(&at);
            sum += term.batch.value(&at, 0..term.batch.len());
        }
    }
    sum
}

fn history(simulation: &Simulation, name: &str) -> Vec<f64> {
    let terms = &simulation.plan().terms;
    let term = terms.iter().find(|t| t.batch.name().starts_with(name));
    term.map(|t| t.batch.history().to_vec()).unwrap_or_default()
}

/// Whether the motion of a point is prescribed.
fn pinned(simulation: &Simulation) -> Vec<bool> {
    let plan = simulation.plan();
    let mut pinned = vec![false; plan.layout.points];
    for p in plan.pins.iter().flat_map(|p| &p.points) {
        pinned[*p as usize] = true;
    }
    pinned
}

impl BuiltScene {
    /// Whether yarns may leave their contacts.
    pub(crate) fn topology_changes(&self) -> bool {
        self.geometry.passages.is_some()
    }

    /// What happens to yarns that have slid to these arc lengths \[m\]: cuts that
    /// are due first, all at once, then what follows from the lengths.
    fn events(
        &self,
        network: &YarnNetwork,
        arcs: &[f64],
        pinned: &[bool],
        time: f64,
    ) -> Vec<TopologyEvent> {
        let passages = self.geometry.passages.as_ref();
        let due = passages.map(|p| p.due(network, time)).unwrap_or_default();
        if due.is_empty() {
            return changes(network, arcs, |n| pinned[n as usize]);
        }
        due.into_iter()
            .map(|strand| TopologyEvent::Cut { strand })
            .collect()
    }

    /// The scene with a changed network.
    fn changed(&self, change: Change) -> Result<Self, Diagnostics> {
        let mut next = self.clone();
        let passages = self.geometry.passages.as_ref();
        next.geometry.passages = passages.map(|p| p.changed(&change));
        let nodes = change.network.nodes();
        next.geometry.mesh = ShellMesh::new(nodes, Vec::new(), Vec::new(), Vec::new())
            .map_err(|e| self.refused(&e))?;
        if let Some(yarns) = &mut next.geometry.yarns {
            yarns.network = change.network;
        }
        Ok(next)
    }

    fn refused(&self, error: &dyn std::error::Error) -> Diagnostics {
        let name = self.parsed.locations.name();
        Finding::error("scene::topology", name, error.to_string()).into()
    }
}
