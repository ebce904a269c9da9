//! Which end of one sewn edge meets which end of the other.

use super::{EdgeId, Pattern, Stitch};
use crate::math::dist;

/// How the points of two sewn edges are matched, walking both outlines in
/// their own direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pairing {
    /// Start to end: the outside continues over the seam.
    Opposed,
    /// Start to start: the outside flips over the seam.
    Parallel,
}

impl Stitch {
    /// The pairing the pattern declares.
    pub fn pairing(&self) -> Pairing {
        if self.right_wrong {
            Pairing::Parallel
        } else {
            Pairing::Opposed
        }
    }
}

/// A stitch measured in the placement of its panels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedStitch {
    /// Sum of the distances of the matched ends with [`Pairing::Opposed`] [m].
    pub opposed: f64,
    /// The same with [`Pairing::Parallel`] [m].
    pub parallel: f64,
    /// Lengths of both edges [m].
    pub lengths: [f64; 2],
}

impl PlacedStitch {
    /// The pairing that the placement suggests, when it does so clearly: the
    /// sums must differ by the length of the shorter edge (for edges that lie
    /// parallel they differ by up to twice that).
    pub fn clear_pairing(&self) -> Option<Pairing> {
        let clear = self.lengths[0].min(self.lengths[1]);
        if self.parallel - self.opposed > clear {
            Some(Pairing::Opposed)
        } else if self.opposed - self.parallel > clear {
            Some(Pairing::Parallel)
        } else {
            None
        }
    }
}

/// End points of an edge along the panel's outline, placed; with its length.
fn placed_ends(pattern: &Pattern, id: EdgeId) -> Option<([[f64; 3]; 2], f64)> {
    let panel = pattern.panels.get(id.panel as usize)?;
    let mut ends = panel.edge_ends(id.edge as usize)?;
    let walked = panel.outline().ok()?;
    if walked
        .iter()
        .any(|l| l.edge == id.edge as usize && l.reversed)
    {
        ends.reverse();
    }
    let frame = panel.frame();
    let length = panel.edge_table(id.edge as usize)?.length();
    Some((ends.map(|p| frame.place(p)), length))
}

/// Measures a stitch in the placement; `None` when an edge does not exist or
/// its panel's outline is open.
pub fn placed_stitch(pattern: &Pattern, stitch: &Stitch) -> Option<PlacedStitch> {
    let (a, la) = placed_ends(pattern, stitch.a)?;
    let (b, lb) = placed_ends(pattern, stitch.b)?;
    Some(PlacedStitch {
        opposed: dist(a[0], b[1]) + dist(a[1], b[0]),
        parallel: dist(a[0], b[0]) + dist(a[1], b[1]),
        lengths: [la, lb],
    })
}
