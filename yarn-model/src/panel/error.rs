use crate::chart::ChartError;
use crate::{WeaveError, YarnError};

/// What can be wrong with panels.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PanelError {
    /// An outline that encloses nothing.
    #[error("the outline of {points} points encloses no area")]
    EmptyOutline {
        /// Its points.
        points: usize,
    },
    /// A number that is NaN or infinite.
    #[error("{what} {index}: not a finite number")]
    NotFinite {
        /// What holds the number.
        what: &'static str,
        /// Its index.
        index: usize,
    },
    /// A triangle that names a point that does not exist.
    #[error("triangle {triangle} names point {point} (there are {count})")]
    NoSuchPoint {
        /// The triangle.
        triangle: usize,
        /// The point.
        point: u32,
        /// How many there are.
        count: usize,
    },
    /// Not as many flat triangles as triangles.
    #[error("{triangles} triangles, but flat coordinates of {flat}")]
    FlatCount {
        /// Triangles in space.
        triangles: usize,
        /// Triangles in the plane.
        flat: usize,
    },
    /// A triangle without area in the plane, or one that runs clockwise.
    #[error("triangle {triangle}: flat coordinates have no area or run clockwise")]
    FlatTriangle {
        /// The triangle.
        triangle: usize,
    },
    /// A panel too small for a stitch or a crossing.
    #[error("panel {panel}: no {what} fits into its {area} m²")]
    TooSmall {
        /// The panel.
        panel: usize,
        /// What does not fit.
        what: &'static str,
        /// Area of the panel \[m²\].
        area: f64,
    },
    /// A chart that cannot be repeated across.
    #[error("chart `{name}` has a fixed width: a panel needs one with a repeat")]
    FixedChart {
        /// The chart.
        name: String,
    },
    /// A network for each panel is needed.
    #[error("{networks} networks for {panels} panels")]
    NetworkCount {
        /// Networks.
        networks: usize,
        /// Panels.
        panels: usize,
    },
    /// A chart that does not fit itself.
    #[error(transparent)]
    Chart(#[from] ChartError),
    /// A weave that cannot be.
    #[error(transparent)]
    Weave(#[from] WeaveError),
    /// A network that does not fit together.
    #[error(transparent)]
    Yarn(#[from] YarnError),
}
