mod bounds;
mod measure;
mod memory;
mod near;
mod overlap;
mod pass;
mod skin;
mod source;

use selvedge_energy::EvalPoint;

use bounds::{Bounds, Moves};
use memory::Memory;
use near::{Near, Visit};
use overlap::Overlap;
use pass::{LaggedContact, Pairs, Pass, Task};
use skin::Skin;

use super::check_margin;
use super::envelope::Envelope;
use super::side::Meeting;
use crate::error::check_length;
use crate::friction::{common_coefficient, inverse_masses};
use crate::{
    BvhParry, Candidates, CollisionBackend, CollisionError, CollisionMesh, ContactPotential,
    ContactQuadratic, ContactSet, Friction, ProximityBackend,
};

const NAME: &str = "self-contact";

/// How far detection looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfContactSettings {
    /// Room beyond the predicted motion, for both sides of a pair together
    /// \[m\]. A point that leaves its predicted way by more than half of it asks
    /// for another detection.
    pub margin: f64,
    /// Fraction by which the predicted motion is overshot \[1\].
    pub overshoot: f64,
    /// How far points may drift before slow cloth is searched again \[m\];
    /// zero searches in every step. A quarter of the shortest edge bounds it, of
    /// the thickness where the mesh has segments alone.
    pub skin: f64,
    /// Time in which pairs that begin closer than the thickness part \[s\];
    /// zero lets all their force act at once.
    pub release: f64,
}

impl Default for SelfContactSettings {
    fn default() -> Self {
        Self {
            margin: 5e-4,
            overshoot: 0.25,
            skin: 1e-3,
            release: 0.0,
        }
    }
}

/// Cloth against itself: layers, folds, garment on garment. With a mesh of
/// [segments](CollisionMesh::from_segments) yarns touch, edge against edge.
///
/// Every vertex-triangle and every edge-edge pair closer than the thickness
/// repels, each with its own closest points. All of them count, as in
/// \[Pizana2025\]: near an edge or a vertex of the mesh several pairs share their
/// closest points and the stiffness is a multiple (2 at an edge, the valence at
/// a vertex) of that in a triangle's middle. Counting shared closest points
/// once would make the force jump in folds; with all of them it is continuous
/// while no pair is behind a surface. The price is a contact stiffness that
/// varies over the mesh, which moves the rest gap by micrometres.
///
/// Pairs in contact remember on which side of each other they are, and the
/// anchors of their friction. Cloth that begins closer than the thickness
/// parts within [`release`](SelfContactSettings::release).
pub struct SelfContact {
    pairs: Pairs,
    backend: Box<dyn CollisionBackend>,
    settings: SelfContactSettings,
    envelope: Envelope,
    skin: Skin,
    spare: Memory,
    lagged: Vec<LaggedContact>,
    moves: Moves,
    near: Near,
    tasks: Vec<Task>,
    active: usize,
    deepest: f64,
}

impl SelfContact {
    /// Contact without friction, with the BVH and the quadratic penalty of
    /// [`ContactQuadratic::cloth`] at the thickness of the mesh.
    pub fn new(mesh: CollisionMesh) -> Self {
        let potential = ContactQuadratic {
            thickness: mesh.thickness(),
            ..ContactQuadratic::cloth()
        };
        Self {
            pairs: Pairs {
                mesh,
                potential: Box::new(potential),
                friction: None,
                coefficients: Vec::new(),
                inverse_masses: Vec::new(),
                candidates: Candidates::default(),
                bounds: Bounds::default(),
                memory: Memory::default(),
                overlap: Overlap::default(),
            },
            backend: Box::new(ProximityBackend::new(BvhParry::new())),
            settings: SelfContactSettings::default(),
            envelope: Envelope::default(),
            skin: Skin::default(),
            spare: Memory::default(),
            lagged: Vec::new(),
            moves: Moves::default(),
            near: Near::default(),
            tasks: Vec::new(),
            active: 0,
            deepest: 0.0,
        }
    }

    /// Another back-end.
    #[must_use]
    pub fn with_backend(mut self, backend: Box<dyn CollisionBackend>) -> Self {
        self.backend = backend;
        self
    }

    /// Another potential. Its thickness should be that of the mesh, which the
    /// exclusions were made for.
    #[must_use]
    pub fn with_potential(mut self, potential: Box<dyn ContactPotential>) -> Self {
        self.pairs.potential = potential;
        self
    }

    /// Adds friction. `masses` of all points \[kg\] set the damping of anchors;
    /// an infinite or zero mass is a point that does not move.
    ///
    /// # Errors
    /// [`CollisionError::Parameter`] for a bad parameter,
    /// [`CollisionError::Length`] for too few masses.
    pub fn with_friction(
        mut self,
        friction: Friction,
        masses: &[f64],
    ) -> Result<Self, CollisionError> {
        friction.validate()?;
        check_length("masses", masses.len(), self.pairs.mesh.points())?;
        self.pairs.inverse_masses = inverse_masses(masses);
        self.pairs.friction = Some(friction);
        Ok(self)
    }

    /// Coefficients of all points \[1\], each of the cloth there on itself, in
    /// place of the one of [`with_friction`](Self::with_friction), which has
    /// to come first. A side of a pair has the mean at its closest point, the
    /// pair the [geometric mean](crate::pair_friction) of its sides. Equal
    /// coefficients cost nothing.
    ///
    /// # Errors
    /// [`CollisionError::Length`], and [`CollisionError::Parameter`] for one
    /// that is negative or not finite.
    pub fn with_coefficients(mut self, coefficients: Vec<f64>) -> Result<Self, CollisionError> {
        let common = common_coefficient(&coefficients, self.pairs.mesh.points())?;
        match (self.pairs.friction, common) {
            (None, _) => {}
            (Some(f), Some(common)) => self.pairs.friction = Some(f.with_coefficient(common)),
            (Some(_), None) => self.pairs.coefficients = coefficients,
        }
        Ok(self)
    }

    /// Other settings.
    ///
    /// # Errors
    /// [`CollisionError::Parameter`] for a negative or infinite value.
    pub fn with_settings(mut self, settings: SelfContactSettings) -> Result<Self, CollisionError> {
        check_margin(settings.margin, settings.overshoot)?;
        if !(settings.release >= 0.0 && settings.release.is_finite()) {
            return Err(CollisionError::Parameter {
                name: "release",
                value: settings.release,
                requirement: "finite and not negative",
            });
        }
        self.settings = settings;
        Ok(self)
    }

    /// The mesh.
    pub fn mesh(&self) -> &CollisionMesh {
        &self.pairs.mesh
    }

    /// Pairs of the last detection.
    pub fn pairs(&self) -> &Candidates {
        &self.pairs.candidates
    }

    /// Replaces `out` by the active contacts at a point.
    pub fn contacts(&self, at: &EvalPoint<'_>, out: &mut ContactSet) {
        out.clear();
        let pass = Pass::new(&self.pairs, at, false);
        let all = Visit::All(0..self.pairs.candidates.len());
        pass.each(all, |_, kind, pair, side, _| {
            if let Meeting::Touching(t) = pass.meet(kind, pair, side) {
                out.nodes.push(pass.nodes(kind, pair));
                out.weights.push(t.weights);
                out.normal.push(t.normal);
                out.gap.push(t.gap);
            }
        });
    }
}
