//! Knitted cloth from a stitch chart.
//!
//! A [`Chart`](crate::chart::Chart) becomes loops ([`LoopGraph`]), loops get a
//! place in the plane ([`relaxed_centres`]), and every loop drawn through others
//! gets two stitch contacts of two nodes each [Cirio2017]. One yarn runs through
//! all rows, back and forth.
//!
//! ```
//! use selvedge_yarn_model::chart::StitchPattern;
//! use selvedge_yarn_model::knit::{KnitOptions, knitted};
//! let chart = StitchPattern::built_in("rib-2x2")?.chart(5, 10)?;
//! let rib = knitted(&chart, &KnitOptions::default())?;
//! assert_eq!(rib.map.loops.len(), 400);
//! assert_eq!(rib.network.yarns.len(), 3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Edges
//!
//! Two auxiliary yarns of the same kind keep the first and the last row from
//! unravelling. The cast-on is a row of parents and the bind-off a row of
//! children, loops of the ordinary shape; what would be their other contacts is
//! two nodes of a single yarn a loop. Arc lengths of the auxiliary yarns are
//! prescribed at every node, so they never slip. They are loops and not a
//! straight thread for the sake of stiffness: the edge stretches by bending its
//! loops as the rows within do, and lacks only their sliding.

mod graph;
mod layout;
mod measure;
mod network;
mod options;
mod periodic;
mod regularity;
mod relax;
mod template;

pub use graph::{KnitLoop, LoopGraph, Thread};
pub(crate) use network::knitted_within;
pub use network::{Knitted, StitchLoop, StitchMap, knitted, knitted_part};
pub use options::KnitOptions;
pub use periodic::LoopsAtRest;
pub use regularity::LoopSpread;
pub use relax::relaxed_centres;
pub use template::{LoopTemplate, TemplateCells};
