//! Yarns against yarns: meshes of segments alone.

mod common;

use common::{Random, World, along_random_ways, detect, evaluate, spread};
use selvedge_collision::{
    CollisionError, CollisionMesh, ContactQuadratic, ContactSource, ContactStiffness, Friction,
    FrictionAnchored, Joined, Segment, SelfContact, SelfContactSettings,
};

const R: f64 = 0.75e-3;
const K: f64 = 100.0;

fn line(points: std::ops::Range<u32>, length: f64, radius: f64) -> Vec<Segment> {
    let ends = points.clone().zip(points.skip(1));
    let segment = |(a, b)| Segment {
        ends: [a, b],
        length,
        radius,
    };
    ends.map(segment).collect()
}

fn contact(mesh: CollisionMesh) -> SelfContact {
    let potential = ContactQuadratic {
        thickness: mesh.thickness(),
        stiffness: ContactStiffness::PerPair(K),
        ..ContactQuadratic::cloth()
    };
    SelfContact::new(mesh).with_potential(Box::new(potential))
}

/// Two crossing straight yarns of radii `r` and `s`: points 0, 1 along x, points 2,
/// 3 along y at a height.
fn cross(r: f64, s: f64, height: f64) -> (Vec<f64>, SelfContact) {
    let q = vec![
        -0.01, 0.0, 0.0, 0.01, 0.0, 0.0, //
        0.0, -0.01, height, 0.0, 0.01, height,
    ];
    let mut segments = line(0..2, 0.02, r);
    segments.extend(line(2..4, 0.02, s));
    let mesh = CollisionMesh::from_segments(4, &segments, Joined::default());
    (q, contact(mesh.expect("a mesh")))
}

/// A yarn that falls on another across it comes to rest where the penalty
/// carries its weight: at `r + s − m g/k`, for equal and for unequal radii.
#[test]
fn a_yarn_rests_on_another() {
    for (r, s) in [(R, R), (R, 0.4 * R)] {
        let (q, contact) = cross(r, s, 2.5e-3);
        let mass = 2e-5;
        let mut world = World::new(q, vec![mass; 4], vec![Box::new(contact)]);
        world.fixed[..2].fill(true);
        world.gravity = [0.0, 0.0, -9.81];
        world.run(400, 2e-3);
        let rest = r + s - 2.0 * mass * 9.81 / K;
        for p in [2, 3] {
            let z = world.point(p)[2];
            assert!((z - rest).abs() < 1e-9, "{z} instead of {rest}");
        }
    }
}

/// With friction the yarn stays where it is on a slope of less than the
/// coefficient, and slides down a steeper one.
#[test]
fn yarns_rub() {
    for (slope, sticks) in [(0.2, true), (0.6, false)] {
        let (q, contact) = cross(R, R, 2.0 * R);
        let masses = vec![2e-5; 4];
        let friction = Friction::Anchored(FrictionAnchored::new(0.4));
        let contact = contact.with_friction(friction, &masses).expect("friction");
        let mut world = World::new(q, masses, vec![Box::new(contact)]);
        world.fixed[..2].fill(true);
        world.gravity = [9.81 * slope, 0.0, -9.81];
        world.run(100, 1e-3);
        let way = world.point(2)[0];
        assert_eq!(way.abs() < 1e-4, sticks, "{way}");
    }
}

/// Crumpled yarns of two radii with many contacts.
fn crumple(seed: u64) -> (SelfContact, Vec<f64>, Vec<f64>) {
    let mut random = Random(seed);
    let (mut q, mut segments) = (Vec::new(), Vec::new());
    for yarn in 0..8_u32 {
        let height = 3e-4 * f64::from(yarn);
        let radius = if yarn % 2 == 0 { R } else { 0.6 * R };
        for k in 0..12 {
            let along = 3e-3 * f64::from(k);
            let across = 3e-3 * f64::from(yarn);
            match yarn % 2 {
                0 => q.extend([along, across, height]),
                _ => q.extend([across, along, height]),
            }
        }
        segments.extend(line(12 * yarn..12 * yarn + 12, 3e-3, radius));
    }
    let joined = Joined {
        near: 6.0 * R,
        ..Joined::default()
    };
    let mesh = CollisionMesh::from_segments(q.len() / 3, &segments, joined).expect("a mesh");
    let start: Vec<f64> = q.iter().map(|x| x + 8e-4 * random.next()).collect();
    let end = start.iter().map(|x| x + 1e-4 * random.next()).collect();
    (contact(mesh), start, end)
}

/// Forces of segments are minus the gradient of their energy, and have neither
/// resultant nor moment.
#[test]
fn forces_are_the_gradient_of_the_energy() {
    for seed in 0..4 {
        let (mut s, start, q) = crumple(seed);
        detect(&mut s, &start, &q, 1e-3);
        let (_, out) = evaluate(&mut s, &q, &start, 1e-3);
        assert!(s.active() > 25, "{} contacts", s.active());
        let n = q.len() / 3;
        let force = spread(n, &out);
        let scale: f64 = force.iter().map(|f| f * f).sum::<f64>().sqrt();
        for [slope, numeric] in along_random_ways(&mut s, &q, &start, &force, 77 + seed) {
            assert!(
                (numeric - slope).abs() < 2e-6 * scale,
                "{numeric} against {slope}"
            );
        }
        for k in 0..3 {
            let (a, b) = ((k + 1) % 3, (k + 2) % 3);
            let sum: f64 = (0..n).map(|i| force[3 * i + k]).sum();
            let moment: f64 = (0..n)
                .map(|i| q[3 * i + a] * force[3 * i + b] - q[3 * i + b] * force[3 * i + a])
                .sum();
            assert!(sum.abs() < 1e-13 * scale && moment.abs() < 1e-14 * scale);
        }
    }
}

/// Detection finds what looking at every pair finds: pairs that share no point,
/// are not joined by a short way and lie closer than they keep.
#[test]
fn no_pair_is_missed() {
    for seed in 0..4 {
        let (mut s, _, q) = crumple(seed);
        let found = s.closer_than(1.0, &q).expect("positions").len();
        let mesh = s.mesh();
        let edges = mesh.edges();
        let mut expected = 0;
        for a in 0..edges.len() {
            for b in a + 1..edges.len() {
                // Rows of the same yarn are one long chain of points.
                let (x, y) = (edges[a], edges[b]);
                let same = x[0] / 12 == y[0] / 12;
                let between = y[0].saturating_sub(x[1]);
                if same && f64::from(between) * 3e-3 < 6.0 * R {
                    continue;
                }
                let at = [x[0], x[1], y[0], y[1]].map(|n| {
                    let n = 3 * n as usize;
                    [q[n], q[n + 1], q[n + 2]]
                });
                let radius = |e: [u32; 2]| {
                    if (e[0] / 12).is_multiple_of(2) {
                        R
                    } else {
                        0.6 * R
                    }
                };
                let distance = selvedge_collision::narrow::closest_edge_edge(&at).distance;
                // Radii of segments are kept in single precision.
                expected += usize::from(distance.abs() < radius(x) + radius(y));
            }
        }
        assert_eq!(found, expected);
        assert!(found > 25, "{found}");
    }
}

/// A way around a ring joins from both sides; what lies close where it is laid is
/// excluded up to a longer way, and what is far where it is laid is not.
#[test]
fn ways_join() {
    // A hairpin: two legs of 20 segments of 1 mm, 1 mm apart.
    let leg = |x: f64| (0..20).flat_map(move |i| [x, 1e-3 * f64::from(i), 0.0]);
    let mut laid: Vec<f64> = leg(0.0).collect();
    let mut back: Vec<[f64; 3]> = leg(1e-3).collect::<Vec<_>>().as_chunks().0.to_vec();
    back.reverse();
    laid.extend(back.as_flattened());
    let segments = line(0..40, 1e-3, R);
    let mesh = |near, near_laid| {
        let joined = Joined {
            near,
            near_laid,
            laid: &laid,
        };
        CollisionMesh::from_segments(40, &segments, joined).expect("a mesh")
    };
    let near = mesh(4.5e-3, 0.0);
    assert!(near.excludes_edge_edge(3, 8) && !near.excludes_edge_edge(3, 9));
    assert!(near.excludes_edge_edge(17, 21) && !near.excludes_edge_edge(10, 28));
    let laid = mesh(4.5e-3, 10.5e-3);
    // Opposite segments of the legs, with ways of 9 mm and of 11 mm between them.
    assert!(laid.excludes_edge_edge(14, 24) && !laid.excludes_edge_edge(13, 25));
    // As long a way along one leg, where they lie apart.
    assert!(!laid.excludes_edge_edge(2, 12));
}

/// Two yarns between the same two points are one segment; patches of other orders
/// find the same.
#[test]
fn double_segments_count_once() {
    let mut segments = line(0..3, 1e-3, R);
    segments.push(Segment {
        ends: [2, 1],
        length: 0.5e-3,
        radius: 2.0 * R,
    });
    let mesh = CollisionMesh::from_segments(3, &segments, Joined::default()).expect("a mesh");
    assert_eq!(mesh.edges(), [[0, 1], [1, 2]]);
    assert_eq!((mesh.thickness(), mesh.shortest_edge()), (4.0 * R, 0.5e-3));
}

/// What cannot be is named.
#[test]
fn mistakes_are_named() {
    let good = line(0..3, 1e-3, R);
    let with = |change: &dyn Fn(&mut Segment), joined: Joined<'_>| {
        let mut segments = good.clone();
        change(&mut segments[1]);
        let made = CollisionMesh::from_segments(3, &segments, joined);
        made.map(|_| ()).expect_err("refused").to_string()
    };
    let none = Joined::default();
    assert_eq!(
        with(&|s| s.ends[1] = 7, none),
        "segment 1 names point 7, but there are 3 points"
    );
    assert_eq!(
        with(&|s| s.ends[1] = 1, none),
        "segment 1 names point 1 twice"
    );
    assert!(with(&|s| s.length = 0.0, none).contains("length of a segment = 0"));
    assert!(with(&|s| s.radius = f64::NAN, none).contains("radius = NaN"));
    let negative = Joined { near: -1.0, ..none };
    assert!(with(&|_| {}, negative).contains("way between segments = -1"));
    let short = Joined {
        laid: &[0.0; 4],
        ..none
    };
    let made = CollisionMesh::from_segments(3, &good, short);
    assert!(matches!(made, Err(CollisionError::Length { .. })));
    let empty = CollisionMesh::from_segments(3, &[], none).expect("nothing");
    assert_eq!(
        contact(empty).closer_than(1.0, &[0.0; 9]).expect("nothing"),
        []
    );
}

/// Yarns that begin in each other part within the release time, without more than
/// a small part of the energy that the penalty would have given them at once.
#[test]
fn overlapping_yarns_part_softly() {
    let fastest = |release: f64| {
        let (q, contact) = cross(R, R, 0.2 * R);
        let settings = SelfContactSettings {
            release,
            ..SelfContactSettings::default()
        };
        let contact = contact.with_settings(settings).expect("settings");
        let mut world = World::new(q, vec![2e-5; 4], vec![Box::new(contact)]);
        world.fixed[..2].fill(true);
        let mut fastest = 0.0_f64;
        for _ in 0..100 {
            world.step(1e-3);
            fastest = fastest.max(world.velocity(2)[2].abs());
        }
        let apart = world.point(2)[2];
        assert!(apart > 2.0 * R * (1.0 - 1e-3), "{apart}");
        fastest
    };
    let (soft, hard) = (fastest(0.02), fastest(0.0));
    assert!(soft < 0.3 * hard, "{soft} against {hard} m/s");
}

/// After a change points take over what is left of their overlaps, and new ones
/// begin to part.
#[test]
fn changes_carry_overlaps() {
    let (q, contact) = cross(R, R, 0.5 * R);
    let settings = SelfContactSettings {
        release: 0.02,
        ..SelfContactSettings::default()
    };
    let mut before = contact.with_settings(settings).expect("settings");
    detect(&mut before, &q, &q, 1e-3);
    let after = cross(R, R, 0.5 * R).1.with_settings(settings);
    let mut after = after.expect("settings");
    let from = [0, 1, 2, 3];
    let history = before.history();
    let nothing = vec![0.0; 4];
    let carried = after.changed_history(&history, 4, &from, &nothing, 0.01);
    after
        .restore_history(&carried.expect("a history"))
        .expect("of its own");
    // Half of the release is over: half of the overlap of 1.5 R is allowed.
    let step = selvedge_collision::StepStart {
        q_start: &q,
        q_predicted: &q,
        dt: 1e-9,
        time: 0.01,
    };
    after.detect(&step).expect("positions");
    let (_, out) = evaluate(&mut after, &q, &q, 1e-9);
    let force = out.force[0][2].abs();
    assert!((force - K * 0.75 * R).abs() < 1e-6 * K * R, "{force}");
    // A fresh overlap parts from the beginning.
    let fresh = vec![1.5 * R; 4];
    let history = after.changed_history(&history, 4, &from, &fresh, 0.01);
    after
        .restore_history(&history.expect("a history"))
        .expect("of its own");
    after.detect(&step).expect("positions");
    let (energy, _) = evaluate(&mut after, &q, &q, 1e-9);
    assert!(energy < 1e-12, "{energy}");
    let wrong = after.changed_history(&[0.0], 2, &from, &nothing, 0.0);
    assert!(matches!(
        wrong,
        Err(CollisionError::PointOutOfRange { point: 2, .. })
    ));
}
