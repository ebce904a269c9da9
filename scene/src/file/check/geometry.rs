//! Cloths and bodies.

use super::super::model::{BodyShape, Cloth, ClothShape, Rotation};
use super::super::suggest::show;
use super::Check;

/// Points above which a sheet is taken for a mistake.
const MOST_POINTS: f64 = 5e6;

impl Check<'_> {
    pub(super) fn cloths(&mut self) {
        let scene = self.scene;
        for (i, cloth) in scene.cloth.iter().enumerate() {
            let path = format!("cloth.{i}");
            self.rotation(&format!("{path}.rotation"), &cloth.rotation);
            match &cloth.shape {
                ClothShape::Sheet {
                    size,
                    points,
                    edge_length,
                    ..
                } => self.sheet(&path, *size, *points, *edge_length),
                ClothShape::Mesh { file, .. }
                | ClothShape::Pattern { file, .. }
                | ClothShape::KnitMesh { file, .. }
                | ClothShape::KnitPattern { file, .. }
                | ClothShape::WovenMesh { file, .. } => {
                    self.input_file(&format!("{path}.file"), file);
                }
                ClothShape::Knit { .. } | ClothShape::Woven { .. } => {}
            }
            if !matches!(cloth.shape, ClothShape::Mesh { .. }) && !cloth.is_of_yarns() {
                self.spacing(&path, cloth.edge_length());
            }
        }
    }

    /// Cuts go through yarns that may leave their contacts.
    pub(super) fn cuts(&mut self) {
        let scene = self.scene;
        let cloths: Vec<&str> = scene.cloth.iter().map(|c| c.name.as_str()).collect();
        for (i, cut) in scene.cut.iter().enumerate() {
            let path = format!("cut.{i}");
            self.reference(&format!("{path}.cloth"), "cloth", &cut.cloth, &cloths);
            let cloth = scene.cloth.iter().find(|c| c.name == cut.cloth);
            let kind = cloth.map(|c| &c.shape);
            if cloth.is_some_and(|c| !c.is_of_yarns()) {
                self.error(
                    "scene::cut",
                    &format!("{path}.cloth"),
                    format!("`{path}`: cloth {:?} is not made of yarns", cut.cloth),
                    "a shell cannot be cut while it moves; cut the pattern instead",
                );
            } else if matches!(kind, Some(ClothShape::KnitPattern { .. })) {
                self.error(
                    "scene::cut",
                    &format!("{path}.cloth"),
                    format!(
                        "`{path}`: the panels of cloth {:?} have coordinates of their own, which \
                         lie on each other",
                        cut.cloth
                    ),
                    "drape the pattern as a shell and knit its `final.obj` (`kind = \"knit-mesh\"`)",
                );
            } else if !scene.topology.changes {
                self.error(
                    "scene::cut",
                    "topology.changes",
                    "yarns that are cut leave their contacts",
                    "`topology.changes = true`, or leave it out",
                );
            }
            if cut.from == cut.to {
                self.error(
                    "scene::cut",
                    &format!("{path}.to"),
                    format!("`{path}` has no length: `to` is `from`"),
                    "another place",
                );
            }
            if cut.time > scene.simulation.duration {
                self.warning(
                    "scene::cut",
                    &format!("{path}.time"),
                    format!(
                        "`{path}.time` = {} s is after the end of the run at {} s",
                        cut.time, scene.simulation.duration
                    ),
                    "a longer `simulation.duration`",
                );
            }
        }
    }

    /// Cloth of yarns keeps to itself, and slides all or none.
    pub(super) fn yarns(&mut self) {
        let cloth = &self.scene.cloth;
        let Some(first) = cloth.iter().position(Cloth::is_of_yarns) else {
            if self.scene.topology.changes {
                self.warning(
                    "scene::yarns",
                    "topology.changes",
                    "`topology.changes` does nothing: no cloth is made of yarns",
                    "leave it out",
                );
            }
            return;
        };
        let other = cloth.iter().position(|c| !c.is_of_yarns());
        if let Some(other) = other {
            self.error(
                "scene::yarns",
                &format!("cloth.{other}.kind"),
                format!("`cloth.{other}` is a shell, `cloth.{first}` is made of yarns"),
                "a scene has cloth of one kind; put the other into a scene of its own",
            );
        }
        let unlike = cloth
            .iter()
            .position(|c| c.slides().is_some_and(|s| Some(s) != cloth[first].slides()));
        if let Some(unlike) = unlike {
            self.error(
                "scene::yarns",
                &format!("cloth.{unlike}.sliding"),
                format!("yarns of `cloth.{unlike}` and of `cloth.{first}` differ in `sliding`"),
                "the same in every cloth of a scene",
            );
        }
        if self.scene.topology.changes && cloth[first].slides() != Some(true) {
            self.error(
                "scene::yarns",
                "topology.changes",
                "`topology.changes` needs yarns that slide",
                "`sliding = true` in every cloth",
            );
        }
        if self.scene.solver.matrix != super::super::model::MatrixKind::Dual {
            self.error(
                "scene::yarns",
                "solver.matrix",
                "cloth of yarns needs `solver.matrix` = \"dual\"",
                "leave it out",
            );
        }
        if self.scene.solver.kind == super::super::model::SolverKind::Refined {
            self.error(
                "scene::yarns",
                "solver.kind",
                "`solver.kind` = \"refined\" does not take arc lengths",
                "\"cg\" or \"direct\"",
            );
        }
    }

    /// Layers are there to touch.
    pub(super) fn layers(&mut self) {
        let off = self.scene.contact.self_contact == super::super::model::Switch::Off;
        if off && self.scene.cloth.iter().any(Cloth::is_layered) {
            self.warning(
                "scene::layer",
                "contact.self",
                "`contact.self` = false lets layers of cloth pass through each other",
                "leave it out",
            );
        }
    }

    fn sheet(
        &mut self,
        path: &str,
        size: [f64; 2],
        points: Option<[usize; 2]>,
        edge_length: Option<f64>,
    ) {
        let at = |key: &str| format!("{path}.{key}");
        if points.is_some() && edge_length.is_some() {
            self.error(
                "scene::value",
                &at("points"),
                format!("`{path}` has both `points` and `edge_length`"),
                "remove one of them",
            );
        }
        let (key, edge) = match edge_length {
            Some(edge) => (at("edge_length"), edge),
            None => ("mesh.edge_length".to_owned(), self.scene.mesh.edge_length),
        };
        // a default that does not suit the sheet is reported at the sheet
        let key = if self.locations.is_set(&key) {
            key
        } else {
            at("size")
        };
        let count = match points {
            Some([n, m]) => n as f64 * m as f64,
            None if edge > size[0].min(size[1]) => {
                self.error(
                    "scene::value",
                    &key,
                    format!(
                        "the edge length {} m is longer than the sheet of {} m × {} m",
                        show(edge),
                        show(size[0]),
                        show(size[1])
                    ),
                    "a tenth of the shorter side or less; lengths are in m",
                );
                return;
            }
            None => (size[0] / edge + 1.0) * (size[1] / edge + 1.0),
        };
        if count > MOST_POINTS {
            self.error(
                "scene::value",
                &if points.is_some() { at("points") } else { key },
                format!("the sheet would have {count:.0} points"),
                "a longer `edge_length` or a smaller `size`; lengths are in m",
            );
        }
    }

    /// Contact thickness against edge length: neighbours must not repel.
    fn spacing(&mut self, path: &str, own: Option<f64>) {
        let edge = own.unwrap_or(self.scene.mesh.edge_length);
        let thickness = self.scene.contact.thickness;
        let off = self.scene.contact.self_contact == super::super::model::Switch::Off;
        if off || thickness <= 0.25 * edge {
            return;
        }
        let candidates = [
            "contact.thickness".to_owned(),
            format!("{path}.edge_length"),
            format!("{path}.points"),
            "mesh.edge_length".to_owned(),
        ];
        let set = candidates.iter().find(|p| self.locations.is_set(p));
        let at = set.unwrap_or(&candidates[0]).clone();
        self.warning(
            "scene::thickness",
            &at,
            format!(
                "`contact.thickness` = {} m is more than a quarter of the edge length {} m of \
                 `{path}`: neighbours repel each other",
                show(thickness),
                show(edge)
            ),
            format!("`contact.thickness` = {} or less", show(0.25 * edge)),
        );
    }

    pub(super) fn bodies(&mut self) {
        let scene = self.scene;
        for (i, body) in scene.body.iter().enumerate() {
            let path = format!("body.{i}");
            self.shape(&path, &body.shape);
            self.motion(&path, &body.motion);
        }
    }

    fn shape(&mut self, path: &str, shape: &BodyShape) {
        let at = |key: &str| format!("{path}.{key}");
        match shape {
            BodyShape::Ellipsoid { rotation, .. } => self.rotation(&at("rotation"), rotation),
            BodyShape::Box {
                size,
                rotation,
                rounding,
                ..
            } => {
                self.rotation(&at("rotation"), rotation);
                let most = 0.5 * size.iter().copied().fold(f64::INFINITY, f64::min);
                if *rounding > most {
                    self.error(
                        "scene::value",
                        &at("rounding"),
                        format!("`{}` = {} m does not fit", at("rounding"), show(*rounding)),
                        format!("at most half the shortest side, {} m", show(most)),
                    );
                }
            }
            BodyShape::Plane { normal, .. } => self.direction(&at("normal"), *normal),
            BodyShape::Union { shapes, .. } => {
                if shapes.is_empty() {
                    self.error(
                        "scene::value",
                        &at("shapes"),
                        format!("`{}` is empty", at("shapes")),
                        "list at least one shape",
                    );
                }
                for (i, part) in shapes.iter().enumerate() {
                    self.shape(&at(&format!("shapes.{i}")), &part.shape);
                }
            }
            BodyShape::Mesh { file, rotation, .. } => {
                self.rotation(&at("rotation"), rotation);
                self.input_file(&at("file"), file);
            }
            BodyShape::Capsule { from, to, .. } => {
                if from == to {
                    self.warning(
                        "scene::value",
                        &at("to"),
                        format!("both ends of `{path}` are at the same place"),
                        "use `kind = \"sphere\"`",
                    );
                }
            }
            BodyShape::Sphere { .. } | BodyShape::Mannequin { .. } => {}
        }
    }

    pub(super) fn rotation(&mut self, path: &str, rotation: &Rotation) {
        if let Rotation::AxisAngle { axis, .. } = rotation {
            self.direction(&format!("{path}.axis"), *axis);
        }
    }

    pub(super) fn direction(&mut self, path: &str, v: [f64; 3]) {
        let length = v[0].hypot(v[1]).hypot(v[2]);
        if !(length.is_normal() && length > 1e-150 && length < 1e150) {
            self.error(
                "scene::value",
                path,
                format!("`{path}` has no direction"),
                "a vector that is not zero, for example [0, 1, 0]",
            );
        }
    }
}
