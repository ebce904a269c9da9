//! Yarns on panels, and their seams.

use std::collections::BTreeSet;
use std::f64::consts::TAU;

use selvedge_yarn_model::chart::StitchPattern;
use selvedge_yarn_model::knit::KnitOptions;
use selvedge_yarn_model::panel::{
    Outline, PanelSet, PanelSurface, PanelWeave, SewingOptions, Sewn, knitted_panel, woven_panel,
};
use selvedge_yarn_model::{Draft, NONE, NodeContact, YarnMaterial, YarnNetwork};

/// A triangle mesh with flat corners.
struct Mesh {
    positions: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    flat: Vec<[[f64; 2]; 3]>,
}

const RADIUS: f64 = 0.1;
const HEIGHT: f64 = 0.2;

/// A tube of two half cylinders about the y axis with right sides out, each
/// `n` by `m` quads; the second one's flat coordinates lie elsewhere and are
/// `wide` times as wide.
fn tube(n: usize, m: usize, wide: f64) -> Mesh {
    let mut mesh = Mesh {
        positions: Vec::new(),
        triangles: Vec::new(),
        flat: Vec::new(),
    };
    for half in 0..2 {
        let first = mesh.positions.len() as u32;
        let width = 0.5 * TAU * RADIUS * if half == 1 { wide } else { 1.0 };
        let flat = |i: usize, j: usize| {
            let x = width * i as f64 / n as f64 + 3.0 * half as f64;
            [x, HEIGHT * j as f64 / m as f64]
        };
        for j in 0..=m {
            for i in 0..=n {
                let angle = 0.5 * TAU * (half as f64 + i as f64 / n as f64);
                let y = HEIGHT * j as f64 / m as f64;
                let p = [RADIUS * angle.cos(), y, -RADIUS * angle.sin()];
                mesh.positions.push(p);
            }
        }
        let at = |i: usize, j: usize| first + (j * (n + 1) + i) as u32;
        for j in 0..m {
            for i in 0..n {
                for c in [[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]] {
                    mesh.triangles.push(c.map(|(a, b)| at(i + a, j + b)));
                    mesh.flat.push(c.map(|(a, b)| flat(i + a, j + b)));
                }
            }
        }
    }
    mesh
}

fn panels(mesh: &Mesh) -> PanelSet {
    PanelSet::new(&mesh.positions, &mesh.triangles, &mesh.flat, 1e-6).expect("panels")
}

fn stockinette() -> StitchPattern {
    StitchPattern::built_in("stockinette").expect("a chart")
}

fn options() -> KnitOptions {
    KnitOptions::new(YarnMaterial::pullover())
}

fn sewing(pitch: f64, reach: f64) -> SewingOptions {
    SewingOptions {
        material: YarnMaterial::pullover(),
        pitch,
        slack: 1.0,
        reach,
    }
}

fn knitted_tube(wide: f64) -> (PanelSet, Vec<YarnNetwork>, Sewn) {
    let set = panels(&tube(24, 8, wide));
    let options = options();
    let flat: Vec<YarnNetwork> = (set.panels.iter())
        .map(|p| {
            let outline = p.outline().expect("an outline");
            let knitted = knitted_panel(&stockinette(), &options, &outline);
            knitted.expect("knits").expect("stitches").network
        })
        .collect();
    let course = options.template.course;
    let sewn = set.sew(&flat, &sewing(0.5 * course, 1.5 * course));
    (set, flat, sewn.expect("sewn"))
}

/// What every network must be; `build` has checked the rest.
fn check(network: &YarnNetwork) {
    for [a, b] in network.segments() {
        let [a, b] = [a, b].map(|s| network.strands[s as usize]);
        assert!(b.arc > a.arc, "{a:?} {b:?}");
        assert_ne!(a.node, b.node, "a segment needs two nodes");
        let [x, y] = [a, b].map(|s| network.points[s.node as usize]);
        assert!((0..3).any(|k| x[k] != y[k]), "a segment needs a length");
    }
    for (k, front) in network.front.iter().enumerate() {
        let length = front.iter().map(|x| x * x).sum::<f64>().sqrt();
        assert!((length - 1.0).abs() < 1e-12, "front of node {k}: {front:?}");
        if network.contacts[k] == NodeContact::Rod {
            let strands = network.strands_of(k as u32);
            let held = |s: u32| network.strands[s as usize].held;
            assert!(strands.into_iter().all(held), "node {k}");
        }
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// A rectangle of a whole number of stitches holds just these.
#[test]
fn a_rectangle_holds_its_stitches() {
    let options = options();
    let (c, r) = (options.template.course, options.template.row);
    let at = [0.3, -0.2];
    let corner = |x: f64, y: f64| [at[0] + x * c, at[1] + y * r];
    let corners = [
        corner(0.0, 0.0),
        corner(12.0, 0.0),
        corner(12.0, 9.0),
        corner(0.0, 9.0),
    ];
    let outline = Outline::polygon(&corners).expect("an outline");
    let knitted = knitted_panel(&stockinette(), &options, &outline)
        .expect("knits")
        .expect("stitches");
    assert_eq!(knitted.map.loops.len(), 12 * 9);
    assert_eq!(knitted.network.yarns.len(), 9);
    for p in &knitted.network.flat {
        let margin = 0.11 * r;
        assert!(p[0] >= at[0] - 1e-12 && p[0] <= at[0] + 12.0 * c + 1e-12);
        assert!(p[1] >= at[1] - margin && p[1] <= at[1] + 9.0 * r + margin);
    }
    check(&knitted.network);
    // Too small for a stitch.
    let small = Outline::polygon(&[[0.0, 0.0], [c, 0.0], [0.0, r]]).expect("an outline");
    assert!(
        knitted_panel(&stockinette(), &options, &small)
            .expect("knits")
            .is_none()
    );
}

/// Stitches of a round panel: its area over that of a stitch, less the strip
/// within which no whole stitch fits.
#[test]
fn a_disc_holds_its_area_in_stitches() {
    let options = options();
    let (c, r) = (options.template.course, options.template.row);
    let radius = 40.0 * c;
    let points: Vec<[f64; 2]> = (0..400)
        .map(|k| {
            let angle = TAU * f64::from(k) / 400.0;
            [radius * angle.cos(), radius * angle.sin()]
        })
        .collect();
    let outline = Outline::polygon(&points).expect("an outline");
    let knitted = knitted_panel(&stockinette(), &options, &outline)
        .expect("knits")
        .expect("stitches");
    let count = knitted.map.loops.len() as f64;
    let all = outline.area() / (c * r);
    // A cell's support in direction θ is (c |cos θ| + r |sin θ|)/2; its mean
    // over the circle is (c + r)/π.
    let inner = radius - (c + r) / std::f64::consts::PI;
    let expected = std::f64::consts::PI * inner * inner / (c * r);
    assert!(
        count < all && (count / expected - 1.0).abs() < 0.02,
        "{count} of {all}, {expected}"
    );
    check(&knitted.network);
}

/// A U: its notch cuts wefts in two, and the warps above it end at it.
#[test]
fn a_re_entrant_outline_cuts_yarns_in_two() {
    let outline = Outline::polygon(&[
        [0.0, 0.0],
        [0.03, 0.0],
        [0.03, 0.02],
        [0.02, 0.02],
        [0.02, 0.01],
        [0.01, 0.01],
        [0.01, 0.02],
        [0.0, 0.02],
    ])
    .expect("an outline");
    let weave = PanelWeave {
        spacing: [1e-3; 2],
        crimp: [1.0, 1.02],
        materials: vec![YarnMaterial::weaving()],
        warp_materials: vec![0],
        weft_materials: vec![0],
    };
    let draft = Draft::named("plain").expect("a draft");
    let network = woven_panel(&draft, &weave, &outline)
        .expect("weaves")
        .expect("crossings");
    assert_eq!(network.crossings.len(), 500);
    // 30 warps; 10 wefts below the notch and twice 10 beside it.
    assert_eq!(network.yarns.len(), 30 + 10 + 20);
    let lengths: Vec<f64> = (0..60u32)
        .map(|y| {
            let yarn = network.yarns[y as usize];
            network.strands[yarn.last as usize].arc - network.strands[yarn.first as usize].arc
        })
        .collect();
    assert!((lengths[0] - 0.02).abs() < 1e-12 && (lengths[15] - 0.01).abs() < 1e-12);
    assert!((lengths[30] - 1.02 * 0.03).abs() < 1e-12);
    assert!((lengths[59] - 1.02 * 0.01).abs() < 1e-12);
    for p in &network.flat {
        assert!((0.0..=0.03).contains(&p[0]) && (0.0..=0.02).contains(&p[1]));
    }
    check(&network);
}

/// The tube has two panels, two seams between them, and four free edges.
#[test]
fn a_tube_has_two_seams() {
    let set = panels(&tube(24, 8, 1.0));
    assert_eq!(set.panels.len(), 2);
    assert_eq!(set.points.len(), 48 * 9);
    let seams = set.seams();
    let of = |n: usize| seams.iter().filter(move |s| s.sides.len() == n);
    assert_eq!((of(1).count(), of(2).count()), (4, 2));
    for seam in of(2) {
        assert!((seam.length() - HEIGHT).abs() < 1e-12);
        let panels: Vec<u32> = seam.sides.iter().map(|s| s.panel).collect();
        assert_eq!(panels, [0, 1]);
    }
    for seam in of(1) {
        assert!((seam.length() - 0.5 * TAU * RADIUS).abs() < 1e-12);
    }
    let area: f64 = (set.panels.iter())
        .map(|p| p.outline().expect("an outline").area())
        .sum();
    assert!((area - TAU * RADIUS * HEIGHT).abs() < 1e-12);
}

/// Panels whose flat coordinates agree along a seam are one panel, here one
/// with a single seam.
#[test]
fn continuous_flat_coordinates_are_one_panel() {
    let mut mesh = tube(24, 8, 1.0);
    let half = mesh.flat.len() / 2;
    let width = 0.5 * TAU * RADIUS;
    for p in mesh.flat[half..].iter_mut().flatten() {
        let column = ((p[0] - 3.0) / width * 24.0).round();
        p[0] = width + width * column / 24.0;
    }
    let set = panels(&mesh);
    assert_eq!(set.panels.len(), 1);
    let seams = set.seams();
    let sides: Vec<usize> = seams.iter().map(|s| s.sides.len()).collect();
    // The seam of the panel with itself, its upper and its lower edge.
    assert_eq!(sides.iter().filter(|n| **n == 2).count(), 1);
    assert_eq!(sides.iter().filter(|n| **n == 1).count(), 2);
}

/// Places go through the triangles: a flat length is one on the tube, fronts
/// point outwards, and beyond the border the last triangle goes on.
#[test]
fn places_lie_on_the_surface() {
    let set = panels(&tube(96, 8, 1.0));
    let surface = PanelSurface::new(&set, 0);
    let sagitta = RADIUS * (1.0 - (0.25 * TAU / 96.0).cos());
    for k in 0..50 {
        let t = (f64::from(k) + 0.3) / 50.0;
        let (p, n) = surface.place([0.5 * TAU * RADIUS * t, HEIGHT * t]);
        let out = p[0].hypot(p[2]);
        assert!(
            out <= RADIUS + 1e-12 && out >= RADIUS - 1.01 * sagitta,
            "{out}"
        );
        assert!((p[1] - HEIGHT * t).abs() < 1e-12);
        let cosine = (p[0] * n[0] + p[2] * n[2]) / out;
        assert!(cosine > 0.9998, "{cosine}");
    }
    let (p, _) = surface.place([0.1, HEIGHT + 0.01]);
    assert!((p[1] - HEIGHT - 0.01).abs() < 1e-12);
}

/// Knitted halves: all ends find the rods, panels share the rod of a seam, and
/// nothing is pulled far.
#[test]
fn a_knitted_tube_is_closed() {
    let (set, flat, sewn) = knitted_tube(1.0);
    let n = &sewn.network;
    check(n);
    let options = options();
    let (c, r) = (options.template.course, options.template.row);
    assert_eq!(sewn.loose, 0);
    // Whole stitches of each panel.
    let (across, up) = ((0.5 * TAU * RADIUS / c).floor(), (HEIGHT / r).floor());
    let stitches = flat.iter().map(|f| f.stitches.len()).sum::<usize>();
    assert_eq!(n.stitches.len(), stitches);
    // Two contacts a stitch but for the first row.
    assert_eq!(stitches as f64, 2.0 * 2.0 * across * (up - 1.0));
    // Every row of each panel is a yarn; four free edges and two seams.
    assert_eq!(n.yarns.len(), 2 * up as usize + 6);
    assert_eq!(sewn.rods.len(), 6);
    let seams: Vec<_> = sewn.rods.iter().filter(|r| r.panels.len() == 2).collect();
    assert_eq!(seams.len(), 2);
    for rod in &seams {
        // The ends of the rows on this side; those of the first and the last
        // may be nearer to the free edge.
        let joined = &rod.joined;
        assert!(
            joined.iter().all(|k| f64::from(*k) >= up - 2.0),
            "{joined:?}"
        );
        let nodes: Vec<u32> = n
            .along(rod.yarn)
            .map(|s| n.strands[s as usize].node)
            .collect();
        let height = |k: u32| n.points[k as usize][1];
        let spacing = height(nodes[1]) - height(nodes[0]);
        assert!((spacing.abs() / (0.5 * c) - 1.0).abs() < 0.05, "{spacing}");
        // Nodes of the rod lie on the line where the panels meet.
        let p = n.points[nodes[0] as usize];
        assert!((p[0].abs() - RADIUS).abs() < 1e-12 && p[2].abs() < 1e-12);
        // Rows of both panels go through it.
        let yarns = nodes.iter().flat_map(|k| n.strands_of(*k));
        let yarns: BTreeSet<u32> = yarns.map(|s| n.strands[s as usize].yarn).collect();
        assert!(yarns.len() as f64 >= 2.0 * (up - 2.0), "{}", yarns.len());
    }
    let mut worst = 0.0f64;
    for [a, b] in n.segments() {
        let [a, b] = [a, b].map(|s| n.strands[s as usize]);
        let apart = distance(n.points[a.node as usize], n.points[b.node as usize]);
        worst = worst.max(apart / (b.arc - a.arc));
    }
    // Chords of the tube, and sides of a rod that differ.
    assert!(worst < 1.02, "stretched by {worst}");
    let bounds = [[-RADIUS, 0.0, -RADIUS], [RADIUS, HEIGHT, RADIUS]];
    for p in &n.points {
        for k in 0..3 {
            assert!(
                p[k] >= bounds[0][k] - 1e-12 && p[k] <= bounds[1][k] + 1e-12,
                "{p:?}"
            );
        }
    }
    assert_eq!(set.panels.len(), 2);
}

/// Sides of unlike length meet in equal fractions of the seam.
#[test]
fn unlike_sides_are_matched_by_fraction() {
    let (set, _, sewn) = knitted_tube(1.2);
    check(&sewn.network);
    let mean = 0.5 * TAU * RADIUS;
    let seams = set.seams();
    let free = seams.iter().filter(|s| s.sides.len() == 1);
    let mut lengths: Vec<f64> = free.map(|s| s.length() / mean).collect();
    lengths.sort_by(f64::total_cmp);
    assert!((lengths[0] - 1.0).abs() < 1e-12 && (lengths[3] - 1.2).abs() < 1e-12);
    // The second half above the first: the seam runs around.
    let mut mesh = tube(24, 8, 1.2);
    let half = mesh.positions.len() / 2;
    for k in half..2 * half {
        let [x, y, z] = mesh.positions[k - half];
        mesh.positions[k] = [x, y + HEIGHT, z];
    }
    let set = panels(&mesh);
    let seams = set.seams();
    let seam = seams.iter().find(|s| s.sides.len() == 2).expect("a seam");
    assert!((seam.length() / mean - 1.1).abs() < 1e-12);
    let at = seam.at(0.25 * seam.length());
    let x: Vec<f64> = (0..2).map(|s| seam.flat(&set, s, at)[0]).collect();
    let (a, b) = (x[0] / mean, (x[1] - 3.0) / (1.2 * mean));
    let from = if a > 0.5 { 0.75 } else { 0.25 };
    assert!((a - from).abs() < 1e-12 && (b - from).abs() < 1e-12);
}

/// A woven tube: ends of the wefts meet at the seams.
#[test]
fn a_woven_tube_is_closed() {
    let set = panels(&tube(24, 8, 1.0));
    let spacing = 2e-3;
    let weave = PanelWeave {
        spacing: [spacing; 2],
        crimp: [1.0; 2],
        materials: vec![YarnMaterial::weaving()],
        warp_materials: vec![0],
        weft_materials: vec![0],
    };
    let draft = Draft::named("twill-2-2").expect("a draft");
    let flat: Vec<YarnNetwork> = (set.panels.iter())
        .map(|p| {
            let outline = p.outline().expect("an outline");
            let woven = woven_panel(&draft, &weave, &outline);
            woven.expect("weaves").expect("crossings")
        })
        .collect();
    let options = SewingOptions {
        material: YarnMaterial::weaving(),
        pitch: spacing,
        slack: 1.0,
        reach: spacing,
    };
    let sewn = set.sew(&flat, &options).expect("sewn");
    let n = &sewn.network;
    check(n);
    assert_eq!(sewn.loose, 0);
    let (warps, wefts) = (157, 100);
    assert_eq!(n.crossings.len(), 2 * warps * wefts);
    assert_eq!(n.yarns.len(), 2 * (warps + wefts) + 6);
    for rod in &sewn.rods {
        let ends = if rod.panels.len() == 2 { wefts } else { warps };
        assert!(rod.joined.iter().all(|k| *k as usize == ends), "{rod:?}");
    }
    // Both wefts of a height end in the same node.
    let ends: BTreeSet<u32> = (n.yarns.iter())
        .flat_map(|y| [y.first, y.last])
        .map(|s| n.strands[s as usize].node)
        .collect();
    assert!(ends.len() < 2 * (warps + wefts) * 2);
    let again = set.sew(&flat, &options).expect("sewn");
    assert_eq!(sewn, again);
}

/// Turns of yarns beyond an angle.
fn turns_beyond(n: &YarnNetwork, degrees: f64) -> usize {
    let inner = n
        .strands
        .iter()
        .filter(|s| s.prev != NONE && s.next != NONE);
    let turned = inner.filter(|s| {
        let at = |s: u32| n.points[n.strands[s as usize].node as usize];
        let (a, b, c) = (at(s.prev), n.points[s.node as usize], at(s.next));
        let dot: f64 = (0..3).map(|k| (b[k] - a[k]) * (c[k] - b[k])).sum();
        dot < degrees.to_radians().cos() * distance(a, b) * distance(b, c)
    });
    turned.count()
}

fn stretch_energy(n: &YarnNetwork) -> f64 {
    let of = |[a, b]: [u32; 2]| {
        let k = n.material_of(a).stretch_stiffness();
        let [a, b] = [a, b].map(|s| n.strands[s as usize]);
        let (rest, [x, y]) = (b.arc - a.arc, [a, b].map(|s| n.points[s.node as usize]));
        0.5 * k * rest * (distance(x, y) / rest - 1.0).powi(2)
    };
    n.segments().map(of).sum()
}

/// A panel with slanted sides, pulled by 5 % across: settling leaves no yarn
/// stretched and none folded back, moves nodes by less than a stitch, keeps what
/// is joined joined, and repeats to the bit.
#[test]
fn slanted_and_stretched_panels_settle() {
    let corners = [[0.0, 0.0], [0.3, 0.0], [0.22, 0.2], [0.08, 0.2]];
    let mesh = Mesh {
        positions: corners.map(|[x, y]| [1.05 * x, y, 0.0]).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        flat: [[0, 1, 2], [0, 2, 3]]
            .map(|t| t.map(|k: usize| corners[k]))
            .to_vec(),
    };
    let set = panels(&mesh);
    let options = options();
    let outline = set.panels[0].outline().expect("an outline");
    let knitted = knitted_panel(&stockinette(), &options, &outline);
    let flat = [knitted.expect("knits").expect("stitches").network];
    let course = options.template.course;
    let sewn = set.sew(&flat, &sewing(0.5 * course, 1.5 * course));
    let mut sewn = sewn.expect("sewn");
    assert!(stretch_energy(&sewn.network) > 0.1);
    let mut again = sewn.clone();
    let before = sewn.network.clone();
    let settled = sewn.settle(300, 1.0);
    check(&sewn.network);
    assert_eq!(turns_beyond(&sewn.network, 108.0), settled.sharp);
    assert_eq!(turns_beyond(&sewn.network, 170.0), 0, "{settled:?}");
    let energy = stretch_energy(&sewn.network);
    assert!(energy < 1e-2, "{energy} J {settled:?}");
    assert!(settled.moved < course, "{settled:?}");
    assert_eq!(before.offsets, sewn.network.offsets);
    assert_eq!(again.settle(300, 1.0), settled);
    assert_eq!(again, sewn);
}
