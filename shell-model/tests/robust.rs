//! No data makes an energy return NaN, and projections stay semidefinite.

mod common;

use common::{at, moduli, smallest_eigenvalue};
use proptest::prelude::*;
use selvedge_energy::{Batch, Curvature, EnergyBatch};
use selvedge_shell_model::{
    BendingHinge, HingeRest, IncrementalDamping, MembraneGuard, MembraneStVk, RateDamping,
    ShellMesh,
};

/// Coordinates of many sizes, with exact coincidences.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        3 => -1.0..1.0_f64,
        2 => (-1.0..1.0_f64).prop_map(|x| x * 1e-6),
        2 => Just(0.0),
        1 => (-1.0..1.0_f64).prop_map(|x| x * 1e-14),
        1 => (-1.0..1.0_f64).prop_map(|x| x * 1e6),
        1 => Just(0.25),
    ]
}

fn check(term: &mut dyn EnergyBatch, q: &[f64], start: &[f64]) -> Result<(), TestCaseError> {
    let at = at(q, start, 1e-3);
    term.begin_step(&at);
    let m = term.local_dim();
    let (mut g, mut h) = (vec![0.0; m], vec![0.0; m * m]);
    for curvature in [
        Curvature::Exact,
        Curvature::Projected,
        Curvature::GaussNewton,
    ] {
        let value = term.hessians(&at, curvature, 0..1, &mut g, &mut h);
        prop_assert!(value.is_finite(), "value {value}");
        prop_assert!(g.iter().all(|x| x.is_finite()), "gradient {g:?}");
        prop_assert!(h.iter().all(|x| x.is_finite()), "hessian {h:?}");
        if curvature != Curvature::Exact {
            let least = smallest_eigenvalue(&h, m);
            prop_assert!(least > -1e-9, "{curvature:?}: {least}");
        }
    }
    term.commit(&at);
    prop_assert!(term.history().iter().all(|x| x.is_finite()));
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..Default::default() })]

    #[test]
    fn hinges(
        q in prop::collection::vec(coordinate(), 12),
        start in prop::collection::vec(coordinate(), 12),
        angle in -3.0..3.0_f64,
        guarded in any::<bool>(),
    ) {
        let (length, heights) = if guarded { (0.5, [0.4, 0.3]) } else { (0.0, [0.0; 2]) };
        let rest = [HingeRest {
            points: [0, 1, 2, 3], stiffness: 1e-5, angle, length, heights, damping: 0.1,
        }];
        check(&mut Batch::<_, 4, 12>::new("", BendingHinge::<RateDamping>::new(&rest)), &q, &start)?;
        check(&mut Batch::<_, 4, 12>::new("", BendingHinge::<IncrementalDamping>::new(&rest)), &q, &start)?;
    }

    #[test]
    fn triangles(
        q in prop::collection::vec(coordinate(), 9),
        start in prop::collection::vec(coordinate(), 9),
        material in prop::collection::vec(-1.0..1.0_f64, 6),
    ) {
        let corners = [0, 1, 2].map(|i| [material[2 * i], material[2 * i + 1]]);
        let Ok(mesh) = ShellMesh::new(3, vec![[0, 1, 2]], vec![corners], vec![0]) else {
            return Ok(());
        };
        let laws = [(moduli(&[800.0, 60.0, 0.0, 60.0, 500.0, 0.0, 0.0, 0.0, 40.0]), 0.01)];
        check(&mut Batch::<_, 3, 9>::new("", MembraneStVk::<RateDamping>::new(&mesh, &laws)), &q, &start)?;
        check(&mut Batch::<_, 3, 9>::new("", MembraneStVk::<IncrementalDamping>::new(&mesh, &laws)), &q, &start)?;
        check(&mut Batch::<_, 3, 9>::new("", MembraneGuard::new(&mesh, &[50.0], 0.1)), &q, &start)?;
    }
}

/// A triangle collapsed to a point has no force, and the compressive
/// instability that the documentation states.
#[test]
fn collapsed_triangle() {
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
    let mesh = ShellMesh::new(3, vec![[0, 1, 2]], vec![corners], vec![0]).unwrap();
    let laws = [(
        moduli(&[800.0, 0.0, 0.0, 0.0, 800.0, 0.0, 0.0, 0.0, 40.0]),
        0.0,
    )];
    let term = Batch::<_, 3, 9>::new(
        "",
        MembraneStVk::<selvedge_shell_model::Undamped>::new(&mesh, &laws),
    );
    let q = [0.3; 9];
    let (value, g, h) = common::evaluate(&term, &at(&q, &q, 1e-3), Curvature::Exact, 0);
    // k/8 per axis on an area of one half.
    assert!((value - 0.5 * 2.0 * 100.0).abs() < 1e-12);
    assert!(g.iter().all(|x| *x == 0.0));
    assert!(smallest_eigenvalue(&h, 9) < -0.99);
    // The largest compressive force of a strip is k/(3 √3), at s = 1/√3.
    let force = |s: f64| {
        let q = [0.0, 0.0, 0.0, s, 0.0, 0.0, 0.0, 1.0, 0.0];
        let mut g = [0.0; 9];
        term.gradients(&at(&q, &q, 1e-3), 0..1, &mut g);
        g[3] / 0.5
    };
    let peak = 1.0 / 3.0_f64.sqrt();
    assert!((force(peak) + 800.0 / (3.0 * 3.0_f64.sqrt())).abs() < 1e-9);
    assert!(force(peak + 0.01) > force(peak) && force(peak - 0.01) > force(peak));
}
