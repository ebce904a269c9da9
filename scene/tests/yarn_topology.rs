//! Yarns that leave their contacts during a run: unravelling, recording, resume.

mod runs;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use runs::{StopAt, options, uninterrupted};
use selvedge_record::Recording;
use selvedge_scene::build::BuiltScene;
use selvedge_scene::driver::{self, RunResult};
use selvedge_scene::file;
use selvedge_scene::summary::Status;

/// The last row of a garter patch with open loops, pulled at its end.
const KNIT: &str = r#"
name = "unravel"
[[cloth]]
kind = "knit"
chart = "garter"
stitches = [4, 3]
yarn = "sweater"
bind_off = false
[topology]
changes = true
tail = 0.006
[[pin]]
select = { edge = "bottom" }
[[pin]]
select = { yarn = { index = -1, end = "last" } }
motion = [{ time = 0 }, { time = 0.45, translation = [0, 0, -0.18] }]
[simulation]
duration = 0.4
gravity = [0, 0, 0]
[output]
frame_rate = 100
"#;

/// The last weft of a plain weave, pulled out sideways.
const WOVEN: &str = r#"
name = "fray"
[[cloth]]
kind = "woven"
yarns = [4, 4]
spacing = 0.001
yarn = "thread"
[yarn.thread]
library = "weaving"
stretch_modulus = 1e7
friction = 0.05
[topology]
changes = true
[[pin]]
select = { edge = "bottom" }
[[pin]]
select = { yarn = { index = -1, end = "last" } }
interpolation = "eased"
motion = [{ time = 0 }, { time = 0.05, translation = [0.012, 0, 0] }]
[simulation]
duration = 0.05
gravity = [0, 0, 0]
[output]
frame_rate = 200
"#;

/// Wefts, drawn out between their ends by a fiftieth, are cut across.
const CUT: &str = r#"
name = "cut"
[[cloth]]
kind = "woven"
yarns = [6, 5]
spacing = 0.001
yarn = "weaving"
[topology]
tail = 0.002
[[cut]]
time = 0.02
from = [0.00447, -1.0]
to = [0.00447, 1.0]
[[pin]]
select = { edge = "left" }
[[pin]]
select = { edge = "right" }
motion = [{ time = 0 }, { time = 0.01, translation = [1.5e-4, 0, 0] }]
[simulation]
duration = 0.06
gravity = [0, 0, 0]
[stop]
early = false
[output]
frame_rate = 1000
"#;

fn built(text: &str, folder: &Path, set: &[(&str, &str)]) -> BuiltScene {
    let own = |(k, v): &(&str, &str)| ((*k).to_owned(), (*v).to_owned());
    let set: Vec<_> = set.iter().map(own).collect();
    let parsed = file::parse(text, &folder.join("scene.toml"), &set);
    let parsed = parsed.expect("a valid scene");
    BuiltScene::new(parsed).expect("a scene that can be built")
}

fn whole(text: &str, directory: &Path, set: &[(&str, &str)]) -> RunResult {
    let built = built(text, directory, set);
    uninterrupted(&built, &options(text, directory, false))
}

/// Most of a small patch comes apart, and its held points are counted anew.
#[test]
fn a_small_patch_comes_apart() {
    let folder = tempfile::tempdir().expect("a folder");
    let s = whole(KNIT, folder.path(), &[("cloth.0.stitches", "[2, 2]")]).summary;
    assert_eq!(s.status, Status::Finished, "{}", s.reason);
    assert!(s.topology.expect("counts").removed > 0);
}

/// The row comes out loop by loop; energy goes with it; the frames, of as many
/// points all along, show it.
#[test]
fn a_row_unravels() {
    let folder = tempfile::tempdir().expect("a folder");
    let result = whole(KNIT, folder.path(), &[]);
    let s = &result.summary;
    assert_eq!(s.status, Status::Finished, "{}", s.reason);
    let topology = s.topology.expect("counts");
    assert!(topology.drawn >= 4, "{topology:?}");
    assert!(topology.energy_removed_j > 0.0);
    let start = built(KNIT, folder.path(), &[]);
    let network = &start.geometry.yarns.as_ref().expect("yarns").network;
    // Nothing but open loops goes, two contacts of two strands each a loop.
    assert_eq!(s.scalars, network.strands.len() - topology.removed);
    assert!(s.max_abs_edge_strain < 0.6, "{}", s.max_abs_edge_strain);

    let recording = Recording::open(result.recording.as_deref().expect("a recording"));
    let recording = recording.expect("a readable recording");
    assert_eq!(recording.warnings(), [] as [String; 0]);
    let points = recording.header().points;
    assert_eq!(points, network.strands.len());
    assert_eq!(recording.header().yarns.points.len(), points);
    let frames = recording.frames().len();
    let last = recording.frame(frames - 1).expect("a frame");
    assert_eq!(last.positions, result.positions);
    assert_eq!(result.positions.len(), 3 * points);
    assert_eq!(result.yarn_strain.len(), points);
    // The end of the yarn follows its pin, the cast-on stays.
    let paths = &recording.header().yarns;
    let tip = *paths.offsets.last().expect("an end") as usize - 1;
    let first = recording.frame(0).expect("a frame");
    let way = last.positions[3 * tip + 2] - first.positions[3 * tip + 2];
    assert!((way + 0.16).abs() < 1e-9, "{way}");
    // Pins are followed through every change of the points.
    let pulled = |k: usize| &recording.diagnostics()[k].pins[1];
    for (k, step) in recording.diagnostics().iter().enumerate() {
        if step.accepted {
            let fell = pulled(k).place[2] + 0.4 * step.time;
            assert!(
                (fell - pulled(0).place[2] - 0.4 * recording.diagnostics()[0].time).abs() < 1e-9
            );
            assert!(pulled(k).force.iter().all(|f| f.is_finite()));
        }
    }
    // Steps with events say what went.
    let told = recording.diagnostics().iter();
    assert!(told.filter(|d| d.note.contains("drawn out")).count() >= 4);
}

/// Runs stopped after events and resumed, and runs on two threads, end like
/// one that went through, bit for bit, in the same frames.
#[test]
fn resume_after_events() {
    for (text, stop_at, least) in [(KNIT, 250, 3), (WOVEN, 12, 3), (CUT, 25, 0)] {
        let folder = tempfile::tempdir().expect("a folder");
        let through = whole(text, &folder.path().join("one"), &[]);
        let s = &through.summary;
        let topology = s.topology.expect("counts");
        assert!(topology.released + topology.drawn >= least, "{topology:?}");
        let threads = [("assembly.threads", "2")];
        let two = whole(text, &folder.path().join("two"), &threads);
        assert_eq!(two.summary.final_state_hash, s.final_state_hash);

        let part = folder.path().join("part");
        let scene = built(text, &part, &[]);
        let interrupt = Arc::new(AtomicBool::new(false));
        let mut stop = StopAt(interrupt.clone(), stop_at);
        let cut = driver::run(&scene, &options(text, &part, false), &mut stop, &interrupt);
        let cut = cut.expect("a run").summary;
        assert_eq!(cut.status, Status::Stopped);
        let before = cut.topology.expect("counts");
        assert!(before.removed + before.cut > 0);
        assert!(least == 0 || before.removed < topology.removed);
        let rest = uninterrupted(&scene, &options(text, &part, true));
        assert_eq!(rest.summary.final_state_hash, s.final_state_hash);
        assert_eq!(rest.summary.topology, through.summary.topology);
        assert_eq!(rest.positions, through.positions);
        let frames = |r: &RunResult| {
            let recording = Recording::open(r.recording.as_deref().expect("a recording"));
            let recording = recording.expect("a readable recording");
            let all = (0..recording.frames().len()).map(|i| recording.frame(i).expect("a frame"));
            // The stop itself is a frame of its own.
            let at = cut.simulated_s;
            all.filter(|f| f.time != at).collect::<Vec<_>>()
        };
        assert_eq!(frames(&rest), frames(&through));
    }
}

/// A scene that does not ask for it is recorded as ever, and yarns that do not
/// slide cannot leave.
#[test]
fn off_and_impossible() {
    let folder = tempfile::tempdir().expect("a folder");
    let plain = built(KNIT, folder.path(), &[("topology.changes", "false")]);
    assert!(plain.geometry.passages.is_none());
    assert_eq!(
        plain.geometry.recorded_points(),
        plain.geometry.mesh.points()
    );
    let network = &plain.geometry.yarns.as_ref().expect("yarns").network;
    assert!(network.strands.len() > plain.geometry.recorded_points());
    let set = [("cloth.0.sliding".to_owned(), "false".to_owned())];
    assert!(file::parse(KNIT, &folder.path().join("scene.toml"), &set).is_err());
    // A shell has no yarns to leave, nor to hold.
    let sheet = "[[cloth]]\nsize = [0.1, 0.1]\n[topology]\nchanges = true\n";
    let path = folder.path().join("scene.toml");
    let parsed = file::parse(sheet, &path, &[]).expect("a valid scene");
    let told = parsed.warnings.findings().iter();
    assert_eq!(
        told.filter(|f| f.to_string().contains("does nothing"))
            .count(),
        1
    );
    let pin = "[[cloth]]\nsize = [0.1, 0.1]\n[[pin]]\nselect = { yarn = { index = 0, end = \"last\" } }\n";
    let parsed = file::parse(pin, &path, &[]).expect("a valid scene");
    let built = BuiltScene::new(parsed).expect("a sheet");
    let refused = built.simulation(built.geometry.start(), &built.drape_stage());
    let message = refused.map(|_| ()).expect_err("no yarns").findings()[0].to_string();
    assert!(message.contains("not made of yarns"), "{message}");
}

/// A cut takes effect in the step that reaches its time: the five wefts part in
/// the middle of a segment, let go of their pins and draw back; their halves are
/// ways of their own in the recording from the start.
#[test]
fn cut_yarns_let_go() {
    let folder = tempfile::tempdir().expect("a folder");
    let result = whole(CUT, folder.path(), &[]);
    let s = &result.summary;
    assert_eq!(s.status, Status::Finished, "{}", s.reason);
    let topology = s.topology.expect("counts");
    assert_eq!(topology.cut, 5);
    assert!(topology.first_s.is_some_and(|t| (t - 0.02).abs() < 1e-9));
    let recording = Recording::open(result.recording.as_deref().expect("a recording"));
    let recording = recording.expect("a readable recording");
    let start = built(CUT, folder.path(), &[]);
    let network = &start.geometry.yarns.as_ref().expect("yarns").network;
    let header = recording.header();
    assert_eq!(header.points, network.strands.len() + 2 * 5);
    assert_eq!(header.yarns.radii.len(), network.yarns.len() + 5);

    // Both ends of a cut, of every weft: the last visit of a way and the first of the next.
    let arcs = &header.yarns.arcs;
    let ends: Vec<usize> = header
        .yarns
        .offsets
        .windows(2)
        .map(|w| w[1] as usize)
        .collect();
    let cuts = ends
        .iter()
        .filter(|e| **e < arcs.len() && arcs[**e] == arcs[**e - 1]);
    let cuts: Vec<usize> = cuts.copied().collect();
    assert_eq!(cuts.len(), 5);
    let x = |frame: &[f64], k: usize| frame[3 * k];
    for i in 0..recording.frames().len() {
        let frame = recording.frame(i).expect("a frame");
        for &k in &cuts {
            let gap = x(&frame.positions, k) - x(&frame.positions, k - 1);
            if frame.time < 0.02 - 1e-9 {
                assert!(gap.abs() < 1e-12, "{gap} at {}", frame.time);
                continue;
            }
            assert!(gap > -1e-9, "{gap} at {}", frame.time);
        }
    }
    let last = recording
        .frame(recording.frames().len() - 1)
        .expect("a frame");
    for &k in &cuts {
        let gap = x(&last.positions, k) - x(&last.positions, k - 1);
        assert!(gap > 2e-5, "the ends are {gap} m apart");
    }
    // Nothing is left of the wefts' tension, which friction on the warps alone holds.
    let pulls = |time: f64| {
        let step = recording.diagnostics().iter().filter(|d| d.accepted);
        let step = step.min_by(|a, b| (a.time - time).abs().total_cmp(&(b.time - time).abs()));
        step.expect("a step").pins[1].force[0].abs()
    };
    assert!(
        pulls(0.06) < 0.2 * pulls(0.019),
        "{} and {}",
        pulls(0.06),
        pulls(0.019)
    );
}

/// Rest before a cut is not the end; cuts that cannot be made are
/// refused at their place.
#[test]
fn cuts_are_waited_for_and_checked() {
    let folder = tempfile::tempdir().expect("a folder");
    let patient = [
        ("stop.early", "true"),
        ("stop.kinetic_energy", "1.0"),
        ("stop.window", "0.001"),
        ("pin.1.motion", "[]"),
    ];
    let s = whole(CUT, folder.path(), &patient).summary;
    assert_eq!(s.status, Status::Converged, "{}", s.reason);
    assert_eq!(s.topology.expect("counts").cut, 5);
    assert!(
        s.simulated_s > 0.02 && s.simulated_s < 0.025,
        "{}",
        s.simulated_s
    );
    let refused = |text: &str, set: &[(&str, &str)]| {
        let own = |(k, v): &(&str, &str)| ((*k).to_owned(), (*v).to_owned());
        let set: Vec<_> = set.iter().map(own).collect();
        let built = file::parse(text, &folder.path().join("scene.toml"), &set);
        let built = built.and_then(BuiltScene::new);
        built.map(|_| ()).expect_err("refused").to_string()
    };
    for (key, value, told) in [
        ("cut.0.from", "[0.1, -1.0]", "crosses no yarn"),
        ("cut.0.to", "[0.00447, -1.0]", "no length"),
        ("cut.0.time", "-1.0", "cut.0.time"),
        ("topology.changes", "false", "leave their contacts"),
        ("cloth.0.sliding", "false", "sliding"),
    ] {
        let mut set = vec![(key, value)];
        if key == "cut.0.from" {
            set.push(("cut.0.to", "[0.1, 1.0]"));
        }
        let message = refused(CUT, &set);
        assert!(message.contains(told), "{key}: {message}");
    }
    let sheet = "[[cloth]]\nsize = [0.1, 0.1]\n[[cut]]\ntime = 0\nfrom = [0, 0]\nto = [1, 1]\n";
    assert!(refused(sheet, &[]).contains("not made of yarns"));
}
