/// What can go wrong in collision detection and response.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CollisionError {
    /// A position is NaN or infinite.
    #[error("point {point}: position is not finite")]
    NotFinitePosition {
        /// Index of the point.
        point: usize,
    },
    /// A triangle, edge or pair names a point that does not exist.
    #[error("{what} {index} names point {point}, but there are {points} points")]
    PointOutOfRange {
        /// "triangle", "edge" or "excluded pair".
        what: &'static str,
        /// Index of the triangle, edge or pair.
        index: usize,
        /// The point named.
        point: u32,
        /// Number of points.
        points: usize,
    },
    /// A triangle or a segment names a point twice.
    #[error("{what} {index} names point {point} twice")]
    RepeatedPoint {
        /// "triangle" or "segment".
        what: &'static str,
        /// Index of the triangle or segment.
        index: usize,
        /// The point named twice.
        point: u32,
    },
    /// A parameter is outside its range.
    #[error("{name} = {value}: must be {requirement}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// The value given.
        value: f64,
        /// What it must be.
        requirement: &'static str,
    },
    /// An array has the wrong length.
    #[error("{what}: length {found}, expected {expected}")]
    Length {
        /// Which array.
        what: &'static str,
        /// The length given.
        found: usize,
        /// The length needed.
        expected: usize,
    },
    /// More pairs or boxes than 32-bit indices can name.
    #[error("{count} {what} exceed 32-bit indices")]
    TooMany {
        /// What is counted.
        what: &'static str,
        /// How many there are.
        count: usize,
    },
    /// A body's mesh cannot give a signed distance.
    #[error("body `{body}`: {reason}")]
    Body {
        /// Name of the body.
        body: String,
        /// What is wrong.
        reason: String,
    },
    /// A body's distance or normal is NaN or infinite at a point.
    #[error("body `{body}`: distance at point {point} is not finite")]
    NotFiniteSample {
        /// Name of the body.
        body: String,
        /// Index of the point.
        point: u32,
    },
    /// Body and point approach so fast that the point would end the step deeper
    /// than where the nearest surface is surely the one that it came through.
    #[error(
        "body `{body}` runs over point {point}: {depth:.3e} m deep within one step, more than \
         {limit:.3e} m"
    )]
    Overrun {
        /// Name of the body.
        body: String,
        /// Index of the point.
        point: u32,
        /// Depth that is foreseen [m].
        depth: f64,
        /// Depth that is allowed [m].
        limit: f64,
    },
    /// A history array does not fit this source.
    #[error("contact history `{source_name}`: {reason}")]
    History {
        /// Name of the contact source.
        source_name: String,
        /// What does not fit.
        reason: &'static str,
    },
}

/// Refuses an array of another length than expected.
pub(crate) fn check_length(
    what: &'static str,
    found: usize,
    expected: usize,
) -> Result<(), CollisionError> {
    if found == expected {
        return Ok(());
    }
    Err(CollisionError::Length {
        what,
        found,
        expected,
    })
}
