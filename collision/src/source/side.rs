use crate::narrow::{Closest, PairKind};
use crate::vec3::{Vec3, dot, scale};

/// What a pair in contact remembers: the direction in which its gap opened at
/// the end of the last step, and whether it was then behind the surface.
///
/// The direction takes the place of a sign. A sign belongs to a normal, and
/// that of two edges flips as they turn through parallel; a direction can also
/// follow a vertex around a border to the other side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Side {
    pub normal: Vec3,
    pub behind: bool,
}

/// An active contact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch {
    pub weights: [f64; 4],
    /// Unit direction in which the gap opens.
    pub normal: Vec3,
    pub gap: f64,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum Meeting {
    /// Farther apart than the thickness.
    Apart,
    /// Behind the surface and beside it: no force, but the side is remembered.
    Behind,
    Touching(Touch),
}

/// A pair at the positions `x`.
pub(crate) struct Pair<'a> {
    pub kind: PairKind,
    pub x: [Vec3; 4],
    /// Positions at the start of the step.
    pub start: &'a dyn Fn() -> [Vec3; 4],
    /// Direction for a pair that coincided already then.
    pub fallback: &'a dyn Fn() -> Vec3,
    pub side: Option<Side>,
}

impl Pair<'_> {
    /// Decides whether and how the pair touches.
    ///
    /// - Closest points inside both features: the gap is signed; its sign is
    ///   that of the remembered direction, or of the start of the step.
    ///   A pair that went right through during the step is caught too.
    /// - On a boundary: the gap is the distance, so that a vertex may go round
    ///   a border. A pair that began the step behind the surface gets no force
    ///   here, or it would be pushed on to the wrong side; the neighbouring
    ///   triangle, which it is behind as well, takes over.
    pub(crate) fn meet(&self, thickness: f64) -> Meeting {
        let c = self.kind.closest(&self.x);
        let near = c.distance.abs() < thickness;
        if !c.interior {
            if !near {
                return Meeting::Apart;
            }
            if self.side.is_some_and(|s| s.behind) {
                return Meeting::Behind;
            }
            let normal = if c.coincident {
                self.direction()
            } else {
                c.normal
            };
            return Meeting::Touching(Touch {
                weights: c.weights,
                normal,
                gap: c.distance,
            });
        }
        if !near && self.side.is_none() {
            let above = if c.distance < 0.0 { -1.0 } else { 1.0 };
            if !self.kind.crossed(&(self.start)(), &self.x) {
                return Meeting::Apart;
            }
            let normal = scale(-above, c.normal);
            let gap = -c.distance.abs();
            return Meeting::Touching(Touch {
                weights: c.weights,
                normal,
                gap,
            });
        }
        let sign = if dot(c.normal, self.direction()) < 0.0 {
            -1.0
        } else {
            1.0
        };
        let gap = sign * c.distance;
        if gap >= thickness {
            return Meeting::Apart;
        }
        Meeting::Touching(Touch {
            weights: c.weights,
            normal: scale(sign, c.normal),
            gap,
        })
    }

    /// The direction in which the gap opens, from memory or from the start of
    /// the step.
    fn direction(&self) -> Vec3 {
        if let Some(s) = self.side {
            return s.normal;
        }
        let start = self.kind.closest(&(self.start)());
        match start {
            Closest {
                coincident: true, ..
            } => (self.fallback)(),
            Closest {
                interior: true,
                distance,
                normal,
                ..
            } if distance < 0.0 => scale(-1.0, normal),
            Closest { normal, .. } => normal,
        }
    }
}
