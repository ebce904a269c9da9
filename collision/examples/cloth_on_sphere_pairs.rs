//! Contact pairs and forces of a cloth that lies on a sphere in two layers.

use std::sync::Arc;

use selvedge_collision::body::{Body, RoundCone};
use selvedge_collision::{
    BodyContact, CollisionMesh, ContactResponse, ContactSource, SelfContact, StepStart,
};
use selvedge_energy::{DofLayout, EvalPoint};

const RADIUS: f64 = 0.1;
const CELLS: usize = 24;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A square projected on spheres: 1.4 mm above the surface (within the
    // 1.5 mm of body contact), and another layer 0.9 mm above (within 1 mm).
    let (mut q, mut triangles) = (Vec::new(), Vec::new());
    for height in [1.4e-3, 2.3e-3] {
        let base = (q.len() / 3) as u32;
        for j in 0..=CELLS {
            for i in 0..=CELLS {
                let p = [i, j].map(|i| 0.16 * (i as f64 / CELLS as f64 - 0.5));
                let d = [p[0], RADIUS, p[1]];
                let s = (RADIUS + height) / d.iter().map(|d| d * d).sum::<f64>().sqrt();
                q.extend(d.map(|d| s * d));
            }
        }
        let at = |i: usize, j: usize| base + (j * (CELLS + 1) + i) as u32;
        for j in 0..CELLS {
            for i in 0..CELLS {
                let (a, b, c, d) = (at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    let points = q.len() / 3;
    let layout = DofLayout::points(points);
    let step = StepStart {
        q_start: &q,
        q_predicted: &q,
        dt: 1e-3,
        time: 0.0,
    };
    let at = EvalPoint {
        layout,
        q: &q,
        q_start: &q,
        dt: 1e-3,
    };

    let mesh = CollisionMesh::from_positions(&q, triangles, &[], 1e-3)?;
    println!("shortest edge {:.2} mm", 1e3 * mesh.shortest_edge());
    let sphere: Arc<dyn Body> = Arc::new(RoundCone::sphere([0.0; 3], RADIUS)?);
    let mut sources: [Box<dyn ContactSource>; 2] = [
        Box::new(SelfContact::new(mesh)),
        Box::new(BodyContact::new(points, vec![sphere])),
    ];
    for s in &mut sources {
        s.detect(&step)?;
        let mut out = ContactResponse::default();
        let energy = s.evaluate(&at, true, &mut out)?;
        println!(
            "{}: {} candidates, {} active, {:.3} mm deep, {:.2e} J",
            s.name(),
            s.candidates(),
            s.active(),
            1e3 * s.max_penetration(),
            energy
        );
        assert!(s.active() > 0 && energy > 0.0);
    }
    // The lower layer touches the sphere, all of it and nothing else.
    assert_eq!(sources[1].active(), points / 2);
    assert!((sources[1].max_penetration() - 1e-4).abs() < 1e-9);
    // Facets of the upper layer sag towards the lower one, so pairs are deeper.
    assert!(sources[0].max_penetration() > 1e-4);
    Ok(())
}
