//! Measures of the mannequin, as a tailor takes them.

use selvedge_collision::body::{Body, girth, mannequin, surface_mesh};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let description = mannequin();
    let body = description.build()?;
    let up = [0.0, 1.0, 0.0];
    let arm = [0.410 - 0.195, 1.192 - 1.372, 0.0];
    let measures = [
        ("neck", [0.0, 1.470, -0.008], up, 0.36),
        ("chest", [0.0, 1.250, 0.0], up, 0.92),
        ("waist", [0.0, 1.060, 0.0], up, 0.76),
        ("hips", [0.0, 0.870, 0.0], up, 0.98),
        ("thigh", [0.087, 0.700, 0.0], up, 0.50),
        ("calf", [0.095, 0.330, -0.008], up, 0.30),
        ("upper arm", [0.3025, 1.282, -0.01], arm, 0.29),
        ("wrist", [0.601, 1.031, 0.01], arm, 0.17),
    ];
    println!(
        "{} shapes, blend {} m",
        description.shapes.len(),
        description.blend
    );
    for (name, center, axis, wanted) in measures {
        let found = girth(&body, 0.0, center, axis).ok_or("the centre is not inside")?;
        println!(
            "{name:10} {:.3} m tape, {:.3} m contour, wanted {wanted}",
            found.tape, found.contour
        );
        assert!((found.tape - wanted).abs() < 0.01, "{name}");
    }

    let (points, triangles) = surface_mesh(&body, 0.0, 0.01)?;
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut worst = 0.0_f64;
    for p in &points {
        low = low.min(p[1]);
        high = high.max(p[1]);
        worst = worst.max(body.sample(*p, 0.0).distance.abs());
    }
    println!(
        "feet {low:.4} m, crown {high:.4} m, {} triangles within {worst:.1e} m",
        triangles.len()
    );
    assert!(low.abs() < 2e-3 && (high - 1.70).abs() < 5e-3);
    Ok(())
}
