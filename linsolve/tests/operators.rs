//! Products and entries of the matrices against dense algebra.

mod common;

use common::*;
use nalgebra::DVector;
use selvedge_linsolve::*;
use std::sync::Arc;

/// Every product equals the dense matrix made of the visited entries.
#[test]
fn products_match_the_entries() {
    let mut random = Random(7);
    for (w, h, contacts) in [(2, 2, 0), (5, 4, 9), (40, 60, 300)] {
        let (points, groups) = sheet(w, h);
        let a = random_spd::<f64>(&mut random, points, &groups, contacts);
        let x = random.vector(3 * points);
        let expected = dense(&a) * DVector::from_row_slice(&x);
        let mut y = vec![f64::NAN; x.len()];
        a.apply(&x, &mut y);
        assert!(relative(&y, expected.as_slice()) < 1e-13);
        let mut z = vec![f64::NAN; x.len()];
        for sums in [Sums::Double, Sums::OfVectors] {
            let d = a.apply_dot(&x, &mut z, sums);
            assert_eq!(y, z);
            assert!((d / dot(&x, &y) - 1.0).abs() < 1e-12);
        }
        // the dynamic part alone plus the static part alone
        let mut s = vec![f64::NAN; x.len()];
        a.stat.apply(&x, &mut s);
        a.dynamic.apply(&x, &mut z);
        axpy(1.0, &z, &mut s);
        assert!(relative(&s, &y) < 1e-13);
    }
}

/// The diagonal blocks hold the static and the dynamic part.
#[test]
fn diagonal_blocks_are_complete() {
    let mut random = Random(8);
    let (points, groups) = sheet(5, 6);
    let a = random_spd::<f64>(&mut random, points, &groups, 40);
    let m = dense(&a);
    let mut blocks = vec![[0.0; 9]; points];
    a.diagonal_blocks(&mut blocks);
    for (i, b) in blocks.iter().enumerate() {
        for k in 0..9 {
            let expected = m[(3 * i + k / 3, 3 * i + k % 3)];
            assert!((b[k] - expected).abs() < 1e-12 * m.amax());
        }
    }
}

/// The reassembled baseline is the same matrix, and keeps the identity of its
/// pattern while that is the same.
#[test]
fn reassembled_equals_dual() {
    let mut random = Random(9);
    let (points, groups) = sheet(6, 5);
    let a = random_spd::<f64>(&mut random, points, &groups, 25);
    let m = dense(&a);
    let mut b = ReassembledMatrix::<f64>::new(points);
    let mut ids = Vec::new();
    for _ in 0..2 {
        b.clear();
        for i in 0..points {
            for j in 0..points {
                let block: [[f64; 3]; 3] =
                    std::array::from_fn(|r| std::array::from_fn(|c| m[(3 * i + r, 3 * j + c)]));
                if block != [[0.0; 3]; 3] {
                    let half = block.map(|r| r.map(|v| 0.5 * v));
                    b.push_block(i, j, &half);
                    b.push_block(i, j, &half);
                }
            }
        }
        b.compress();
        assert!((dense(&b) - &m).amax() < 1e-13 * m.amax());
        ids.push(b.pattern_id());
    }
    assert_eq!(ids[0], ids[1]);
}

/// A contact set with the same nodes keeps the pattern identity, another one
/// changes it, and memory is reused.
#[test]
fn dynamic_pattern_identity() {
    let mut random = Random(10);
    let mut a: DualMatrix<f64> = random_spd(&mut random, 6, &[vec![0, 1, 2], vec![3, 4, 5]], 0);
    let empty = a.pattern_id();
    let k = [random.spd_block(), random.spd_block()];
    let w = [[0.3, 0.7, 0.0, -1.0], [1.0, -1.0, 0.0, 0.0]];
    let far = u32::MAX; // a node of weight zero may be anything
    a.dynamic
        .rebuild(6, &[[0, 1, far, 5], [2, 4, far, far]], &w, &k, 1.0);
    let first = a.pattern_id();
    a.dynamic
        .rebuild(6, &[[0, 1, 3, 5], [2, 4, 0, far]], &w, &k, 3.0);
    assert_eq!(first, a.pattern_id());
    assert_ne!(first, empty);
    a.dynamic
        .rebuild(6, &[[0, 1, 3, 4], [2, 4, 0, far]], &w, &k, 3.0);
    assert_ne!(first, a.pattern_id());
    assert_eq!(a.dynamic.touched(), 4);
    a.dynamic.clear();
    assert_eq!(a.pattern_id(), empty);
    let single = DualMatrix {
        stat: Bsr::<f32>::zeros(Arc::clone(a.stat.pattern())),
        dynamic: WeightedBlocks::new(6),
    };
    assert_eq!(single.pattern_id(), empty);
}

/// Pattern of known size, with slots that are found and bandwidth as counted.
#[test]
fn pattern_of_a_sheet() {
    let (points, groups) = sheet(30, 20);
    let p = Pattern::from_groups(points, groups.iter().map(Vec::as_slice));
    for i in 0..points {
        assert!(p.columns(i).is_sorted_by(|a, b| a < b));
        assert_eq!(p.all_columns()[p.diagonal_slot(i) as usize], i as u32);
        for &j in p.columns(i) {
            assert!(p.slot(j, i as u32).is_some(), "symmetric");
        }
    }
    assert_eq!(p.slot(0, (points - 1) as u32), None);
    assert_eq!(p.slot(u32::MAX, 0), None);
    let wide = (0..points).flat_map(|i| p.columns(i).iter().map(move |&j| i.abs_diff(j as usize)));
    assert_eq!(wide.max(), Some(p.bandwidth()));
}
