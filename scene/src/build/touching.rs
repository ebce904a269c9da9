//! Cloth that touches itself: shells by their triangles, yarns by their segments.

use selvedge_collision::{
    CollisionError, CollisionMesh, ContactQuadratic, ContactStiffness, Joined, Segment,
    SelfContact, SelfContactSettings,
};
use selvedge_yarn_model::YarnNetwork;

use super::{BuiltScene, system};

/// Ways along yarns, from contact to contact, below which two segments never touch,
/// in diameters: a loop is two to three wide.
const NEAR: f64 = 3.0;

/// The same where the construction itself lays them closer than they keep: at
/// bound-off edges, in stitches knitted together.
const NEAR_LAID: f64 = 6.0;

/// Centre lines of yarns that come closer than this part of the distance that
/// they keep have passed into each other.
const INSIDE: f64 = 0.5;

impl BuiltScene {
    /// Contact of the cloth with itself, without friction.
    pub(super) fn touching(&self) -> Result<SelfContact, CollisionError> {
        let c = &self.scene().contact;
        let mesh = self.touching_mesh()?;
        let mut settings = SelfContactSettings {
            release: c.release,
            ..SelfContactSettings::default()
        };
        if self.geometry.yarns.is_some() {
            // Yarns may be finer than any cloth of triangles.
            settings.margin = settings.margin.min(0.5 * mesh.thickness());
        }
        let potential = ContactQuadratic {
            thickness: mesh.thickness(),
            stiffness: ContactStiffness::PerPair(c.stiffness),
            ..ContactQuadratic::cloth()
        };
        SelfContact::new(mesh)
            .with_backend(system::backend(c.broad_phase))
            .with_potential(Box::new(potential))
            .with_settings(settings)
    }

    fn touching_mesh(&self) -> Result<CollisionMesh, CollisionError> {
        let g = &self.geometry;
        if let Some(yarns) = &g.yarns {
            return yarn_mesh(&yarns.network);
        }
        let springs = g.spring_seams.iter();
        let links: Vec<[u32; 2]> = springs.flat_map(|(p, e, _)| e.map(|e| [*p, e])).collect();
        CollisionMesh::new(
            g.mesh.points(),
            g.mesh.triangles().to_vec(),
            g.mesh.material(),
            &links,
            self.scene().contact.thickness,
        )
    }

    /// Places where yarns that no stitch joins have passed into each other [m].
    pub(crate) fn passed_into(&self, q: &[f64]) -> Result<Vec<[f64; 3]>, CollisionError> {
        let found = self.touching()?.closer_than(INSIDE, q)?;
        Ok(found.into_iter().map(|(place, _)| place).collect())
    }
}

/// Segments of yarns, each with its length at rest.
fn yarn_mesh(n: &YarnNetwork) -> Result<CollisionMesh, CollisionError> {
    let segment = |[a, b]: [u32; 2]| {
        let strands = [a, b].map(|s| n.strands[s as usize]);
        Segment {
            ends: strands.map(|s| s.node),
            length: strands[1].arc - strands[0].arc,
            radius: n.material_of(a).radius,
        }
    };
    let segments: Vec<Segment> = n.segments().map(segment).collect();
    let radius = segments.iter().map(|s| s.radius).fold(0.0, f64::max);
    let joined = Joined {
        near: NEAR * 2.0 * radius,
        near_laid: NEAR_LAID * 2.0 * radius,
        laid: n.points.as_flattened(),
    };
    CollisionMesh::from_segments(n.nodes(), &segments, joined)
}
