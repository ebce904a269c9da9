//! The same bits for any number of threads, and scattering by several.

mod common;

use common::*;
use rayon::prelude::*;
use selvedge_linsolve::*;
use std::sync::Arc;

fn with_threads<R: Send>(threads: usize, run: impl FnOnce() -> R + Send) -> R {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("a small pool").install(run)
}

/// Products, dots and whole solves.
#[test]
fn bits_do_not_depend_on_threads() {
    let solve = |precision: &str, name: &str| {
        let mut random = Random(12);
        let (points, groups) = sheet(150, 90);
        let b = random.vector(3 * points);
        let mut filter = BlockFilter::new();
        for i in 0..40 {
            filter
                .constrain(17 * i, [1.0, 2.0, f64::from(i)], 0.1)
                .expect("valid");
        }
        let mut x = vec![0.0; b.len()];
        filter.prescribe(&mut x);
        let settings = MpcgSettings {
            tolerance: 1e-5,
            ..MpcgSettings::default()
        };
        let report = if precision == "f32" {
            let a = random_spd::<f32>(&mut random, points, &groups, 3000);
            let mut s = solver_by_name::<f32>("cg", name, settings).expect("valid");
            s.solve(&a, &b, &filter, &mut x)
        } else {
            let a = random_spd::<f64>(&mut random, points, &groups, 3000);
            let mut s = solver_by_name::<f64>("cg", name, settings).expect("valid");
            s.solve(&a, &b, &filter, &mut x)
        };
        let report = report.expect("solvable");
        assert!(report.converged(), "{report:?}");
        (x.iter().map(|v| v.to_bits()).collect::<Vec<_>>(), report)
    };
    for precision in ["f32", "f64"] {
        for name in PRECONDITIONERS {
            let one = with_threads(1, || solve(precision, name));
            for threads in [2, 4] {
                assert!(
                    one == with_threads(threads, || solve(precision, name)),
                    "{name}"
                );
            }
        }
    }
}

/// Chunks of a colour share no point, every stencil is in one chunk, and few
/// colours are needed.
#[test]
fn chunks_of_a_colour_are_disjoint() {
    let t = triangles(60, 40);
    let h = hinges(&t);
    let points = 60 * 40;
    let lists: [Vec<&[u32]>; 2] = [
        t.iter().map(|t| &t[..]).collect(),
        h.iter().map(|h| &h[..]).collect(),
    ];
    for stencils in lists {
        for size in [1, 16, 64, 100_000] {
            let c = colour_chunks(points, stencils.iter().copied(), size);
            assert_eq!(
                c.colours.iter().map(Vec::len).sum::<usize>(),
                c.chunks.len()
            );
            let mut next = 0;
            for chunk in &c.chunks {
                assert_eq!(chunk.start, next);
                assert!((1..=size).contains(&chunk.len()));
                next = chunk.end;
            }
            assert_eq!(next as usize, stencils.len());
            for colour in &c.colours {
                let mut owner = vec![u32::MAX; points];
                for &chunk in colour {
                    for e in c.chunks[chunk as usize].clone() {
                        for &p in stencils[e as usize] {
                            let owner = &mut owner[p as usize];
                            assert!(*owner == u32::MAX || *owner == chunk);
                            *owner = chunk;
                        }
                    }
                }
            }
        }
    }
}

/// Single stencils: proper, not below the bound, smallest-last close to it,
/// and more than 64 colours where one point needs them.
#[test]
fn stencil_colourings() {
    let t = triangles(40, 40);
    let h = hinges(&t);
    let lists: [Vec<&[u32]>; 2] = [
        t.iter().map(|t| &t[..]).collect(),
        h.iter().map(|h| &h[..]).collect(),
    ];
    for stencils in lists {
        for order in [
            ColourOrder::Natural,
            ColourOrder::LargestFirst,
            ColourOrder::SmallestLast,
        ] {
            let c = colour_stencils(1600, stencils.iter().copied(), order);
            assert_eq!(
                c.colours.iter().map(Vec::len).sum::<usize>(),
                stencils.len()
            );
            assert!(c.colours.len() >= c.lower_bound);
            if order == ColourOrder::SmallestLast {
                assert!(
                    c.colours.len() <= c.lower_bound + 3,
                    "{} {}",
                    c.colours.len(),
                    c.lower_bound
                );
            }
            for colour in &c.colours {
                let mut used = vec![false; 1600];
                for p in colour.iter().flat_map(|&e| stencils[e as usize]) {
                    assert!(!std::mem::replace(&mut used[*p as usize], true));
                }
            }
        }
    }
    let hub: Vec<[u32; 2]> = (1..200).map(|i| [0, i]).collect();
    let c = colour_stencils(200, hub.iter().map(|s| &s[..]), ColourOrder::Natural);
    assert_eq!((c.colours.len(), c.lower_bound), (199, 199));
}

/// Scattering by colours from several threads equals serial scattering to the
/// bit (in the order of the colours), and compare-and-swap to rounding.
#[test]
fn shared_scatter() {
    let t = triangles(80, 50);
    let points = 80 * 50;
    let pattern = Arc::new(Pattern::from_groups(points, t.iter().map(|t| &t[..])));
    let colouring = colour_chunks(points, t.iter().map(|t| &t[..]), 64);
    let block = |e: u32, a: usize, b: usize| {
        let v = f64::from(e) + (a * 3 + b) as f64 * 0.1;
        std::array::from_fn(|r| std::array::from_fn(|c| (v + r as f64 * 0.3 + c as f64).sin()))
    };
    let each = |e: u32, add: &dyn Fn(usize, &[[f64; 3]; 3])| {
        for (a, &i) in t[e as usize].iter().enumerate() {
            for (b, &j) in t[e as usize].iter().enumerate() {
                add(
                    pattern.slot(i, j).expect("in the pattern") as usize,
                    &block(e, a, b),
                );
            }
        }
    };
    let mut serial = Bsr::<f64>::zeros(Arc::clone(&pattern));
    let mut forces = vec![0.0; 3 * points];
    {
        let shared = SharedValues::new(serial.values_mut());
        let f = SharedValues::new(&mut forces);
        for &chunk in colouring.colours.iter().flatten() {
            for e in colouring.chunks[chunk as usize].clone() {
                each(e, &|slot, k| shared.add_block(slot, k, 0.5));
                for &p in &t[e as usize] {
                    f.add_point(p as usize, &[1.0, f64::from(e), 0.1], 2.0);
                }
            }
        }
    }
    // one slot by hand: the block is given as rows
    let mut check = Bsr::<f64>::zeros(Arc::clone(&pattern));
    check.add_block(5, &[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]], 2.0);
    assert_eq!(check.block(5)[1][2], 12.0);
    assert_eq!(check.values()[Bsr::<f64>::index(5, 1, 2)], 12.0);
    for threads in [1, 2, 4] {
        let (mut exclusive, mut atomic) = (serial.clone(), serial.clone());
        exclusive.fill_zero();
        atomic.fill_zero();
        let mut g = vec![0.0; 3 * points];
        with_threads(threads, || {
            let shared = SharedValues::new(exclusive.values_mut());
            let f = SharedValues::new(&mut g);
            for colour in &colouring.colours {
                colour.par_iter().for_each(|&chunk| {
                    for e in colouring.chunks[chunk as usize].clone() {
                        each(e, &|slot, k| shared.add_block(slot, k, 0.5));
                        for &p in &t[e as usize] {
                            f.add_point(p as usize, &[1.0, f64::from(e), 0.1], 2.0);
                        }
                    }
                });
            }
            let shared = SharedValues::new(atomic.values_mut());
            (0..t.len() as u32).into_par_iter().for_each(|e| {
                each(e, &|slot, k| shared.add_block_atomic(slot, k, 0.5));
            });
        });
        assert_eq!(exclusive.values(), serial.values());
        assert_eq!(forces, g);
        assert!(relative(atomic.values(), serial.values()) < 1e-13);
    }
}
