//! What cloth of yarns warns of, and what one piece of it does to another.

mod text;

use selvedge_integrator::Outcome;
use selvedge_scene::build::BuiltScene;
use text::{build, simulation};

/// Warnings of a scene, one to a line.
fn warnings(built: &BuiltScene) -> Vec<String> {
    let all = built.warnings.findings().iter();
    all.map(ToString::to_string).collect()
}

const BODY: &str = "inhook + 1\ntuck - f3 1\ntuck - f1 1\ntuck + f0 1\ntuck + f2 1\n\
                    releasehook 1\nknit - f3 1\nknit - f2 1\nknit - f1 1\nknit - f0 1\n";

#[test]
fn knitout_warnings_reach_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("small.k");
    let text = format!(";!knitout-2\n;;Carriers: 1 2\n{BODY}x-presser on\nouthook 1\n");
    std::fs::write(&file, text).unwrap();
    let scene = |stitches: &str| {
        let chart = file.to_string_lossy();
        format!("[[cloth]]\nkind = \"knit\"\nchart = \"{chart}\"\n{stitches}")
    };
    let told = warnings(&build(&scene(""), &[]).unwrap());
    assert_eq!(told.len(), 1, "{told:?}");
    assert!(
        told[0].contains("small.k:13:1") && told[0].contains("x-presser"),
        "{told:?}"
    );
    let told = warnings(&build(&scene("stitches = [4, 1]\n"), &[]).unwrap());
    assert_eq!(told.len(), 1, "{told:?}");
    let told = warnings(&build(&scene("stitches = [9, 7]\n"), &[]).unwrap());
    assert_eq!(told.len(), 2, "{told:?}");
    let size = told
        .iter()
        .find(|t| t.contains("[9, 7] is ignored"))
        .unwrap();
    assert!(
        size.contains("[4, 1]") && size.contains("scene.toml:4"),
        "{size}"
    );
}

#[test]
fn yarns_inside_each_other_are_told_of() {
    let knit = "[[cloth]]\nkind = \"knit\"\nyarn = \"shirt\"\nstitches = [4, 4]\n";
    let woven = "[[cloth]]\nkind = \"woven\"\nyarn = \"weaving\"\nyarns = [6, 6]\n";
    // Radii of 0.25 mm.
    for (cloth, key, close, fits) in [
        (knit, "course_pitch", "0.0009", "0.001"),
        (knit, "wale_pitch", "0.0004", "0.0005"),
        (woven, "spacing", "0.0001", "0.0005"),
    ] {
        let told = warnings(&build(&format!("{cloth}{key} = {close}\n"), &[]).unwrap());
        assert_eq!(told.len(), 1, "{told:?}");
        assert!(
            told[0].contains(close) && told[0].contains(&format!("{fits} m")),
            "{told:?}"
        );
        let told = warnings(&build(&format!("{cloth}{key} = {fits}\n"), &[]).unwrap());
        assert!(told.is_empty(), "{told:?}");
        assert!(warnings(&build(cloth, &[]).unwrap()).is_empty());
    }
}

/// A weave swings as it does alone, whatever damps and jams a metre away.
#[test]
fn pieces_apart_do_not_change_each_other() {
    let weave = "[yarn.free]\nlibrary = \"weaving\"\nmass_damping = 0\nstiffness_damping = 0\n\
                 [[cloth]]\nname = \"weave\"\nkind = \"woven\"\nyarn = \"free\"\nyarns = [6, 6]\n\
                 [[pin]]\ncloth = \"weave\"\nselect = { edge = \"left\" }\n\
                 [integrator]\nmax_step = 1e-3\n[solver]\ntolerance = 1e-12\n";
    let beside = "[yarn.thick]\nlibrary = \"weaving\"\nmass_damping = 50\nstiffness_damping = 0.1\n\
                  [[cloth]]\nname = \"other\"\nkind = \"knit\"\nyarn = \"thick\"\n\
                  stitches = [4, 4]\ncenter = [1, 0, 0]\n";
    let weaves = |text: &str| {
        let built = build(text, &[]).unwrap();
        let mut simulation = simulation(&built);
        while simulation.state().time < 0.0195 {
            let outcome = simulation.advance().expect("a step");
            assert!(matches!(outcome, Outcome::Accepted { .. }), "{outcome:?}");
        }
        let time = simulation.state().time;
        let q = built.geometry.flat_to_scene(&simulation.state().q);
        let points = built.geometry.part("weave").unwrap().points.clone();
        let of = points.start as usize * 3..points.end as usize * 3;
        (time, q[of].to_vec())
    };
    let (time, alone) = weaves(weave);
    let (also, both) = weaves(&format!("{weave}{beside}"));
    assert!((time - also).abs() < 1e-12, "{time} {also}");
    let apart = alone.iter().zip(&both).map(|(a, b)| (a - b).abs());
    let apart = apart.fold(0.0, f64::max);
    println!("{apart} m apart");
    assert!(apart < 1e-8, "{apart} m");
}

#[test]
fn no_damping_acts_on_yarns() {
    let knit = "[[cloth]]\nkind = \"knit\"\nstitches = [4, 4]\n";
    let row = |set: &[(&str, &str)]| {
        let built = build(knit, set).unwrap();
        let made = built.simulation(built.geometry.start(), &built.drape_stage());
        let made = made.unwrap_or_else(|e| panic!("{:?}", e.findings()[0].to_string()));
        let row = made.effects.iter().find(|r| r.name == "yarn damping");
        let damped = made.simulation.plan().inertia.damping.len();
        (row.unwrap().clone(), damped)
    };
    let (on, damped) = row(&[]);
    assert!(on.on && damped > 0);
    let (off, damped) = row(&[("damping.kind", "none")]);
    assert!(!off.on && off.reason.contains("damping.kind") && damped == 0);
}
