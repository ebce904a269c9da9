//! Pins and attachments of a scene.

use std::collections::BTreeMap;
use std::sync::Arc;

use selvedge_integrator::{Pins, State, StepReport, Term, Trajectory};
use selvedge_linsolve::BlockFilter;
use selvedge_record::PinState;
use selvedge_shell_model::{SharedTargets, attachment_term};

use super::bodies::BuiltBody;
use super::geometry::Geometry;
use super::select::select;
use crate::diagnostic::Diagnostics;
use crate::file::Parsed;
use crate::file::model::{DenseKey, Interpolation, PinKind, dense_keys};
use crate::motion::Motion;

/// Points that follow rigid motions from where they start.
pub struct Followers {
    start: Vec<[f64; 3]>,
    motion: Vec<Option<Arc<Motion>>>,
}

impl Trajectory for Followers {
    fn position(&self, k: usize, time: f64) -> [f64; 3] {
        match &self.motion[k] {
            None => self.start[k],
            Some(motion) => motion.place(self.start[k], time),
        }
    }
}

impl Followers {
    fn moves(&self) -> bool {
        self.motion.iter().any(Option::is_some)
    }
}

fn motion(
    keys: &[crate::file::model::Keyframe],
    interpolation: Interpolation,
    pivot: Option<[f64; 3]>,
    points: &[[f64; 3]],
) -> Option<Arc<Motion>> {
    let keys: Vec<DenseKey> = dense_keys(keys);
    if keys.is_empty() {
        return None;
    }
    let middle = || {
        let n = points.len() as f64;
        std::array::from_fn(|i| points.iter().map(|p| p[i]).sum::<f64>() / n)
    };
    let pivot = pivot.unwrap_or_else(middle);
    Some(Arc::new(Motion::new(
        keys,
        pivot,
        interpolation == Interpolation::Eased,
    )))
}

/// Pins of a scene, and whether any moves.
pub struct BuiltPins {
    /// For the plan.
    pub pins: Pins,
    /// Whether any pin moves.
    pub moves: bool,
    /// The pins of the scene, in its order.
    pub groups: Vec<PinGroup>,
}

/// One `[[pin]]` of a scene.
#[derive(Clone, Debug)]
pub struct PinGroup {
    /// `pin.0`, `pin.1`, …
    pub name: String,
    /// Its points and their indices in [`Pins::points`]; what an earlier pin
    /// holds already is left to that one.
    pub members: Vec<(u32, u32)>,
}

impl PinGroup {
    /// Its force and place after a step.
    pub(crate) fn held(&self, state: &State, report: &StepReport) -> PinState {
        let (x, _) = state.q.as_chunks::<3>();
        let mut pin = PinState {
            name: self.name.clone(),
            ..PinState::default()
        };
        let share = 1.0 / self.members.len().max(1) as f64;
        for &(point, place) in &self.members {
            let force = report.pin_forces.get(place as usize);
            for i in 0..3 {
                pin.place[i] += share * x[point as usize][i];
                pin.force[i] += force.map_or(f64::NAN, |f| f[i]);
            }
        }
        pin
    }
}

/// Builds the pins, or `None` when the scene has none.
///
/// # Errors
/// All findings, when one is an error.
pub fn pins(parsed: &Parsed, geometry: &Geometry) -> Result<Option<BuiltPins>, Diagnostics> {
    let mut findings = Diagnostics::new();
    let mut filter = BlockFilter::new();
    let mut points = Vec::new();
    let mut groups = Vec::new();
    // Who holds a point, and whether that moves.
    let mut held: BTreeMap<u32, (usize, bool)> = BTreeMap::new();
    let mut followers = Followers {
        start: Vec::new(),
        motion: Vec::new(),
    };
    let scene_positions = geometry.to_scene(&geometry.positions);
    for (i, pin) in parsed.scene.pin.iter().enumerate() {
        let path = format!("pin.{i}");
        let Some(part) = geometry.part(&pin.cloth) else {
            continue;
        };
        let chosen = match select(geometry, part, &pin.select, &scene_positions) {
            Ok(chosen) => chosen,
            Err(message) => {
                let path = format!("{path}.select");
                findings.push(parsed.locations.error("scene::pin", &path, message));
                continue;
            }
        };
        let places: Vec<[f64; 3]> = chosen
            .iter()
            .map(|p| scene_positions[*p as usize])
            .collect();
        let motion = motion(&pin.motion, pin.interpolation, pin.pivot, &places);
        let mut group = PinGroup {
            name: path.clone(),
            members: Vec::new(),
        };
        for (&p, place) in chosen.iter().zip(places) {
            let point = geometry.order.new_of_old[p as usize];
            let first = !held.contains_key(&point);
            if let Some((other, moves)) = held.insert(point, (i, motion.is_some()))
                && other != i
                && (moves || motion.is_some())
            {
                let message = format!(
                    "point {} of cloth `{}` is held by `pin.{other}` too, and one of them moves: \
                     keep it in one of the selections",
                    p - part.points.start,
                    part.name
                );
                findings.push(parsed.locations.error("scene::pin", &path, message));
                break;
            }
            // A point may have become several.
            for point in geometry.now(point) {
                let added = match pin.kind {
                    PinKind::Fixed {} => filter.fix(point, [0.0; 3]),
                    PinKind::Plane { normal } => filter.constrain(point, normal, 0.0),
                    PinKind::Line { direction } => filter.line(point, direction),
                };
                if let Err(e) = added {
                    findings.push(parsed.locations.error("scene::pin", &path, e.to_string()));
                    break;
                }
                if first {
                    group.members.push((point, points.len() as u32));
                }
                points.push(point);
                followers.start.push(place);
                followers.motion.push(motion.clone());
            }
        }
        groups.push(group);
    }
    if findings.has_errors() {
        return Err(findings);
    }
    if points.is_empty() {
        return Ok(None);
    }
    let moves = followers.moves();
    Ok(Some(BuiltPins {
        pins: Pins {
            filter,
            points,
            trajectory: Box::new(followers),
        },
        moves,
        groups,
    }))
}

/// Springs of one `[[attachment]]` or of held labels, with their moving ends.
pub struct BuiltAttachment {
    /// For the plan, which takes it.
    pub term: Option<Term>,
    /// Where the other ends are; updated by the driver as they move.
    pub targets: SharedTargets,
    follow: Followers,
    body: Option<Arc<dyn selvedge_collision::Body>>,
    local: Vec<[f64; 3]>,
}

impl BuiltAttachment {
    /// Whether the other ends move.
    pub fn moves(&self) -> bool {
        self.body.is_some() || self.follow.moves()
    }

    /// Moves the other ends to their places at a time [s].
    pub fn update(&self, time: f64) {
        self.targets.update(|k, _| match &self.body {
            Some(body) => body.from_body(self.local[k], time),
            None => self.follow.position(k, time),
        });
    }
}

/// Builds the attachments.
///
/// # Errors
/// All findings, when one is an error.
pub fn attachments(
    parsed: &Parsed,
    geometry: &Geometry,
    bodies: &[BuiltBody],
) -> Result<Vec<BuiltAttachment>, Diagnostics> {
    let mut findings = Diagnostics::new();
    let mut built = Vec::new();
    let scene_positions = geometry.to_scene(&geometry.positions);
    for (i, spec) in parsed.scene.attachment.iter().enumerate() {
        let path = format!("attachment.{i}");
        let Some(part) = geometry.part(&spec.cloth) else {
            continue;
        };
        let chosen = match select(geometry, part, &spec.select, &scene_positions) {
            Ok(chosen) => chosen,
            Err(message) => {
                let path = format!("{path}.select");
                findings.push(parsed.locations.error("scene::attachment", &path, message));
                continue;
            }
        };
        let (mut start, mut points) = (Vec::new(), Vec::new());
        for p in chosen {
            for now in geometry.now(geometry.order.new_of_old[p as usize]) {
                start.push(scene_positions[p as usize]);
                points.push(now);
            }
        }
        let body = spec
            .body
            .as_ref()
            .and_then(|name| bodies.iter().find(|b| b.name == *name))
            .filter(|b| b.moves)
            .map(|b| b.body.clone());
        let motion = motion(&spec.motion, spec.interpolation, spec.pivot, &start);
        match attachment(&points, spec.stiffness, start, motion, body) {
            Ok(attachment) => built.push(attachment),
            Err(e) => findings.push(parsed.locations.error("scene::attachment", &path, e)),
        }
    }
    if findings.has_errors() {
        return Err(findings);
    }
    Ok(built)
}

/// Springs from `points` (solver's order) to where they are, `start`.
///
/// # Errors
/// A message when the arrays do not fit.
pub fn attachment(
    points: &[u32],
    stiffness: f64,
    start: Vec<[f64; 3]>,
    motion: Option<Arc<Motion>>,
    body: Option<Arc<dyn selvedge_collision::Body>>,
) -> Result<BuiltAttachment, String> {
    let local = match &body {
        Some(body) => start.iter().map(|p| body.to_body(*p, 0.0)).collect(),
        None => Vec::new(),
    };
    let targets = SharedTargets::new(start.clone());
    let term = attachment_term(points, stiffness, targets.clone()).map_err(|e| e.to_string())?;
    let follow = Followers {
        motion: vec![motion; start.len()],
        start,
    };
    Ok(BuiltAttachment {
        term: Some(Term::fixed(term)),
        targets,
        follow,
        body,
        local,
    })
}
