use super::layout::Layout;
use super::template::{HEAD, LEG, SINKER, distance};
use super::{KnitLoop, KnitOptions, LoopGraph};
use crate::chart::{Chart, Op};
use crate::{NONE, NetworkBuilder, StitchContact, Visit, YarnError, YarnNetwork};

/// Shortest arc between two nodes, in yarn radii.
const LEAST_ARC: f64 = 0.25;
/// Width of the contacts of such a child at node A, in those of a single one.
const NARROW: f64 = 0.75;
/// Distance of a yarn's end from the loop's outermost node, in courses: half a
/// sinker.
const BESIDE: f64 = 0.18;

/// A knitted cloth and where its loops are.
#[derive(Clone, Debug, PartialEq)]
pub struct Knitted {
    /// The yarns: that of the cast-on, one through all rows (more where loops
    /// are left out), that of the bind-off.
    pub network: YarnNetwork,
    /// The loops.
    pub map: StitchMap,
}

/// Loops of the chart's rows, row by row, left to right.
#[derive(Clone, Debug, PartialEq)]
pub struct StitchMap {
    /// The loops that were knitted.
    pub loops: Vec<StitchLoop>,
}

/// A loop of a knitted cloth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StitchLoop {
    /// Row of the chart, from 0.
    pub row: u32,
    /// Place in the row, from the left.
    pub column: u32,
    /// Operation that made it.
    pub op: Op,
    /// Centre in the panel's plane \[m\].
    pub centre: [f64; 2],
    /// Strands at the eight nodes of [`LoopTemplate`](super::LoopTemplate), or [`NONE`]: base-left
    /// A, B, head-left A', B', head-right B', A', base-right B, A. The head of
    /// a loop with several children reaches from the first to the last.
    pub strands: [u32; 8],
}

/// Knits a chart as a rectangle.
///
/// Node A of every contact lies in front for the parents of a knit stitch,
/// node B for its child; stacks of several parents follow
/// [`Stack`](crate::chart::Stack). Row 0 of the chart lies at height 0, its
/// loop `j` at `j` courses, unless increases and decreases move them
/// ([`relaxed_centres`]).
///
/// # Errors
/// [`YarnError`] for material or template values outside their range.
pub fn knitted(chart: &Chart, options: &KnitOptions) -> Result<Knitted, YarnError> {
    knitted_part(chart, options, |_, _| true)
}

/// Knits the loops of a chart for which `keep` holds, given the loop and its
/// centre \[m\]. A kept loop without its parents or children ends in nodes of a
/// single yarn; such cut edges are not secured.
///
/// # Errors
/// [`YarnError`] for material or template values outside their range.
pub fn knitted_part(
    chart: &Chart,
    options: &KnitOptions,
    keep: impl Fn(&KnitLoop, [f64; 2]) -> bool,
) -> Result<Knitted, YarnError> {
    let graph = LoopGraph::new(chart);
    let layout = laid_out(&graph, options)?;
    let kept = kept(&graph, &layout, keep);
    Knitter::new(&graph, layout, kept, false).knit()
}

/// As [`knitted_part`], for a part that its border cuts out: stitches that
/// hold no other and are held by none are left out, and both ends of every yarn
/// get a node half a stitch beside their last loop. `None` if nothing is left.
pub(crate) fn knitted_within(
    chart: &Chart,
    options: &KnitOptions,
    keep: impl Fn(&KnitLoop, [f64; 2]) -> bool,
) -> Result<Option<Knitted>, YarnError> {
    let graph = LoopGraph::new(chart);
    let layout = laid_out(&graph, options)?;
    let within = kept(&graph, &layout, keep);
    let any = |mut of: std::ops::Range<u32>| of.any(|k| within[k as usize]);
    let held = |l: &KnitLoop| any(l.parent_range()) || any(l.child_range());
    let kept: Vec<bool> = (graph.loops.iter().zip(&within))
        .map(|(l, within)| *within && held(l))
        .collect();
    if !kept.contains(&true) {
        return Ok(None);
    }
    Knitter::new(&graph, layout, kept, true).knit().map(Some)
}

fn laid_out<'a>(graph: &'a LoopGraph, options: &'a KnitOptions) -> Result<Layout<'a>, YarnError> {
    options.validate()?;
    Ok(Layout::new(graph, options))
}

fn kept(
    graph: &LoopGraph,
    layout: &Layout<'_>,
    keep: impl Fn(&KnitLoop, [f64; 2]) -> bool,
) -> Vec<bool> {
    let loops = graph.loops.iter().zip(&layout.centres);
    loops.map(|(l, centre)| keep(l, *centre)).collect()
}

/// Node numbers at the base of a loop.
#[derive(Clone, Copy)]
enum Foot {
    /// A yarn-over, or a loop left out.
    None,
    /// Drawn through others: first of its two contacts.
    Drawn(u32),
    /// Held by nothing: left and right node of a single yarn.
    Free(u32, u32),
}

/// A visit with what its neighbours need to know.
#[derive(Clone, Copy)]
struct Pass {
    node: u32,
    layer: u8,
    contact: u32,
    owner: u32,
    head: bool,
    right: bool,
    /// Place among the nodes of the template, or [`EXTRA`].
    place: usize,
}

const EXTRA: usize = 8;

struct Knitter<'a> {
    graph: &'a LoopGraph,
    layout: Layout<'a>,
    kept: Vec<bool>,
    least: f64,
    builder: NetworkBuilder,
    points: Vec<[f64; 3]>,
    contacts: Vec<StitchContact>,
    feet: Vec<Foot>,
    /// Whether yarns end beside their loops.
    ends: bool,
}

impl<'a> Knitter<'a> {
    fn new(graph: &'a LoopGraph, layout: Layout<'a>, kept: Vec<bool>, ends: bool) -> Self {
        let material = &layout.options.material;
        Self {
            least: LEAST_ARC * material.radius,
            builder: NetworkBuilder::new(vec![material.clone()]),
            points: Vec::new(),
            contacts: Vec::new(),
            feet: Vec::with_capacity(graph.loops.len()),
            graph,
            layout,
            kept,
            ends,
        }
    }

    fn knit(mut self) -> Result<Knitted, YarnError> {
        for l in 0..self.graph.loops.len() as u32 {
            let foot = self.foot(l);
            self.feet.push(foot);
        }
        for contact in &self.contacts {
            self.builder.stitch(*contact);
        }
        let graph = self.graph;
        // Yarn and visit of every node of every loop.
        let mut visits = vec![[NONE; 8]; graph.loops.len()];
        let mut yarn_of = vec![NONE; graph.loops.len()];
        for thread in graph.threads(|l| self.kept[l as usize]) {
            let mut passes = self.passes(&thread.loops);
            if self.ends {
                self.add_ends(&mut passes, &thread.loops);
            }
            let yarn = self.thread(&passes, thread.auxiliary);
            for (k, pass) in passes.iter().enumerate() {
                if pass.place != EXTRA {
                    visits[pass.owner as usize][pass.place] = k as u32;
                    yarn_of[pass.owner as usize] = yarn;
                }
            }
        }
        let network = self.builder.build()?;
        let along: Vec<Vec<u32>> = (0..network.yarns.len() as u32)
            .map(|y| network.along(y).collect())
            .collect();
        let mut map = StitchMap { loops: Vec::new() };
        for (l, this) in graph.loops.iter().enumerate() {
            if graph.is_auxiliary(this.row as usize) || !self.kept[l] {
                continue;
            }
            let strand = |visit: u32| match visit {
                NONE => NONE,
                visit => along[yarn_of[l] as usize][visit as usize],
            };
            map.loops.push(StitchLoop {
                row: this.row - 1,
                column: this.column,
                op: this.op,
                centre: self.layout.centres[l],
                strands: visits[l].map(strand),
            });
        }
        Ok(Knitted { network, map })
    }

    /// Makes the nodes at the base of a loop.
    fn foot(&mut self, l: u32) -> Foot {
        let this = self.graph.loops[l as usize];
        let yarn_over = this.row > 0 && this.parents == 0;
        if !self.kept[l as usize] || yarn_over {
            return Foot::None;
        }
        let parents = this.parent_range().filter(|p| self.kept[*p as usize]);
        let parents = parents.count() as u8;
        if parents == 0 {
            return Foot::Free(
                self.place(l, 0, self.layout.centres[l as usize], 1.0),
                self.place(l, 7, self.layout.centres[l as usize], 1.0),
            );
        }
        let (centre, narrow) = self.layout.contact_centre(l);
        let shared = self.graph.loops[this.first_parent as usize].children > 1;
        let first = self.contacts.len() as u32;
        for (side, a, b, segment) in [(-1, 0, 1, 0), (1, 7, 6, 6)] {
            let wide = narrow * if shared { NARROW } else { 1.0 };
            let contact = StitchContact {
                a: self.place(l, a, centre, wide),
                b: self.place(l, b, centre, narrow),
                purl: this.op.purl(),
                side,
                parents,
                rest: match self.layout.options.cells {
                    Some(_) => self.layout.options.template.arcs[segment],
                    None => self.layout.template(l).arcs[segment],
                },
                row: this.row - 1,
                column: this.column,
            };
            self.contacts.push(contact);
        }
        Foot::Drawn(first)
    }

    /// A node at a place of the template, about a centre.
    fn place(&mut self, l: u32, place: usize, centre: [f64; 2], narrow: f64) -> u32 {
        let point = self.layout.point(l, place, centre, narrow);
        self.node(point)
    }

    fn node(&mut self, point: [f64; 3]) -> u32 {
        self.points.push(point);
        let flat = [point[0], point[1]];
        self.builder.node(point, flat, [0.0, 0.0, 1.0])
    }

    /// Visits of a piece of yarn.
    fn passes(&mut self, loops: &[(u32, bool)]) -> Vec<Pass> {
        let mut passes: Vec<Pass> = Vec::with_capacity(8 * loops.len());
        for &(l, right) in loops {
            let mut own = self.loop_passes(l);
            if !right {
                own.reverse();
            }
            // A yarn-over at the edge: the yarn would go from the loop's head
            // to the base of the loop above it, which is the same node.
            if let (Some(last), Some(first)) = (passes.last(), own.first())
                && last.node == first.node
            {
                let mut point = self.points[last.node as usize];
                let aside = 0.32 * self.layout.template(l).course;
                point[0] += if right { -aside } else { aside };
                passes.push(Pass {
                    node: self.node(point),
                    layer: 0,
                    contact: NONE,
                    owner: NONE,
                    head: false,
                    right: false,
                    place: EXTRA,
                });
            }
            passes.extend(own);
        }
        passes
    }

    /// Adds a node beside the first and the last loop of a piece of yarn.
    fn add_ends(&mut self, passes: &mut Vec<Pass>, loops: &[(u32, bool)]) {
        let mut beside = |pass: &Pass, l: u32, right: bool| {
            let mut point = self.points[pass.node as usize];
            let aside = BESIDE * self.layout.template(l).course;
            point[0] += if right { aside } else { -aside };
            Pass {
                node: self.node(point),
                layer: 0,
                contact: NONE,
                owner: NONE,
                head: false,
                right: false,
                place: EXTRA,
            }
        };
        let ends = (passes.first().copied(), passes.last().copied());
        if let ((Some(first), Some(last)), [(l, right), ..], [.., (k, on)]) = (ends, loops, loops) {
            let (before, after) = (beside(&first, *l, !right), beside(&last, *k, *on));
            passes.insert(0, before);
            passes.push(after);
        }
    }

    /// Visits of a loop from left to right.
    fn loop_passes(&mut self, l: u32) -> Vec<Pass> {
        let this = self.graph.loops[l as usize];
        let mut passes = Vec::with_capacity(8);
        let pass = |node, layer, contact, head, place: usize| Pass {
            node,
            layer,
            contact,
            owner: l,
            head,
            right: place > 3,
            place,
        };
        let foot = self.feet[l as usize];
        match foot {
            Foot::None => {}
            Foot::Free(left, _) => passes.push(pass(left, 0, NONE, false, 0)),
            Foot::Drawn(c) => {
                let k = &self.contacts[c as usize];
                let (at_a, at_b) = if k.purl {
                    (0, k.parents)
                } else {
                    (k.parents, 0)
                };
                passes.push(pass(k.a, at_a, c, false, 0));
                passes.push(pass(k.b, at_b, c, false, 1));
            }
        }
        let children: Vec<u32> = this
            .child_range()
            .filter(|c| matches!(self.feet[*c as usize], Foot::Drawn(_)))
            .collect();
        for (k, child) in children.iter().enumerate() {
            let Foot::Drawn(c) = self.feet[*child as usize] else {
                continue;
            };
            let (left, right) = (&self.contacts[c as usize], &self.contacts[c as usize + 1]);
            let depth = self.depth(*child, l);
            let (at_a, at_b) = (depth + u8::from(left.purl), depth + u8::from(!left.purl));
            let (first, last) = (k == 0, k + 1 == children.len());
            let or = |is: bool, place| if is { place } else { EXTRA };
            passes.push(pass(left.a, at_a, c, true, or(first, 2)));
            passes.push(pass(left.b, at_b, c, true, or(first, 3)));
            passes.push(pass(right.b, at_b, c + 1, true, or(last, 4)));
            passes.push(pass(right.a, at_a, c + 1, true, or(last, 5)));
        }
        if children.is_empty() {
            let centre = self.layout.centres[l as usize];
            for place in [2, 5] {
                let node = self.place(l, place, centre, 1.0);
                passes.push(pass(node, 0, NONE, true, place));
            }
        }
        match foot {
            Foot::None => {}
            Foot::Free(_, right) => passes.push(pass(right, 0, NONE, false, 7)),
            Foot::Drawn(c) => {
                let k = &self.contacts[c as usize + 1];
                let (at_a, at_b) = if k.purl {
                    (0, k.parents)
                } else {
                    (k.parents, 0)
                };
                passes.push(pass(k.b, at_b, c + 1, false, 6));
                passes.push(pass(k.a, at_a, c + 1, false, 7));
            }
        }
        passes
    }

    /// Place of a parent among the kept parents of a child, front to back.
    fn depth(&self, child: u32, parent: u32) -> u8 {
        let child = self.graph.loops[child as usize];
        let Op::Together { stack, .. } = child.op else {
            return 0;
        };
        let right_most = child.first_parent + u32::from(child.parents) - 1;
        let parents = stack.order().iter().map(|o| right_most - u32::from(*o));
        let before = parents.take_while(|p| *p != parent);
        before.filter(|p| self.kept[*p as usize]).count() as u8
    }

    /// Adds a yarn with its arc lengths.
    fn thread(&mut self, passes: &[Pass], held: bool) -> u32 {
        let mut arc = 0.0;
        let mut visits = Vec::with_capacity(passes.len());
        for (k, pass) in passes.iter().enumerate() {
            if k > 0 {
                arc += self.arc(&passes[k - 1], pass);
            }
            visits.push(Visit {
                node: pass.node,
                layer: pass.layer,
                arc,
                held,
            });
        }
        self.builder.yarn(0, visits)
    }

    /// Rest length of the yarn between two visits: that of the contact within
    /// one, else the distance with the template's excess \[m\].
    fn arc(&self, a: &Pass, b: &Pass) -> f64 {
        let same_loop = a.owner == b.owner;
        if same_loop && a.contact == b.contact && a.contact != NONE {
            let rest = self.contacts[a.contact as usize].rest;
            let place = match (a.head, a.right) {
                (false, false) => 0,
                (true, false) => HEAD - 1,
                (true, true) => HEAD + 1,
                (false, true) => LEG + 5,
            };
            return match self.layout.options.cells {
                Some(_) if a.place != EXTRA => self.layout.template(a.owner).arcs[place],
                _ => rest,
            };
        }
        let segment = match (same_loop, a.head == b.head) {
            (true, false) if a.right => LEG + 4,
            (true, false) => LEG,
            (true, true) => HEAD,
            _ => SINKER,
        };
        let straight = distance(self.points[a.node as usize], self.points[b.node as usize]);
        // A node beside the edge belongs to no loop.
        let owner = if a.owner == NONE { b.owner } else { a.owner };
        let excess = match segment {
            SINKER if a.owner != NONE && b.owner != NONE => {
                let [left, right] = if a.right { [a, b] } else { [b, a] };
                self.sinker(left.owner, right.owner)
            }
            _ => self.layout.template(owner).excess(segment),
        };
        (excess * straight).max(self.least)
    }

    /// Arc length over distance between two loops side by side, whose shapes
    /// may differ. Where the yarn turns into the next row it lies straight.
    fn sinker(&self, left: u32, right: u32) -> f64 {
        let row = |l: u32| self.graph.loops[l as usize].row;
        if self.layout.options.cells.is_some() && row(left) != row(right) {
            return 1.0;
        }
        let end = |l: u32, node: usize| {
            let template = self.layout.template(l);
            let mut x = template.nodes[node];
            if self.graph.loops[l as usize].op.purl() {
                x[2] = -x[2];
            }
            x
        };
        let (from, mut to) = (end(left, 7), end(right, 0));
        let template = self.layout.template(left);
        to[0] += template.course;
        template.arcs[SINKER] / distance(from, to)
    }
}
