/// What can be wrong with a sewing pattern or with meshing it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GarmentError {
    /// The text is not JSON.
    #[error("line {line}, column {column}: {message}")]
    Json {
        /// Line of the mistake, from 1.
        line: usize,
        /// Column of the mistake, from 1 (0: at the end of the line before).
        column: usize,
        /// What the JSON parser expected.
        message: String,
    },
    /// A required entry is absent.
    #[error("{path}: `{key}` is missing")]
    Missing {
        /// JSON path of the object that should hold it.
        path: String,
        /// Name of the absent entry.
        key: &'static str,
    },
    /// An entry has the wrong type or shape.
    #[error("{path}: expected {expected}, found {found}")]
    WrongType {
        /// JSON path of the entry.
        path: String,
        /// What it should be.
        expected: &'static str,
        /// What it is, shortened.
        found: String,
    },
    /// A number is outside what a garment can mean.
    #[error("{path}: {value} is out of range ({allowed})")]
    OutOfRange {
        /// JSON path of the number.
        path: String,
        /// The number as written (after scaling to metres for lengths).
        value: f64,
        /// The allowed range.
        allowed: &'static str,
    },
    /// A stitch or the panel order names a panel that does not exist.
    #[error("{path}: there is no panel `{name}`{}", did_you_mean(nearest))]
    UnknownPanel {
        /// JSON path of the name.
        path: String,
        /// The name as written.
        name: String,
        /// The most similar name of an existing panel.
        nearest: Option<String>,
    },
    /// A stitch names an edge that its panel does not have.
    #[error("{path}: panel `{panel}` has no edge {edge}: its edges are 0 to {last}")]
    UnknownEdge {
        /// JSON path of the edge number.
        path: String,
        /// Name of the panel.
        panel: String,
        /// The number as written.
        edge: u64,
        /// Largest valid number.
        last: usize,
    },
    /// An edge names a vertex that its panel does not have.
    #[error("{path}: panel `{panel}` has no vertex {vertex}: it has {count}")]
    UnknownVertex {
        /// JSON path of the vertex number.
        path: String,
        /// Name of the panel.
        panel: String,
        /// The number as written.
        vertex: u64,
        /// How many vertices the panel has.
        count: usize,
    },
    /// An edge's curve type is not known.
    #[error(
        "{path}: `{name}` is not a curve type; known are \"quadratic\", \"cubic\" and \"circle\"{}",
        did_you_mean(nearest)
    )]
    UnknownCurve {
        /// JSON path of the type.
        path: String,
        /// The type as written.
        name: String,
        /// The most similar known type.
        nearest: Option<String>,
    },
    /// The pattern has no panel.
    #[error("the pattern has no panel")]
    NoPanels,
    /// The edges of a panel do not form one closed loop.
    #[error(
        "panel `{panel}`: the outline is open: edge {edge} ends at ({:.4}, {:.4}) m \
         and no unused edge continues there", at[0], at[1]
    )]
    OpenOutline {
        /// Name of the panel.
        panel: String,
        /// Edge after which the walk stops.
        edge: usize,
        /// Where it stops, panel coordinates [m].
        at: [f64; 2],
    },
    /// The outline of a panel crosses or touches itself.
    #[error(
        "panel `{panel}`: edge {edge_a} meets edge {edge_b} at ({:.4}, {:.4}) m", at[0], at[1]
    )]
    OutlineCrosses {
        /// Name of the panel.
        panel: String,
        /// One edge.
        edge_a: usize,
        /// The other edge (may be the same).
        edge_b: usize,
        /// Where they meet, panel coordinates [m].
        at: [f64; 2],
    },
    /// A panel has (almost) no area.
    #[error("panel `{panel}` has an area of {area:.2e} m²")]
    NoArea {
        /// Name of the panel.
        panel: String,
        /// Area of its outline [m²].
        area: f64,
    },
    /// A stitch refers to a panel or edge that is not in the pattern.
    #[error("stitch {stitch} names panel {panel}, edge {edge}, which does not exist")]
    BadStitch {
        /// Index of the stitch.
        stitch: usize,
        /// Panel index it names.
        panel: u32,
        /// Edge index it names.
        edge: u32,
    },
    /// The requested edge length is not a usable number.
    #[error("edge length {value} m is not usable: give 0.0005 to 1 m")]
    EdgeLength {
        /// The requested edge length [m].
        value: f64,
    },
    /// A panel would need more points than the limit.
    #[error(
        "panel `{panel}` would need about {points:.0} points at an edge length of \
         {edge_length} m (limit {limit}): are the units right?"
    )]
    TooManyPoints {
        /// Name of the panel.
        panel: String,
        /// Estimated count.
        points: f64,
        /// Requested edge length [m].
        edge_length: f64,
        /// Largest count allowed.
        limit: usize,
    },
    /// The triangulation does not cover the outline.
    #[error("panel `{panel}`: triangles cover {kept:.6e} m² of {expected:.6e} m²")]
    AreaMismatch {
        /// Name of the panel.
        panel: String,
        /// Area of the triangles [m²].
        kept: f64,
        /// Area of the outline [m²].
        expected: f64,
    },
    /// The shell model refuses the mesh.
    #[error("the shell model refuses the garment's mesh")]
    Shell(#[from] selvedge_shell_model::ModelError),
}

fn did_you_mean(nearest: &Option<String>) -> String {
    match nearest {
        Some(name) => format!("; did you mean `{name}`?"),
        None => String::new(),
    }
}
