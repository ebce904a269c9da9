/// What can be wrong with yarns, their networks or their parameters.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum YarnError {
    /// A parameter outside its range.
    #[error("{what} = {value}: must be {allowed}")]
    Parameter {
        /// The parameter.
        what: &'static str,
        /// Its value, in SI units.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// Something names a node, strand, yarn or material that does not exist.
    #[error("{what} {index} does not exist (there are {count})")]
    OutOfRange {
        /// What is missing.
        what: &'static str,
        /// Index named.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A yarn with fewer than two visits.
    #[error("yarn {yarn} visits {visits} nodes; it needs at least 2")]
    ShortYarn {
        /// The yarn.
        yarn: usize,
        /// Its visits.
        visits: usize,
    },
    /// Arc lengths that do not grow along a yarn.
    #[error(
        "yarn {yarn}, visit {visit}: arc length {arc} m does not exceed the one before, {before} m"
    )]
    ArcNotIncreasing {
        /// The yarn.
        yarn: usize,
        /// Index of the visit.
        visit: usize,
        /// Arc length there \[m\].
        arc: f64,
        /// Arc length before \[m\].
        before: f64,
    },
    /// Yarns of a node whose order front to back is not 0, 1, 2, ...
    #[error("node {node}: the layers of its yarns are {layers:?} instead of 0 to {last}")]
    Layers {
        /// The node.
        node: usize,
        /// Layers found, sorted.
        layers: Vec<u8>,
        /// Largest layer expected.
        last: usize,
    },
    /// A node that no yarn visits.
    #[error("node {node} is not visited by any yarn")]
    LooseNode {
        /// The node.
        node: usize,
    },
    /// A position or an arc length that is NaN or infinite.
    #[error("{what} {index}: not a finite number")]
    NotFinite {
        /// What holds the number.
        what: &'static str,
        /// Its index.
        index: usize,
    },
    /// A stitch contact whose nodes carry a number of yarns that does not fit.
    #[error("stitch contact {contact}: node {node} carries {strands} yarns, expected {expected}")]
    StitchStack {
        /// The contact.
        contact: usize,
        /// The node at fault.
        node: usize,
        /// Its yarns.
        strands: usize,
        /// Parents plus the child.
        expected: usize,
    },
    /// Loops whose energy has no minimum that could be found.
    #[error(
        "the loops did not come to rest in {iterations} iterations: the largest unbalanced force \
         is {force:.2e} N"
    )]
    NoRest {
        /// Iterations made.
        iterations: usize,
        /// Largest unbalanced force \[N\].
        force: f64,
    },
}
