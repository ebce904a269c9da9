use super::draft::limit;
use super::{Draft, WeaveError};
use crate::{NetworkBuilder, Visit, YarnMaterial, YarnNetwork};

/// Most nodes of a network.
const NODES: usize = 1 << 30;

/// A rectangle of woven cloth, flat in the plane z = 0 with its right side
/// towards +z. Warps run along y, wefts along x; in arrays the warp comes
/// first.
///
/// Every warp crosses every weft in a node of its own, floats included
/// [Cirio2014]. Warp `i` lies at `x = fringe_weft + i · spacing_warp`, weft `j`
/// at `y = fringe_warp + j · spacing_weft`, so that the cloth, fringes and all,
/// fills a rectangle with one corner in the origin.
///
/// Yarns reach past their outermost crossings by a *fringe* that ends in a node
/// of its own, at which the arc length is held; so all arc lengths of all
/// crossings can slide, the outermost ones by the length of the fringe.
/// Without fringe, yarns end in their outermost crossings and are held there.
///
/// Nodes are numbered weft by weft, then the ends of the warps (low and high
/// one in turn), then those of the wefts. Yarns are the warps, then the wefts.
#[derive(Clone, Debug, PartialEq)]
pub struct Woven {
    /// Number of warps and wefts.
    pub counts: [usize; 2],
    /// Distance L between warps, between wefts [m].
    pub spacing: [f64; 2],
    /// Rest length of a warp's and a weft's yarn over the length that it spans
    /// when flat [1]: `Δu = crimp · L`. 1 is unstretched, more is slack.
    pub crimp: [f64; 2],
    /// How far warps and wefts reach past the outermost crossings [m].
    pub fringe: [f64; 2],
    /// Kinds of yarn.
    pub materials: Vec<YarnMaterial>,
    /// Indices of the warps' materials, repeated without end.
    pub warp_materials: Vec<u32>,
    /// Indices of the wefts' materials, repeated without end.
    pub weft_materials: Vec<u32>,
}

impl Woven {
    /// Numbers of warps and wefts `spacing` [m] apart, all of one material,
    /// without crimp, with fringes of half a spacing.
    pub fn new(counts: [usize; 2], spacing: [f64; 2], material: YarnMaterial) -> Self {
        Self {
            counts,
            spacing,
            crimp: [1.0; 2],
            // A warp reaches past wefts, and the other way round.
            fringe: [0.5 * spacing[1], 0.5 * spacing[0]],
            materials: vec![material],
            warp_materials: vec![0],
            weft_materials: vec![0],
        }
    }

    /// As [`new`](Self::new), with as many yarns as come closest to a width and
    /// a length [m], fringes included, but at least one.
    pub fn of_size(size: [f64; 2], spacing: [f64; 2], material: YarnMaterial) -> Self {
        // A saturating cast: what is not a number of yarns fails in `build`.
        let counts = [0, 1].map(|k| ((size[k] / spacing[k]).round() as usize).max(1));
        Self::new(counts, spacing, material)
    }

    /// Weaves the network of a draft, repeated from the lower left corner.
    ///
    /// # Errors
    /// [`WeaveError`] for impossible counts, lengths or materials.
    pub fn build(&self, draft: &Draft) -> Result<YarnNetwork, WeaveError> {
        self.validate()?;
        let [warps, wefts] = self.counts;
        let mut builder = NetworkBuilder::new(self.materials.clone());
        let front = [0.0, 0.0, 1.0];
        let x = |i: usize| self.fringe[1] + i as f64 * self.spacing[0];
        let y = |j: usize| self.fringe[0] + j as f64 * self.spacing[1];
        let mut node = |x: f64, y: f64| builder.node([x, y, 0.0], [x, y], front);
        let mut crossings = Vec::with_capacity(warps * wefts);
        for j in 0..wefts {
            for i in 0..warps {
                crossings.push(node(x(i), y(j)));
            }
        }
        let mut ends = [Vec::new(), Vec::new()];
        if self.fringe[0] > 0.0 {
            let high = y(wefts - 1) + self.fringe[0];
            for i in 0..warps {
                ends[0].push([node(x(i), 0.0), node(x(i), high)]);
            }
        }
        if self.fringe[1] > 0.0 {
            let high = x(warps - 1) + self.fringe[1];
            for j in 0..wefts {
                ends[1].push([node(0.0, y(j)), node(high, y(j))]);
            }
        }
        for i in 0..warps {
            let crossed = (0..wefts).map(|j| {
                let layer = u8::from(!draft.warp_over(i, j));
                (crossings[j * warps + i], layer)
            });
            let visits = self.visits(0, crossed, ends[0].get(i));
            builder.yarn(cycle(&self.warp_materials, i), visits);
        }
        for j in 0..wefts {
            let crossed = (0..warps).map(|i| {
                let layer = u8::from(draft.warp_over(i, j));
                (crossings[j * warps + i], layer)
            });
            let visits = self.visits(1, crossed, ends[1].get(j));
            builder.yarn(cycle(&self.weft_materials, j), visits);
        }
        for node in crossings {
            builder.crossing(node);
        }
        Ok(builder.build()?)
    }

    /// Visits of a yarn of family 0 (warp) or 1 (weft); arc lengths start with
    /// 0 at its low end.
    fn visits(
        &self,
        family: usize,
        crossed: impl Iterator<Item = (u32, u8)>,
        ends: Option<&[u32; 2]>,
    ) -> Vec<Visit> {
        let (crimp, fringe) = (self.crimp[family], self.fringe[family]);
        let spacing = self.spacing[1 - family];
        let visit = |node, layer, length: f64, held| Visit {
            node,
            layer,
            arc: crimp * length,
            held,
        };
        let mut visits = Vec::with_capacity(self.counts[1 - family] + 2);
        if let Some([low, _]) = ends {
            visits.push(visit(*low, 0, 0.0, true));
        }
        for (k, (node, layer)) in crossed.enumerate() {
            visits.push(visit(node, layer, fringe + k as f64 * spacing, false));
        }
        if let Some([_, high]) = ends {
            let last = self.counts[1 - family] - 1;
            let length = fringe + last as f64 * spacing + fringe;
            visits.push(visit(*high, 0, length, true));
        }
        visits
    }

    fn validate(&self) -> Result<(), WeaveError> {
        for (count, what) in self.counts.into_iter().zip(["warp", "weft"]) {
            if count == 0 {
                return Err(WeaveError::Empty { what });
            }
        }
        let nodes = self.counts[0].saturating_mul(self.counts[1]);
        limit("crossings of the cloth", nodes, NODES)?;
        for what in [
            (&self.warp_materials, "material of the warps"),
            (&self.weft_materials, "material of the wefts"),
        ] {
            if what.0.is_empty() {
                return Err(WeaveError::Empty { what: what.1 });
            }
        }
        let positive = [
            ("spacing of the warps", self.spacing[0]),
            ("spacing of the wefts", self.spacing[1]),
            ("crimp of the warps", self.crimp[0]),
            ("crimp of the wefts", self.crimp[1]),
        ];
        for (what, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                let allowed = "positive and finite";
                return Err(WeaveError::Parameter {
                    what,
                    value,
                    allowed,
                });
            }
        }
        for (what, value) in [
            ("fringe of the warps", self.fringe[0]),
            ("fringe of the wefts", self.fringe[1]),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                let allowed = "zero or positive, and finite";
                return Err(WeaveError::Parameter {
                    what,
                    value,
                    allowed,
                });
            }
        }
        Ok(())
    }
}

fn cycle(materials: &[u32], k: usize) -> u32 {
    materials[k % materials.len()]
}
