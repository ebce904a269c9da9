//! Every energy against finite differences, rigid motions, shifts of the
//! material and its own claim of semidefiniteness.

use selvedge_energy::{
    Batch, Curvature, DofLayout, EnergyBatch, EvalPoint, check_derivatives, check_projection,
    check_rigid_motion,
};
use selvedge_yarn_model::{
    JammingBending, LockedBending, LockedGravity, LockedStretch, ParallelYarns, PlainBending,
    StitchLength, StitchWrapping, YarnBending, YarnGravity, YarnMaterial, YarnNetwork, YarnShear,
    YarnStretch,
};

use super::common::{
    Random, at, chain, close, evaluate, is_above, layout, stitch, unknowns, weave,
};

const G: [f64; 3] = [0.3, -0.2, -9.81];
const MM: f64 = 1e-3;

/// A yarn that wriggles through space, some segments compressed and some
/// stretched, some bends past the jamming angle.
fn wriggle() -> (YarnNetwork, Vec<f64>, Vec<f64>) {
    let mut random = Random(7);
    let points: Vec<[f64; 3]> = (0..40)
        .map(|i| {
            let s = 0.4 * f64::from(i);
            std::array::from_fn(|k| {
                MM * ([s, (3.0 * s).sin(), (2.0 * s).cos()][k] + 0.6 * random.next())
            })
        })
        .collect();
    let arcs: Vec<f64> = (0..40).map(|i| MM * f64::from(i)).collect();
    let network = chain(YarnMaterial::default(), &points, &arcs);
    let mut q = unknowns(&network);
    for u in &mut q[120..] {
        *u += 0.2 * MM * random.next();
    }
    let start = random.shake(&q, 0.1 * MM);
    (network, q, start)
}

fn terms(network: &YarnNetwork) -> Vec<Box<dyn EnergyBatch>> {
    let plain: PlainBending = YarnBending::new(network);
    let jamming: JammingBending = YarnBending::new(network);
    vec![
        Box::new(Batch::<_, 4, 8>::new("stretch", YarnStretch::new(network))),
        Box::new(Batch::<_, 5, 11>::new("bending", plain)),
        Box::new(Batch::<_, 5, 11>::new("jamming", jamming)),
        Box::new(Batch::<_, 4, 8>::new(
            "gravity",
            YarnGravity::new(network, G),
        )),
    ]
}

fn locked_terms(network: &YarnNetwork) -> Vec<Box<dyn EnergyBatch>> {
    let plain: LockedBending<false> = LockedBending::bending(network);
    let jamming: LockedBending<true> = LockedBending::bending(network);
    vec![
        Box::new(Batch::<_, 2, 6>::new(
            "stretch",
            LockedStretch::stretch(network),
        )),
        Box::new(Batch::<_, 3, 9>::new("bending", plain)),
        Box::new(Batch::<_, 3, 9>::new("jamming", jamming)),
        Box::new(Batch::<_, 2, 6>::new(
            "gravity",
            LockedGravity::gravity(network, G),
        )),
    ]
}

fn check(term: &dyn EnergyBatch, at: &EvalPoint<'_>, tolerance: f64) {
    assert!(!term.is_empty());
    if let Err(error) = check_derivatives(term, at, tolerance) {
        panic!("{error}");
    }
    for curvature in [Curvature::Projected, Curvature::GaussNewton] {
        if let Err(error) = check_projection(term, at, curvature, 1e-11) {
            panic!("{curvature:?}: {error}");
        }
    }
}

/// A curvature that a linear solve may use resists no translation: gravity's has
/// none at all.
fn holds_nothing(term: &dyn EnergyBatch, at: &EvalPoint<'_>) {
    for curvature in [Curvature::Projected, Curvature::GaussNewton] {
        for e in 0..term.len() {
            let (_, _, h) = evaluate(term, at, curvature, e);
            assert!(h.iter().all(|h| *h == 0.0), "{curvature:?}");
        }
    }
}

#[test]
fn sliding() {
    let (network, q, start) = wriggle();
    let at = at(&network, &q, &start);
    for term in terms(&network) {
        check(&*term, &at, 1e-6);
        if term.name() == "gravity" {
            holds_nothing(&*term, &at);
        } else {
            is_above(&*term, &at);
        }
        assert!(term.is_conservative());
    }
    // The sample has what it claims.
    let angles = |from: f64, to: f64| {
        (0..38).any(|i| {
            let p = |j: usize| nalgebra::Vector3::from_column_slice(&q[3 * j..3 * j + 3]);
            let angle = (p(i + 1) - p(i)).angle(&(p(i + 2) - p(i + 1)));
            angle > from && angle < to
        })
    };
    assert!(angles(0.0, 1.5) && angles(1.6, 1.83) && angles(1.84, 2.9));
}

/// The same material moved along the yarn changes nothing but gravity's share
/// at the ends.
#[test]
fn shift_of_the_material() {
    let (network, q, start) = wriggle();
    let mut shifted = q.clone();
    for u in &mut shifted[120..] {
        *u += 3.0 * MM;
    }
    for term in terms(&network) {
        for e in 0..term.len() {
            let (a, ga, _) = evaluate(&*term, &at(&network, &q, &start), Curvature::Exact, e);
            let (b, gb, _) = evaluate(&*term, &at(&network, &shifted, &start), Curvature::Exact, e);
            close(term.name(), &[a], &[b], 1e-11);
            close(term.name(), &ga, &gb, 1e-11);
            let scalars = term
                .node_dims()
                .iter()
                .rev()
                .take_while(|d| **d == 1)
                .count();
            let sum: f64 = ga[ga.len() - scalars..].iter().sum();
            assert!(sum.abs() <= 1e-12 * ga[ga.len() - 1].abs());
        }
    }
}

/// Gravity on an arc length inside a yarn does not depend on the origin.
#[test]
fn weight_is_the_same_anywhere() {
    let (network, q, start) = wriggle();
    let mut moved = q.clone();
    for p in moved[..120].as_chunks_mut::<3>().0 {
        *p = [p[0] + 0.5, p[1] - 0.25, p[2] + 1.0];
    }
    let gravity = Batch::<_, 4, 8>::new("gravity", YarnGravity::new(&network, G));
    let sum = |q: &[f64]| {
        let mut total = vec![0.0; q.len()];
        let mut g = [0.0; 8];
        for e in 0..gravity.len() {
            gravity.gradients(&at(&network, q, &start), e..e + 1, &mut g);
            for (i, node) in gravity.nodes(e)[2..].iter().enumerate() {
                total[120 + *node as usize] += g[6 + i];
            }
            for (i, node) in gravity.nodes(e)[..2].iter().enumerate() {
                for k in 0..3 {
                    total[3 * *node as usize + k] += g[3 * i + k];
                }
            }
        }
        total
    };
    let (a, b) = (sum(&q), sum(&moved));
    close("inner forces", &a[..120], &b[..120], 1e-12);
    close("inner pulls", &a[121..159], &b[121..159], 1e-10);
}

#[test]
fn locked() {
    let (network, q, start) = wriggle();
    let points = EvalPoint {
        layout: DofLayout::points(40),
        q: &q[..120],
        q_start: &start[..120],
        dt: 1e-3,
    };
    // Sliding at the frozen arc lengths must give the same.
    let mut rest = q.clone();
    rest[120..].copy_from_slice(&unknowns(&network)[120..]);
    for (term, sliding) in locked_terms(&network).into_iter().zip(terms(&network)) {
        if term.name() == "gravity" {
            holds_nothing(&*term, &points);
        } else {
            check(&*term, &points, 1e-6);
            if let Err(error) = check_rigid_motion(&*term, &points, 1e-10) {
                panic!("{error}");
            }
            is_above(&*term, &points);
        }
        let (x, m) = (term.local_dim(), sliding.local_dim());
        for e in 0..term.len() {
            for curvature in [
                Curvature::Exact,
                Curvature::Projected,
                Curvature::GaussNewton,
            ] {
                let (a, ga, ha) = evaluate(&*term, &points, curvature, e);
                let (b, gb, hb) = evaluate(&*sliding, &at(&network, &rest, &start), curvature, e);
                assert_eq!(a, b);
                assert_eq!(ga, gb[..x]);
                for i in 0..x {
                    assert_eq!(ha[i * x..(i + 1) * x], hb[i * m..i * m + x]);
                }
            }
        }
    }
}

/// Angles from nearly straight to nearly folded back, in and out of the range
/// where jamming sets in.
#[test]
fn bending_at_all_angles() {
    let points = [[-MM, 0.0, 0.0], [0.0; 3], [1.3 * MM, 0.0, 0.0]];
    let network = chain(YarnMaterial::default(), &points, &[0.0, MM, 2.2 * MM]);
    let jamming: JammingBending = YarnBending::new(&network);
    let jamming = Batch::<_, 5, 11>::new("jamming", jamming);
    let mut angles = vec![1e-9, 1e-6, 1e-4, 1e-3, 3e-3];
    angles.extend((1..62).map(|i| 0.05 * f64::from(i)));
    for theta in angles {
        let mut q = unknowns(&network);
        let (s, c) = theta.sin_cos();
        q[6] = 1.3 * MM * c;
        q[7] = 1.3 * MM * s * 0.6;
        q[8] = 1.3 * MM * s * 0.8;
        let at = at(&network, &q, &q);
        if let Err(error) = check_derivatives(&jamming, &at, 1e-6) {
            panic!("{theta}: {error}");
        }
        for curvature in [Curvature::Projected, Curvature::GaussNewton] {
            if let Err(error) = check_projection(&jamming, &at, curvature, 1e-11) {
                panic!("{theta} {curvature:?}: {error}");
            }
        }
        is_above(&jamming, &at);
    }
}

#[test]
fn shear() {
    let material = YarnMaterial {
        radius: 0.25 * MM,
        ..YarnMaterial::default()
    };
    let network = weave(material, [6, 6], 2.2 * MM, |i, j| (i + j) % 2 == 0);
    let mut random = Random(3);
    for rest in [YarnShear::new(&network), YarnShear::from_layout(&network)] {
        let term = Batch::<_, 3, 9>::new("shear", rest);
        // Four at an inner crossing, two at an edge, one at a corner.
        assert_eq!(term.len(), 4 * 16 + 2 * 16 + 4);
        for shake in [0.1, 0.8, 1.5] {
            let q = random.shake(&unknowns(&network), shake * MM);
            let start = random.shake(&q, 0.1 * MM);
            let at = at(&network, &q, &start);
            check(&term, &at, 1e-6);
            is_above(&term, &at);
            if let Err(error) = check_rigid_motion(&term, &at, 1e-10) {
                panic!("{error}");
            }
        }
        // Square is at rest.
        let q = unknowns(&network);
        let mut g = [f64::NAN; 9];
        for e in 0..term.len() {
            term.gradients(&at(&network, &q, &q), e..e + 1, &mut g);
            assert!(g.iter().all(|g| g.abs() < 1e-15));
        }
    }
}

#[test]
fn wrapping() {
    let mut random = Random(11);
    for side in [-1, 1] {
        for purl in [false, true] {
            let network = stitch(YarnMaterial::default(), side, purl, false);
            let term = Batch::<_, 4, 12>::new("wrapping", StitchWrapping::new(&network));
            assert_eq!(term.len(), 2);
            for shake in [0.02, 0.1, 0.3] {
                let q = random.shake(&unknowns(&network), shake);
                let start = random.shake(&q, 0.02);
                let at = at(&network, &q, &start);
                check(&term, &at, 1e-6);
                if let Err(error) = check_rigid_motion(&term, &at, 1e-9) {
                    panic!("{error}");
                }
                is_above(&term, &at);
                if let Err(error) = check_projection(&term, &at, Curvature::GaussNewton, 1e-9) {
                    panic!("{error}");
                }
            }
        }
    }
}

/// Wings close to their axes, where the energy fades into a constant: the force
/// is its gradient there too, stays bounded and goes out.
#[test]
fn wrapping_fades() {
    let network = stitch(YarnMaterial::default(), -1, false, false);
    let term = Batch::<_, 4, 12>::new("wrapping", StitchWrapping::new(&network));
    let length = network.stitches[0].rest;
    let stiffness = network.materials[0].wrapping * length;
    let flat = 0.5 * stiffness * (0.5 * std::f64::consts::PI).powi(2);
    let mut random = Random(13);
    let nodes: [u32; 4] = term.nodes(0).try_into().unwrap();
    let mut worst = [0.0f64; 4];
    for (height, worst) in [0.6, 0.3, 0.1, 0.01].into_iter().zip(&mut worst) {
        for sample in 0..20 {
            let mut q = unknowns(&network);
            let place = |q: &[f64], i: u32| {
                let i = 3 * i as usize;
                nalgebra::Vector3::new(q[i], q[i + 1], q[i + 2])
            };
            let [x0, x1] = [nodes[0], nodes[1]].map(|i| place(&q, i));
            let axis = (x1 - x0).normalize();
            // Wings beyond both ends of the axis, one of them at this height. With
            // both near the axis the force drowns in the rounding of the constant.
            let heights = match sample % 2 {
                0 => [height, 0.4],
                _ => [0.4, height],
            };
            let ends = [(nodes[2], x1, 1.0), (nodes[3], x0, -1.0)];
            for ((node, end, out), height) in ends.into_iter().zip(heights) {
                let any = nalgebra::Vector3::new(random.next(), random.next(), random.next());
                let across = (any - axis * any.dot(&axis)).normalize();
                let x = end + axis * (out * 0.7 * length) + across * (height * length);
                q[3 * node as usize..][..3].copy_from_slice(x.as_slice());
            }
            // Differences across the cut, π from the angle at the start, see a jump.
            let mut local = [0.0; 12];
            for (x, node) in local.as_chunks_mut::<3>().0.iter_mut().zip(nodes) {
                *x = place(&q, node).into();
            }
            let angle = term.energy().angle(0, &local).unwrap();
            if angle.abs() > 2.8 {
                continue;
            }
            let start = q.clone();
            let at = at(&network, &q, &start);
            for curvature in [Curvature::Exact, Curvature::Projected] {
                let (value, g, h) = evaluate(&term, &at, curvature, 0);
                let size = g.iter().fold(0.0, |a: f64, g| a.max(g.abs()));
                *worst = worst.max(size * length / stiffness);
                let faded = height < 0.5;
                assert!(!faded || (value - flat).abs() < 20.0 * stiffness);
                assert!(h.iter().all(|h| h.is_finite()));
            }
            if let Err(error) = check_derivatives(&term, &at, 2e-5) {
                panic!("{error}: height {height}, angle {angle}, sample {sample}");
            }
            for curvature in [Curvature::Projected, Curvature::GaussNewton] {
                if let Err(error) = check_projection(&term, &at, curvature, 1e-9) {
                    panic!("{error}");
                }
            }
            is_above(&term, &at);
        }
    }
    // Of order 10 at most; it goes out with the square of the height.
    assert!(worst.iter().all(|w| *w < 40.0), "{worst:?}");
    assert!(worst[3] < 0.02 * worst[2], "{worst:?}");
}

/// The steps of the differences are those of metres where a stencil has no
/// points, so these networks are large.
#[test]
fn arc_lengths() {
    let material = YarnMaterial {
        radius: 0.3,
        ..YarnMaterial::default()
    };
    let network = weave(material.clone(), [4, 4], 2.0, |i, j| (i + j) % 2 == 0);
    let term = Batch::<_, 2, 2>::new("parallel", ParallelYarns::new(&network));
    assert_eq!(term.len(), 24);
    let mut random = Random(5);
    // d = 4 R = 1.2 of 2: shaken by up to 0.7 either way some touch.
    let q = random.shake(&unknowns(&network), 0.7);
    let at_q = at(&network, &q, &q);
    check(&term, &at_q, 1e-8);
    is_above(&term, &at_q);
    let touching = (0..24)
        .filter(|&e| term.value(&at_q, e..e + 1) > 0.0)
        .count();
    assert!((1..24).contains(&touching), "{touching}");

    let network = stitch(material, -1, false, false);
    let term = Batch::<_, 2, 2>::new("length", StitchLength::new(&network));
    let q = random.shake(&unknowns(&network), 0.1);
    check(&term, &at(&network, &q, &q), 1e-8);
    is_above(&term, &at(&network, &q, &q));
    assert_eq!(layout(&network).scalars, 8);
}

/// `d` of [Cirio2014]: 2 R along a float, 4 R where the yarn changes side, and
/// never so large that cloth pushes at rest.
#[test]
fn spacing() {
    let material = YarnMaterial {
        radius: 0.1 * MM,
        ..YarnMaterial::default()
    };
    // Warps 0 and 1 on top everywhere but at (0, 1).
    let network = weave(material, [3, 3], MM, |i, j| (i, j) != (0, 1));
    let strand = |i: u32, j: u32, warp: bool| {
        let c = &network.crossings[(i * 3 + j) as usize];
        if warp { c.warp } else { c.weft }
    };
    let d = |a: u32, b: u32| ParallelYarns::spacing(&network, a, b).unwrap();
    let float = d(strand(1, 0, true), strand(1, 1, true));
    let between = d(strand(0, 0, true), strand(0, 1, true));
    let weft = d(strand(0, 1, false), strand(1, 1, false));
    close(
        "spacing",
        &[float, between, weft],
        &[0.2 * MM, 0.4 * MM, 0.4 * MM],
        1e-14,
    );

    let dense = weave(YarnMaterial::default(), [3, 3], MM, |_, _| true);
    for [a, b] in dense.segments() {
        let d = ParallelYarns::spacing(&dense, a, b).unwrap();
        close("dense", &[d], &[0.95 * MM], 1e-12);
    }
    // Inside a stitch contact and beside a yarn's end nothing is in the way.
    let knit = stitch(YarnMaterial::default(), 1, false, false);
    assert!(
        knit.segments()
            .all(|[a, b]| ParallelYarns::spacing(&knit, a, b).is_none())
    );
}
