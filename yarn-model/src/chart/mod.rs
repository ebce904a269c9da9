//! Stitch charts: a text format for hand knitting, built-in charts, and a
//! reader of machine files.
//!
//! # The text format
//!
//! ```text
//! # Old shale: a comment runs to the end of the line.
//! name: feather-and-fan
//! multiple: 18          # stitches of one repeat
//! plus: 0               # stitches at the edges
//! row 1 RS: *k*
//! row 2 WS: *p*
//! row 3: *(k2tog)x3 (yo k1)x6 (k2tog)x3*
//! row 4: *k*
//! ```
//!
//! Rows are written as worked: right-side rows from right to left, wrong-side
//! rows from left to right, with `k` for a stitch that the worker knits. Row 1
//! is a right-side row unless marked `WS`; sides alternate, marks are checked.
//! Several rows share a line: `row 1, 3, 5-8: ...`.
//!
//! `*...*` is repeated until the row is full, once a row at most. `k6` is six
//! knit stitches; `(...)x3` or `word x3` repeats what stands before. Commas
//! may part operations. `multiple` and `plus` say which widths are possible,
//! `multiple: 0` a fixed one; without them any width is tried.
//!
//! | operation | takes → makes | |
//! |---|---|---|
//! | `k`, `p` | 1 → 1 | knit, purl |
//! | `yo` | 0 → 1 | yarn over |
//! | `k2tog`, `p2tog`, `kNtog`, `pNtog` | N → 1 | left-most on top |
//! | `ssk`, `ssp`, `sssk`, ... | 2, 3, ... → 1 | right-most on top |
//! | `skp`, `sk2p`, `sp2p`, `skNp` | N + 1 → 1 | right-most passed over N together |
//! | `s2kp`, `s2pp` | 3 → 1 | centre on top |
//! | `kfb`, `pfb`, `kyok`, `pyop` | 1 → 2, 1 → 3 | increases |
//! | `kincN`, `pincN` | 1 → N | N loops through one |
//! | `kMtoN`, `pMtoN` | M → N | with M or N one; both larger would split |
//!
//! N is at most [`MAX_STACK`]. "On top" is in front, on the face that the
//! worker sees. Every loop of an increase is drawn through its parent with the
//! same face: the twist of `kfb`'s second loop is left out.
//!
//! Every mistake is a [`ChartError`] with line, column, row and stitch.

mod built_in;
mod error;
mod expand;
mod knitout;
mod op;
mod parse;
mod rows;

pub use built_in::BUILT_IN_CHARTS;
pub use error::{ChartError, Place};
pub use expand::StitchPattern;
pub use knitout::{Knitout, KnitoutError, KnitoutWarning, read_knitout};
pub use op::{MAX_STACK, Op, Stack};
pub use rows::{Chart, ChartRow};
