use super::{Shape, SmoothUnion};
use crate::CollisionError;

/// A person as a list of shapes, joined smoothly.
#[derive(Clone, Debug, PartialEq)]
pub struct Mannequin {
    /// The shapes [m].
    pub shapes: Vec<Shape>,
    /// Blend radius of the [`SmoothUnion`] [m].
    pub blend: f64,
}

impl Mannequin {
    /// The body.
    ///
    /// # Errors
    ///
    /// Those of [`Shape::build`] and [`SmoothUnion::new`], for shapes that were
    /// changed.
    pub fn build(&self) -> Result<SmoothUnion, CollisionError> {
        let parts = self
            .shapes
            .iter()
            .map(Shape::build)
            .collect::<Result<_, _>>()?;
        SmoothUnion::new(parts, self.blend)
    }
}

/// A standing person of 1.70 m: feet at `y = 0`, facing `+z`, left arm to
/// `+x`, arms 40° below the horizontal.
///
/// | measure | [m] |
/// |---|---|
/// | chest, waist, hips | 0.92, 0.76, 0.98 |
/// | neck, upper arm | 0.36, 0.29 |
/// | between the shoulder joints | 0.39 |
///
/// The example `body_mannequin` measures it.
pub fn mannequin() -> Mannequin {
    let mut shapes = vec![
        // head, neck
        ellipsoid([0.0, 1.590, 0.020], [0.074, 0.110, 0.094]),
        cone([0.0, 1.400, -0.020], [0.0, 1.530, 0.005], [0.0595, 0.0515]),
        // chest, abdomen, hips
        ellipsoid([0.0, 1.250, 0.0], [0.170, 0.178, 0.121]),
        ellipsoid([0.0, 1.060, 0.0], [0.137, 0.170, 0.104]),
        ellipsoid([0.0, 0.890, -0.005], [0.177, 0.125, 0.118]),
    ];
    for side in [1.0, -1.0] {
        let at = |x: f64, y: f64, z: f64| [side * x, y, z];
        let shoulder = at(0.195, 1.372, -0.010);
        let elbow = at(0.410, 1.192, -0.010);
        let wrist = at(0.601, 1.031, 0.010);
        shapes.extend([
            // slope of the shoulder, arm, hand
            cone(
                at(0.030, 1.412, -0.020),
                at(0.170, 1.378, -0.012),
                [0.052, 0.050],
            ),
            cone(shoulder, elbow, [0.052, 0.039]),
            cone(elbow, wrist, [0.039, 0.0215]),
            cone(wrist, at(0.690, 0.956, 0.020), [0.0215, 0.024]),
            // seat, thigh, calf, foot
            ellipsoid(at(0.072, 0.865, -0.040), [0.085, 0.095, 0.085]),
            cone(at(0.090, 0.830, 0.0), at(0.092, 0.470, 0.0), [0.091, 0.056]),
            cone(
                at(0.092, 0.470, 0.0),
                at(0.098, 0.085, -0.020),
                [0.055, 0.036],
            ),
            cone(
                at(0.098, 0.038, -0.035),
                at(0.112, 0.028, 0.130),
                [0.038, 0.028],
            ),
        ]);
    }
    Mannequin {
        shapes,
        blend: 0.008,
    }
}

fn ellipsoid(center: [f64; 3], axes: [f64; 3]) -> Shape {
    Shape::Ellipsoid {
        center,
        axes,
        rotation: [0.0; 3],
    }
}

fn cone(a: [f64; 3], b: [f64; 3], radius: [f64; 2]) -> Shape {
    Shape::Capsule { a, b, radius }
}
