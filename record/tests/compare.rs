//! Distances with known values.

mod common;

use std::fs;

use approx::assert_relative_eq;
use common::{DT, advance, header, options, record, state};
use proptest::prelude::*;
use selvedge_record::compare::{
    CompareOptions, SurfaceOptions, compare_points, compare_recordings, compare_surfaces,
};
use selvedge_record::{RecordError, Recorder, Recording, Surface};
use serde_json::json;

fn surface<'a>(positions: &'a [f64], triangles: &'a [[u32; 3]]) -> Surface<'a> {
    Surface {
        positions,
        points: positions.len() / 3,
        triangles,
        ..Surface::default()
    }
}

/// Verifies mean, root mean square, percentile and maximum on 1, 2, ... 100.
#[test]
fn point_statistics() {
    let a = vec![0.0; 300];
    let b: Vec<f64> = (1..=100)
        .flat_map(|i| [0.0, 0.6 * f64::from(i), -0.8 * f64::from(i)])
        .collect();
    let d = compare_points(&a, &b).unwrap();
    assert_eq!((d.count, d.max_point), (100, 99));
    assert_relative_eq!(d.mean, 50.5, max_relative = 1e-14);
    assert_relative_eq!(d.rms, 3383.5_f64.sqrt(), max_relative = 1e-14);
    assert_relative_eq!(d.p95, 95.0, max_relative = 1e-14);
    assert_relative_eq!(d.max, 100.0, max_relative = 1e-14);
    assert!(matches!(
        compare_points(&a, &b[3..]),
        Err(RecordError::Length { .. })
    ));
    assert!(compare_points(&[f64::NAN, 0.0, 0.0], &[0.0; 3]).is_err());
    assert_eq!(compare_points(&[], &[]).unwrap().count, 0);
}

/// Verifies that equal surfaces with other numbering are at distance zero, and
/// that a shifted plane is at the shift.
#[test]
fn surface_shift() {
    let header = header(12);
    let (q, _) = state(&header, 0);
    let q = &q[..3 * header.points];
    let a = surface(q, &header.triangles);
    let mut turned: Vec<[u32; 3]> = header
        .triangles
        .iter()
        .map(|[a, b, c]| [*b, *c, *a])
        .collect();
    turned.reverse();
    let same = compare_surfaces(&a, &surface(q, &turned), &SurfaceOptions::default()).unwrap();
    assert!(
        same.hausdorff < 1e-15 && same.hausdorff_bound < 1.2e-5,
        "{same:?}"
    );

    let flat: Vec<f64> = q
        .as_chunks::<3>()
        .0
        .iter()
        .flat_map(|p| [p[0], 0.0, p[2]])
        .collect();
    let lifted: Vec<f64> = q
        .as_chunks::<3>()
        .0
        .iter()
        .flat_map(|p| [p[0], 0.007, p[2]])
        .collect();
    let d = compare_surfaces(
        &surface(&flat, &header.triangles),
        &surface(&lifted, &header.triangles),
        &SurfaceOptions::default(),
    )
    .unwrap();
    assert_relative_eq!(d.hausdorff, 0.007, max_relative = 1e-12);
    assert!(d.hausdorff_bound < 0.007 + 1.2e-5, "{d:?}");
    assert_relative_eq!(d.a_to_b.vertices.mean, 0.007, max_relative = 1e-12);
}

/// Verifies that the maximum inside a triangle is found, where no vertex is:
/// a flat triangle over a surface with a pit.
#[test]
fn maximum_inside() {
    let roof = [-1.0, 0.0, -1.0, 3.0, 0.0, -1.0, -1.0, 0.0, 3.0];
    // The same outline, with a point 0.5 below its middle.
    let pit = [roof.as_slice(), &[1.0 / 3.0, -0.5, 1.0 / 3.0]].concat();
    let pit_triangles = [[0, 1, 3], [1, 2, 3], [2, 0, 3]];
    let d = compare_surfaces(
        &surface(&roof, &[[0, 1, 2]]),
        &surface(&pit, &pit_triangles),
        &SurfaceOptions {
            tolerance: 1e-4,
            ..SurfaceOptions::default()
        },
    )
    .unwrap();
    assert_relative_eq!(d.b_to_a.max, 0.5, max_relative = 1e-12);
    assert_eq!(d.a_to_b.vertices.max, 0.0);
    // Farthest point of the roof: its incentre-like point between the three
    // sloping faces; checked by a fine sampling below.
    let mut sampled = 0.0_f64;
    let n = 120;
    for i in 0..=n {
        for j in 0..=n - i {
            let (s, t) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
            let p = [-1.0 + 4.0 * s, 0.0, -1.0 + 4.0 * t];
            let to_faces = pit_triangles.iter().map(|t| {
                let corner = |k: usize| std::array::from_fn(|c| pit[3 * t[k] as usize + c]);
                distance(p, [corner(0), corner(1), corner(2)])
            });
            sampled = sampled.max(to_faces.fold(f64::INFINITY, f64::min));
        }
    }
    let edge = (4.0 + 4.0 + 32.0_f64.sqrt()) / 3.0;
    assert!(
        d.a_to_b.max >= sampled - 1e-4 * edge,
        "{} {sampled}",
        d.a_to_b.max
    );
    assert!(d.a_to_b.max_bound >= sampled && d.a_to_b.max_bound - d.a_to_b.max <= 1e-4 * edge);
    // The true maximum exceeds the samples by less than their spacing.
    assert!(d.a_to_b.max <= sampled + 4.0 / f64::from(n));
}

/// Distance to a triangle by another way than the crate's: the normal
/// equations of the inside, and the three edges. Every candidate is a point of
/// the triangle, so this is never too small.
fn distance(p: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> f64 {
    let sub = |x: [f64; 3], y: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| x[i] - y[i]) };
    let dot = |x: [f64; 3], y: [f64; 3]| x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
    let edge = |a: [f64; 3], b: [f64; 3]| {
        let (d, w) = (sub(b, a), sub(p, a));
        let s = if dot(d, d) > 0.0 {
            (dot(w, d) / dot(d, d)).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let r = sub(w, d.map(|x| s * x));
        dot(r, r)
    };
    let mut best = edge(a, b).min(edge(b, c)).min(edge(c, a));
    let (u, v, w) = (sub(b, a), sub(c, a), sub(p, a));
    let det = dot(u, u) * dot(v, v) - dot(u, v) * dot(u, v);
    let s = (dot(v, v) * dot(w, u) - dot(u, v) * dot(w, v)) / det;
    let t = (dot(u, u) * dot(w, v) - dot(u, v) * dot(w, u)) / det;
    if det > 0.0 && s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
        let r: [f64; 3] = std::array::from_fn(|i| w[i] - s * u[i] - t * v[i]);
        best = best.min(dot(r, r));
    }
    best.sqrt()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    /// Verifies that a triangle as thin as rounding is the line that it looks
    /// like, seen from points on that line and its extension.
    #[test]
    fn sliver_is_its_edges(
        ends in prop::array::uniform6(-1.0..1.0_f64),
        middle in 0.0..1.0_f64,
        along in prop::array::uniform3(-2.0..3.0_f64),
    ) {
        let at = |s: f64| (0..3).map(move |c| ends[c] + s * (ends[3 + c] - ends[c]));
        let sliver: Vec<f64> = at(0.0).chain(at(1.0)).chain(at(middle)).collect();
        let from: Vec<f64> = along.into_iter().flat_map(at).collect();
        let d = compare_surfaces(
            &surface(&from, &[[0, 1, 2]]),
            &surface(&sliver, &[[0, 1, 2]]),
            &SurfaceOptions::default(),
        )
        .unwrap();
        let length = (0..3).map(|c| (ends[3 + c] - ends[c]).powi(2)).sum::<f64>().sqrt();
        let expected = along.map(|s| length * (-s).max(s - 1.0).max(0.0));
        let largest = expected.into_iter().fold(0.0, f64::max);
        prop_assert!((d.a_to_b.vertices.max - largest).abs() < 1e-9, "{} {largest}", d.a_to_b.vertices.max);
    }

    /// Verifies the tree and the bounds against brute force over all
    /// triangles: points, lines and slivers as thin as rounding included.
    #[test]
    fn against_brute_force(
        a in prop::collection::vec(-1.0..1.0_f64, 18),
        mut b in prop::collection::vec(-1.0..1.0_f64, 24),
        along in 0.0..1.0_f64,
        picks in prop::collection::vec([0..8_u32, 0..8, 0..8], 1..12),
        sliver_only: bool,
    ) {
        // Three points on a line, up to rounding.
        for c in 0..3 {
            b[21 + c] = b[c] + along * (b[3 + c] - b[c]);
        }
        let picks: Vec<_> = if sliver_only { vec![[0, 1, 7]] } else { picks };
        let from = surface(&a, &[[0, 1, 2], [3, 4, 5]]);
        let to = surface(&b, &picks);
        let options = SurfaceOptions { tolerance: 1e-2, max_subdivisions: 20_000 };
        let d = compare_surfaces(&from, &to, &options).unwrap();
        let corner = |p: u32| std::array::from_fn(|c| b[3 * p as usize + c]);
        let brute = |p: [f64; 3]| {
            let all = picks.iter().map(|t| distance(p, t.map(corner)));
            all.fold(f64::INFINITY, f64::min)
        };
        let at: Vec<f64> = a.as_chunks::<3>().0.iter().map(|p| brute(*p)).collect();
        let largest = at.iter().copied().fold(0.0, f64::max);
        prop_assert!((d.a_to_b.vertices.max - largest).abs() < 1e-9, "{} {largest}", d.a_to_b.vertices.max);
        let mean = at.iter().sum::<f64>() / 6.0;
        prop_assert!((d.a_to_b.vertices.mean - mean).abs() < 1e-9);
        for t in [[0, 1, 2], [3, 4, 5]] {
            for w in [[0.3, 0.3, 0.4], [0.5, 0.5, 0.0], [0.1, 0.2, 0.7], [0.9, 0.05, 0.05]] {
                let p = std::array::from_fn(|c| (0..3).map(|k| w[k] * a[3 * t[k] + c]).sum::<f64>());
                prop_assert!(brute(p) <= d.a_to_b.max_bound + 1e-9);
            }
        }
        prop_assert!(d.a_to_b.max <= d.a_to_b.max_bound);
        prop_assert!(d.hausdorff_bound - d.hausdorff < 0.1, "{d:?}");
    }
}

/// Verifies frame matching, energies and figures of two recordings, one of
/// them interrupted.
#[test]
fn recordings() {
    let folder = tempfile::tempdir().unwrap();
    let header = header(8);
    let (path_a, path_b) = (folder.path().join("a.mcap"), folder.path().join("b.mcap"));
    record(&path_a, &header, 12, 4);
    let mut recorder = Recorder::create(&path_b, &header, options()).unwrap();
    advance(&mut recorder, &header, 0..6, 4, |_| {}).unwrap();
    let (mut q, v) = state(&header, 6);
    for p in q.as_chunks_mut::<3>().0 {
        p[1] += 0.001;
    }
    recorder.frame(6.0 * DT, 6, &q, &v).unwrap();
    recorder.frame(6.3 * DT, 6, &q, &v).unwrap();
    recorder.finish(&json!({})).unwrap();
    let (a, b) = (
        Recording::open(&path_a).unwrap(),
        Recording::open(&path_b).unwrap(),
    );
    let c = compare_recordings(&a, &b, &CompareOptions::default()).unwrap();
    assert!(c.same_mesh);
    assert_eq!((c.frames.len(), c.unmatched_a, c.unmatched_b), (7, 5, 1));
    assert!(c.frames[..6].iter().all(|f| f.distances.max == 0.0));
    assert_relative_eq!(c.frames[6].distances.mean, 0.001, max_relative = 1e-9);
    let last = c.last.as_ref().unwrap();
    let surfaces = last.surfaces.unwrap();
    assert!(
        surfaces.hausdorff <= 0.001 + 1e-12 && surfaces.hausdorff > 0.0008,
        "{surfaces:?}"
    );
    assert_eq!(last.energies.len(), 3);
    assert_relative_eq!(last.energies[0].a.unwrap(), 0.6, max_relative = 1e-14);
    assert_relative_eq!(last.energies[0].b.unwrap(), 0.5, max_relative = 1e-14);
    assert_eq!((c.a.steps, c.b.steps, c.a.newton_iterations), (12, 6, 36));
    assert!(c.a.complete && c.a.warnings.is_empty());
    let text = serde_json::to_string_pretty(&c).unwrap();
    assert!(text.contains("\"hausdorff_bound\""));
    fs::write(folder.path().join("comparison.json"), text).unwrap();
}
