use std::collections::HashMap;

use super::{StrandPaths, Tubes, strand_centres};
use crate::chart::StitchPattern;
use crate::knit::{KnitOptions, knitted};
use crate::{Draft, NodeContact, Woven, YarnMaterial, YarnNetwork};

fn knit() -> YarnNetwork {
    let pattern = StitchPattern::built_in("stockinette").unwrap();
    let material = YarnMaterial::pullover();
    let course = 5.2 * material.radius;
    let options = KnitOptions::with_gauge(material, course, 0.75 * course, 1.0);
    knitted(&pattern.chart_of(6, 5).unwrap(), &options)
        .unwrap()
        .network
}

fn weave() -> YarnNetwork {
    let woven = Woven::new([6, 5], [2e-3; 2], YarnMaterial::weaving());
    woven.build(&Draft::named("plain").unwrap()).unwrap()
}

fn length(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

/// Every corner is a radius away from the curve, which goes through every
/// centre.
#[test]
fn radius_is_kept() {
    for network in [knit(), weave()] {
        let paths = StrandPaths::of(&network);
        let centres = strand_centres(&paths, &network.points);
        let tubes = Tubes {
            sides: 5,
            samples: 3,
            stride: 1,
        };
        let points = tubes.points(&paths, &centres);
        let mut at = 0;
        for yarn in 0..paths.yarn_count() {
            let visits = paths.visits(yarn);
            for (k, v) in visits.clone().enumerate() {
                let ring = &points[at + 15 * k..at + 15 * k + 5];
                for p in ring {
                    let off = length(*p, centres[v]) / paths.radii()[yarn];
                    assert!((off - 1.0).abs() < 1e-12, "{off}");
                }
            }
            at += 15 * (visits.len() - 1) + 5;
        }
        assert_eq!(at, points.len());
    }
}

/// Tubes are closed: every edge is in two triangles, once in each direction,
/// and they enclose the volume of their prisms.
#[test]
fn closed_and_outward() {
    for (sides, samples, stride) in [(3, 1, 1), (4, 2, 1), (8, 3, 2), (3, 1, 7)] {
        let tubes = Tubes {
            sides,
            samples,
            stride,
        };
        let paths = StrandPaths::of(&knit());
        let mesh = tubes.mesh(&paths);
        assert_eq!(mesh.triangles.len(), tubes.triangle_count(&paths));
        let mut edges: HashMap<[u32; 2], i32> = HashMap::new();
        for t in &mesh.triangles {
            for k in 0..3 {
                *edges.entry([t[k], t[(k + 1) % 3]]).or_default() += 1;
            }
        }
        for ([a, b], n) in &edges {
            assert_eq!((*n, edges.get(&[*b, *a])), (1, Some(&1)));
        }
        let centres = strand_centres(&paths, &knit().points);
        assert_eq!(tubes.points(&paths, &centres).len(), mesh.points);
    }
    // A straight tube: area of the polygon times the length.
    let (n, r, l) = (6.0_f64, 1e-3, 0.5);
    let paths =
        StrandPaths::new(3, vec![0, 3], vec![0, 1, 2], vec![0; 3], vec![r], vec![]).unwrap();
    let points = [[0.0; 3], [0.3 * l, 0.0, 0.0], [l, 0.0, 0.0]];
    let tubes = Tubes {
        sides: 6,
        samples: 4,
        stride: 1,
    };
    let x = tubes.points(&paths, &strand_centres(&paths, &points));
    let volume: f64 = tubes
        .mesh(&paths)
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|p| nalgebra::Vector3::from(x[p as usize]));
            a.dot(&b.cross(&c)) / 6.0
        })
        .sum();
    let exact = 0.5 * n * r * r * (std::f64::consts::TAU / n).sin() * l;
    assert!((volume / exact - 1.0).abs() < 1e-9, "{volume} {exact}");
}

/// Yarns in front are in front, two radii apart, also after the cloth turned
/// over, and the whole yarn is nearer at B than at A where it comes forward.
#[test]
fn front_yarn_is_in_front() {
    for network in [knit(), weave()] {
        let paths = StrandPaths::of(&network);
        let turned = |p: &[f64; 3]| [p[0], -p[1], -p[2]];
        let (mut points, mut front) = (network.points.clone(), network.front.clone());
        for side in 0..2 {
            let centres = strand_centres(&paths, &points);
            let mut checked = 0;
            for node in 0..network.nodes() as u32 {
                if network.contacts[node as usize] == NodeContact::Rod {
                    continue;
                }
                for pair in paths.stack(node).windows(2) {
                    let (a, b) = (centres[pair[0] as usize], centres[pair[1] as usize]);
                    let radius = network.materials[0].radius;
                    assert!((length(a, b) / (2.0 * radius) - 1.0).abs() < 1e-9);
                    let nearer: f64 = (0..3)
                        .map(|i| (a[i] - b[i]) * front[node as usize][i])
                        .sum();
                    // The plane of a stitch contact leans, but not beyond.
                    assert!(nearer > 0.0, "side {side}, node {node}: {nearer}");
                    checked += 1;
                }
            }
            assert!(checked > 20);
            points.iter_mut().for_each(|p| *p = turned(p));
            front.iter_mut().for_each(|p| *p = turned(p));
        }
    }
}

/// All nodes in one place, and yarns that fold back, give finite tubes of the
/// right radius.
#[test]
fn coinciding_points() {
    let network = knit();
    let paths = StrandPaths::of(&network);
    let tubes = Tubes {
        sides: 4,
        samples: 2,
        stride: 1,
    };
    let mut points = vec![[0.1, 0.2, 0.3]; network.nodes()];
    for step in 0..3 {
        let centres = strand_centres(&paths, &points);
        let x = tubes.points(&paths, &centres);
        assert!(x.iter().flatten().all(|c| c.is_finite()));
        let radius = network.materials[0].radius;
        let width = length(x[0], x[2]);
        assert!((width / (2.0 * radius) - 1.0).abs() < 1e-9, "{width}");
        if step == 0 {
            // On a line, forth and back.
            for (k, p) in points.iter_mut().enumerate() {
                p[0] = 1e-3 * (k % 2) as f64;
            }
        } else {
            points.clone_from(&network.points);
            for k in (0..points.len() - 1).step_by(3) {
                points[k + 1] = points[k];
            }
        }
    }
}

/// Fewer triangles are asked for, fewer are given, down to two rings a yarn.
#[test]
fn detail_follows_the_budget() {
    let paths = StrandPaths::of(&knit());
    let mut before = usize::MAX;
    for budget in [10_000_000, 20_000, 10_000, 5_000, 2_000, 1_000, 500, 200] {
        let tubes = Tubes::within(budget, &paths);
        let count = tubes.triangle_count(&paths);
        assert!(count <= budget && count <= before, "{budget}: {tubes:?}");
        before = count;
    }
    let least = Tubes::within(0, &paths).triangle_count(&paths);
    assert_eq!(least, paths.yarn_count() * 8);
}

/// What is stored gives the same tubes; what does not fit together is refused.
#[test]
fn from_parts() {
    let network = knit();
    let paths = StrandPaths::of(&network);
    let parts = |nodes: Vec<u32>, sides: Vec<i8>| {
        StrandPaths::new(
            network.nodes(),
            paths.offsets().to_vec(),
            nodes,
            paths.layers().to_vec(),
            paths.radii().to_vec(),
            sides,
        )
    };
    let same = parts(paths.nodes().to_vec(), paths.sides().to_vec()).unwrap();
    assert_eq!(same, paths);
    assert!(parts(paths.nodes().to_vec(), Vec::new()).is_err());
    let mut nodes = paths.nodes().to_vec();
    nodes[3] = u32::MAX;
    assert!(parts(nodes, paths.sides().to_vec()).is_err());
}

/// Around a plane curve every corner keeps its height above the plane: the
/// frame does not twist.
#[test]
fn frame_does_not_twist() {
    let count = 40;
    let points: Vec<[f64; 3]> = (0..count)
        .map(|k| {
            let a = 0.3 * k as f64;
            [0.05 * a.cos(), (0.05 + 1e-3 * a) * a.sin(), 0.0]
        })
        .collect();
    let nodes = (0..count as u32).collect();
    let layers = vec![0; count];
    let offsets = vec![0, count as u32];
    let paths = StrandPaths::new(count, offsets, nodes, layers, vec![1e-3], vec![]).unwrap();
    let tubes = Tubes {
        sides: 5,
        samples: 4,
        stride: 1,
    };
    let x = tubes.points(&paths, &strand_centres(&paths, &points));
    for ring in x.chunks(5) {
        for k in 0..5 {
            assert!((ring[k][2] - x[k][2]).abs() < 1e-12);
        }
    }
}
