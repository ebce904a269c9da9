//! Cloth against itself: forces, sides, friction.

mod common;

use common::{Random, World, add_sheet, along_random_ways, detect, evaluate, spread};
use selvedge_collision::{
    CollisionMesh, ContactResponse, ContactSet, ContactSource, Friction, FrictionAnchored,
    FrictionLagged, SelfContact, SelfContactSettings,
};
use selvedge_energy::{DofLayout, EvalPoint};

const DELTA: f64 = 1e-3;

/// Two crumpled layers with many contacts, at the start and the end of a step.
fn crumple(seed: u64) -> (SelfContact, Vec<f64>, Vec<f64>) {
    let mut random = Random(seed);
    let (mut q, mut triangles) = (Vec::new(), Vec::new());
    add_sheet(&mut q, &mut triangles, 5, 4, 0.01, 0.0);
    add_sheet(&mut q, &mut triangles, 4, 5, 0.01, 0.0);
    let mesh = CollisionMesh::from_positions(&q, triangles, &[], DELTA).unwrap();
    let start: Vec<f64> = q.iter().map(|x| x + 1.5e-3 * random.next()).collect();
    let end = start.iter().map(|x| x + 1e-4 * random.next()).collect();
    (SelfContact::new(mesh), start, end)
}

/// A vertex (point 0) of a long triangle, whose other corners are far above or
/// far beside, and a table of triangles given.
fn with_table(
    vertex: [f64; 3],
    far: [f64; 6],
    table: &[[f64; 3]],
    triangles: &[[u32; 3]],
) -> (Vec<f64>, CollisionMesh) {
    let mut q = vertex.to_vec();
    q.extend(far);
    q.extend(table.iter().flatten());
    let mut all = vec![[0, 1, 2]];
    all.extend(triangles.iter().map(|t| t.map(|p| p + 3)));
    let mesh = CollisionMesh::from_positions(&q, all, &[], DELTA).unwrap();
    (q, mesh)
}

fn over_table(
    vertex: [f64; 3],
    table: &[[f64; 3]],
    triangles: &[[u32; 3]],
) -> (Vec<f64>, CollisionMesh) {
    with_table(vertex, [5.0, 5.0, 9.0, 5.0, -5.0, 9.0], table, triangles)
}

const BESIDE: [f64; 6] = [-9.0, 5.0, 0.0, -9.0, -5.0, 0.0];

const BIG: [[f64; 3]; 3] = [[-1.0, -1.0, 0.0], [2.0, -1.0, 0.0], [-1.0, 2.0, 0.0]];

fn commit(s: &mut SelfContact, q: &[f64], q_start: &[f64]) {
    s.commit(&EvalPoint {
        layout: DofLayout::points(q.len() / 3),
        q,
        q_start,
        dt: 1e-3,
    });
}

/// Nodal forces are minus the gradient of the energy, without friction and
/// with the smoothed one, in a crumple of hundreds of contacts of all kinds.
#[test]
fn forces_are_the_gradient_of_the_energy() {
    for friction in [None, Some(Friction::Lagged(FrictionLagged::new(0.4)))] {
        for seed in 0..4 {
            let (mut s, start, q) = crumple(seed);
            if let Some(f) = friction {
                let masses = vec![1e-5; q.len() / 3];
                s = s.with_friction(f, &masses).unwrap();
            }
            detect(&mut s, &start, &q, 1e-3);
            let (_, out) = evaluate(&mut s, &q, &start, 1e-3);
            assert!(s.active() > 100, "{} contacts", s.active());
            let force = spread(q.len() / 3, &out);
            let scale: f64 = force.iter().map(|f| f * f).sum::<f64>().sqrt();
            for [slope, numeric] in along_random_ways(&mut s, &q, &start, &force, 77 + seed) {
                assert!(
                    (numeric - slope).abs() < 2e-6 * scale,
                    "{numeric} against {slope}"
                );
            }
        }
    }
}

/// Normal forces carry no net momentum and no net torque, and all curvatures
/// are symmetric and positive semidefinite, friction included.
#[test]
fn momentum_and_definiteness() {
    let (mut s, start, q) = crumple(9);
    detect(&mut s, &start, &q, 1e-3);
    let (_, out) = evaluate(&mut s, &q, &start, 1e-3);
    let n = q.len() / 3;
    let f = spread(n, &out);
    let scale = f.iter().map(|f| f.abs()).sum::<f64>();
    for k in 0..3 {
        let sum: f64 = (0..n).map(|i| f[3 * i + k]).sum();
        let (a, b) = ((k + 1) % 3, (k + 2) % 3);
        let torque: f64 = (0..n)
            .map(|i| q[3 * i + a] * f[3 * i + b] - q[3 * i + b] * f[3 * i + a])
            .sum();
        assert!(
            sum.abs() < 1e-14 * scale && torque.abs() < 1e-15 * scale,
            "{sum} {torque}"
        );
    }
    let masses = vec![1e-5; n];
    for friction in [
        Friction::Anchored(FrictionAnchored::new(0.3)),
        Friction::Lagged(FrictionLagged::new(0.3)),
    ] {
        let (s, start, q) = crumple(9);
        let mut s = s.with_friction(friction, &masses).unwrap();
        detect(&mut s, &start, &q, 1e-3);
        let (_, out) = evaluate(&mut s, &q, &start, 1e-3);
        for k in &out.curvature {
            let m = nalgebra::Matrix3::from_fn(|i, j| k[i][j]);
            assert_eq!(m, m.transpose());
            let e = m.symmetric_eigenvalues();
            assert!(e.min() >= -1e-12 * e.max(), "{e}");
        }
    }
}

/// A rigid motion of start and end leaves the energy and turns the forces.
#[test]
fn rigid_motion() {
    let (s, start, q) = crumple(3);
    let masses = vec![1e-5; q.len() / 3];
    let mut s = s
        .with_friction(Friction::Anchored(FrictionAnchored::new(0.3)), &masses)
        .unwrap();
    let turn = nalgebra::Rotation3::from_euler_angles(0.4, -1.1, 2.0);
    let place = |q: &[f64], shift: f64| -> Vec<f64> {
        let (points, _) = q.as_chunks::<3>();
        points
            .iter()
            .flat_map(|p| {
                let r = turn * nalgebra::Vector3::from(*p);
                [r[0] + shift, r[1] - shift, r[2] + 2.0 * shift]
            })
            .collect()
    };
    detect(&mut s, &start, &q, 1e-3);
    let (e, out) = evaluate(&mut s, &q, &start, 1e-3);
    let (start2, q2) = (place(&start, 0.3), place(&q, 0.3));
    detect(&mut s, &start2, &q2, 1e-3);
    let (e2, out2) = evaluate(&mut s, &q2, &start2, 1e-3);
    assert!((e / e2 - 1.0).abs() < 1e-10);
    let f = place(&spread(q.len() / 3, &out), 0.0);
    let f2 = spread(q.len() / 3, &out2);
    let scale = f.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    for (a, b) in f.iter().zip(&f2) {
        assert!((a - b).abs() < 1e-9 * scale, "{a} {b}");
    }
}

/// Force on point 0 along z, with the source's memory.
fn lift(s: &mut SelfContact, q: &[f64], q_start: &[f64]) -> f64 {
    let (_, out) = evaluate(s, q, q_start, 1e-3);
    spread(q.len() / 3, &out)[2]
}

/// A vertex that was pushed through a triangle is pushed back, in the same
/// step and, through its memory, in later ones; a source without that memory
/// takes the side it finds.
#[test]
fn side_is_remembered() {
    let (above, mesh) = over_table([0.1, 0.1, 0.3e-3], &BIG, &[[0, 1, 2]]);
    let mut below = above.clone();
    below[2] = -0.5e-3;
    let mut s = SelfContact::new(mesh.clone());
    detect(&mut s, &above, &below, 1e-3);
    assert!((lift(&mut s, &below, &above) - 1e2 * 1.5e-3).abs() < 1e-12);
    assert!((s.max_penetration() - 1.5e-3).abs() < 1e-15);
    commit(&mut s, &below, &above);
    for _ in 0..3 {
        detect(&mut s, &below, &below, 1e-3);
        assert!((lift(&mut s, &below, &below) - 1e2 * 1.5e-3).abs() < 1e-12);
        commit(&mut s, &below, &below);
    }
    let mut fresh = SelfContact::new(mesh);
    detect(&mut fresh, &below, &below, 1e-3);
    assert!((lift(&mut fresh, &below, &below) + 1e2 * 0.5e-3).abs() < 1e-12);
}

/// A vertex that passes right through the thickness within a step is caught,
/// with the capped force; one that passes beside the triangle is not.
#[test]
fn tunnelling_within_a_step_is_caught() {
    let (above, mesh) = over_table([0.1, 0.1, 5e-3], &BIG, &[[0, 1, 2]]);
    let mut below = above.clone();
    below[2] = -4e-3;
    let mut s = SelfContact::new(mesh);
    detect(&mut s, &above, &below, 1e-3);
    assert!((lift(&mut s, &below, &above) - 1e2 * 2e-3).abs() < 1e-12);

    // Comes from beside the triangle to below it: nothing was crossed.
    let (beside, mesh) = with_table([-1.01, 0.1, 1e-3], BESIDE, &BIG, &[[0, 1, 2]]);
    let mut under = beside.clone();
    (under[0], under[2]) = (-0.98, -4e-3);
    let mut s = SelfContact::new(mesh);
    detect(&mut s, &beside, &under, 1e-3);
    assert_eq!(lift(&mut s, &under, &beside), 0.0);
}

/// A vertex walks around a free border in small steps, always within the
/// thickness: below, it is pushed down.
#[test]
fn border_can_be_rounded() {
    let r = 0.6e-3;
    let (mut q, mesh) = with_table([0.0; 3], BESIDE, &BIG, &[[0, 1, 2]]);
    // Around the border x = -1: inward above, a half circle, inward below.
    let at = |t: f64| {
        if t < 1.0 {
            [-1.0 + 1e-3 * (1.0 - t), 0.1, r]
        } else if t < 2.0 {
            let a = std::f64::consts::PI * (t - 1.0);
            [-1.0 - r * a.sin(), 0.1, r * a.cos()]
        } else {
            [-1.0 + 1e-3 * (t - 2.0), 0.1, -r]
        }
    };
    let mut s = SelfContact::new(mesh);
    q[..3].copy_from_slice(&at(0.0));
    for i in 1..=300 {
        let mut next = q.clone();
        next[..3].copy_from_slice(&at(i as f64 / 100.0));
        detect(&mut s, &q, &next, 1e-3);
        let (_, out) = evaluate(&mut s, &next, &q, 1e-3);
        let f = &spread(next.len() / 3, &out)[..3];
        let a = [next[0] + 1.0, next[2]];
        // Always away from the border or the surface.
        assert!(
            f[0] * a[0].min(0.0) + f[2] * a[1] > 0.0,
            "step {i}: {f:?} at {a:?}"
        );
        commit(&mut s, &next, &q);
        q = next;
    }
    assert!(lift(&mut s, &q.clone(), &q) < 0.0);
}

/// Two edges turn through parallel above each other, which flips the normal of
/// their common plane: the force keeps its direction.
#[test]
fn parallel_edges_do_not_swap_sides() {
    let edges = |angle: f64| -> Vec<f64> {
        let (s, c) = angle.sin_cos();
        let far = 5.0;
        vec![
            -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -far, -c, -s, 0.7e-3, c, s, 0.7e-3, 0.0, 0.0,
            far,
        ]
    };
    let mut q = edges(-1e-2);
    let mesh = CollisionMesh::from_positions(&q, vec![[0, 1, 2], [3, 4, 5]], &[], DELTA).unwrap();
    let mut s = SelfContact::new(mesh);
    // Exactly parallel, and nearly so, on the way.
    for angle in [-5e-3, -1e-4, -1e-9, 0.0, 1e-12, 1e-8, 1e-6, 1e-3, 1e-2] {
        let next = edges(angle);
        detect(&mut s, &q, &next, 1e-3);
        let (_, out) = evaluate(&mut s, &next, &q, 1e-3);
        let f = spread(6, &out);
        let up = f[11] + f[14];
        assert!(up > 1e2 * 0.29e-3, "force {up} N at {angle} rad");
        commit(&mut s, &next, &q);
        q = next;
    }
}

/// Two layers that lie exactly in each other part, all points to the same
/// side, within 50 ms (hard case 15).
#[test]
fn coincident_layers_part() {
    let (mut q, mut triangles) = (Vec::new(), Vec::new());
    add_sheet(&mut q, &mut triangles, 3, 3, 0.01, 0.0);
    add_sheet(&mut q, &mut triangles, 3, 3, 0.01, 0.0);
    // A curved sheet: the direction must follow the surface.
    for p in q.chunks_mut(3) {
        p[2] = 20.0 * p[0] * p[0] - 0.5 * p[1];
    }
    let mesh = CollisionMesh::from_positions(&q, triangles, &[], DELTA).unwrap();
    let s = SelfContact::new(mesh);
    let mut w = World::new(q, vec![2e-5; 32], vec![Box::new(s)]);
    w.run(50, 1e-3);
    assert!(w.q.iter().all(|x| x.is_finite()));
    for i in 0..16 {
        let (a, b) = (w.point(i), w.point(16 + i));
        assert!(b[2] - a[2] > 0.0, "point {i} went to the other side");
        let d: f64 = (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
        assert!(d > 0.5 * DELTA, "point {i}: {d} m");
    }
}

/// A particle on a table, two per cent below and above the friction angle: of
/// its own kind, and of another one, whose geometric mean is the same.
#[test]
fn incline_of_cloth() {
    let mu = 0.4;
    let of_two = vec![0.2, 0.2, 0.2, 0.8, 0.8, 0.8];
    for (factor, steps, coefficients) in [
        (0.98, 1000, vec![mu; 6]),
        (1.02, 600, vec![mu; 6]),
        (0.98, 1000, of_two.clone()),
        (1.02, 600, of_two),
    ] {
        let m = 1e-3;
        let (q, mesh) = over_table([0.0, 0.0, DELTA - m * 9.81 / 1e2], &BIG, &[[0, 1, 2]]);
        let masses = vec![m, 1e9, 1e9, 1e9, 1e9, 1e9];
        let friction = Friction::Anchored(FrictionAnchored::new(9.0));
        let s = SelfContact::new(mesh)
            .with_friction(friction, &masses)
            .and_then(|s| s.with_coefficients(coefficients))
            .unwrap();
        let mut w = World::new(q, masses, vec![Box::new(s)]);
        w.fixed[1..].fill(true);
        let angle = factor * f64::atan(mu);
        w.gravity = [9.81 * angle.sin(), 0.0, -9.81 * angle.cos()];
        w.run(steps / 2, 1e-3);
        let before = w.velocity(0)[0];
        w.run(steps / 2, 1e-3);
        if factor < 1.0 {
            assert!(w.velocity(0)[0].abs() < 1e-9, "{} m/s", w.velocity(0)[0]);
        } else {
            let a = (w.velocity(0)[0] - before) / (0.5e-3 * steps as f64);
            let expected = 9.81 * (angle.sin() - mu * angle.cos());
            assert!(
                (a / expected - 1.0).abs() < 1e-3,
                "{a} m/s², not {expected}"
            );
        }
    }
}

/// Friction is handed over at the edges of a mesh without a jump of the
/// anchors' force: from step to step it changes by less than a fifth of the
/// cap (hard case 34), slowly with many steps at an edge, and fast across it in
/// one.
#[test]
fn friction_is_handed_over_at_edges() {
    let (mu, m) = (0.3, 2e-5);
    for (speed, steps) in [(0.01, 1200), (0.3, 150)] {
        let (mut table, mut triangles) = (Vec::new(), Vec::new());
        add_sheet(&mut table, &mut triangles, 6, 2, 0.01, 0.0);
        let table: Vec<[f64; 3]> = table.as_chunks::<3>().0.to_vec();
        let start = [3e-3, 0.0113, DELTA - m * 9.81 / 1e2];
        let (q, mesh) = over_table(start, &table, &triangles);
        let n = q.len() / 3;
        let masses: Vec<f64> = (0..n).map(|i| if i == 0 { m } else { 1e9 }).collect();
        let friction = Friction::Anchored(FrictionAnchored::new(mu));
        let s = SelfContact::new(mesh.clone())
            .with_friction(friction, &masses)
            .unwrap();
        let mut w = World::new(q, masses, vec![Box::new(s)]);
        w.fixed[1..].fill(true);
        // As much pull as friction holds: the speed stays.
        w.gravity = [9.81 * mu, 0.0, -9.81];
        w.v[0] = speed;
        let mut smooth = SelfContact::new(mesh);
        let mut last: Option<f64> = None;
        let mut pairs = [usize::MAX, 0];
        for i in 0..steps {
            let before = w.q.clone();
            w.step(1e-3);
            // What is left without the normal forces, against their sum.
            detect(&mut smooth, &before, &w.q, 1e-3);
            let (_, normal) = evaluate(&mut smooth, &w.q, &before, 1e-3);
            let size = |f: &[f64; 3]| f.iter().map(|f| f * f).sum::<f64>().sqrt();
            let cap = mu * normal.force.iter().map(size).sum::<f64>();
            let f = spread(n, &w.response)[0] - spread(n, &normal)[0];
            let now = f / cap;
            if i > 20 {
                pairs = [pairs[0].min(normal.len()), pairs[1].max(normal.len())];
                let change = last.map_or(0.0, |l: f64| (now - l).abs());
                assert!(
                    change < 0.2,
                    "{speed} m/s, step {i}: from {last:?} to {now}"
                );
                assert!(now < -0.8, "{speed} m/s, step {i}: friction of {now} caps");
            }
            last = Some(now);
        }
        assert!(
            w.point(0)[0] > 13e-3,
            "it must cross edges: {}",
            w.point(0)[0]
        );
        assert!(pairs[1] > pairs[0], "edges must add pairs");
    }
}

/// The inspection list has every active pair; the response adds up those that
/// share their closest features, to the same nodal forces and curvatures.
#[test]
fn contacts_are_listed_and_merged() {
    let (mut s, start, q) = crumple(5);
    detect(&mut s, &start, &q, 1e-3);
    let (_, out) = evaluate(&mut s, &q, &start, 1e-3);
    let mut set = ContactSet::default();
    let n = q.len() / 3;
    let layout = DofLayout::points(n);
    s.contacts(
        &EvalPoint {
            layout,
            q: &q,
            q_start: &start,
            dt: 1e-3,
        },
        &mut set,
    );
    assert_eq!(set.len(), s.active());
    assert!(out.len() < set.len(), "{} of {}", out.len(), set.len());
    let deepest = set.gap.iter().fold(0.0_f64, |a, g| a.max(DELTA - g));
    assert_eq!(deepest, s.max_penetration());
    // Pair by pair.
    let mut single = ContactResponse::default();
    for c in 0..set.len() {
        let n = set.normal[c];
        single.nodes.push(set.nodes[c]);
        single.weights.push(set.weights[c]);
        single.force.push(n.map(|n| n * 1e2 * (DELTA - set.gap[c])));
        single.curvature.push(n.map(|a| n.map(|b| 1e2 * a * b)));
    }
    for (a, b) in spread(n, &single).iter().zip(spread(n, &out)) {
        assert!((a - b).abs() < 1e-13, "{a} {b}");
    }
    let matrix = |r: &ContactResponse| {
        let mut m = nalgebra::DMatrix::zeros(3 * n, 3 * n);
        common::add_curvature(&mut m, r, 1.0);
        m
    };
    assert!((matrix(&single) - matrix(&out)).amax() < 1e-9);
    let mut none = ContactResponse::default();
    none.extend(&out);
    none.clear();
    assert!(none.is_empty());
}

/// Leaving the predicted way by more than half the margin is noticed.
#[test]
fn coverage_is_checked() {
    let (mut s, start, q) = crumple(5);
    detect(&mut s, &start, &q, 1e-3);
    let layout = DofLayout::points(q.len() / 3);
    let covers = |s: &SelfContact, q: &[f64]| {
        s.covers(&EvalPoint {
            layout,
            q,
            q_start: &start,
            dt: 1e-3,
        })
    };
    assert!(covers(&s, &q) && covers(&s, &start));
    let mut off = q.clone();
    off[7] += 2.3e-4;
    assert!(covers(&s, &off));
    off[7] += 3e-4;
    assert!(!covers(&s, &off));
    off[7] = f64::NAN;
    assert!(!covers(&s, &off));
}

/// Layers that begin a fifth of a thickness apart part at about what is missing
/// over the time of release, instead of all at once, and end a thickness apart.
#[test]
fn overlaps_are_released_slowly() {
    let run = |release: f64| {
        let (mut q, mut triangles) = (Vec::new(), Vec::new());
        add_sheet(&mut q, &mut triangles, 4, 4, 0.01, 0.0);
        add_sheet(&mut q, &mut triangles, 4, 4, 0.01, 0.2 * DELTA);
        let mesh = CollisionMesh::from_positions(&q, triangles, &[], DELTA).unwrap();
        let settings = SelfContactSettings {
            release,
            ..SelfContactSettings::default()
        };
        let s = SelfContact::new(mesh).with_settings(settings).unwrap();
        let points = q.len() / 3;
        let mut world = World::new(q, vec![2e-5; points], vec![Box::new(s)]);
        let mut fastest = 0.0_f64;
        for _ in 0..50 {
            world.step(5e-4);
            fastest = fastest.max(world.v.iter().map(|v| v.abs()).fold(0.0, f64::max));
        }
        let gap = world.point(points - 1)[2] - world.point(points / 2 - 1)[2];
        (fastest, gap)
    };
    let (slow, gap) = run(0.02);
    let (at_once, _) = run(0.0);
    let expected = 0.5 * 0.8 * DELTA / 0.02;
    assert!(slow < 3.0 * expected, "{slow} m/s");
    assert!(at_once > 5.0 * slow, "{at_once} m/s");
    assert!(gap > 0.99 * DELTA, "{gap} m");
}
