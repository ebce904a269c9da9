//! Buttons and buttonholes of a scene.

use selvedge_energy::EvalPoint;
use selvedge_integrator::{Simulation, Term};
use selvedge_shell_model::{BodyInertia, TrimBody, TrimThread, trim_term};

use super::anchor::{Anchor, axis, quaternion};
use super::geometry::{Geometry, Part};
use crate::diagnostic::{Diagnostics, Finding};
use crate::file::Parsed;
use crate::summary::TrimSummary;

/// Threads of a button.
const THREADS: usize = 4;
/// Height of a button above its cloth, in contact thicknesses: room for the
/// cloth of a hole in between.
const HEIGHT: f64 = 2.0;
/// Height of a hole above that cloth, in contact thicknesses.
const HOLE: f64 = 1.0;

/// Where the trims of a scene are on its cloth.
#[derive(Clone, Debug, Default)]
pub struct Trims {
    /// For every button where it sits, and its threads.
    buttons: Vec<(Anchor, [Anchor; THREADS])>,
    /// For every hole its button and where it is.
    holes: Vec<(usize, Anchor)>,
}

/// What trims bring into a plan.
pub(super) struct TrimParts {
    pub term: Term,
    /// Two more points a button: its centre, and its rotation vector.
    pub points: Vec<[f64; 3]>,
    pub masses: Vec<f64>,
    pub weightless: Vec<u32>,
}

impl Trims {
    /// Finds every button and hole on its cloth.
    ///
    /// # Errors
    /// All findings, when one is an error.
    pub fn new(parsed: &Parsed, geometry: &Geometry) -> Result<Self, Diagnostics> {
        let scene = &parsed.scene;
        let mut findings = Diagnostics::new();
        let mut trims = Self::default();
        for (i, b) in scene.button.iter().enumerate() {
            let found = Chart::new(parsed, geometry, &format!("button.{i}"), &b.cloth, &b.panel)
                .and_then(|chart| {
                    let (center, seat) = chart.seat(b.at)?;
                    let threads = std::array::from_fn(|k| {
                        let [c, s] = direction(k);
                        let reach = b.radius / 3.0;
                        let place = [center[0] + reach * c, center[1] + reach * s];
                        // Beyond the border the nearest triangle goes on.
                        chart.find(place).unwrap_or_else(|| seat.at(place))
                    });
                    Ok((seat, threads))
                });
            match found {
                Ok(button) => trims.buttons.push(button),
                Err(finding) => findings.push(*finding),
            }
        }
        for (i, hole) in scene.buttonhole.iter().enumerate() {
            let path = format!("buttonhole.{i}");
            let button = scene.button.iter().position(|b| b.name == hole.button);
            let found = Chart::new(parsed, geometry, &path, &hole.cloth, &hole.panel)
                .and_then(|chart| chart.seat(hole.at));
            match (button, found) {
                (Some(button), Ok((_, place))) => trims.holes.push((button, place)),
                (None, _) => {}
                (_, Err(finding)) => findings.push(*finding),
            }
        }
        if findings.has_errors() {
            return Err(findings);
        }
        Ok(trims)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.buttons.is_empty()
    }

    /// Counts of buttons and of holes.
    pub fn counts(&self) -> (usize, usize) {
        (self.buttons.len(), self.holes.len())
    }

    /// The term and the points of buttons that sit on cloth at `x` (solver's
    /// order); `None` without buttons.
    ///
    /// # Errors
    /// A message when the model refuses.
    pub(super) fn parts(
        &self,
        parsed: &Parsed,
        x: &[[f64; 3]],
    ) -> Result<Option<TrimParts>, String> {
        if self.is_empty() {
            return Ok(None);
        }
        let scene = &parsed.scene;
        let gap = scene.contact.thickness;
        let (mut bodies, mut threads) = (Vec::new(), Vec::new());
        let mut parts = (Vec::new(), Vec::new(), Vec::new());
        for (i, ((seat, ends), spec)) in self.buttons.iter().zip(&scene.button).enumerate() {
            let centre = (x.len() + 2 * i) as u32;
            let (place, axes) = seat.frame(x);
            bodies.push(TrimBody {
                centre,
                spin: centre + 1,
                orientation: quaternion(&axes),
            });
            let out = axes[2];
            parts
                .0
                .push(std::array::from_fn(|k| place[k] + HEIGHT * gap * out[k]));
            parts.0.push([0.0; 3]);
            let inertia = BodyInertia::disc(spec.mass, spec.radius, spec.radius / 3.0);
            parts.1.extend([spec.mass, inertia.mean()]);
            parts.2.push(centre + 1);
            for (k, end) in ends.iter().enumerate() {
                let arm = direction(k).map(|c| c * spec.radius / 3.0);
                threads.push(TrimThread {
                    points: end.points,
                    weights: end.weights,
                    body: i,
                    arm: [arm[0], arm[1], -HEIGHT * gap],
                    stiffness: spec.stiffness / THREADS as f64,
                });
            }
        }
        for ((button, end), spec) in self.holes.iter().zip(&scene.buttonhole) {
            threads.push(TrimThread {
                points: end.points,
                weights: end.weights,
                body: *button,
                arm: [0.0, 0.0, (HOLE - HEIGHT) * gap],
                stiffness: spec.stiffness,
            });
        }
        let term = trim_term(&bodies, &threads).map_err(|e| e.to_string())?;
        let (points, masses, weightless) = parts;
        Ok(Some(TrimParts {
            term: Term::fixed(term),
            points,
            masses,
            weightless,
        }))
    }

    /// Where the buttons of a simulation are and what they carry.
    pub fn summary(&self, parsed: &Parsed, simulation: &Simulation) -> Vec<TrimSummary> {
        let state = simulation.state();
        let mut terms = simulation.plan().terms.iter();
        let Some(term) = terms.find(|t| t.batch.name() == "trim") else {
            return Vec::new();
        };
        let batch = term.batch.as_ref();
        let at = EvalPoint {
            layout: state.layout,
            q: &state.q,
            q_start: &state.q,
            dt: simulation.settings().control.max_step,
        };
        let mut g = vec![0.0; batch.local_dim()];
        // The gradient at the centre is the force on the cloth.
        let mut pull = |range: std::ops::Range<usize>| {
            let mut sum = [0.0; 3];
            for e in range {
                batch.gradients(&at, e..e + 1, &mut g);
                for k in 0..3 {
                    sum[k] += g[9 + k];
                }
            }
            sum
        };
        let (orientations, _) = batch.history().as_chunks::<4>();
        let first_hole = THREADS * self.buttons.len();
        let buttons = parsed.scene.button.iter().enumerate().map(|(i, b)| {
            let centre = batch.nodes(THREADS * i)[3];
            let holes = self.holes.iter().enumerate();
            TrimSummary {
                name: b.name.clone(),
                center_m: at.point(centre),
                axis: axis(orientations[i]),
                sewn_force_n: pull(THREADS * i..THREADS * (i + 1)),
                hole_force_n: holes
                    .filter(|(_, (button, _))| *button == i)
                    .map(|(h, _)| pull(first_hole + h..first_hole + h + 1))
                    .collect(),
            }
        });
        buttons.collect()
    }
}

/// Where thread `k` goes through a button.
fn direction(k: usize) -> [f64; 2] {
    let h = std::f64::consts::FRAC_1_SQRT_2;
    [[h, h], [-h, h], [-h, -h], [h, -h]][k % THREADS]
}

/// Triangles of one panel with flat coordinates.
struct Chart<'a> {
    parsed: &'a Parsed,
    geometry: &'a Geometry,
    part: &'a Part,
    path: String,
    /// Its name; empty for a sheet.
    panel: String,
    triangles: Vec<usize>,
}

impl<'a> Chart<'a> {
    fn new(
        parsed: &'a Parsed,
        geometry: &'a Geometry,
        path: &str,
        cloth: &str,
        panel: &Option<String>,
    ) -> Result<Self, Box<Finding>> {
        let refuse = |key: &str, message: String, help: String| {
            let path = format!("{path}.{key}");
            let finding = parsed.locations.error("scene::trim", &path, message);
            Box::new(finding.help(help))
        };
        let Some(part) = geometry.part(cloth) else {
            let message = format!("there is no cloth {cloth:?}");
            return Err(refuse("cloth", message, String::new()));
        };
        let name = match (&part.garment, panel) {
            (None, _) => String::new(),
            (Some(sewn), given) => {
                let names: Vec<&str> = sewn.mesh.panels.iter().map(|p| p.name.as_str()).collect();
                match (given, names.as_slice()) {
                    (Some(name), all) if all.contains(&name.as_str()) => name.clone(),
                    (None, [only]) => (*only).to_owned(),
                    (Some(name), all) => {
                        let message =
                            format!("`{path}.panel`: cloth {cloth:?} has no panel {name:?}");
                        return Err(refuse(
                            "panel",
                            message,
                            format!("known: {}", all.join(", ")),
                        ));
                    }
                    (None, all) => {
                        let message = format!("`{path}` does not say on which panel it is");
                        let help = format!("add `panel = \"…\"`, one of {}", all.join(", "));
                        return Err(refuse("panel", message, help));
                    }
                }
            }
        };
        let triangles = (0..geometry.scene_triangles.len())
            .filter(|&t| {
                let panel = usize::from(geometry.scene_panel[t]);
                part.points.contains(&geometry.scene_triangles[t][0])
                    && (part.garment.is_none() || geometry.panel_names[panel] == name)
            })
            .collect();
        Ok(Self {
            parsed,
            geometry,
            part,
            path: path.to_owned(),
            panel: name,
            triangles,
        })
    }

    /// Material coordinates of a place given in the panel's own, and the
    /// triangle there.
    fn seat(&self, at: [f64; 2]) -> Result<([f64; 2], Anchor), Box<Finding>> {
        let panel = self
            .part
            .garment
            .as_ref()
            .and_then(|g| g.mesh.panels.iter().find(|p| p.name == self.panel));
        let place = panel.map_or(at, |p| p.to_material(at));
        if let Some(anchor) = self.find(place) {
            return Ok((place, anchor));
        }
        let own = |m: [f64; 2]| panel.map_or(m, |p| p.from_material(m));
        let corners = self
            .triangles
            .iter()
            .flat_map(|&t| self.geometry.scene_material[t]);
        let (low, high) =
            corners
                .map(own)
                .fold(([f64::MAX; 2], [f64::MIN; 2]), |(low, high), p| {
                    (
                        [low[0].min(p[0]), low[1].min(p[1])],
                        [high[0].max(p[0]), high[1].max(p[1])],
                    )
                });
        let what = match panel {
            Some(_) => format!("panel `{}`", self.panel),
            None => format!("cloth `{}`", self.part.name),
        };
        let path = format!("{}.at", self.path);
        let message = format!(
            "`{path}` = ({:.4}, {:.4}) m lies outside of {what}",
            at[0], at[1]
        );
        let finding = self.parsed.locations.error("scene::trim", &path, message);
        Err(Box::new(finding.help(format!(
            "it reaches from ({:.4}, {:.4}) to ({:.4}, {:.4}) m",
            low[0], low[1], high[0], high[1]
        ))))
    }

    /// The triangle that contains a place in material coordinates.
    fn find(&self, place: [f64; 2]) -> Option<Anchor> {
        let g = self.geometry;
        let inside = |t: &usize| {
            let points = g.scene_triangles[*t].map(|p| g.order.new_of_old[p as usize]);
            let anchor = Anchor {
                points,
                weights: [0.0; 3],
                material: g.scene_material[*t],
            };
            let anchor = anchor.at(place);
            let least = anchor.weights.into_iter().fold(f64::MAX, f64::min);
            (least > -1e-9).then_some(anchor)
        };
        self.triangles.iter().find_map(inside)
    }
}
