//! Properties over random inputs.

mod common;

use common::*;
use nalgebra::{DMatrix, Matrix3, Matrix3x4, Vector3};
use proptest::prelude::*;
use selvedge_linsolve::*;

fn vector() -> impl Strategy<Value = [f64; 3]> {
    let one = prop_oneof![
        -1.0..1.0f64,
        -1e-9..1e-9f64,
        Just(0.0),
        Just(1.0),
        (-1.0..1.0f64).prop_map(|v| v * 1e150),
    ];
    [one.clone(), one.clone(), one]
}

proptest! {
    /// Any sequence of constraints on a point, contradictory, repeated or
    /// nearly parallel, leaves an orthogonal projector; accepted directions
    /// are removed and their values met.
    #[test]
    fn filters_are_projectors(normals in prop::collection::vec((vector(), -2.0..2.0f64), 1..7)) {
        let mut filter = BlockFilter::new();
        let mut accepted = Vec::new();
        for (n, v) in normals {
            let rank = filter.rank(3);
            if filter.constrain(3, n, v).is_ok() && filter.rank(3) > rank {
                let n = Vector3::from(n).unscale(n.iter().fold(0.0, |m: f64, a| m.max(a.abs())));
                accepted.push((n.normalize(), v));
            }
        }
        if let Some(s) = filter.projector(3) {
            let s = Matrix3::from_row_slice(s);
            prop_assert!((s * s - s).amax() <= 1e-14);
            prop_assert!((s - s.transpose()).amax() <= 1e-15);
            prop_assert!((s.trace() - (3 - filter.rank(3)) as f64).abs() <= 1e-14);
            let mut x = [0.3; 12];
            filter.prescribe(&mut x);
            let x = Vector3::new(x[9], x[10], x[11]);
            for (n, v) in accepted {
                // independent by at least 1e-6: the value is met to 1e-16/1e-6²
                prop_assert!((s * n).amax() <= 1e-9);
                prop_assert!((n.dot(&x) - v).abs() <= 1e-9 * (1.0 + x.amax()));
            }
        }
    }

    /// An overconstrained point reports by how much the last value is missed.
    #[test]
    fn contradictions_are_reported(p in [-1.0..1.0f64, -1.0..1.0, -1.0..1.0], gap in 0.1..3.0f64) {
        let mut filter = BlockFilter::new();
        prop_assert_eq!(filter.fix(0, p).unwrap(), 0.0);
        let n = Vector3::new(0.36, 0.48, 0.8);
        let value = n.dot(&Vector3::from(p)) + gap;
        let violation = filter.constrain(0, n.into(), value).unwrap();
        prop_assert!((violation - gap).abs() < 1e-12);
        prop_assert_eq!(filter.rank(0), 3);
    }

    /// Adding weighted blocks is the rank-3 update it claims to be: the solution
    /// follows from the one without by Sherman–Morrison–Woodbury.
    #[test]
    fn weighted_blocks_are_low_rank_updates(seed in 1u64..1_000_000) {
        let mut random = Random(seed);
        let (points, groups) = sheet(4, 4);
        let mut a = random_spd::<f64>(&mut random, points, &groups, 0);
        let n = 3 * points;
        let b = random.vector(n);
        let inverse = dense(&a).cholesky().unwrap().inverse();
        let nodes = [0u32, 5, 6, 11];
        let w: [f64; 4] = std::array::from_fn(|_| random.unit());
        let mut k = random.spd_block();
        for r in 0..3 {
            k[r][r] += 0.1;
        }
        a.dynamic.rebuild(points, &[nodes], &[w], &[k], 1.0);
        let mut u = DMatrix::zeros(n, 3);
        for (&p, w) in nodes.iter().zip(w) {
            for r in 0..3 {
                u[(3 * p as usize + r, r)] = w;
            }
        }
        let k = DMatrix::from_fn(3, 3, |r, c| k[r][c]);
        let capacitance = k.try_inverse().unwrap() + u.transpose() * &inverse * &u;
        let y = &inverse * nalgebra::DVector::from_row_slice(&b);
        let expected = &y - &inverse * &u * capacitance.lu().solve(&(u.transpose() * &y)).unwrap();
        let mut x = vec![0.0; n];
        Direct::default().solve(&a, &b, &NoFilter, &mut x).unwrap();
        prop_assert!(relative(&x, expected.as_slice()) < 1e-9);
    }

    /// Renumbering there and back is the identity, and the ordering is a
    /// permutation that does not widen a shuffled mesh.
    #[test]
    fn permutations(seed in 1u64..1_000_000, w in 2usize..12, h in 2usize..12) {
        let mut random = Random(seed);
        let (points, mut groups) = sheet(w, h);
        let mut shuffle: Vec<u32> = (0..points as u32).collect();
        for i in (1..points).rev() {
            shuffle.swap(i, random.below(i + 1));
        }
        let shuffle = Permutation::from_old_of_new(shuffle).unwrap();
        for g in &mut groups {
            shuffle.relabel(g);
        }
        let pattern = Pattern::from_groups(points, groups.iter().map(Vec::as_slice));
        let order = reverse_cuthill_mckee(&pattern);
        let data: Vec<u64> = (0..points as u64).map(|i| i * i).collect();
        prop_assert_eq!(&order.to_old(&order.to_new(&data)), &data);
        for g in &mut groups {
            order.relabel(g);
        }
        let new = Pattern::from_groups(points, groups.iter().map(Vec::as_slice));
        prop_assert_eq!(order.bandwidth(&pattern), new.bandwidth());
        prop_assert!(new.bandwidth() <= pattern.bandwidth());
        prop_assert!(new.bandwidth() <= 4 * w.min(h) + 4, "{} {} {}", w, h, new.bandwidth());
        prop_assert!(Permutation::from_old_of_new(vec![0, 0]).is_none());
        prop_assert!(Permutation::from_old_of_new(vec![0, 2]).is_none());
    }

    /// The factorised weights equal the assembled 12 × 12 matrix `W K Wᵀ`.
    #[test]
    fn weighted_product(seed in 1u64..1_000_000) {
        let mut random = Random(seed);
        let w: [f64; 4] = std::array::from_fn(|_| random.unit());
        let k = random.spd_block();
        let mut a = WeightedBlocks::<f64>::new(4);
        a.rebuild(4, &[[2, 0, 3, 1]], &[w], &[k], 1.5);
        let x = random.vector(12);
        let gap = Matrix3x4::from_column_slice(&x)
            * nalgebra::Vector4::new(w[1], w[3], w[0], w[2]);
        let f = Matrix3::from_fn(|r, c| 1.5 * k[r][c]) * gap;
        let expected: Vec<f64> = [w[1], w[3], w[0], w[2]].iter().flat_map(|w| (f * *w).data.0[0]).collect();
        let mut y = vec![0.0; 12];
        a.apply(&x, &mut y);
        prop_assert!(relative(&y, &expected) < 1e-13);
    }
}
