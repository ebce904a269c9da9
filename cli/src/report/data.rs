//! Plain input of a report: nothing here refers to a solver type.

/// A point in metres, y up.
pub type Point = [f32; 3];

/// Everything a report shows. Empty parts are left out of the page.
#[derive(Debug, Clone, Default)]
pub struct ReportData {
    /// Heading, usually the scene's name.
    pub title: String,
    /// `summary.json` as it is written.
    pub summary: serde_json::Value,
    /// All effective settings, as nested tables.
    pub settings: serde_json::Value,
    /// The scene file, verbatim.
    pub scene_text: String,
    /// The cloth; for cloth of yarns the tubes that the pictures show.
    pub mesh: ReportMesh,
    /// Yarns, for cloth that is made of them; frames then hold points of their
    /// centre lines.
    pub yarns: Option<ReportYarns>,
    /// Bodies the cloth touches.
    pub bodies: Vec<ReportSurface>,
    /// Recorded states, in time order; the last one is drawn in the pictures.
    pub frames: Vec<ReportFrame>,
    /// Maps with one value a triangle.
    pub triangle_fields: Vec<Field>,
    /// Maps with one value a point.
    pub point_fields: Vec<Field>,
    /// Curves over simulated time.
    pub series: Vec<Series>,
    /// Named stages of a garment's assembly, in order; when empty, those of the
    /// summary's `assembly` are shown.
    pub stages: Vec<AssemblyStage>,
    /// Warnings of the scene check and remarks of the run; the summary's
    /// `warnings` are shown with them.
    pub notes: Vec<String>,
}

/// Topology of the cloth.
#[derive(Debug, Clone, Default)]
pub struct ReportMesh {
    /// Corner points of each triangle, counter-clockwise seen from the fabric's right side.
    pub triangles: Vec<[u32; 3]>,
    /// Panel of each triangle; empty when there is one panel.
    pub panel: Vec<u16>,
    /// Names of the panels.
    pub panel_names: Vec<String>,
}

/// Cloth made of yarns.
#[derive(Debug, Clone, Default)]
pub struct ReportYarns {
    /// First point of every yarn in the frames, and the number of points.
    pub offsets: Vec<u32>,
    /// Radius of each yarn \[m\].
    pub radii: Vec<f32>,
    /// Piece of cloth of each yarn, by its index among the panels' names.
    pub panels: Vec<u16>,
    /// Corners of the tubes in the 3D view.
    pub sides: usize,
    /// Rings a segment in the 3D view.
    pub samples: usize,
    /// Every how many points of the recording the frames hold.
    pub stride: usize,
    /// Segments of all yarns as recorded.
    pub segments: usize,
    /// Vertices of the pictures' tubes at the last frame \[m\].
    pub tube_points: Vec<Point>,
    /// Maps with one value a point of a yarn, which is that of the segment to the
    /// next point; shown in the 3D view.
    pub segment_fields: Vec<Field>,
}

/// A body's surface.
#[derive(Debug, Clone, Default)]
pub struct ReportSurface {
    /// Name in the scene.
    pub name: String,
    /// Points \[m\] (at the last frame, when the body moves).
    pub points: Vec<Point>,
    /// Corner points of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Points at every frame of [`ReportData::frames`]; empty for a body at rest.
    pub motion: Vec<Vec<Point>>,
}

/// One recorded state.
#[derive(Debug, Clone, Default)]
pub struct ReportFrame {
    /// Simulated time \[s\].
    pub time: f64,
    /// Cloth points \[m\].
    pub positions: Vec<Point>,
}

/// A scalar map on the cloth.
#[derive(Debug, Clone, Default)]
pub struct Field {
    /// What is shown, e.g. "warp strain".
    pub name: String,
    /// Its unit, e.g. "%", "mm", "N/m"; empty for none.
    pub unit: String,
    /// Values at the last frame; NaN marks "no value here".
    pub values: Vec<f32>,
    /// Ends of the colour scale; `None` takes them from the data.
    pub range: Option<(f32, f32)>,
    /// Whether the sign matters: the scale is then centred on zero.
    pub diverging: bool,
    /// Values at every frame of [`ReportData::frames`] for the 3D view; may be empty.
    pub history: Vec<Vec<f32>>,
}

/// A curve over simulated time.
#[derive(Debug, Clone, Default)]
pub struct Series {
    /// Plot it belongs to: "energy", "residual", "step", "contacts", "solver", "kinetic" or any other word.
    pub group: String,
    /// Name in the legend.
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// Whether the plot's axis is logarithmic.
    pub log: bool,
    /// `(time in s, value)`; values that are not finite leave a gap.
    pub points: Vec<(f64, f64)>,
}

/// One stage of an assembly (placing, sewing, relaxing, ...).
#[derive(Debug, Clone, Default)]
pub struct AssemblyStage {
    /// Name of the stage.
    pub name: String,
    /// Simulated duration \[s\].
    pub duration_s: f64,
    /// Wall time \[s\].
    pub wall_s: f64,
    /// Largest edge strain at its end \[1\].
    pub max_strain: Option<f64>,
    /// Deepest penetration at its end \[m\].
    pub max_penetration_m: Option<f64>,
    /// Anything worth a remark, e.g. "stopped at rest".
    pub note: String,
}
