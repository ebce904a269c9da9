//! Cloth of a scene as one mesh in the solver's order.

mod draft;
mod order;
mod pieces;

use std::collections::BTreeMap;
use std::ops::Range;

use selvedge_integrator::State;
use selvedge_linsolve::Permutation;
use selvedge_shell_model::ShellMesh;
use selvedge_shell_model::fabric::Fabric;
use selvedge_shell_model::shape::hinge_angles;

use super::cuts;
use super::passages::Passages;
use super::sewn::Sewn;
use super::yarns::YarnCloth;
use crate::diagnostic::Diagnostics;
use crate::driver::Progress;
use crate::file::model::{Cloth, ClothShape, RestAngles};
use crate::file::{Parsed, SceneFile};
use draft::{Draft, add_cloth, part_crossed};
use order::finish;

/// All cloth of a scene.
#[derive(Clone)]
pub struct Geometry {
    /// The mesh in the solver's order.
    pub mesh: ShellMesh,
    /// Initial positions in the solver's order [m].
    pub positions: Vec<[f64; 3]>,
    /// Fabrics by index.
    pub fabrics: Vec<Fabric>,
    /// From the scene's order of points to the solver's and back.
    pub order: Permutation,
    /// For every triangle of the solver its index in the scene's order.
    pub triangle_order: Vec<u32>,
    /// Triangles in the scene's order, naming points in the scene's order.
    pub scene_triangles: Vec<[u32; 3]>,
    /// Material coordinates of their corners [m].
    pub scene_material: Vec<[[f64; 2]; 3]>,
    /// Fabric of each, in the scene's order.
    pub scene_fabric: Vec<u16>,
    /// Panel of each, in the scene's order.
    pub scene_panel: Vec<u16>,
    /// Names of the panels.
    pub panel_names: Vec<String>,
    /// The pieces.
    pub parts: Vec<Part>,
    /// Spring seams in the solver's order: point, edge, weight of its second
    /// end.
    pub spring_seams: Vec<(u32, [u32; 2], f64)>,
    /// Whether any piece is sewn from a pattern.
    pub sewn: bool,
    /// Cloth made of yarns, which is then all of it.
    pub yarns: Option<YarnCloth>,
    /// What is recorded of yarns that leave their contacts.
    pub passages: Option<Passages>,
}

/// One piece of cloth, in the scene's order.
#[derive(Clone)]
pub struct Part {
    /// Its name.
    pub name: String,
    /// Its points.
    pub points: Range<u32>,
    /// Material coordinates of its points [m], for sheets.
    pub material: Option<Vec<[f64; 2]>>,
    /// Points of labelled edges.
    pub labels: BTreeMap<String, Vec<u32>>,
    /// Labels attached to the body.
    pub hold: Vec<String>,
    /// The garment, for pieces sewn from a pattern.
    pub garment: Option<Sewn>,
}

impl Geometry {
    /// Meshes every piece and joins them.
    ///
    /// # Errors
    /// All findings of the pieces, when one is an error.
    pub fn new(
        parsed: &Parsed,
        progress: &mut (dyn Progress + Send),
        warnings: &mut Diagnostics,
    ) -> Result<Self, Diagnostics> {
        let scene = &parsed.scene;
        let mut draft = Draft::default();
        let mut findings = Diagnostics::new();
        for (i, cloth) in scene.cloth.iter().enumerate() {
            add_cloth(parsed, i, cloth, progress, &mut draft, &mut findings);
        }
        if findings.has_errors() {
            return Err(findings);
        }
        if scene.contact.part_crossed == Some(true) {
            part_crossed(parsed, &mut draft, &mut findings);
        }
        let mut geometry = finish(scene, draft)
            .map_err(|message| {
                let mut error = parsed.locations.error("scene::cloth", "cloth", message);
                if scene.cloth.iter().any(Cloth::is_sewn) {
                    error = error.help(
                        "a shorter edge length where panels are narrow; check that no two \
                         stitches join the same edges",
                    );
                }
                // What was suspicious before may be the reason.
                let mut all = findings.clone();
                all.push(error);
                all
            })
            .inspect(|_| warnings.extend(findings.clone()))?;
        if scene.topology.changes && geometry.yarns.is_some() {
            let cuts = cuts::planned(parsed, &geometry)?;
            geometry.passages = Some(Passages::new(&geometry, &cuts));
        }
        Ok(geometry)
    }

    /// Values of points brought to the scene's order; those of trims, which
    /// come after the cloth's, are left out.
    pub fn to_scene<V: Copy>(&self, solver: &[V]) -> Vec<V> {
        self.order.to_old(&solver[..self.order.len()])
    }

    /// Flat coordinates brought to the scene's order.
    pub fn flat_to_scene(&self, solver: &[f64]) -> Vec<f64> {
        self.to_scene(solver.as_chunks::<3>().0).into_flattened()
    }

    /// Rest angle of every hinge \[rad\], where a piece is not flat at rest.
    pub fn rest_angles(&self, scene: &SceneFile) -> Option<Vec<f64>> {
        let curved = |part: &Part| {
            let shape = scene.cloth.iter().find(|c| c.name == part.name);
            let shape = shape.map(|c| &c.shape);
            matches!(shape, Some(ClothShape::Mesh { rest_angles, .. })
                if *rest_angles == RestAngles::Shape)
        };
        let curved: Vec<&Part> = self.parts.iter().filter(|p| curved(p)).collect();
        if curved.is_empty() {
            return None;
        }
        let mut bent = vec![false; self.mesh.points()];
        for p in curved.iter().flat_map(|part| part.points.clone()) {
            bent[self.order.new_of_old[p as usize] as usize] = true;
        }
        let mut angles = hinge_angles(&self.mesh, self.positions.as_flattened());
        for (angle, hinge) in angles.iter_mut().zip(self.mesh.hinges()) {
            if !bent[hinge.points[0] as usize] {
                *angle = 0.0;
            }
        }
        Some(angles)
    }

    /// Everything at rest where it begins.
    pub fn start(&self) -> State {
        match &self.yarns {
            Some(yarns) if yarns.sliding => {
                let positions = match &self.passages {
                    Some(passages) => passages.points(&self.positions),
                    None => self.positions.clone(),
                };
                State::with_scalars(&positions, &yarns.network.arcs())
            }
            _ => State::at_rest(&self.positions),
        }
    }

    /// A piece by its name.
    pub fn part(&self, name: &str) -> Option<&Part> {
        self.parts.iter().find(|p| p.name == name)
    }
}
