/// What can be wrong with a mesh or with the terms built on it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// Two arrays that run in parallel differ in length.
    #[error("{what}: expected {expected} entries, found {found}")]
    Length {
        /// The array at fault.
        what: &'static str,
        /// Length needed.
        expected: usize,
        /// Length given.
        found: usize,
    },
    /// A triangle names a point that does not exist.
    #[error("triangle {triangle}: point {point} does not exist (the mesh has {points} points)")]
    PointOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// Point it names.
        point: u32,
        /// Number of points.
        points: usize,
    },
    /// A triangle names a point twice.
    #[error("triangle {triangle}: point {point} occurs twice")]
    RepeatedPoint {
        /// Index of the triangle.
        triangle: usize,
        /// The repeated point.
        point: u32,
    },
    /// A coordinate or parameter is NaN or infinite.
    #[error("{what} {index}: not a finite number")]
    NotFinite {
        /// What holds the number, for example "material coordinates of triangle".
        what: &'static str,
        /// Its index.
        index: usize,
    },
    /// A rest triangle is too thin to have a strain.
    #[error(
        "triangle {triangle}: degenerate at rest (area {area:.3e} m², height over longest edge \
         {aspect:.1e})"
    )]
    DegenerateTriangle {
        /// Index of the triangle.
        triangle: usize,
        /// Rest area \[m²\].
        area: f64,
        /// Smallest height over longest edge \[1\].
        aspect: f64,
    },
    /// A triangle runs clockwise in material coordinates.
    #[error("triangle {triangle}: clockwise in material coordinates (signed area {area:.3e} m²)")]
    InvertedTriangle {
        /// Index of the triangle.
        triangle: usize,
        /// Signed rest area \[m²\].
        area: f64,
    },
    /// Two triangles have the same three points.
    #[error("triangles {first} and {second} have the same three points")]
    DuplicateTriangle {
        /// Index of the first triangle.
        first: usize,
        /// Index of the second triangle.
        second: usize,
    },
    /// More than two triangles share an edge.
    #[error("edge {}-{}: shared by {} triangles {triangles:?}, at most 2 can be", edge[0], edge[1], triangles.len())]
    NonManifoldEdge {
        /// End points of the edge.
        edge: [u32; 2],
        /// Every triangle on it.
        triangles: Vec<usize>,
    },
    /// Two neighbours run through their common edge in the same direction.
    #[error("edge {}-{}: triangles {} and {} face opposite sides", edge[0], edge[1], triangles[0], triangles[1])]
    InconsistentWinding {
        /// End points of the edge.
        edge: [u32; 2],
        /// The two triangles.
        triangles: [usize; 2],
    },
    /// A renumbering is not a permutation of the points.
    #[error("renumbering: entry {index} is {value}, which is out of range or occurs twice")]
    NotAPermutation {
        /// Index of the first entry at fault.
        index: usize,
        /// Its value.
        value: u32,
    },
    /// A triangle names a fabric that does not exist.
    #[error("triangle {triangle}: fabric {fabric} does not exist ({fabrics} are given)")]
    FabricOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// Fabric it names.
        fabric: u16,
        /// Number of fabrics given.
        fabrics: usize,
    },
    /// A fabric has a parameter that no energy can use.
    #[error("fabric `{fabric}`: {what} = {value:?}: must be {allowed}")]
    Fabric {
        /// Name of the fabric.
        fabric: String,
        /// Name of the parameter.
        what: &'static str,
        /// Its value, in SI units.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A parameter is outside its range.
    #[error("{what} = {value:?}: must be {allowed}")]
    Parameter {
        /// Name of the parameter.
        what: &'static str,
        /// Value given, in SI units.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
}
