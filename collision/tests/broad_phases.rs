//! All broad phases find the pairs that brute force finds.

use selvedge_collision::testing::conformance;
use selvedge_collision::{Aabb, BroadPhase, BruteForce, BvhParry, HashGrid};

/// Every structure passes the public suite, for several seeds and sizes.
#[test]
fn conform_to_brute_force() {
    for (seed, count) in [(1, 40), (2, 150), (3, 500)] {
        conformance(&mut BruteForce, seed, count).unwrap();
        conformance(&mut HashGrid::new(), seed, count).unwrap();
        conformance(&mut BvhParry::new(), seed, count).unwrap();
    }
}

/// The suite catches a structure that forgets touching boxes, repeats a pair,
/// or swaps its ends.
#[test]
fn suite_detects_faults() {
    struct Faulty(fn(&mut Vec<[u32; 2]>, &[Aabb]));
    impl BroadPhase for Faulty {
        fn name(&self) -> &str {
            "faulty"
        }
        fn overlaps(&mut self, boxes: &[Aabb], pairs: &mut Vec<[u32; 2]>) {
            BruteForce.overlaps(boxes, pairs);
            (self.0)(pairs, boxes);
        }
        fn heap_bytes(&self) -> usize {
            0
        }
    }
    let strict = |pairs: &mut Vec<[u32; 2]>, boxes: &[Aabb]| {
        pairs.retain(|p| {
            let [a, b] = p.map(|i| boxes[i as usize]);
            (0..3).all(|k| a.min[k] < b.max[k] && b.min[k] < a.max[k])
        });
    };
    assert_eq!(
        conformance(&mut Faulty(strict), 1, 60).unwrap_err().what,
        "missing"
    );
    let twice = |pairs: &mut Vec<[u32; 2]>, _: &[Aabb]| pairs.extend_from_within(..);
    assert_eq!(
        conformance(&mut Faulty(twice), 1, 60).unwrap_err().what,
        "repeated"
    );
    let swapped =
        |pairs: &mut Vec<[u32; 2]>, _: &[Aabb]| pairs.iter_mut().for_each(|p| p.reverse());
    assert_eq!(
        conformance(&mut Faulty(swapped), 1, 60).unwrap_err().what,
        "misordered"
    );
    let all = |pairs: &mut Vec<[u32; 2]>, boxes: &[Aabb]| {
        pairs.clear();
        for j in 0..boxes.len() as u32 {
            pairs.extend((0..j).map(|i| [i, j]));
        }
    };
    assert_eq!(
        conformance(&mut Faulty(all), 1, 60).unwrap_err().what,
        "wrong"
    );
}

/// The tree is refitted while boxes move and rebuilt when they have grown to
/// twice their area or changed their number.
#[test]
fn tree_is_rebuilt_when_worn() {
    let cube = |x: f64, s: f64| Aabb {
        min: [x, 0.0, 0.0],
        max: [x + s, s, s],
    };
    let boxes = |n: usize, s: f64| -> Vec<Aabb> { (0..n).map(|i| cube(i as f64, s)).collect() };
    let mut bvh = BvhParry::new();
    let mut pairs = Vec::new();
    for (n, size, builds) in [
        (9, 1.0, 1),
        (9, 1.1, 1),
        (9, 1.4, 1),
        (9, 1.5, 2),
        (8, 1.5, 3),
    ] {
        bvh.overlaps(&boxes(n, size), &mut pairs);
        assert_eq!(bvh.build_count(), builds, "{n} boxes of {size}");
    }
}
