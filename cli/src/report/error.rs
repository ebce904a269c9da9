//! What can go wrong while a report is drawn.

/// Errors of the report module.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// The picture size is zero or beyond [`MAX_SIDE`](super::MAX_SIDE).
    #[error("a picture of {width} x {height} pixels cannot be drawn (1 to {limit} a side)")]
    PictureSize {
        /// Requested width \[pixels\].
        width: u32,
        /// Requested height \[pixels\].
        height: u32,
        /// Largest allowed side \[pixels\].
        limit: u32,
    },
    /// No point of the scene has finite coordinates.
    #[error("nothing to draw: none of {points} points has finite coordinates")]
    NothingToDraw {
        /// Points that were offered.
        points: usize,
    },
    /// The PNG encoder refused the pixels.
    #[error("the picture could not be encoded")]
    Encoding(#[from] png::EncodingError),
}
