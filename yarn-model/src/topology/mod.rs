//! Networks that change: yarns that leave their contacts, unravel, are cut.
//!
//! [`changes`] looks at a network and the arc lengths that its yarns have slid
//! to, and lists what happens, in a fixed order; [`Change`] is the network after
//! that, and carries the state over. Changes keep the layout: positions and arc
//! lengths of a [`YarnNetwork`] stay those at rest, so that what did not change
//! keeps its rest lengths; the state alone says how far a yarn has slid.

mod carry;
mod detect;
mod edit;
mod tails;

pub use detect::changes;
pub use edit::Change;

/// Least arc length between two nodes, in yarn radii [Cirio2017]: the `du_min`
/// below which nodes are taken out.
pub const LEAST_GAP: f64 = 0.25;

/// Something that happens to a network. Strands are those of the network before
/// it.
///
/// A contact that a yarn leaves breaks: every yarn of a crossing, or of both
/// nodes of a stitch contact, goes on through a node of its own at the same
/// place, with the velocity of its material and its arc length frozen. In a
/// stack of several parents that a parent leaves, the others stay.
///
/// Deviation: [Cirio2017] first merges the two nodes of a stitch contact for
/// the yarn that moves, and breaks the contact when the yarn's end has passed
/// the merged node; here it breaks when the end passes its first node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TopologyEvent {
    /// The end of the yarn passes this strand next to it: the yarn leaves the
    /// contact.
    Release {
        /// The strand.
        strand: u32,
    },
    /// A loop that holds nothing is drawn out of the loops that hold it: nothing
    /// of it is left between this strand, at a node B, and the next, at the
    /// other one.
    Draw {
        /// The strand.
        strand: u32,
    },
    /// A node of a single yarn comes too close to the one beside it, and is
    /// taken out.
    Remove {
        /// The strand.
        strand: u32,
    },
    /// The yarn is cut half-way between this strand and the next.
    Cut {
        /// The strand.
        strand: u32,
    },
}

impl TopologyEvent {
    /// Two numbers that [`decode`](Self::decode) understands.
    pub fn encode(self) -> [u32; 2] {
        match self {
            Self::Release { strand } => [0, strand],
            Self::Draw { strand } => [1, strand],
            Self::Remove { strand } => [2, strand],
            Self::Cut { strand } => [3, strand],
        }
    }

    /// The event of two numbers.
    pub fn decode([kind, strand]: [u32; 2]) -> Option<Self> {
        Some(match kind {
            0 => Self::Release { strand },
            1 => Self::Draw { strand },
            2 => Self::Remove { strand },
            3 => Self::Cut { strand },
            _ => return None,
        })
    }

    /// The strand that it names.
    pub fn strand(self) -> u32 {
        self.encode()[1]
    }
}
