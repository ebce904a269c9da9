//! Networks that change: counts, momentum, mass, histories.

use selvedge_energy::{DofLayout, EvalPoint, StencilEnergy};
use selvedge_yarn_model::chart::StitchPattern;
use selvedge_yarn_model::knit::{KnitOptions, knitted};
use selvedge_yarn_model::topology::{Change, LEAST_GAP, TopologyEvent, changes};
use selvedge_yarn_model::{
    Draft, FrictionSettings, NONE, NodeContact, SlidingFriction, StitchWrapping, Woven,
    YarnMaterial, YarnNetwork,
};

fn garter(width: usize, rows: usize) -> YarnNetwork {
    let chart = StitchPattern::built_in("garter")
        .unwrap()
        .chart_of(width, rows);
    knitted(&chart.unwrap(), &KnitOptions::new(YarnMaterial::sweater()))
        .unwrap()
        .network
}

fn weave() -> YarnNetwork {
    let mut cloth = Woven::new([5, 6], [1e-3; 2], YarnMaterial::weaving());
    cloth.fringe = [2e-3, 3e-3];
    cloth.build(&Draft::named("plain").unwrap()).unwrap()
}

/// Everything that has to hold of a network.
fn check(n: &YarnNetwork) {
    assert_eq!(n.offsets.len(), n.nodes() + 1);
    assert_eq!(*n.offsets.last().unwrap() as usize, n.strands.len());
    let mut seen = vec![false; n.strands.len()];
    for y in 0..n.yarns.len() as u32 {
        let all: Vec<u32> = n.along(y).collect();
        assert_eq!(all.len(), n.yarns[y as usize].strands as usize);
        assert!(all.len() >= 2);
        assert_eq!(all[all.len() - 1], n.yarns[y as usize].last);
        for (k, &s) in all.iter().enumerate() {
            let strand = n.strands[s as usize];
            assert!(!std::mem::replace(&mut seen[s as usize], true));
            assert_eq!(strand.yarn, y);
            assert!(n.strands_of(strand.node).contains(&s));
            assert_eq!(strand.prev, if k == 0 { NONE } else { all[k - 1] });
            assert!(k == 0 || n.strands[all[k - 1] as usize].arc < strand.arc);
        }
    }
    assert!(seen.iter().all(|s| *s));
    for (node, contact) in n.contacts.iter().enumerate() {
        let count = n.strands_of(node as u32).len();
        match contact {
            NodeContact::Rod => {
                assert_eq!(count, 1, "node {node}");
                assert!(n.strands[n.offsets[node] as usize].held);
            }
            NodeContact::Crossing(c) => {
                let c = n.crossings[*c as usize];
                assert_eq!((c.node as usize, count), (node, 2));
                let mut both = [c.warp, c.weft];
                both.sort_unstable();
                assert_eq!(both.to_vec(), n.strands_of(node as u32).collect::<Vec<_>>());
            }
            NodeContact::StitchA(c) => {
                let c = n.stitches[*c as usize];
                assert_eq!((c.a as usize, count), (node, usize::from(c.parents) + 1));
            }
            NodeContact::StitchB(c) => {
                let c = n.stitches[*c as usize];
                assert_eq!((c.b as usize, count), (node, usize::from(c.parents) + 1));
            }
        }
    }
}

/// A state that moves and slides, without two numbers alike.
fn moving(n: &YarnNetwork) -> (Vec<f64>, Vec<f64>) {
    let wave = |k: usize| (1.0 + 12.9898 * k as f64).sin();
    let mut q: Vec<f64> = n.points.as_flattened().to_vec();
    for (k, x) in q.iter_mut().enumerate() {
        *x += 1e-4 * wave(k);
    }
    q.extend(n.arcs());
    let mut v: Vec<f64> = (0..q.len()).map(|k| 0.3 * wave(3 * k + 1)).collect();
    for (s, strand) in n.strands.iter().enumerate() {
        if strand.held {
            v[3 * n.nodes() + s] = 0.0;
        }
    }
    (q, v)
}

/// Mass [kg] and momentum [kg·m/s] of the consistent mass matrix.
fn inertia(n: &YarnNetwork, q: &[f64], v: &[f64]) -> (f64, [f64; 3]) {
    let points = n.nodes();
    let (mut mass, mut momentum) = (0.0, [0.0; 3]);
    for [a, b] in n.segments() {
        let ends = [a, b].map(|s| 3 * n.strands[s as usize].node as usize);
        let [u0, u1] = [a, b].map(|s| q[3 * points + s as usize]);
        let m = n.material_of(a).line_density() * (u1 - u0);
        mass += m;
        for i in 0..3 {
            let w = (q[ends[1] + i] - q[ends[0] + i]) / (u1 - u0);
            let slip = v[3 * points + a as usize] + v[3 * points + b as usize];
            momentum[i] += 0.5 * m * (v[ends[0] + i] + v[ends[1] + i] - w * slip);
        }
    }
    (mass, momentum)
}

fn happen(
    n: &YarnNetwork,
    q: &[f64],
    v: &[f64],
    events: &[TopologyEvent],
) -> (YarnNetwork, Vec<f64>, Vec<f64>) {
    let change = Change::new(n, events).unwrap();
    check(&change.network);
    let (x, r) = change.carry(n, q, v, |_| false);
    let (m0, p0) = inertia(n, q, v);
    let (m1, p1) = inertia(&change.network, &x, &r);
    assert!((m1 / m0 - 1.0).abs() < 1e-13, "{m0} {m1}");
    let size = p0.iter().fold(0.0, |s: f64, p| s.max(p.abs()));
    for i in 0..3 {
        assert!(
            (p1[i] - p0[i]).abs() < 1e-12 * size,
            "{events:?}: {p0:?} {p1:?}"
        );
    }
    (change.network, x, r)
}

/// Mass and momentum are the same before and after every kind of event, in
/// a state in which everything moves and slides.
#[test]
fn momentum_and_mass() {
    for n in [weave(), garter(4, 4).with_tails(2e-3)] {
        check(&n);
        let (q, v) = moving(&n);
        let mut kinds = [0; 2];
        for strand in (0..n.strands.len() as u32).step_by(3) {
            let s = n.strands[strand as usize];
            if s.next != NONE {
                happen(&n, &q, &v, &[TopologyEvent::Cut { strand }]);
            }
            if n.contacts[s.node as usize] != NodeContact::Rod {
                let (n, q, v) = happen(&n, &q, &v, &[TopologyEvent::Release { strand }]);
                kinds[0] += 1;
                // The nodes that came of it, as if they had come close.
                let mut rods = n.segments().map(|[_, s]| s).filter(|&s| {
                    let strand = n.strands[s as usize];
                    n.contacts[strand.node as usize] == NodeContact::Rod && strand.next != NONE
                });
                if let Some(strand) = rods.next() {
                    happen(&n, &q, &v, &[TopologyEvent::Remove { strand }]);
                    kinds[1] += 1;
                }
            }
        }
        assert!(kinds.iter().all(|k| *k > 4), "{kinds:?}");
    }
}

/// Nothing happens to cloth at rest, and impossible events are refused.
#[test]
fn rest_and_refusals() {
    for n in [weave(), garter(5, 4).with_tails(2e-3)] {
        assert_eq!(changes(&n, &n.arcs(), |_| false), []);
        let first = n.yarns[0].first;
        for event in [
            TopologyEvent::Remove { strand: first },
            TopologyEvent::Cut {
                strand: n.yarns[0].last,
            },
            TopologyEvent::Cut { strand: u32::MAX },
        ] {
            assert!(Change::new(&n, &[event]).is_err(), "{event:?}");
        }
    }
}

/// Slides every end-side contact of a yarn to its last end, one at a time, as a
/// pull at its first end does, and counts the events.
fn pull(mut n: YarnNetwork, yarn: u32, tips: usize) -> YarnNetwork {
    let (mut q, mut v) = moving(&n);
    for _ in 0..10_000 {
        let last = n.yarns[yarn as usize].last;
        let beside = n.strands[last as usize].prev;
        if n.yarns[yarn as usize].strands as usize <= tips {
            return n;
        }
        let points = 3 * n.nodes();
        let end = q[points + last as usize];
        let least = LEAST_GAP * n.material_of(last).radius;
        q[points + beside as usize] = end - 0.9 * least;
        let events = changes(&n, &q[points..], |_| false);
        assert!(!events.is_empty());
        (n, q, v) = happen(&n, &q, &v, &events);
    }
    panic!("the yarn does not come out");
}

/// Pull-out: a row cut free at both ends and drawn out leaves the rows beside
/// it unconnected, and takes four nodes of two yarns for each of its stitches
/// and four for each stitch of the row above [Cirio2017].
#[test]
fn a_row_pulled_out() {
    let (width, rows) = (5, 5);
    let n = garter(width, rows);
    let row = 2;
    // The child strands at the bases of the row, in the order of its yarn.
    let child = |n: &YarnNetwork, r: u32| -> Vec<u32> {
        let c = n.stitches.iter().filter(|c| c.row == r);
        c.map(|c| n.child_at_a(c)).collect()
    };
    let arc = |s: &u32| n.strands[*s as usize].arc;
    let mut own = child(&n, row);
    own.sort_by(|a, b| arc(a).total_cmp(&arc(b)));
    let (first, last) = (own[0], own[own.len() - 1]);
    let before = n.strands[first as usize].prev;
    let (q, v) = moving(&n);
    // The later cut first: it leaves the numbers before it alone.
    let cuts = [last, before].map(|strand| TopologyEvent::Cut { strand });
    let (free, _, _) = happen(&n, &q, &v, &cuts);
    assert_eq!(free.yarns.len(), n.yarns.len() + 2);
    let doubles = |n: &YarnNetwork| {
        n.contacts
            .iter()
            .filter(|c| **c != NodeContact::Rod)
            .count()
    };
    assert_eq!(doubles(&free), doubles(&n));
    let strand = child(&free, row)[0];
    let yarn = free.strands[strand as usize].yarn;
    let out = pull(free, yarn, 2);
    assert_eq!(doubles(&out), doubles(&n) - 4 * width - 4 * width);
    for c in &out.stitches {
        assert!(c.row != row && c.row != row + 1);
    }
    // Yarns that can be reached from one below the row through contacts.
    let mut reached = vec![false; out.yarns.len()];
    let start = child(&out, 0)[0];
    reached[out.strands[start as usize].yarn as usize] = true;
    for _ in 0..out.yarns.len() {
        for node in 0..out.nodes() as u32 {
            let yarns = || {
                out.strands_of(node)
                    .map(|s| out.strands[s as usize].yarn as usize)
            };
            if yarns().any(|y| reached[y]) {
                yarns().for_each(|y| reached[y] = true);
            }
        }
    }
    let above = child(&out, row + 2)[0];
    assert!(!reached[out.strands[above as usize].yarn as usize]);
    assert!(!reached[yarn as usize]);
}

/// A weft drawn out of a weave leaves a node of a single yarn at every warp.
#[test]
fn a_weft_leaves() {
    let n = weave();
    let weft = n.yarns.len() as u32 - 1;
    assert!(
        n.crossings
            .iter()
            .any(|c| n.strands[c.weft as usize].yarn == weft)
    );
    let out = pull(n.clone(), weft, 2);
    assert_eq!(out.crossings.len(), n.crossings.len() - 5);
    assert_eq!(out.nodes(), n.nodes());
    let lone = out
        .contacts
        .iter()
        .filter(|c| **c == NodeContact::Rod)
        .count();
    assert_eq!(lone, 2 * (5 + 6) + 5);
}

/// A loop of the last row that nothing holds comes out of its parents when its
/// yarn is drawn through, and takes both of its contacts with it.
#[test]
fn a_loop_drawn_out() {
    let chart = StitchPattern::built_in("garter")
        .unwrap()
        .chart_of(3, 2)
        .unwrap();
    let options = KnitOptions::new(YarnMaterial::sweater());
    let live = |l: &selvedge_yarn_model::knit::KnitLoop, _: [f64; 2]| l.row < 3;
    let n = selvedge_yarn_model::knit::knitted_part(&chart, &options, live)
        .unwrap()
        .network;
    let n = n.with_tails(2e-3);
    check(&n);
    let (mut q, v) = moving(&n);
    // The loop of the last row at the yarn's end.
    let last = n.stitches.iter().filter(|c| c.row == 1).max_by(|a, b| {
        let arc = |c| n.strands[n.child_at_b(c) as usize].arc;
        arc(a).total_cmp(&arc(b))
    });
    let b = n.child_at_b(last.unwrap());
    let contacts = n.stitches.len();
    let least = LEAST_GAP * n.material_of(b).radius;
    let (mut n, mut v) = (n, v);
    let mut drawn = false;
    for _ in 0..5 {
        // Whatever is before the contact nearest to the end slides up to it.
        let s = n.strands.iter().enumerate().filter(|(_, s)| {
            matches!(n.contacts[s.node as usize], NodeContact::StitchB(_)) && !s.held
        });
        let Some((s, _)) = s.max_by(|a, b| a.1.arc.total_cmp(&b.1.arc)) else {
            break;
        };
        let points = 3 * n.nodes();
        let prev = n.strands[s].prev as usize;
        q[points + s] = q[points + prev] + 0.9 * least;
        let events = changes(&n, &q[points..], |_| false);
        assert_eq!(events.len(), 1, "{events:?}");
        drawn |= matches!(events[0], TopologyEvent::Draw { .. });
        (n, q, v) = happen(&n, &q, &v, &events);
        if drawn {
            break;
        }
    }
    assert!(drawn);
    assert_eq!(n.stitches.len(), contacts - 2);
}

/// Anchors and normals of contacts that stay are kept through a change, to the
/// last bit.
#[test]
fn friction_remembers() {
    let n = weave();
    let settings = FrictionSettings::default();
    let mut friction = SlidingFriction::new(&n, settings).unwrap();
    let (q, v) = moving(&n);
    let at = EvalPoint {
        layout: DofLayout {
            points: n.nodes(),
            scalars: n.strands.len(),
        },
        q: &q,
        q_start: &q,
        dt: 1e-3,
    };
    friction.begin_step(&at);
    friction.commit(&at);
    let mut history = friction.history().to_vec();
    for (k, h) in history.iter_mut().enumerate() {
        *h += 1e-3 * (k as f64).cos();
    }
    let strand = n.crossings[7].weft;
    let change = Change::new(&n, &[TopologyEvent::Release { strand }]).unwrap();
    let _ = change.carry(&n, &q, &v, |_| false);
    let kept = change.friction_history(&n, settings, &history);
    let now = SlidingFriction::new(&change.network, settings).unwrap();
    assert_eq!(kept.len(), now.history().len());
    assert_eq!(kept.len(), history.len() - 5);
    // One stencil and one normal are gone, the rest is in the same order.
    let gone = friction
        .stencils()
        .iter()
        .position(|s| s.contains(&strand))
        .unwrap();
    let stencils = 2 * friction.stencils().len();
    let expected: Vec<f64> = (0..history.len())
        .filter(|k| match k.checked_sub(stencils) {
            None => k / 2 != gone,
            Some(k) => k / 3 != gone,
        })
        .map(|k| history[k])
        .collect();
    assert_eq!(kept, expected);
}

/// Angles of stitch contacts that stay are kept through a change.
#[test]
fn wrapping_remembers() {
    let n = garter(4, 4).with_tails(2e-3);
    let elements = StitchWrapping::elements(&n);
    let history: Vec<f64> = (0..elements.len()).map(|k| k as f64).collect();
    let strand = n.child_at_a(&n.stitches[5]);
    let change = Change::new(&n, &[TopologyEvent::Release { strand }]).unwrap();
    let new = StitchWrapping::new(&change.network);
    let kept = change.wrapping_history(&n, &history, &new);
    let now = StitchWrapping::elements(&change.network);
    assert_eq!(kept.len(), now.len());
    assert_eq!(now.len() + 2, elements.len());
    for (angle, e) in kept.iter().zip(&now) {
        let was = change.stitch_from[e.contact as usize];
        let was = elements
            .iter()
            .position(|o| (o.contact, o.pair) == (was, e.pair));
        assert_eq!(Some(*angle as usize), was);
    }
}
