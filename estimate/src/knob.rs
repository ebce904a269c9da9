//! Settings of the integration that are tightened until they no longer matter.

use selvedge_record::compare::Distances;
use selvedge_scene::file::SceneFile;
use selvedge_scene::summary::{Decision, ErrorPart};

use crate::companion::{Companion, Session, scaled_step, scaled_tolerance};
use crate::estimator::{attempt, unknown};
use crate::parts::{algebraic_part, scatter_part, time_part};
use crate::{EstimateError, MaterialMap};

/// How hard a setting is looked for.
#[derive(Clone, Copy)]
pub(crate) struct Effort {
    /// How often it is tightened at most.
    pub times: usize,
    /// How often in vain.
    pub patience: usize,
    /// Told apart from other searches in the companions' folders.
    pub suffix: &'static str,
}

/// A setting of the integration that is tightened until it no longer matters.
pub(crate) struct Knob {
    /// Of the companions' folders.
    name: &'static str,
    tighten: fn(&SceneFile) -> SceneFile,
    /// What the difference has to fall to, beside the smallest before, to count
    /// as closer.
    falls_to: f64,
    /// Error from the distance to the tightened run, and what both ran on.
    part: fn(Distances, &str) -> ErrorPart,
    /// The tightened setting, in words.
    other: &'static str,
    /// The same beside its loose twin.
    fraction: &'static str,
    /// Keys it stands for, and their values.
    values: fn(&SceneFile) -> Vec<(&'static str, f64)>,
}

pub(crate) const STEP: Knob = Knob {
    name: "step",
    tighten: |scene| scaled_step(scene, 0.5),
    // A half would be the order 1.
    falls_to: 0.75,
    part: time_part,
    other: "steps half as long",
    fraction: "half",
    values: |scene| vec![("integrator.max_step", scene.integrator.max_step)],
};

pub(crate) const TOLERANCE: Knob = Knob {
    name: "tolerance",
    tighten: |scene| scaled_tolerance(scene, 0.1),
    // A tenth would be in proportion; tight runs are too dear for less.
    falls_to: 0.5,
    part: algebraic_part,
    other: "a tenth of it",
    fraction: "a tenth",
    values: |scene| {
        vec![
            (
                "integrator.newton_tolerance",
                scene.integrator.newton_tolerance,
            ),
            ("solver.tolerance", scene.solver.tolerance),
        ]
    },
};

impl Knob {
    /// Whether it stands for the same setting.
    pub(crate) fn is(&self, other: &Self) -> bool {
        self.name == other.name
    }

    /// Tightens the setting of `now` until the error is within its share, or
    /// until tightening no longer brings the results closer.
    pub(crate) fn choose(
        &self,
        session: &mut Session<'_>,
        now: &mut Companion,
        share: f64,
        effort: Effort,
        mesh: &str,
        decisions: &mut Vec<Decision>,
    ) -> Result<ErrorPart, EstimateError> {
        let mut part = unknown(&format!("no {} could be compared", self.name));
        let mut why = None;
        let mut seen: Vec<Distances> = Vec::new();
        // The setting before the smallest difference, and that difference's place.
        let mut best: Option<(Companion, usize)> = None;
        for k in 0..=effort.times {
            let tight = (self.tighten)(now.built.scene());
            let name = format!("estimate/{}{}-{k}", self.name, effort.suffix);
            let tight = match attempt(session, &name, None, tight, false)? {
                Ok(tight) => tight,
                Err(reason) => {
                    let fraction = self.fraction;
                    why = Some(format!("{fraction} of it could not be run: {reason}"));
                    break;
                }
            };
            let distance = MaterialMap::new(now.surface())?.distance(&tight.surface());
            seen.push(distance);
            part = (self.part)(distance, mesh);
            if part.error_m.is_some_and(|e| e <= share) || k == effort.times {
                break;
            }
            let least = best.as_ref().map(|(_, b)| seen[*b].mean);
            if least.is_none_or(|least| distance.mean < self.falls_to * least) {
                best = Some((std::mem::replace(now, tight), k));
            } else if let Some((loose, b)) = best.take_if(|(_, b)| k >= *b + effort.patience) {
                // Differences that add up are no scatter: the whole way counts too.
                seen.push(MaterialMap::new(loose.surface())?.distance(&tight.surface()));
                *now = loose;
                part = scatter_part(&seen[b..], mesh);
                why = Some(format!(
                    "{} moves the cloth by {} mm, and tightening further brings the results no \
                     closer: they scatter by {} mm",
                    self.other,
                    mm(Some(seen[b].mean)),
                    mm(part.error_m)
                ));
                break;
            } else {
                *now = tight;
            }
        }
        let why = why.unwrap_or_else(|| reason(&part, share, self.other));
        let values = (self.values)(now.built.scene());
        for (setting, value) in values {
            let decision = Decision {
                setting: setting.to_owned(),
                value: value.into(),
                why: why.clone(),
            };
            match decisions.iter_mut().find(|d| d.setting == setting) {
                Some(earlier) => *earlier = decision,
                None => decisions.push(decision),
            }
        }
        Ok(part)
    }
}

fn reason(part: &ErrorPart, share: f64, other: &str) -> String {
    let distance = part.distance_m.map(|d| d[0]);
    let within = part.error_m.is_some_and(|e| e <= share);
    format!(
        "{other} would move the cloth by {} mm: {} {} mm that {}",
        mm(distance),
        if within {
            "within the"
        } else {
            "more than the"
        },
        mm(Some(share)),
        if within {
            "it may take"
        } else {
            "it should take, but nothing smaller is tried"
        }
    )
}

pub(crate) fn mm(metres: Option<f64>) -> String {
    metres.map_or("?".to_owned(), |m| format!("{:.3}", 1e3 * m))
}
