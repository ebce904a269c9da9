//! What cloth touches, and how it rubs.

use std::sync::Arc;

use selvedge_collision::{
    AgainstBodies, Body, BodyContact, BodyElement, BodyFaces, CollisionError, ContactQuadratic,
    ContactSource, ContactStiffness, Friction, FrictionAnchored, FrictionLagged, pair_friction,
};

use super::{BuiltScene, StageOptions, holds};
use crate::file::model::{Cloth, FrictionModel, Switch};

/// Least and greatest coefficient of each kind of contact \[1\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrictionRange {
    /// Cloth on cloth.
    pub on_cloth: [f64; 2],
    /// Cloth on bodies; zeros without bodies.
    pub on_bodies: [f64; 2],
}

impl BuiltScene {
    /// Whether cloth may touch itself, and why.
    pub fn self_contact(&self) -> (bool, &'static str) {
        match self.scene().contact.self_contact {
            Switch::On => (true, "the scene says so"),
            Switch::Off => (false, "the scene says so"),
            Switch::Auto if self.geometry.yarns.is_some() => (
                false,
                "stitches join yarns; others touch with `contact.self = true`",
            ),
            Switch::Auto if self.scene().cloth.iter().any(Cloth::is_layered) => {
                (true, "there are layers")
            }
            Switch::Auto if self.geometry.sewn => (true, "a sewn garment touches itself"),
            Switch::Auto if self.geometry.parts.len() > 1 => {
                (true, "there are several pieces of cloth")
            }
            Switch::Auto if !self.bodies.is_empty() => {
                (true, "cloth on a body can fold onto itself")
            }
            Switch::Auto => (false, "a single piece without a body"),
        }
    }

    /// Least and greatest coefficients of friction that the materials give.
    pub fn friction(&self) -> FrictionRange {
        let range = |values: &mut dyn Iterator<Item = f64>| {
            values
                .map(|v| [v, v])
                .reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
                .unwrap_or_default()
        };
        let g = &self.geometry;
        let of_cloth = |f: &u16| self.fabric_friction(*f);
        let cloth = match &g.yarns {
            Some(_) => range(&mut self.point_friction().into_iter()),
            None => range(&mut g.mesh.fabric().iter().map(of_cloth)),
        };
        let bodies = range(&mut self.bodies.iter().filter_map(|b| b.body.friction()));
        FrictionRange {
            on_cloth: cloth,
            on_bodies: [0, 1].map(|i| pair_friction(cloth[i], bodies[i])),
        }
    }

    fn fabric_friction(&self, fabric: u16) -> f64 {
        let own = self.geometry.fabrics[usize::from(fabric)].friction;
        self.scene().contact.friction.unwrap_or(own)
    }

    /// Coefficient of the cloth at every point: the mean over the triangles
    /// around it, weighted by area.
    fn point_friction(&self) -> Vec<f64> {
        if let Some(yarns) = &self.geometry.yarns {
            let of_yarns = yarns.point_friction();
            return match self.scene().contact.friction {
                Some(mu) => vec![mu; of_yarns.len()],
                None => of_yarns,
            };
        }
        let mesh = &self.geometry.mesh;
        let mut sums = vec![[0.0; 2]; mesh.points()];
        let mut equal = true;
        let first = mesh.fabric().first().map(|f| self.fabric_friction(*f));
        for (t, points) in mesh.triangles().iter().enumerate() {
            let (mu, area) = (self.fabric_friction(mesh.fabric()[t]), mesh.rest_area(t));
            equal &= Some(mu) == first;
            for p in points {
                sums[*p as usize][0] += area * mu;
                sums[*p as usize][1] += area;
            }
        }
        match first {
            // Without the round-off of a mean.
            Some(mu) if equal => vec![mu; mesh.points()],
            _ => sums.iter().map(|[s, a]| s / a).collect(),
        }
    }

    /// Whether bodies meet triangles, and why.
    pub fn body_faces(&self) -> (bool, &'static str) {
        match self.scene().contact.body_faces {
            _ if self.bodies.is_empty() => (false, "no bodies"),
            _ if self.geometry.mesh.triangles().is_empty() => (false, "no triangles"),
            Some(true) => (true, "`contact.body_faces` is true"),
            _ => (false, "`contact.body_faces` is not true"),
        }
    }

    /// The contacts of a stage, between points of these masses [kg].
    pub(super) fn contacts(
        &self,
        stage: &StageOptions,
        masses: &[f64],
        pins: Option<&holds::BuiltPins>,
    ) -> Result<Vec<Box<dyn ContactSource>>, CollisionError> {
        let mut contacts: Vec<Box<dyn ContactSource>> = Vec::new();
        let bodies: Vec<Arc<dyn Body>> = self.bodies.iter().map(|b| b.body.clone()).collect();
        let held = |p: &u32| pins.is_some_and(|pins| pins.pins.filter.rank(*p) >= 3);
        let (points, thickness) = (masses.len(), self.body_thickness());
        if !bodies.is_empty() {
            let contact = BodyContact::new(points, bodies.clone());
            let mut contact = self.on_bodies(contact, thickness, stage, masses)?;
            if pins.is_some() {
                let free = (0..points as u32).filter(|p| !held(p)).collect();
                contact = contact.with_points(free)?;
            }
            contacts.push(Box::new(contact));
        }
        if self.body_faces().0 {
            let triangles = self.geometry.mesh.triangles().iter();
            let free = triangles.filter(|t| !t.iter().all(held)).copied();
            let contact = BodyFaces::new(points, free.collect(), bodies)?;
            contacts.push(Box::new(self.on_bodies(
                contact,
                0.5 * thickness,
                stage,
                masses,
            )?));
        }
        if stage.self_contact && self.self_contact().0 {
            let mut contact = self.touching()?;
            if let Some(friction) = self.friction_model(stage, self.friction().on_cloth[1]) {
                contact = contact
                    .with_friction(friction, masses)?
                    .with_coefficients(self.point_friction())?;
            }
            contacts.push(Box::new(contact));
        }
        Ok(contacts)
    }

    /// What contact of points and of triangles with bodies have in common.
    fn on_bodies<E: BodyElement>(
        &self,
        contact: AgainstBodies<E>,
        thickness: f64,
        stage: &StageOptions,
        masses: &[f64],
    ) -> Result<AgainstBodies<E>, CollisionError> {
        let still: Vec<bool> = self.bodies.iter().map(|b| !b.moves).collect();
        let potential = ContactQuadratic {
            thickness,
            stiffness: ContactStiffness::PerPair(self.scene().contact.body_stiffness),
            ..ContactQuadratic::body()
        };
        let mut contact = contact
            .with_potential(Box::new(potential))
            .with_still(&still)?;
        // Steps of a static solve are no motion.
        if stage.statics.is_none() {
            contact = contact.with_masses(masses)?;
        }
        match self.friction_model(stage, self.friction().on_bodies[1]) {
            Some(friction) => contact
                .with_friction(friction, masses)?
                .with_coefficients(self.point_friction()),
            None => Ok(contact),
        }
    }

    /// Friction of the scene's model, where there is any in a stage.
    fn friction_model(&self, stage: &StageOptions, coefficient: f64) -> Option<Friction> {
        let c = &self.scene().contact;
        if !stage.friction || coefficient <= 0.0 {
            return None;
        }
        match c.friction_model {
            FrictionModel::None => None,
            FrictionModel::Anchored => Some(Friction::Anchored(FrictionAnchored {
                stiffness_ratio: c.anchor_stiffness,
                ..FrictionAnchored::new(coefficient)
            })),
            FrictionModel::Lagged => Some(Friction::Lagged(FrictionLagged::new(coefficient))),
        }
    }

    /// Distance that cloth keeps from bodies [m]: with yarns at least two
    /// radii, since their points lie in the middle of two yarns.
    pub fn body_thickness(&self) -> f64 {
        let yarns = self.geometry.yarns.as_ref().map(|y| &y.network.materials);
        let radii = yarns.into_iter().flatten().map(|m| 2.0 * m.radius);
        radii.fold(self.scene().contact.body_thickness, f64::max)
    }
}
