//! Impulse of pieces that nothing holds, whatever the linear solver leaves.

mod text;

use selvedge_integrator::Outcome;
use text::{build, simulation};

/// A crumpled sheet falls beside one that hangs by an edge and one that lies on a floor:
/// its middle follows `½ g t (t + h)`, however loosely the systems of all three are
/// solved, by either scheme.
#[test]
fn free_pieces_fall_exactly() {
    let sheet = |name: &str, x: f64, rest: &str| {
        format!(
            "[[cloth]]\nname = \"{name}\"\nkind = \"sheet\"\nsize = [0.2, 0.2]\npoints = [9, 9]\n\
             center = [{x}, 1.0, 0.0]\nnoise = 2e-3\n{rest}"
        )
    };
    let text = [
        sheet("falling", 0.0, ""),
        sheet("hanging", 1.0, ""),
        sheet("lying", -1.0, ""),
        "[[pin]]\ncloth = \"hanging\"\nselect = { edge = \"left\" }\n".into(),
        "[[body]]\nkind = \"box\"\ncenter = [-1.0, 0.948, 0.0]\nsize = [0.4, 0.1, 0.4]\n"
            .into(),
        "[damping]\ndrag = 0\n[stop]\nearly = false\n[simulation]\nduration = 0.1\n[relaxation]\nenabled = false\n".into(),
    ]
    .concat();
    for (scheme, loose) in [
        ("backward-euler", "1e-1"),
        ("backward-euler", "1e-2"),
        ("linearised-euler", "1e-1"),
        ("linearised-euler", "1e-2"),
    ] {
        let set = [
            ("integrator.kind", scheme),
            ("solver.tolerance", loose),
            ("solver.preconditioner", "block-jacobi"),
            ("solver.precision", "f64"),
        ];
        let built = build(&text, &set).expect("a scene");
        let mut simulation = simulation(&built);
        let masses = simulation.plan().inertia.masses.clone();
        // points of the falling sheet in the numbering of the solver
        let start = simulation.state().q.clone();
        let (at, _) = start.as_chunks::<3>();
        let falling: Vec<usize> = (0..at.len()).filter(|&p| at[p][0].abs() < 0.5).collect();
        assert_eq!(3 * falling.len(), at.len());
        let height = |q: &[f64]| {
            let moment: f64 = falling.iter().map(|&p| masses[p] * q[3 * p + 1]).sum();
            moment / falling.iter().map(|&p| masses[p]).sum::<f64>()
        };
        let (mut steps, mut way, mut touching) = (0, 0.0, 0);
        let mut fall = 0.0;
        while steps < 90 {
            match simulation.advance().expect("a step") {
                Outcome::Accepted { dt, report, .. } => {
                    fall -= 9.81 * dt;
                    way += fall * dt;
                    touching = touching.max(report.contacts);
                    steps += 1;
                }
                Outcome::Rejected { .. } => {}
                Outcome::Ended(end) => panic!("{end:?}"),
            }
        }
        assert!(touching > 0, "the third sheet lies on the box");
        let error = (height(&simulation.state().q) - height(&start) - way).abs();
        assert!(
            error < 1e-12 * way.abs().max(1.0),
            "{scheme} {loose}: {error:e} m"
        );
    }
}
