//! Pins, attachments and motions.

use super::super::model::{ClothShape, Keyframe, PinKind, Select, dense_keys};
use super::super::suggest::show;
use super::Check;

/// Speed of a motion above which it is taken for a mistake [m/s].
const MOST_SPEED: f64 = 100.0;

impl Check<'_> {
    pub(super) fn holds(&mut self) {
        let scene = self.scene;
        let cloths: Vec<&str> = scene.cloth.iter().map(|c| c.name.as_str()).collect();
        let bodies: Vec<&str> = scene.body.iter().map(|b| b.name.as_str()).collect();
        for (i, pin) in scene.pin.iter().enumerate() {
            let path = format!("pin.{i}");
            self.reference(&format!("{path}.cloth"), "cloth", &pin.cloth, &cloths);
            self.select(&path, &pin.cloth, &pin.select);
            self.motion(&path, &pin.motion);
            self.no_jump(&path, &pin.motion);
            match pin.kind {
                PinKind::Fixed {} => {}
                PinKind::Plane { normal } => self.direction(&format!("{path}.normal"), normal),
                PinKind::Line { direction } => {
                    self.direction(&format!("{path}.direction"), direction);
                }
            }
        }
        for (i, attachment) in scene.attachment.iter().enumerate() {
            let path = format!("attachment.{i}");
            self.reference(
                &format!("{path}.cloth"),
                "cloth",
                &attachment.cloth,
                &cloths,
            );
            self.select(&path, &attachment.cloth, &attachment.select);
            self.motion(&path, &attachment.motion);
            self.no_jump(&path, &attachment.motion);
            if let Some(body) = &attachment.body {
                self.reference(&format!("{path}.body"), "body", body, &bodies);
                if !attachment.motion.is_empty() {
                    self.error(
                        "scene::value",
                        &format!("{path}.motion"),
                        format!("`{path}` follows a body and has a motion of its own"),
                        "remove `body` or `motion`",
                    );
                }
            }
        }
    }

    /// Cloth that is held cannot be somewhere else at the first step.
    fn no_jump(&mut self, path: &str, motion: &[Keyframe]) {
        let Some(first) = motion.first() else { return };
        let moved = |x: &f64| x.abs() > 1e-6;
        let jumps = dense_keys(&[*first])
            .iter()
            .any(|k| k.translation.iter().chain(&k.rotation).any(moved));
        if jumps {
            self.warning(
                "scene::motion",
                &format!("{path}.motion.0"),
                format!("`{path}.motion.0` moves the points within the first step"),
                "put a keyframe without translation and rotation before it",
            );
        }
    }

    fn select(&mut self, path: &str, cloth: &str, select: &Select) {
        let shape = self
            .scene
            .cloth
            .iter()
            .find(|c| c.name == cloth)
            .map(|c| &c.shape);
        let at = |key: &str| format!("{path}.select.{key}");
        let sheet_only = |key: &str| {
            (
                at(key),
                format!("`{}`: only a sheet has {key}s by name", at(key)),
                "select by box, points, label or nearest",
            )
        };
        let wrong = match (select, shape) {
            (Select::Corner(_), Some(shape)) if is_irregular(shape) => Some(sheet_only("corner")),
            (Select::Edge(_), Some(shape)) if is_irregular(shape) => Some(sheet_only("edge")),
            (Select::Label(_), Some(ClothShape::Sheet { .. } | ClothShape::Mesh { .. })) => Some((
                at("label"),
                format!("`{}`: only a pattern has labels", at("label")),
                "select by box, points or nearest",
            )),
            (Select::Points(points), _) if points.is_empty() => Some((
                at("points"),
                format!("`{}` is empty", at("points")),
                "list at least one point, by number from 0",
            )),
            (Select::Box { min, max }, _) if (0..3).any(|k| min[k] > max[k]) => Some((
                at("box.max"),
                format!("`{}` has no inside: `max` is less than `min`", at("box")),
                "every component of `max` at least that of `min`",
            )),
            _ => None,
        };
        if let Some((path, message, help)) = wrong {
            self.error("scene::select", &path, message, help);
        }
    }

    pub(super) fn motion(&mut self, path: &str, motion: &[Keyframe]) {
        for (i, key) in motion.iter().enumerate() {
            let at = format!("{path}.motion.{i}");
            self.rotation(&format!("{at}.rotation"), &key.rotation);
            let before = i.checked_sub(1).map(|j| &motion[j]);
            let Some(before) = before else { continue };
            if key.time <= before.time {
                self.error(
                    "scene::value",
                    &format!("{at}.time"),
                    format!(
                        "`{at}.time` = {} s does not come after {} s",
                        show(key.time),
                        show(before.time)
                    ),
                    "times of keyframes have to increase",
                );
            }
            let moved = (0..3).map(|k| (key.translation[k] - before.translation[k]).powi(2));
            let speed = moved.sum::<f64>().sqrt() / (key.time - before.time);
            if speed > MOST_SPEED {
                self.warning(
                    "scene::motion",
                    &format!("{at}.translation"),
                    format!("`{path}` moves at {speed:.0} m/s between two keyframes"),
                    "times are in s, translations in m",
                );
            }
            // where no keys could be added in between, more than half a turn
            // would be taken the other way round
            let pair = [*before, *key];
            if dense_keys(&pair).windows(2).any(|w| {
                let turn = |k: usize| w[1].rotation[k] - w[0].rotation[k];
                turn(0).hypot(turn(1)).hypot(turn(2)) >= std::f64::consts::PI
            }) {
                self.warning(
                    "scene::motion",
                    &format!("{at}.rotation"),
                    format!("more than half a turn between two keyframes of `{path}`"),
                    "add keyframes in between, or turn about one axis: the shorter way is taken",
                );
            }
        }
    }
}

/// Whether cloth has no corners and edges by name.
fn is_irregular(shape: &ClothShape) -> bool {
    matches!(
        shape,
        ClothShape::Mesh { .. }
            | ClothShape::Pattern { .. }
            | ClothShape::KnitMesh { .. }
            | ClothShape::KnitPattern { .. }
            | ClothShape::WovenMesh { .. }
    )
}
