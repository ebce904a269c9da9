use super::error::nearest;
use super::{ChartError, StitchPattern};

/// Names of the built-in charts.
///
/// `openwork-diamonds` and `flame-chevron` stand in for charts of
/// [Cirio2017] that were not published: an eyelet diamond lattice and a zigzag
/// of biased eyelets.
pub const BUILT_IN_CHARTS: [&str; 7] = [
    "stockinette",
    "garter",
    "rib-2x2",
    "seed",
    "feather-and-fan",
    "openwork-diamonds",
    "flame-chevron",
];

const TEXTS: [&str; 7] = [
    "name: stockinette\nrow 1 RS: *k*\nrow 2 WS: *p*\n",
    "name: garter\nrow 1 RS: *k*\nrow 2 WS: *k*\n",
    "name: rib-2x2\nmultiple: 4\nrow 1 RS: *k2 p2*\nrow 2 WS: *k2 p2*\n",
    "name: seed\nmultiple: 2\nrow 1 RS: *k p*\nrow 2 WS: *p k*\n",
    "# Old shale.
name: feather-and-fan
multiple: 18
row 1 RS: *k*
row 2 WS: *p*
row 3: *(k2tog)x3 (yo k1)x6 (k2tog)x3*
row 4: *k*
",
    "name: openwork-diamonds
multiple: 6
plus: 1
row 1 RS: *k1 yo ssk k1 k2tog yo* k1
row 3: k2 *yo s2kp yo k3* yo s2kp yo k2
row 5: *k1 k2tog yo k1 yo ssk* k1
row 7: k2tog *yo k3 yo s2kp* yo k3 yo ssk
row 2, 4, 6, 8 WS: *p*
",
    "name: flame-chevron
multiple: 7
plus: 2
row 1, 3, 5, 7 RS: k1 *ssk k5 yo* k1
row 9, 11, 13, 15 RS: k1 *yo k5 k2tog* k1
row 2, 4, 6, 8, 10, 12, 14, 16 WS: *p*
",
];

impl StitchPattern {
    /// A built-in chart by name, one of [`BUILT_IN_CHARTS`].
    ///
    /// # Errors
    /// [`ChartError::UnknownChart`] with the most similar name.
    pub fn built_in(name: &str) -> Result<Self, ChartError> {
        let folded = name.to_lowercase().replace(['_', ' '], "-");
        match BUILT_IN_CHARTS.iter().position(|n| *n == folded) {
            Some(k) => Self::parse(TEXTS[k]),
            None => Err(ChartError::UnknownChart {
                name: name.to_owned(),
                nearest: nearest(&folded, &BUILT_IN_CHARTS),
                known: BUILT_IN_CHARTS.join(", "),
            }),
        }
    }
}
