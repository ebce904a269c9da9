//! Whatever the triangles and positions, nothing panics or turns NaN.

mod common;

use common::{detect, evaluate};
use proptest::prelude::*;
use selvedge_collision::{
    CollisionMesh, ContactQuadratic, ContactSource, ContactStiffness, Friction, FrictionAnchored,
    FrictionLagged, SelfContact,
};
use selvedge_energy::{DofLayout, EvalPoint};

/// Coordinates that coincide often, touch the thickness exactly, and have
/// subnormal and huge differences.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -3e-3..3e-3,
        2 => prop::sample::select(vec![0.0, 1e-3, -1e-3, 5e-4]),
        1 => prop::sample::select(vec![1e-320, 1e-200, -1e-13, 1e3, -1e3]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn soup_stays_finite(
        triangles in prop::collection::vec([0u32..9, 0u32..9, 0u32..9], 1..10),
        states in prop::collection::vec(prop::collection::vec(coordinate(), 27), 4),
        model in 0..3,
        per_area in any::<bool>(),
        dt in prop::sample::select(vec![1e-6, 1e-3, 4e-2]),
    ) {
        let triangles: Vec<[u32; 3]> = triangles
            .into_iter()
            .filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0])
            .collect();
        // Any of the states may be the rest shape: rest triangles may have no area.
        let mesh = CollisionMesh::from_positions(&states[3], triangles, &[[0, 1]], 1e-3).unwrap();
        let masses = [1e-5, 0.0, f64::INFINITY, 1e-9, 1.0, 1e-5, 1e-5, 1e-5, 1e-5];
        let stiffness = if per_area {
            ContactStiffness::PerArea(1e6)
        } else {
            ContactStiffness::PerPair(1e2)
        };
        let mut s = SelfContact::new(mesh)
            .with_potential(Box::new(ContactQuadratic { stiffness, ..ContactQuadratic::cloth() }));
        if model > 0 {
            let f = if model == 1 {
                Friction::Anchored(FrictionAnchored::new(0.5))
            } else {
                Friction::Lagged(FrictionLagged::new(0.5))
            };
            s = s.with_friction(f, &masses).unwrap();
        }
        for k in 0..3 {
            let (a, b) = (&states[k], &states[k + 1]);
            detect(&mut s, a, b, dt);
            for q in [a, b] {
                let (e, out) = evaluate(&mut s, q, a, dt);
                prop_assert!(e.is_finite() && e >= 0.0);
                prop_assert!(out.force.iter().flatten().all(|f| f.is_finite()));
                prop_assert!(out.curvature.iter().flatten().flatten().all(|f| f.is_finite()));
                prop_assert!(out.weights.iter().flatten().all(|f| f.is_finite()));
                prop_assert!(out.weights.iter().all(|w| w.iter().sum::<f64>().abs() < 1e-9));
            }
            s.commit(&EvalPoint { layout: DofLayout::points(9), q: b, q_start: a, dt });
            prop_assert!(s.history().iter().all(|h| h.is_finite()));
        }
    }
}
