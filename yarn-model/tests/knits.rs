//! Knitted networks: counts, continuous yarns, roles and stacks at contacts,
//! symmetry, and where loops come to lie.

use std::collections::BTreeMap;

use selvedge_yarn_model::chart::{BUILT_IN_CHARTS, Chart, Op, StitchPattern};
use selvedge_yarn_model::knit::{
    KnitOptions, Knitted, LoopGraph, LoopTemplate, StitchLoop, TemplateCells, knitted,
    knitted_part, relaxed_centres,
};
use selvedge_yarn_model::{NONE, NodeContact, YarnError, YarnNetwork};
use serde_json::Value;

fn built_in(name: &str, across: usize, upwards: usize) -> Chart {
    let pattern = StitchPattern::built_in(name).unwrap();
    pattern.chart(across, upwards).unwrap()
}

fn knit(chart: &Chart) -> Knitted {
    knitted(chart, &KnitOptions::default()).unwrap()
}

fn parse(text: &str, across: usize) -> Chart {
    let pattern = StitchPattern::parse(text).unwrap();
    pattern.chart(across, 1).unwrap()
}

/// Nodes, unknowns, stacks and segments of the golden charts. Contacts of the
/// chart's own loops are counted; beside them there are the contacts of the
/// bind-off, four nodes a loop of the last row, and nodes of a single yarn, two
/// a loop of the cast-on and of the bind-off.
#[test]
fn golden_counts() {
    let text = include_str!("oracles/knit.json");
    let oracle: Value = serde_json::from_str(text).unwrap();
    for (name, across, upwards) in [
        ("stockinette", 20, 5),
        ("garter", 20, 5),
        ("rib_2x2", 5, 5),
        ("feather_and_fan", 2, 3),
        ("openwork_diamonds", 4, 2),
        ("flame_chevron", 4, 1),
    ] {
        let chart = built_in(name, across, upwards);
        let network = knit(&chart).network;
        let golden = &oracle["charts"][name];
        let rows = chart.rows().len() as u32;
        let (own, edge): (Vec<_>, Vec<_>) = network.stitches.iter().partition(|s| s.row < rows);
        let width = chart.cast_on();
        assert_eq!(own.len() as u64, golden["stitch_contacts"], "{name}");
        assert_eq!(2 * own.len() as u64, golden["contact_nodes"], "{name}");
        assert_eq!(edge.len(), 2 * width, "{name}");
        let rods = network.contacts.iter().filter(|c| **c == NodeContact::Rod);
        assert_eq!(rods.count(), 4 * width, "{name}");
        assert_eq!(network.nodes(), 2 * own.len() + 2 * edge.len() + 4 * width);
        let yarns = |s: &&&selvedge_yarn_model::StitchContact| u64::from(s.parents) + 1;
        let dofs: u64 = own.iter().map(|s| 2 * (3 + yarns(&s))).sum();
        assert_eq!(dofs, golden["dofs"], "{name}");
        let segments: u64 = own.iter().map(|s| yarns(&s)).sum();
        assert_eq!(segments, golden["in_contact_segments"], "{name}");
        let mut stacks = BTreeMap::new();
        for s in &own {
            *stacks.entry(yarns(&s).to_string()).or_insert(0u64) += 1;
        }
        let stacks = serde_json::to_value(stacks).unwrap();
        assert_eq!(stacks, golden["contacts_by_yarn_count"], "{name}");
    }
}

/// Contact nodes, the bind-off's included, of panels with as many loops as the
/// garments of [Cirio2017] against the nodes published: within 4 %.
#[test]
fn published_counts() {
    // Two pieces of the pullover, four of the sweater.
    for (pieces, width, rows, published) in [(2, 62, 70, 34_416.0), (4, 100, 140, 224_353.0)] {
        let chart = StitchPattern::built_in("stockinette").unwrap();
        let network = knit(&chart.chart_of(width, rows).unwrap()).network;
        let contacts = network.contacts.iter().filter(|c| **c != NodeContact::Rod);
        let nodes = (pieces * contacts.count()) as f64;
        assert!(
            (nodes / published - 1.0).abs() < 0.04,
            "{nodes} of {published}"
        );
    }
}

fn charts() -> Vec<Chart> {
    let mut charts: Vec<Chart> = BUILT_IN_CHARTS.iter().map(|n| built_in(n, 2, 2)).collect();
    charts.push(parse(
        "multiple: 7\nrow 1: *k3 kyok k3*\nrow 2: *p3 p3tog p3*\n",
        2,
    ));
    charts.push(parse(
        "multiple: 9\nrow 1: *k5tog kinc5 k yo k2tog*\nrow 2: *p*\n",
        2,
    ));
    charts.push(parse(
        "multiple: 4\nrow 1: *ssk yo yo k2tog*\nrow 2: *p*\n",
        3,
    ));
    charts.push(parse(
        "multiple: 0\nplus: 1\nrow 1: k\nrow 2: p\nrow 3: k\n",
        0,
    ));
    charts.push(parse(
        "multiple: 0\nplus: 4\nrow 1: yo k2tog k2tog yo\nrow 2: yo p2tog p2tog yo\n",
        0,
    ));
    charts.push(parse(
        "multiple: 0\nplus: 4\nrow 1: k4 yo yo\nrow 2: yo p6\nrow 3: k7 yo\n",
        0,
    ));
    charts
}

/// One yarn through all rows and two auxiliary ones; arc lengths grow, only
/// ends and auxiliary yarns are held, and yarn that joins contacts is as long
/// as the way.
#[test]
fn yarns_are_continuous() {
    let radius = KnitOptions::default().material.radius;
    for chart in charts() {
        let Knitted { network, .. } = knit(&chart);
        assert_eq!(network.yarns.len(), 3, "{}", chart.name());
        let mut seen = vec![false; network.strands.len()];
        for (y, yarn) in network.yarns.iter().enumerate() {
            let along: Vec<u32> = network.along(y as u32).collect();
            assert_eq!(along.len(), yarn.strands as usize);
            assert_eq!((along[0], along[along.len() - 1]), (yarn.first, yarn.last));
            for (k, s) in along.iter().enumerate() {
                assert!(!std::mem::replace(&mut seen[*s as usize], true));
                let strand = &network.strands[*s as usize];
                let end = k == 0 || k + 1 == along.len();
                let rod = network.contacts[strand.node as usize] == NodeContact::Rod;
                assert_eq!(strand.held, end || rod || y != 1, "{}", chart.name());
                if k > 0 {
                    let before = &network.strands[along[k - 1] as usize];
                    assert_ne!(before.node, strand.node);
                    let arc = strand.arc - before.arc;
                    assert!(arc >= 0.25 * radius * (1.0 - 1e-9), "{arc}");
                    let way = distance(&network, before.node, strand.node);
                    assert!(arc >= way * (1.0 - 1e-9) && arc < way + 2.0 * radius);
                }
            }
        }
        assert!(seen.iter().all(|s| *s));
    }
}

fn distance(network: &YarnNetwork, a: u32, b: u32) -> f64 {
    let (a, b) = (network.points[a as usize], network.points[b as usize]);
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// Strands of a loop sit where its roles say: as a child at its own base, as a
/// parent at the base of its children.
#[test]
fn roles() {
    for chart in charts() {
        let Knitted { network, map } = knit(&chart);
        assert_eq!(map.loops.len(), chart.loops());
        for l in &map.loops {
            let stitch = |place: usize| {
                let strand = l.strands[place];
                let node = network.strands[strand as usize].node;
                match network.contacts[node as usize] {
                    NodeContact::StitchA(c) | NodeContact::StitchB(c) => {
                        (strand, &network.stitches[c as usize])
                    }
                    other => panic!("{other:?}"),
                }
            };
            if l.op == Op::YarnOver {
                assert_eq!([0, 1, 6, 7].map(|k| l.strands[k]), [NONE; 4]);
            } else {
                for (a, b, side) in [(0, 1, -1), (7, 6, 1)] {
                    let (strand, contact) = stitch(a);
                    assert_eq!((contact.row, contact.column), (l.row, l.column));
                    assert_eq!(contact.side, side);
                    assert_eq!(contact.purl, l.op.purl());
                    assert_eq!(usize::from(contact.parents), l.op.takes());
                    assert_eq!(strand, network.child_at_a(contact));
                    let (strand, same) = stitch(b);
                    assert_eq!((strand, same), (network.child_at_b(contact), contact));
                }
            }
            for (a, b, side) in [(2, 3, -1), (5, 4, 1)] {
                let (strand, contact) = stitch(a);
                assert_eq!((contact.row, contact.side), (l.row + 1, side));
                assert!(network.parents_at_a(contact).contains(&strand));
                let place = strand - network.parents_at_a(contact).start;
                let (strand, same) = stitch(b);
                assert_eq!(same, contact);
                // The same place in the stack at both nodes.
                assert_eq!(strand - network.parents_at_b(contact).start, place);
            }
        }
    }
}

/// Front to back, every decrease has its parents in its own order.
#[test]
fn stacks() {
    for (name, orders) in [
        ("k2tog", &[1, 0][..]),
        ("ssk", &[0, 1]),
        ("s2kp", &[1, 2, 0]),
        ("sk2p", &[0, 2, 1]),
        ("k3tog", &[2, 1, 0]),
        ("k5tog", &[4, 3, 2, 1, 0]),
        ("p2tog", &[1, 0]),
        ("ssp", &[0, 1]),
        ("p3tog", &[2, 1, 0]),
        ("s2pp", &[2, 0, 1]),
    ] {
        let n = orders.len();
        let text = format!(
            "multiple: 0\nplus: {}\nrow 1: k{0}\nrow 2: p{0}\nrow 3: k {name} k\n",
            n + 2
        );
        let chart = parse(&text, 0);
        let Knitted { network, map } = knit(&chart);
        let row = |r: u32| map.loops.iter().filter(move |l| l.row == r);
        let child = row(2).find(|l| l.column == 1).unwrap();
        let node = network.strands[child.strands[0] as usize].node;
        let NodeContact::StitchA(c) = network.contacts[node as usize] else {
            panic!("{name}");
        };
        let contact = &network.stitches[c as usize];
        // Parents are columns 1 to n of the row below.
        let expected: Vec<u32> = orders.iter().map(|o| n as u32 - o).collect();
        for (strands, place) in [
            (network.parents_at_a(contact), 2),
            (network.parents_at_b(contact), 3),
        ] {
            let found: Vec<u32> = strands
                .map(|s| row(1).find(|l| l.strands[place] == s).unwrap().column)
                .collect();
            assert_eq!(found, expected, "{name}");
        }
        let child_in_front = network.child_at_b(contact) < network.parents_at_b(contact).start;
        assert_eq!(child_in_front, !contact.purl, "{name}");
    }
}

/// Rows are worked back and forth: from one row to the next the yarn goes up
/// at the edge.
#[test]
fn back_and_forth() {
    let chart = built_in("stockinette", 4, 2);
    let Knitted { network, map } = knit(&chart);
    let at = |row: u32, column: u32| -> &StitchLoop {
        let mut loops = map.loops.iter();
        loops.find(|l| l.row == row && l.column == column).unwrap()
    };
    let next = |s: u32| network.strands[s as usize].next;
    // The first row runs to the left and goes up there, the second to the right.
    assert_eq!(next(at(0, 3).strands[0]), at(0, 2).strands[7]);
    assert_eq!(next(at(0, 0).strands[0]), at(1, 0).strands[0]);
    assert_eq!(next(at(1, 0).strands[7]), at(1, 1).strands[0]);
    assert_eq!(next(at(1, 3).strands[7]), at(2, 3).strands[7]);
    assert_eq!(network.yarns[1].first, at(0, 3).strands[7]);
    assert_eq!(network.yarns[1].last, at(3, 3).strands[7]);
}

/// A map from a network to itself under which points and stacks agree.
fn symmetric(network: &YarnNetwork, image: impl Fn([f64; 3]) -> [f64; 3], swap: bool) -> bool {
    let key = |p: [f64; 3]| p.map(|x| (x * 1e7).round() as i64);
    let index: BTreeMap<_, usize> = (0..network.nodes())
        .map(|i| (key(network.points[i]), i))
        .collect();
    network.stitches.iter().all(|c| {
        [c.a, c.b].iter().all(|n| {
            let Some(&m) = index.get(&key(image(network.points[*n as usize]))) else {
                return false;
            };
            let d = match network.contacts[m] {
                NodeContact::StitchA(d) | NodeContact::StitchB(d) => &network.stitches[d as usize],
                _ => return false,
            };
            d.parents == c.parents && (d.purl != c.purl) == swap
        })
    })
}

/// Stockinette, garter and rib agree with their mirror images in a wale;
/// garter turned over and moved by a row and rib turned over and moved by two
/// wales have knit for purl.
#[test]
fn symmetry() {
    let options = KnitOptions::default();
    let (course, row) = (options.template.course, options.template.row);
    for (name, width) in [("stockinette", 1), ("garter", 1), ("rib-2x2", 4)] {
        let chart = built_in(name, 8 / width, 2);
        let network = knit(&chart).network;
        let mirror = |p: [f64; 3]| [7.0 * course - p[0], p[1], p[2]];
        // Mirrored about the middle, the columns p p k k p p k k change place.
        assert!(symmetric(&network, mirror, name == "rib-2x2"), "{name}");
    }
    let network = knit(&built_in("rib-2x2", 2, 2)).network;
    let inner =
        |network: &YarnNetwork, columns: std::ops::Range<u32>, rows: std::ops::Range<u32>| {
            let mut part = network.clone();
            part.stitches
                .retain(|s| columns.contains(&s.column) && rows.contains(&s.row));
            part.contacts = vec![NodeContact::Rod; part.nodes()];
            for (c, s) in network.stitches.iter().enumerate() {
                part.contacts[s.a as usize] = NodeContact::StitchA(c as u32);
                part.contacts[s.b as usize] = NodeContact::StitchB(c as u32);
            }
            (part, network.stitches.clone())
        };
    let moved = |network: &YarnNetwork, columns, rows, by: [f64; 2]| {
        let (mut part, all) = inner(network, columns, rows);
        let chosen = std::mem::replace(&mut part.stitches, all);
        let key = |p: [f64; 3]| p.map(|x| (x * 1e7).round() as i64);
        let index: BTreeMap<_, usize> = (0..part.nodes())
            .map(|i| (key(part.points[i]), i))
            .collect();
        chosen.iter().all(|c| {
            let p = part.points[c.a as usize];
            let m = index[&key([p[0] + by[0], p[1] + by[1], p[2]])];
            let NodeContact::StitchA(d) = part.contacts[m] else {
                return false;
            };
            part.stitches[d as usize].purl != c.purl
        })
    };
    assert!(moved(&network, 0..6, 0..4, [2.0 * course, 0.0]));
    let network = knit(&built_in("garter", 6, 3)).network;
    assert!(moved(&network, 0..6, 0..5, [0.0, row]));
}

/// Every loop of plain knitting is the same as every other.
#[test]
fn loops_repeat() {
    let options = KnitOptions::default();
    let template = &options.template;
    let Knitted { network, map } = knit(&built_in("garter", 5, 3));
    for l in &map.loops {
        for (k, s) in l.strands.iter().enumerate() {
            let point = network.points[network.strands[*s as usize].node as usize];
            let nodes = template.nodes[k];
            let place = [l.centre[0] + nodes[0], l.centre[1] + nodes[1], nodes[2]];
            assert!((0..3).all(|k| (point[k] - place[k]).abs() < 1e-12));
        }
        for k in 0..7 {
            let arc = |k: usize| network.strands[l.strands[k] as usize].arc;
            let length = (arc(k + 1) - arc(k)).abs();
            assert!((length - template.arcs[k]).abs() < 1e-12, "segment {k}");
        }
        let [x, y] = l.centre;
        assert_eq!(x, f64::from(l.column) * template.course);
        assert_eq!(y, f64::from(l.row) * template.row);
    }
}

/// Lace finds its places: rows stay in order, neighbours and parents near
/// their distances.
#[test]
fn relaxed() {
    let (course, row) = (4e-3, 3e-3);
    for chart in charts() {
        let graph = LoopGraph::new(&chart);
        let x = relaxed_centres(&graph, course, row);
        let apart = |a: usize, b: usize| (x[a][0] - x[b][0]).hypot(x[a][1] - x[b][1]);
        let (mut along, mut up) = (Vec::new(), Vec::new());
        for (l, this) in graph.loops.iter().enumerate() {
            if this.column > 0 {
                assert!(x[l][0] > x[l - 1][0], "{}: row {}", chart.name(), this.row);
                along.push(apart(l, l - 1) / course);
            }
            for p in this.parent_range() {
                assert!(
                    x[l][1] > x[p as usize][1],
                    "{}: row {}",
                    chart.name(),
                    this.row
                );
                if this.parents == 1 && graph.loops[p as usize].children == 1 {
                    up.push(apart(l, p as usize) / row);
                }
            }
        }
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len().max(1) as f64;
        if !along.is_empty() {
            assert!(
                (mean(&along) - 1.0).abs() < 0.15,
                "{}: {}",
                chart.name(),
                mean(&along)
            );
        }
        assert!(
            (mean(&up) - 1.0).abs() < 0.25,
            "{}: {}",
            chart.name(),
            mean(&up)
        );
    }
}

/// Cloth cut to an outline: pieces of yarn, every node visited, no loop beyond.
#[test]
fn part_of_a_chart() {
    let chart = built_in("openwork-diamonds", 3, 2);
    let options = KnitOptions::default();
    let middle = [9.0 * options.template.course, 8.0 * options.template.row];
    let reach = 7.0 * options.template.row;
    let inside = |c: [f64; 2]| (c[0] - middle[0]).hypot(c[1] - middle[1]) < reach;
    let Knitted { network, map } = knitted_part(&chart, &options, |_, c| inside(c)).unwrap();
    assert!(map.loops.len() > 50 && map.loops.iter().all(|l| inside(l.centre)));
    assert!(network.yarns.len() > 3);
    let visited: usize = network.yarns.iter().map(|y| y.strands as usize).sum();
    assert_eq!(visited, network.strands.len());
    let nothing = knitted_part(&chart, &options, |_, _| false).unwrap();
    assert_eq!((nothing.network.nodes(), nothing.map.loops.len()), (0, 0));
}

/// Shapes of a repeat's loops go to the loops of the chart, cell by cell.
#[test]
fn cells() {
    let mut options = KnitOptions::default();
    let mut templates = vec![options.template.clone(); 4];
    for (k, t) in templates.iter_mut().enumerate() {
        // Longer legs, deeper contacts, cell by cell.
        t.arcs[1] *= 1.0 + 0.1 * k as f64;
        t.nodes[0][2] = 1e-4 * k as f64;
    }
    let cells = TemplateCells::new(2, templates.clone()).unwrap();
    options.cells = Some(cells);
    let chart = built_in("garter", 5, 2);
    let Knitted { network, map } = knitted(&chart, &options).unwrap();
    for l in &map.loops {
        let cell = 2 * (l.row % 2) + l.column % 2;
        let strand = |k: usize| &network.strands[l.strands[k] as usize];
        let sign = if l.op.purl() { -1.0 } else { 1.0 };
        let z = network.points[strand(0).node as usize][2];
        assert_eq!(z, sign * 1e-4 * f64::from(cell));
        let t = &templates[cell as usize];
        let way = distance(&network, strand(1).node, strand(2).node);
        let leg = (strand(2).arc - strand(1).arc).abs();
        let ratio = t.arcs[1] / t.straight(1);
        assert!((leg / way / ratio - 1.0).abs() < 1e-9, "{leg} of {way}");
    }
    assert!(TemplateCells::new(3, templates).is_err());
    assert!(TemplateCells::new(0, Vec::new()).is_err());
}

/// Lengths that cannot be are refused.
#[test]
fn refused() {
    let chart = built_in("garter", 3, 1);
    let with = |template| KnitOptions {
        template,
        ..KnitOptions::default()
    };
    let options = with(LoopTemplate::flat(4e-3, 0.0, 1.0, 1e-3));
    let error = knitted(&chart, &options).unwrap_err();
    assert!(
        matches!(
            error,
            YarnError::Parameter {
                what: "row pitch",
                ..
            }
        ),
        "{error}"
    );
    let options = with(LoopTemplate::flat(4e-3, 3e-3, f64::NAN, 1e-3));
    assert!(knitted(&chart, &options).is_err());
    let mut options = KnitOptions::default();
    options.material.radius = -1.0;
    assert!(knitted(&chart, &options).is_err());
}

/// Measuring a knit as it was laid, turned and moved in space, gives back the
/// loops that it was laid with, cell by cell.
#[test]
fn measured_loops_are_those_laid() {
    let mut options = KnitOptions::default();
    let mut templates = vec![options.template.clone(); 8];
    for (k, t) in templates.iter_mut().enumerate() {
        let (x, z) = (1e-5 * k as f64, 2e-4 * k as f64);
        // Both contacts of a base to the same side: the mean must stay put.
        for (place, sign) in [(0, 1.0), (1, -1.0), (6, 1.0), (7, -1.0)] {
            t.nodes[place][0] += sign * x;
            t.nodes[place][2] += sign * z;
        }
        t.arcs[1] *= 1.0 + 0.02 * k as f64;
    }
    options.cells = Some(TemplateCells::new(4, templates.clone()).unwrap());
    let chart = built_in("rib-2x2", 7, 7);
    let Knitted { network, map } = knitted(&chart, &options).unwrap();
    let (s, c) = 0.3_f64.sin_cos();
    let points: Vec<[f64; 3]> = (network.points.iter())
        .map(|[x, y, z]| [0.1 + c * x - s * z, *y, 0.2 + s * x + c * z])
        .collect();
    let arcs: Vec<f64> = network.strands.iter().map(|s| s.arc).collect();
    let node = |s: u32| network.strands[s as usize].node;
    let found = options
        .measured(&map, [4, 2], node, &points, &arcs)
        .unwrap();
    let base = &options.template;
    assert!((found.template.course / base.course - 1.0).abs() < 1e-12);
    assert!((found.template.row / base.row - 1.0).abs() < 1e-12);
    let (columns, cells) = found.cells.as_ref().unwrap().templates();
    assert_eq!((columns, cells.len()), (4, 8));
    for (cell, laid) in cells.iter().zip(&templates) {
        for place in [0, 1, 6, 7] {
            for k in 0..3 {
                let off = cell.nodes[place][k] - laid.nodes[place][k];
                assert!(off.abs() < 1e-12, "{place} {k}: {off}");
            }
        }
        for place in [0, 6] {
            assert!((cell.arcs[place] - laid.arcs[place]).abs() < 1e-12);
        }
    }
    // Laid with what was measured, contacts lie where they lay.
    let again = knitted(&chart, &found).unwrap();
    let both = again.network.points.iter().zip(&network.points);
    for ((a, b), _) in both
        .zip(&network.contacts)
        .filter(|(_, c)| **c != NodeContact::Rod)
    {
        assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-9), "{a:?} {b:?}");
    }
    // A sample without interior.
    let small = knitted(&built_in("rib-2x2", 3, 3), &options).unwrap();
    let n = &small.network;
    let node = |s: u32| n.strands[s as usize].node;
    let arcs: Vec<f64> = n.strands.iter().map(|s| s.arc).collect();
    assert!(
        options
            .measured(&small.map, [4, 2], node, &n.points, &arcs)
            .is_err()
    );
}
