//! The validations against closed forms, on the coarse end of their ladders.

use approx::assert_relative_eq;
use selvedge_tests::suite::{Case, Effort, Ladder, all, markdown};

fn case(name: &str) -> Case {
    let found = all().into_iter().find(|c| c.name == name);
    found.unwrap_or_else(|| panic!("no case {name}"))
}

/// Runs a case and asserts that every quantity is within its limit.
fn holds(name: &str) -> Vec<Ladder> {
    let ladders = (case(name).run)(Effort::Quick).ladders;
    assert!(!ladders.is_empty());
    for l in &ladders {
        let f = l.finding();
        println!("{name}: {}: {f:?}", l.quantity);
        assert!(f.holds, "{}: {:?}, {f:?}", l.quantity, l.rungs);
    }
    ladders
}

/// The fall converges to the parabola with first order in the step.
#[test]
fn free_fall() {
    let fall = holds("free-fall")[0].finding();
    assert_relative_eq!(fall.order.expect("an order"), 1.0, epsilon = 0.02);
}

/// Momentum stays, angular momentum to first order in the step.
#[test]
fn momentum() {
    let angular = holds("momentum")[1].finding();
    assert_relative_eq!(angular.order.expect("an order"), 1.0, epsilon = 0.1);
}

/// Closed and damped: energy never grows.
#[test]
fn energy() {
    holds("energy");
}

/// Elongation of a hanging strip.
#[test]
fn hanging() {
    holds("hanging");
}

/// Sag of a catenary.
#[test]
fn catenary() {
    holds("catenary");
}

/// Heavy elastica at Γ = 1, 10, 100, with second order in the mesh.
#[test]
fn heavy_elastica() {
    for ladder in holds("heavy-elastica") {
        let order = ladder.finding().order.expect("an order");
        assert_relative_eq!(order, 2.0, epsilon = 0.25);
    }
}

/// Strips of different length, weight and rigidity but equal Γ agree.
#[test]
fn collapse() {
    holds("collapse");
}

/// Elastica with a load at its end.
#[test]
fn tip_load() {
    holds("tip-load");
}

/// Sticking below and sliding above the angle of friction.
#[test]
fn incline() {
    holds("incline");
}

/// Tensions of a sliding strip over a cylinder.
#[test]
fn capstan() {
    holds("capstan");
}

/// First frequencies of a cantilever and of a hanging chain.
#[test]
fn first_modes() {
    for name in ["cantilever-mode", "hanging-mode"] {
        holds(name);
    }
}

/// Buckling between clamps, with second order in the mesh.
#[test]
fn euler() {
    let straight = holds("euler")[0].finding();
    assert_relative_eq!(straight.order.expect("an order"), 2.0, epsilon = 0.1);
}

/// A standing strip falls over at Greenhill's weight.
#[test]
fn standing() {
    let found = holds("standing")[0].finding();
    assert_relative_eq!(found.order.expect("an order"), 2.0, epsilon = 0.1);
}

/// A cantilever on its edge falls sideways.
#[test]
fn lateral() {
    holds("lateral");
}

/// The page names every quantity, and says so when one is missed.
#[test]
fn page() {
    let run = |exact: f64| {
        let case = case("free-fall");
        let mut measured = (case.run)(Effort::Quick);
        measured.ladders[0].exact *= exact;
        markdown(&[(case, measured, 1.0)], "make")
    };
    let good = run(1.0);
    assert!(good.contains("2 quantities in 1 cases, 0 missed"));
    assert_eq!(good.matches("| met |").count(), 2);
    assert!(good.contains("fall in 0.4 s") && good.contains("4 ms | 2 ms | 1 ms"));
    let bad = run(1.001);
    assert_eq!(bad.matches("| **missed** |").count(), 1);
}

/// The page in the repository has all cases.
#[test]
fn page_is_of_today() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/validation.md");
    let page = std::fs::read_to_string(path).expect("docs/validation.md");
    for case in all() {
        let heading = format!("\n## {}\n\n{}\n", case.title, case.text);
        assert!(page.contains(&heading), "{}: make the page anew", case.name);
    }
}
