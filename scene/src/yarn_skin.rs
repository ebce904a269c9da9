//! Yarns of a run as they are recorded, and the tubes around them.

use selvedge_record::YarnPaths;
use selvedge_record::export::Skin;
use selvedge_yarn_model::{StrandPaths, TubeMesh, Tubes, YarnError, strand_centres};

use crate::build::{Geometry, Part};

impl Geometry {
    /// Ways of the yarns over the points in the scene's order; empty where
    /// there are none.
    pub fn yarn_paths(&self) -> YarnPaths {
        let Some(yarns) = &self.yarns else {
            return YarnPaths::default();
        };
        if let Some(passages) = &self.passages {
            return passages.paths().clone();
        }
        // Sides belong to points, which have another order in the scene.
        let network = yarns.network.renumbered(&self.order.old_of_new);
        let paths = StrandPaths::of(&network);
        let strands = (0..network.yarns.len() as u32).flat_map(|y| network.along(y));
        let panel = |y: usize| {
            let first = paths.nodes()[paths.visits(y).start];
            let own = |part: &Part| part.points.contains(&first);
            self.parts.iter().position(own).unwrap_or(0) as u16
        };
        YarnPaths {
            arcs: strands.map(|s| network.strands[s as usize].arc).collect(),
            panels: (0..paths.yarn_count()).map(panel).collect(),
            offsets: paths.offsets().to_vec(),
            points: paths.nodes().to_vec(),
            layers: paths.layers().to_vec(),
            radii: paths.radii().to_vec(),
            sides: paths.sides().to_vec(),
        }
    }
}

/// Tubes around recorded yarns.
#[derive(Clone, Debug)]
pub struct YarnSkin {
    paths: StrandPaths,
    arcs: Vec<f64>,
    tubes: Tubes,
    mesh: TubeMesh,
    panels: Vec<u16>,
}

impl YarnSkin {
    /// The finest tubes of at most `budget` triangles around the yarns of a
    /// recording of `points` points; see [`Tubes::within`].
    ///
    /// # Errors
    /// [`YarnError`] for ways that do not fit together.
    pub fn new(yarns: &YarnPaths, points: usize, budget: usize) -> Result<Self, YarnError> {
        let paths = StrandPaths::new(
            points,
            yarns.offsets.clone(),
            yarns.points.clone(),
            yarns.layers.clone(),
            yarns.radii.clone(),
            yarns.sides.clone(),
        )?;
        let tubes = Tubes::within(budget, &paths);
        let mesh = tubes.mesh(&paths);
        let panel = |y: &u32| yarns.panels.get(*y as usize).copied().unwrap_or(0);
        Ok(Self {
            panels: mesh.yarns.iter().map(panel).collect(),
            arcs: yarns.arcs.clone(),
            paths,
            tubes,
            mesh,
        })
    }

    /// The ways.
    pub fn paths(&self) -> &StrandPaths {
        &self.paths
    }

    /// How fine the tubes are.
    pub fn tubes(&self) -> Tubes {
        self.tubes
    }

    /// Their triangles.
    pub fn mesh(&self) -> &TubeMesh {
        &self.mesh
    }

    /// Points of the centre lines [m], visit after visit, for recorded points.
    pub fn centres(&self, recorded: &[f64]) -> Vec<[f64; 3]> {
        strand_centres(&self.paths, recorded.as_chunks::<3>().0)
    }

    /// Strain `l/l_rest − 1` of the segment that begins at each visit, for
    /// recorded points and the arc lengths at rest: what slid along shows as
    /// strain too. NaN at the last visit of a yarn.
    pub fn strains(&self, recorded: &[f64]) -> Vec<f64> {
        let points = recorded.as_chunks::<3>().0;
        let nodes = self.paths.nodes();
        let mut strains = vec![f64::NAN; nodes.len()];
        for yarn in 0..self.paths.yarn_count() {
            let visits = self.paths.visits(yarn);
            for k in visits.start..visits.end - 1 {
                let [a, b] = [nodes[k], nodes[k + 1]].map(|n| points[n as usize]);
                let rest = self.arcs[k + 1] - self.arcs[k];
                strains[k] = (a[0] - b[0]).hypot(a[1] - b[1]).hypot(a[2] - b[2]) / rest - 1.0;
            }
        }
        strains
    }
}

/// The finest tubes within a budget of triangles; where these leave visits out,
/// the finest within a larger limit.
///
/// # Errors
/// As [`YarnSkin::new`].
pub fn whole_skin(
    yarns: &YarnPaths,
    points: usize,
    [budget, limit]: [usize; 2],
) -> Result<YarnSkin, YarnError> {
    let skin = YarnSkin::new(yarns, points, budget)?;
    match skin.tubes.stride {
        1 => Ok(skin),
        _ => YarnSkin::new(yarns, points, limit),
    }
}

impl Skin for YarnSkin {
    fn points(&self) -> usize {
        self.mesh.points
    }

    fn triangles(&self) -> &[[u32; 3]] {
        &self.mesh.triangles
    }

    fn panels(&self) -> &[u16] {
        &self.panels
    }

    fn positions(&self, recorded: &[f64]) -> Vec<f64> {
        let centres = self.centres(recorded);
        self.tubes.points(&self.paths, &centres).into_flattened()
    }
}

/// Triangles that yarns are drawn with where a file is to stay small.
const FINE: usize = 100_000;
/// Triangles of yarns in a file of a single state.
const LIMIT: usize = 1_000_000;

/// Tubes for a file of a single state: fine where that takes few triangles;
/// `None` where tubes through every visit take too many.
///
/// # Errors
/// As [`YarnSkin::new`].
pub fn still_skin(yarns: &YarnPaths, points: usize) -> Result<Option<YarnSkin>, YarnError> {
    let skin = whole_skin(yarns, points, [FINE, LIMIT])?;
    Ok((skin.tubes.stride == 1).then_some(skin))
}
