mod deepest;
mod search;

use std::ops::Range;
use std::sync::Arc;

use super::against_bodies::{
    AgainstBodies, Candidate, Element, NotFinite, Pass, Search, Task, Touch,
};
use crate::mesh::check_element;
use crate::vec3::{Mat3, Vec3, norm, point, scale, unit};
use crate::{Body, CollisionError, ContactQuadratic, ContactResponse, LaggedResponse};
use deepest::{Face, blend};

/// Thicknesses below which a deepest point and a corner are equally deep: more
/// than the round-off of distances.
const SAME: f64 = 1e-6;

/// Edges and insides of triangles against bodies, between the points that
/// [`BodyContact`](super::BodyContact) takes care of.
///
/// ```text
/// φ* = min φ(Σ b_i x_i)   over the triangle
/// E = Σ max(0, E_f(φ*) − E_f(min φ(x_i)))
/// f_i = −E_f'(φ*) b_i ∇φ   and   +E_f' ∇φ at the lowest corner
/// K = b bᵀ ⊗ E_f'' ∇φ ∇φᵀ
/// ```
/// Every triangle has its deepest point and pays for what that is deeper than
/// its deepest corner: a body that meets the corner first is the point's own
/// affair, and on flat bodies nothing acts. The energy is continuous; the
/// forces are its derivatives, exact since `φ*` does not change with `b` at a
/// minimum. `K` is that of the deepest point, without the corner's, which is
/// negative. An edge has a contact for each of its triangles.
///
/// The thickness of the potential should be less than that of the points (half
/// of it in scenes): where the distance is nearly flat, the deepest point of a
/// triangle at the points' own distance would jump with round-off.
///
/// Friction and steps that come too fast are as with points; anchors sit at a
/// point of the triangle.
pub type BodyFaces = AgainstBodies<Triangles>;

/// Triangles of cloth, at their deepest points.
pub struct Triangles {
    corners: Vec<[u32; 3]>,
    points: usize,
}

impl AgainstBodies<Triangles> {
    /// Contact of triangles of `points` points without friction, with the
    /// penalty of [`ContactQuadratic::body`] at half its thickness.
    ///
    /// # Errors
    /// [`CollisionError::PointOutOfRange`], and [`CollisionError::RepeatedPoint`]
    /// for a triangle that is none.
    pub fn new(
        points: usize,
        triangles: Vec<[u32; 3]>,
        bodies: Vec<Arc<dyn Body>>,
    ) -> Result<Self, CollisionError> {
        for (index, t) in triangles.iter().enumerate() {
            check_element("triangle", index, t, points)?;
        }
        let whole = ContactQuadratic::body();
        let thickness = 0.5 * whole.thickness;
        let potential = Box::new(ContactQuadratic { thickness, ..whole });
        let all = Triangles {
            corners: triangles,
            points,
        };
        Ok(Self::of(all, points, bodies, potential))
    }
}

impl Triangles {
    fn at(&self, triangle: u32, q: &[f64]) -> [Vec3; 3] {
        self.corners[triangle as usize].map(|n| point(q, n))
    }
}

impl Element for Triangles {
    const NAME: &'static str = "body-faces";
    // A descent takes ten samples.
    const CHUNK: usize = 64;
    const ONE_BODY: bool = false;

    type Weights = Vec3;
    type Scratch = ();

    fn searched(&self) -> usize {
        self.corners.len()
    }

    fn total(&self) -> usize {
        self.corners.len()
    }

    fn first_point(&self, triangle: u32) -> u32 {
        self.corners[triangle as usize][0]
    }

    fn points(&self) -> impl Iterator<Item = u32> {
        0..self.points as u32
    }

    fn search(look: &Search<'_, Self>, range: Range<usize>, task: &mut Task<Vec3, ()>) {
        for triangle in range {
            search::look_at(look, triangle as u32, task);
        }
    }

    fn prepare(_: &Pass<'_, Self>, _: &[Candidate<Vec3>], (): &mut ()) {}

    fn touch(
        pass: &Pass<'_, Self>,
        c: &Candidate<Vec3>,
        _: usize,
        (): &(),
    ) -> Result<Option<Touch<Vec3>>, NotFinite> {
        let (source, of) = (pass.source, c.of);
        let face = Face {
            body: &*source.bodies[of.body as usize],
            time: source.time_end,
            x: source.element.at(of.element, pass.at.q),
        };
        let place = face.descend(c.weights);
        if !place.sample.is_finite() {
            return Err(NotFinite);
        }
        let distance = place.sample.distance;
        let thickness = source.potential.thickness();
        if distance >= thickness || place.is_corner() {
            return Ok(None);
        }
        let (corner, of_corner) = face.lowest_corner();
        if !(of_corner.distance - distance > SAME * thickness) {
            return Ok(None);
        }
        let slope = face.slope(&place);
        // Where the field gives no way out of the body, as on the axis of a
        // needle that is through, there is no force.
        let Some(normal) = unit(slope) else {
            return Ok(None);
        };
        let repulsion = pass.repel(of, distance);
        let mut normal_force = repulsion.force * norm(slope);
        let corner = (of_corner.distance < thickness).then(|| {
            let r = pass.repel(of, of_corner.distance);
            normal_force -= r.force * norm(of_corner.normal);
            let node = source.element.corners[of.element as usize][corner];
            (node, r.energy, scale(-r.force, of_corner.normal))
        });
        let normal_force = normal_force.max(0.0);
        Ok(Some(Touch {
            of,
            weights: place.weights,
            distance,
            slope,
            velocity: place.sample.velocity,
            repulsion,
            normal,
            normal_force,
            pressing: scale(normal_force, normal),
            corner,
        }))
    }

    fn position(&self, triangle: u32, weights: &Vec3, q: &[f64]) -> Vec3 {
        blend(*weights, &self.at(triangle, q))
    }

    fn mean(&self, triangle: u32, weights: &Vec3, values: &[f64]) -> f64 {
        let of_corners = self.corners[triangle as usize].map(|n| values[n as usize]);
        (0..3).map(|i| weights[i] * of_corners[i]).sum()
    }

    fn inverse_mass(&self, triangle: u32, weights: &Vec3, inverse_masses: &[f64]) -> f64 {
        let corners = self.corners[triangle as usize];
        let of_corner = |i: usize| weights[i].powi(2) * inverse_masses[corners[i] as usize];
        (0..3).map(of_corner).sum()
    }

    fn push(
        &self,
        touch: &Touch<Vec3>,
        force: Vec3,
        curvature: Option<Mat3>,
        lagged: Option<(Vec3, LaggedResponse)>,
        out: &mut ContactResponse,
    ) {
        let [a, b, c] = self.corners[touch.of.element as usize];
        let mut push = |w: Vec3, force, k: Option<Mat3>| {
            out.nodes.push([a, b, c, c]);
            out.weights.push([w[0], w[1], w[2], 0.0]);
            out.force.push(force);
            out.curvature.extend(k);
        };
        if let Some((weights, answer)) = lagged {
            push(weights, answer.force, curvature.map(|_| answer.curvature));
        }
        push(touch.weights, force, curvature);
    }

    fn heap_bytes(&self) -> usize {
        size_of::<[u32; 3]>() * self.corners.capacity()
    }

    fn scratch_bytes((): &()) -> usize {
        0
    }
}
