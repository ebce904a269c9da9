//! The same bits on any number of threads and after a restart.

mod common;

use common::{Random, add_sheet, detect, evaluate};
use std::sync::Arc;

use selvedge_collision::body::{Body, RoundCone, Union};
use selvedge_collision::{
    BodyContact, BodyFaces, Candidates, CollisionBackend, CollisionError, CollisionMesh,
    ContactResponse, ContactSource, Friction, FrictionAnchored, HashGrid, ProximityBackend,
    SelfContact,
};
use selvedge_energy::{DofLayout, EvalPoint};

/// Two rough layers of some thousand triangles on a floor.
fn scene(steps: usize) -> Vec<Vec<f64>> {
    let mut random = Random(5);
    let (mut q, mut triangles) = (Vec::new(), Vec::new());
    add_sheet(&mut q, &mut triangles, 40, 30, 0.01, 0.0);
    add_sheet(&mut q, &mut triangles, 38, 32, 0.0101, 0.6e-3);
    // Lying on the floor, y up.
    q.chunks_mut(3).for_each(|p| p.swap(1, 2));
    let mut states = vec![q];
    for k in 0..steps {
        let last = &states[k];
        states.push(last.iter().map(|x| x + 2e-4 * random.next()).collect());
    }
    states
}

fn sources(q: &[f64]) -> Vec<Box<dyn ContactSource>> {
    let (mut unused, mut triangles) = (Vec::new(), Vec::new());
    add_sheet(&mut unused, &mut triangles, 40, 30, 0.01, 0.0);
    add_sheet(&mut unused, &mut triangles, 38, 32, 0.01, 0.0);
    let n = q.len() / 3;
    let mesh = CollisionMesh::from_positions(q, triangles, &[], 1e-3).unwrap();
    let masses = vec![2e-5; n];
    let friction = Friction::Anchored(FrictionAnchored::new(0.3));
    vec![
        Box::new(
            SelfContact::new(mesh)
                .with_friction(friction, &masses)
                .unwrap(),
        ),
        Box::new(
            BodyContact::new(
                n,
                vec![std::sync::Arc::new(common::Floor {
                    speed: [0.1, 0.0, 0.0],
                })],
            )
            .with_friction(friction, &masses)
            .unwrap(),
        ),
    ]
}

fn advance(s: &mut dyn ContactSource, from: &[f64], to: &[f64]) -> (f64, ContactResponse) {
    detect(s, from, to, 1e-3);
    let result = evaluate(s, to, from, 1e-3);
    let layout = DofLayout::points(to.len() / 3);
    s.commit(&EvalPoint {
        layout,
        q: to,
        q_start: from,
        dt: 1e-3,
    });
    result
}

/// Energy, forces, curvatures and history of four steps are bit-identical on
/// one, two and four threads.
#[test]
fn threads_do_not_matter() {
    let states = scene(4);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let mut log = Vec::new();
            for mut s in sources(&states[0]) {
                for k in 0..4 {
                    let result = advance(&mut *s, &states[k], &states[k + 1]);
                    assert!(s.active() > 500, "{} contacts of {}", s.active(), s.name());
                    log.push((result, s.history()));
                }
            }
            log
        })
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(4));
}

/// Finds pairs, and says nothing of their distances.
struct Silent(ProximityBackend<HashGrid>);

impl CollisionBackend for Silent {
    fn name(&self) -> &str {
        "silent"
    }
    fn detect(
        &mut self,
        mesh: &CollisionMesh,
        q_start: &[f64],
        q_end: &[f64],
        reach: f64,
        out: &mut Candidates,
    ) -> Result<(), CollisionError> {
        self.0.detect(mesh, q_start, q_end, reach, out)?;
        out.least.clear();
        Ok(())
    }
}

/// A back-end that bounds no distance gives the same bits, and so does an
/// iterate that is looked at alone, without those before it.
#[test]
fn bounds_do_not_matter() {
    let states = scene(4);
    let make = || {
        let (mut unused, mut triangles) = (Vec::new(), Vec::new());
        add_sheet(&mut unused, &mut triangles, 40, 30, 0.01, 0.0);
        add_sheet(&mut unused, &mut triangles, 38, 32, 0.01, 0.0);
        let mesh = CollisionMesh::from_positions(&states[0], triangles, &[], 1e-3).unwrap();
        let friction = Friction::Anchored(FrictionAnchored::new(0.3));
        let masses = vec![2e-5; states[0].len() / 3];
        SelfContact::new(mesh)
            .with_friction(friction, &masses)
            .unwrap()
    };
    let mut bounded = make();
    let mut silent = make().with_backend(Box::new(Silent(ProximityBackend::new(HashGrid::new()))));
    for k in 0..4 {
        let (from, to) = (&states[k], &states[k + 1]);
        detect(&mut bounded, from, to, 1e-3);
        detect(&mut silent, from, to, 1e-3);
        for share in [0.0, 0.3, 1.2, 8.0] {
            let q: Vec<f64> = from
                .iter()
                .zip(to)
                .map(|(a, b)| a + share * (b - a))
                .collect();
            let a = evaluate(&mut bounded, &q, from, 1e-3);
            assert_eq!(a, evaluate(&mut silent, &q, from, 1e-3));
            let mut alone = make();
            alone.restore_history(&bounded.history()).unwrap();
            detect(&mut alone, from, to, 1e-3);
            assert_eq!(a, evaluate(&mut alone, &q, from, 1e-3));
        }
        for s in [&mut bounded, &mut silent] {
            let layout = DofLayout::points(to.len() / 3);
            s.commit(&EvalPoint {
                layout,
                q: to,
                q_start: from,
                dt: 1e-3,
            });
        }
        assert_eq!(bounded.history(), silent.history());
    }
}

/// Triangles on a bed of needles: the same bits on any number of threads.
#[test]
fn faces_and_threads() {
    let (mut q, mut triangles) = (Vec::new(), Vec::new());
    add_sheet(&mut q, &mut triangles, 30, 20, 0.01, 0.0);
    let mut random = Random(9);
    let mut needles: Vec<Box<dyn Body>> = Vec::new();
    for _ in 0..40 {
        let [x, y] = [0.15 + 0.15 * random.next(), 0.1 + 0.1 * random.next()];
        let tip = [x, y, -1.5e-3];
        needles.push(Box::new(
            RoundCone::new([x, y, -0.1], tip, [1e-3; 2]).unwrap(),
        ));
    }
    let bed: Arc<dyn Body> = Arc::new(Union::new(needles).unwrap());
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let friction = Friction::Anchored(FrictionAnchored::new(0.3));
            let mut s = BodyFaces::new(q.len() / 3, triangles.clone(), vec![bed.clone()])
                .unwrap()
                .with_still(&[true])
                .unwrap()
                .with_friction(friction, &vec![2e-5; q.len() / 3])
                .unwrap();
            let moved: Vec<f64> = q.iter().map(|x| x + 2e-4).collect();
            let first = advance(&mut s, &q, &moved);
            let second = advance(&mut s, &moved, &q);
            assert!(s.active() > 20, "{} contacts", s.active());
            (first, second, s.history())
        })
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(4));
}

/// A source restored from its history goes on bit for bit, although its tree
/// has another past; a history that does not fit is refused.
#[test]
fn restart_goes_on_bit_for_bit() {
    let states = scene(4);
    for (mut s, mut restored) in sources(&states[0]).into_iter().zip(sources(&states[0])) {
        for k in 0..3 {
            advance(&mut *s, &states[k], &states[k + 1]);
        }
        let history = s.history();
        assert!(history.len() > 1000);
        restored.restore_history(&history).unwrap();
        assert_eq!(restored.history(), history);
        let a = advance(&mut *s, &states[3], &states[4]);
        let b = advance(&mut *restored, &states[3], &states[4]);
        assert_eq!(a, b);
        assert_eq!(s.history(), restored.history());

        let e = s
            .restore_history(&history[..history.len() - 1])
            .unwrap_err();
        assert!(matches!(e, CollisionError::History { .. }), "{e}");
        let mut wrong = history.clone();
        wrong[1] = 1e9;
        let e = s.restore_history(&wrong).unwrap_err();
        assert!(matches!(e, CollisionError::History { .. }), "{e}");
    }
}

/// Evaluating changes nothing, and buffers stop growing.
#[test]
fn evaluation_is_pure() {
    let states = scene(2);
    for mut s in sources(&states[0]) {
        advance(&mut *s, &states[0], &states[1]);
        advance(&mut *s, &states[0], &states[1]);
        detect(&mut *s, &states[1], &states[2], 1e-3);
        let history = s.history();
        let first = evaluate(&mut *s, &states[2], &states[1], 1e-3);
        evaluate(&mut *s, &states[1], &states[1], 1e-3);
        let bytes = s.heap_bytes();
        for _ in 0..3 {
            assert_eq!(first, evaluate(&mut *s, &states[2], &states[1], 1e-3));
        }
        assert_eq!(history, s.history());
        assert_eq!(bytes, s.heap_bytes());
    }
}
