//! Order of the time stepping scheme.

use approx::assert_relative_eq;
use selvedge_integrator::Term;
use selvedge_shell_model::{SharedTargets, attachment_term, sheet};
use selvedge_tests::{Setup, Solver, mean, plain_fabric, point, rows, run};

/// A sheet on equal springs, moved aside as a whole, swings as backward Euler
/// does in closed form, `Re (1 − i h ω)⁻ⁿ`, and so with an error of first
/// order in `h` against the true `cos ω t`.
#[test]
fn oscillator() {
    let (omega, amplitude, duration) = (20.0_f64, 0.01, 0.2);
    let swing = |h: f64| {
        let sheet = sheet::equilateral(5, 5, [0.1, 0.1]).expect("sheet");
        let home: Vec<[f64; 3]> = sheet.flat.iter().map(|[u, v]| [*u, 0.0, *v]).collect();
        let aside = home
            .iter()
            .map(|p| [p[0], p[1] + amplitude, p[2]])
            .collect();
        let mut setup = Setup::new(sheet.mesh, aside, plain_fabric(500.0, 1e-5, 0.2));
        let mass = 1e-4;
        let all: Vec<u32> = (0..home.len() as u32).collect();
        let springs = attachment_term(&all, mass * omega * omega, SharedTargets::new(home.clone()));
        setup.terms.push(Term::fixed(springs.expect("springs")));
        setup.gravity = [0.0; 3];
        setup.settings.duration = duration;
        setup.settings.control.max_step = h;
        setup.newton.tolerance = 1e-12;
        setup.linear_tolerance = 1e-12;
        let mut s = setup.simulation();
        s.plan_mut().inertia.masses.fill(mass);
        run(&mut s).expect("an oscillator");
        let n = (duration / h).round();
        assert_eq!(s.counters().steps as f64, n);
        let scheme =
            amplitude * (1.0 + (h * omega).powi(2)).powf(-0.5 * n) * (n * (h * omega).atan()).cos();
        for i in all {
            assert!(
                (point(&s, i)[1] - scheme).abs() < 1e-9 * amplitude,
                "{} {scheme}",
                point(&s, i)[1]
            );
        }
        (point(&s, 0)[1] - amplitude * (omega * duration).cos()).abs()
    };
    let errors = [2e-3, 1e-3, 5e-4, 2.5e-4].map(swing);
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        println!("oscillator: order {order:.3}");
        assert_relative_eq!(order, 1.0, epsilon = 0.1);
    }
}

/// A sheet that swings down from one held edge, stretching and bending on its
/// way, converges with first order as the step is halved.
#[test]
fn swinging_sheet() {
    let end = |h: f64| {
        let sheet = sheet::equilateral(6, 8, [0.15, 0.2]).expect("sheet");
        let q: Vec<[f64; 3]> = sheet.flat.iter().map(|[u, v]| [*u, 0.0, *v]).collect();
        let mut fabric = plain_fabric(50.0, 1e-4, 0.2);
        fabric.membrane_damping = 5e-3;
        fabric.bending_damping = 2e-2;
        let all = rows(&sheet);
        let mut setup = Setup::new(sheet.mesh, q, fabric);
        setup.pinned = all[0].clone();
        setup.solver = Solver::Direct;
        setup.settings.duration = 0.128;
        setup.settings.control.max_step = h;
        setup.newton.tolerance = 1e-9;
        let mut s = setup.simulation();
        run(&mut s).expect("a swinging sheet");
        mean(&s, all.last().expect("rows"))
    };
    let ends = [4e-3, 2e-3, 1e-3, 5e-4].map(end);
    let gaps: Vec<f64> = ends
        .windows(2)
        .map(|e| {
            (0..3)
                .map(|i| (e[0][i] - e[1][i]).powi(2))
                .sum::<f64>()
                .sqrt()
        })
        .collect();
    for pair in gaps.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        println!("swinging sheet: gaps {pair:?}, order {order:.3}");
        assert_relative_eq!(order, 1.0, epsilon = 0.15);
    }
}
