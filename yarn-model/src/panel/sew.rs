use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

use super::{PanelError, PanelSet, PanelSurface, Seam};
use crate::vec3::V;
use crate::{
    NONE, NetworkBuilder, NodeContact, StitchContact, Visit, YarnError, YarnMaterial, YarnNetwork,
};

/// Fewest segments of a closed rod.
const CLOSED: usize = 3;
/// Shortest arc of a segment that was drawn to a rod, in yarn radii.
const LEAST_ARC: f64 = 0.25;
/// Least distance of a rod's node from the neighbours of what it takes, in yarn
/// radii.
const NEAREST: f64 = 0.5;
/// Nodes of a rod that a yarn goes out of its way to turn by a radian less.
const TURNED: f64 = 2.0;
/// How many nodes up or down a rod an end may go to.
const ASIDE: i64 = 3;

/// How panels are sewn.
#[derive(Clone, Debug, PartialEq)]
pub struct SewingOptions {
    /// Yarn of the rods.
    pub material: YarnMaterial,
    /// Distance of a rod's nodes \[m\]: half a stitch, or the spacing of a
    /// weave.
    pub pitch: f64,
    /// Rest length of a rod over that of its border \[1\].
    pub slack: f64,
    /// Distance in the plane up to which ends are drawn to a border \[m\].
    pub reach: f64,
}

/// Panels of yarn, sewn.
#[derive(Clone, Debug, PartialEq)]
pub struct Sewn {
    /// All yarns in space: those of the panels in their order, then the rods.
    pub network: YarnNetwork,
    /// The rods.
    pub rods: Vec<SewnRod>,
    /// Ends that no rod took: too far away, or no place left on it.
    pub loose: usize,
}

/// A rod along a border.
#[derive(Clone, Debug, PartialEq)]
pub struct SewnRod {
    /// Its yarn.
    pub yarn: u32,
    /// Panels on its sides; one for a free edge.
    pub panels: Vec<u32>,
    /// Ends of yarns merged into its nodes, for each side.
    pub joined: Vec<u32>,
}

/// A node of a rod to come.
struct Station {
    point: [f64; 3],
    flat: [f64; 2],
    front: [f64; 3],
    /// Strands merged so far, rods not counted.
    layers: u8,
}

/// The stations of a border.
struct Rod<'a> {
    seam: &'a Seam,
    stations: Vec<u32>,
    joined: Vec<u32>,
}

impl PanelSet {
    /// Places flat networks, one for each panel, in space and sews them.
    ///
    /// # Errors
    /// [`PanelError`] when there are not as many networks as panels or values
    /// are outside their range.
    pub fn sew(&self, flat: &[YarnNetwork], options: &SewingOptions) -> Result<Sewn, PanelError> {
        options.validate()?;
        if flat.len() != self.panels.len() {
            return Err(PanelError::NetworkCount {
                networks: flat.len(),
                panels: self.panels.len(),
            });
        }
        let surfaces: Vec<PanelSurface<'_>> = (0..self.panels.len())
            .map(|p| PanelSurface::new(self, p))
            .collect();
        let seams = self.seams();
        let mut stations = Vec::new();
        let mut rods = self.stations(&seams, &surfaces, options, &mut stations);
        let mut all = flat[0].clone();
        for other in &flat[1..] {
            all.append(other);
        }
        let mut drawing = Drawing {
            heights: all.points.iter().map(|p| p[2]).collect(),
            onto: vec![NONE; all.nodes()],
            places: all.flat.clone(),
        };
        let (mut start, mut loose) = (0, 0);
        for (panel, network) in flat.iter().enumerate() {
            let nodes = start..start + network.nodes() as u32;
            for node in nodes.clone() {
                let i = node as usize;
                let (point, front) = surfaces[panel].place(all.flat[i]);
                let above = V::from(point) + drawing.heights[i] * V::from(front);
                (all.points[i], all.front[i]) = (above.into(), front);
            }
            for node in nodes.filter(|n| all.contacts[*n as usize] == NodeContact::Rod) {
                let taken = drawing.draw(self, &mut rods, panel as u32, node, &all, options);
                loose += usize::from(!taken);
            }
            start += network.nodes() as u32;
        }
        // A slit through which the yarns go on needs no rod.
        rods.retain(|rod| rod.joined.iter().any(|k| *k > 0));
        let joined = Joined {
            all: &all,
            drawing: &drawing,
        };
        let (network, yarns) = joined.build(&rods, stations, options)?;
        let rods = rods.into_iter().zip(yarns).map(|(rod, yarn)| SewnRod {
            yarn,
            panels: rod.seam.sides.iter().map(|s| s.panel).collect(),
            joined: rod.joined,
        });
        Ok(Sewn {
            network,
            rods: rods.collect(),
            loose,
        })
    }

    /// Lays nodes along all borders; borders share the points that they meet
    /// in.
    fn stations<'a>(
        &self,
        seams: &'a [Seam],
        surfaces: &[PanelSurface<'_>],
        options: &SewingOptions,
        all: &mut Vec<Station>,
    ) -> Vec<Rod<'a>> {
        let mut corners: BTreeMap<u32, u32> = BTreeMap::new();
        let mut rods = Vec::with_capacity(seams.len());
        for seam in seams {
            let count = (seam.length() / options.pitch).round() as usize;
            let count = count.max(if seam.is_closed() { CLOSED } else { 1 });
            let mut rod = Rod {
                seam,
                stations: Vec::with_capacity(count + 1),
                joined: vec![0; seam.sides.len()],
            };
            for k in 0..=count {
                let at = seam.at(seam.length() * k as f64 / count as f64);
                let mut new = || {
                    let front = seam.sides.iter().map(|s| {
                        let normal = |k: usize| surfaces[s.panel as usize].normal(s.vertices[k]);
                        V::from(normal(at.0)) * (1.0 - at.1) + V::from(normal(at.0 + 1)) * at.1
                    });
                    let front = front.sum::<V>().try_normalize(1e-9);
                    all.push(Station {
                        point: seam.point(self, at),
                        flat: seam.flat(self, 0, at),
                        front: front.unwrap_or_else(V::z).into(),
                        layers: 0,
                    });
                    (all.len() - 1) as u32
                };
                let corner = match k {
                    0 => Some(seam.points[0]),
                    k if k == count => seam.points.last().copied(),
                    _ => None,
                };
                let station = match corner {
                    Some(corner) => *corners.entry(corner).or_insert_with(new),
                    None => new(),
                };
                rod.stations.push(station);
            }
            rods.push(rod);
        }
        rods
    }
}

/// Where nodes go.
struct Drawing {
    /// Height above the panel before \[m\].
    heights: Vec<f64>,
    /// Station of every node, or [`NONE`].
    onto: Vec<u32>,
    /// Place in its panel's plane, once it is there \[m\].
    places: Vec<[f64; 2]>,
}

impl Drawing {
    /// Draws a node to the station that is nearest on the nearest border of its
    /// panel, or to one beside it where a neighbour on the yarn is there
    /// already or too near, or where the yarn would turn back. False if there
    /// is none.
    fn draw(
        &mut self,
        set: &PanelSet,
        rods: &mut [Rod<'_>],
        panel: u32,
        node: u32,
        all: &YarnNetwork,
        options: &SewingOptions,
    ) -> bool {
        let mut best = (f64::INFINITY, 0, 0, 0.0);
        for (r, rod) in rods.iter().enumerate() {
            for (s, side) in rod.seam.sides.iter().enumerate() {
                if side.panel == panel {
                    let flat = all.flat[node as usize];
                    let (arc, distance) = rod.seam.nearest(set, s, flat);
                    if distance < best.0 {
                        best = (distance, r, s, arc);
                    }
                }
            }
        }
        let (distance, r, side, arc) = best;
        if distance > options.reach {
            return false;
        }
        let rod = &mut rods[r];
        let last = rod.stations.len() as i64 - 1;
        let (place, length) = (arc / rod.seam.length() * last as f64, rod.seam.length());
        let at = |k: i64| {
            let at = rod.seam.at(length * k as f64 / last as f64);
            rod.seam.flat(set, side, at)
        };
        let least = NEAREST * all.material_of(all.strands_of(node).start).radius;
        let free = |k: &i64| {
            let (station, place) = (rod.stations[*k as usize], at(*k));
            let beside = all.strands_of(node).flat_map(|s| {
                let strand = &all.strands[s as usize];
                [strand.prev, strand.next]
            });
            let mut beside = beside.filter(|s| *s != NONE).map(|s| {
                let node = all.strands[s as usize].node as usize;
                (self.onto[node], self.places[node])
            });
            beside.all(|(onto, p)| {
                onto != station && (p[0] - place[0]).hypot(p[1] - place[1]) >= least
            })
        };
        let mut order: Vec<i64> = (-ASIDE..=ASIDE).map(|k| place.round() as i64 + k).collect();
        order.retain(|k| (0..=last).contains(k));
        let cost = |k: &i64| {
            let off = (*k as f64 - place).abs();
            off + TURNED * self.sharpness(all, node, at(*k))
        };
        let costs = order.into_iter().filter(free).map(|k| (cost(&k), k));
        let Some((_, k)) = costs.min_by(|a, b| a.0.total_cmp(&b.0)) else {
            return false;
        };
        self.onto[node as usize] = rod.stations[k as usize];
        self.places[node as usize] = at(k);
        rod.joined[side] += 1;
        true
    }

    /// By how much yarns would turn by more than a right angle about a node and
    /// the nodes beside it if the node were at `place`, summed \[rad\].
    fn sharpness(&self, all: &YarnNetwork, node: u32, place: [f64; 2]) -> f64 {
        let strand = |s: u32| &all.strands[s as usize];
        let at = |s: u32| match strand(s).node {
            n if n == node => place,
            n => self.places[n as usize],
        };
        let turn = |s: u32| {
            if s == NONE || strand(s).prev == NONE || strand(s).next == NONE {
                return 0.0;
            }
            let [x, y, z] = [strand(s).prev, s, strand(s).next].map(at);
            let (d, e) = ([y[0] - x[0], y[1] - x[1]], [z[0] - y[0], z[1] - y[1]]);
            let (cross, dot) = (d[0] * e[1] - d[1] * e[0], d[0] * e[0] + d[1] * e[1]);
            (cross.abs().atan2(dot) - FRAC_PI_2).max(0.0)
        };
        let beside = |s| turn(strand(s).prev) + turn(s) + turn(strand(s).next);
        all.strands_of(node).map(beside).sum()
    }
}

/// Networks of panels with what becomes of their nodes.
struct Joined<'a> {
    all: &'a YarnNetwork,
    drawing: &'a Drawing,
}

impl Joined<'_> {
    /// The network, and the yarns of the rods.
    fn build(
        &self,
        rods: &[Rod<'_>],
        mut stations: Vec<Station>,
        options: &SewingOptions,
    ) -> Result<(YarnNetwork, Vec<u32>), YarnError> {
        let all = self.all;
        let (materials, kinds, rod_kind) = distinct(&all.materials, &options.material);
        let mut builder = NetworkBuilder::new(materials);
        let mut number = vec![NONE; all.nodes()];
        for i in (0..all.nodes()).filter(|i| self.drawing.onto[*i] == NONE) {
            number[i] = builder.node(all.points[i], all.flat[i], all.front[i]);
        }
        let mut rod_nodes = vec![NONE; stations.len()];
        for station in rods.iter().flat_map(|rod| &rod.stations) {
            let at = &mut rod_nodes[*station as usize];
            if *at == NONE {
                let s = &stations[*station as usize];
                *at = builder.node(s.point, s.flat, s.front);
            }
        }
        let node = |old: u32| match self.drawing.onto[old as usize] {
            NONE => number[old as usize],
            station => rod_nodes[station as usize],
        };
        for y in 0..all.yarns.len() as u32 {
            let mut visits = Vec::with_capacity(all.yarns[y as usize].strands as usize);
            let mut arc = 0.0;
            for s in all.along(y) {
                let strand = &all.strands[s as usize];
                if strand.prev != NONE {
                    arc += self.rest(strand.prev, s);
                }
                let layer = match self.drawing.onto[strand.node as usize] {
                    NONE => (s - all.strands_of(strand.node).start) as u8,
                    station => next_layer(&mut stations[station as usize]),
                };
                visits.push(Visit {
                    node: node(strand.node),
                    layer,
                    arc,
                    held: strand.held,
                });
            }
            builder.yarn(kinds[all.yarns[y as usize].material as usize], visits);
        }
        let yarns = rods.iter().map(|rod| {
            let step = options.slack * rod.seam.length() / (rod.stations.len() - 1) as f64;
            let visits = rod.stations.iter().enumerate().map(|(k, s)| Visit {
                node: rod_nodes[*s as usize],
                layer: next_layer(&mut stations[*s as usize]),
                arc: k as f64 * step,
                held: true,
            });
            let visits = visits.collect();
            builder.yarn(rod_kind, visits)
        });
        let yarns = yarns.collect();
        for crossing in &all.crossings {
            builder.crossing(node(crossing.node));
        }
        for contact in &all.stitches {
            builder.stitch(StitchContact {
                a: node(contact.a),
                b: node(contact.b),
                ..*contact
            });
        }
        Ok((builder.build()?, yarns))
    }

    /// Rest length of a segment: what it was, times the change of the distance
    /// of its ends in the plane \[m\].
    fn rest(&self, a: u32, b: u32) -> f64 {
        let strand = |s: u32| &self.all.strands[s as usize];
        let rest = strand(b).arc - strand(a).arc;
        let [i, j] = [a, b].map(|s| strand(s).node as usize);
        let Drawing {
            heights,
            onto,
            places,
        } = self.drawing;
        if onto[i] == NONE && onto[j] == NONE {
            return rest;
        }
        let apart = |x: [f64; 2], y: [f64; 2], z: f64| (x[0] - y[0]).hypot(x[1] - y[1]).hypot(z);
        let height = |k: usize| if onto[k] == NONE { heights[k] } else { 0.0 };
        let flat = &self.all.flat;
        let before = apart(flat[i], flat[j], heights[i] - heights[j]);
        let after = apart(places[i], places[j], height(i) - height(j));
        let ratio = if before > 0.0 { rest / before } else { 1.0 };
        (ratio * after).max(LEAST_ARC * self.all.material_of(a).radius)
    }
}

fn next_layer(station: &mut Station) -> u8 {
    station.layers = station.layers.saturating_add(1);
    station.layers - 1
}

/// Materials each of which is there once, their new indices, and that of the
/// rods.
fn distinct(all: &[YarnMaterial], rod: &YarnMaterial) -> (Vec<YarnMaterial>, Vec<u32>, u32) {
    let mut kept: Vec<YarnMaterial> = Vec::new();
    let mut index = |m: &YarnMaterial| {
        let at = kept.iter().position(|k| k == m);
        at.unwrap_or_else(|| {
            kept.push(m.clone());
            kept.len() - 1
        }) as u32
    };
    let kinds = all.iter().map(&mut index).collect();
    let rod = index(rod);
    (kept, kinds, rod)
}

impl SewingOptions {
    fn validate(&self) -> Result<(), YarnError> {
        self.material.validate()?;
        let allowed = "positive and finite";
        for (what, value) in [
            ("distance of the nodes of a seam", self.pitch),
            ("slack of a seam", self.slack),
            ("reach of a seam", self.reach),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(YarnError::Parameter {
                    what,
                    value,
                    allowed,
                });
            }
        }
        Ok(())
    }
}
