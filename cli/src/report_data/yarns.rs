//! Cloth of yarns in a report.

use selvedge_record::YarnPaths;
use selvedge_record::export::Skin;
use selvedge_scene::whole_skin;

use crate::report::{Field, ReportData, ReportYarns};

/// Triangles of the pictures' tubes.
const PICTURE: usize = 600_000;
/// Triangles of the pictures where yarns are many.
const PICTURE_LIMIT: usize = 2_500_000;
/// Triangles that a browser moves without effort.
const VIEW: usize = 400_000;
/// Triangles of the 3D view where yarns are many.
const VIEW_LIMIT: usize = 1_500_000;

/// Replaces recorded points by centre lines and adds tubes and maps of their
/// segments: the strain of sliding yarns at the end where it is known for every
/// visit, and lengths over those at rest, which are strains where nothing
/// slides. Leaves the data as they are where the ways do not fit together.
pub(super) fn dress(data: &mut ReportData, yarns: &YarnPaths, points: usize, strain: &[f64]) {
    let Ok(picture) = whole_skin(yarns, points, [PICTURE, PICTURE_LIMIT]) else {
        data.notes
            .push("the yarns cannot be drawn: their ways do not fit together".into());
        return;
    };
    let Ok(view) = whole_skin(yarns, points, [VIEW, VIEW_LIMIT]) else {
        return;
    };
    let paths = picture.paths();
    // Visits that the view keeps: its tubes leave out the same ones.
    let stride = view.tubes().stride;
    let (mut kept, mut offsets) = (Vec::new(), vec![0]);
    for yarn in 0..paths.yarn_count() {
        let visits = paths.visits(yarn);
        let last = visits.end - 1;
        kept.extend((visits.start..last).step_by(stride).chain([last]));
        offsets.push(kept.len() as u32);
    }
    let percent = |e: f64| (100.0 * e) as f32;
    let mut history = Vec::new();
    let mut last = None;
    for frame in &mut data.frames {
        let flat = frame.positions.as_flattened().iter();
        let recorded: Vec<f64> = flat.map(|x| f64::from(*x)).collect();
        let centres = picture.centres(&recorded);
        let strains = picture.strains(&recorded);
        frame.positions = kept.iter().map(|&k| centres[k].map(|x| x as f32)).collect();
        history.push(
            kept.iter()
                .map(|&k| percent(strains[k]))
                .collect::<Vec<f32>>(),
        );
        last = Some((recorded, strains));
    }
    let Some((recorded, strains)) = last else {
        return;
    };
    let flat: Vec<f32> = picture
        .positions(&recorded)
        .iter()
        .map(|x| *x as f32)
        .collect();
    let field = |name: &str, values: Vec<f32>| Field {
        name: name.into(),
        unit: "%".into(),
        values,
        diverging: true,
        ..Field::default()
    };
    let segments = &picture.mesh().segments;
    let painted = |name: &str, of: &[f64]| {
        let values = segments.iter().map(|&s| percent(of[s as usize]));
        field(name, values.collect())
    };
    let (mut drawn, mut shown) = (Vec::new(), Vec::new());
    if strain.len() == strains.len() {
        let name = "strain of the yarns";
        drawn.push(painted(name, strain));
        shown.push(field(
            name,
            kept.iter().map(|&k| percent(strain[k])).collect(),
        ));
    }
    let name = "length of segments over that at rest, minus one";
    // One scale for the pictures and all times: that of the end.
    let finite = history
        .last()
        .into_iter()
        .flatten()
        .filter(|e| e.is_finite());
    let mut sizes: Vec<f32> = finite.map(|e| e.abs()).collect();
    let range = (!sizes.is_empty()).then(|| {
        let at = (sizes.len() - 1) * 99 / 100;
        let (_, size, _) = sizes.select_nth_unstable_by(at, f32::total_cmp);
        let size = size.max(1e-3);
        (-size, size)
    });
    drawn.push(Field {
        range,
        ..painted(name, &strains)
    });
    shown.push(Field {
        range,
        values: history.last().cloned().unwrap_or_default(),
        history: match history.len() {
            1 => Vec::new(),
            _ => history,
        },
        ..field(name, Vec::new())
    });
    data.triangle_fields = drawn;
    data.point_fields.clear();
    data.mesh.triangles = picture.triangles().to_vec();
    data.mesh.panel = picture.panels().to_vec();
    data.yarns = Some(ReportYarns {
        offsets,
        radii: yarns.radii.iter().map(|r| *r as f32).collect(),
        panels: yarns.panels.clone(),
        sides: view.tubes().sides,
        samples: view.tubes().samples,
        stride,
        segments: paths.nodes().len() - paths.yarn_count(),
        tube_points: flat.as_chunks::<3>().0.to_vec(),
        segment_fields: shown,
    });
}
