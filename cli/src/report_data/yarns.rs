//! Cloth of yarns in a report.

use selvedge_record::YarnPaths;
use selvedge_record::export::Skin;
use selvedge_scene::YarnSkin;

use crate::report::{Field, ReportData, ReportYarns};

/// Triangles of the pictures' tubes.
const PICTURE: usize = 600_000;
/// Triangles that a browser moves without effort.
const VIEW: usize = 400_000;
/// Triangles of the 3D view where yarns are many.
const VIEW_LIMIT: usize = 1_500_000;

/// Replaces recorded points by centre lines and adds tubes and their strain;
/// leaves the data as they are where the ways do not fit together.
pub(super) fn dress(data: &mut ReportData, yarns: &YarnPaths, points: usize) {
    let Ok(picture) = YarnSkin::new(yarns, points, PICTURE) else {
        data.notes
            .push("the yarns cannot be drawn: their ways do not fit together".into());
        return;
    };
    let view = [VIEW, VIEW_LIMIT].map(|budget| YarnSkin::new(yarns, points, budget));
    let view = match view {
        [Ok(fine), Ok(coarse)] if fine.tubes().stride > 1 => coarse,
        [Ok(fine), _] => fine,
        _ => return,
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
    let field = |values: Vec<f32>| Field {
        name: "strain of the yarns (length over rest length at the start)".into(),
        unit: "%".into(),
        values,
        diverging: true,
        ..Field::default()
    };
    let segments = &picture.mesh().segments;
    let mut drawn = field(
        segments
            .iter()
            .map(|&s| percent(strains[s as usize]))
            .collect(),
    );
    // One scale for the pictures and all times.
    let mut sizes: Vec<f32> = history
        .iter()
        .flatten()
        .filter(|e| e.is_finite())
        .map(|e| e.abs())
        .collect();
    if !sizes.is_empty() {
        let at = (sizes.len() - 1) * 99 / 100;
        let (_, size, _) = sizes.select_nth_unstable_by(at, f32::total_cmp);
        let size = size.max(1e-3);
        drawn.range = Some((-size, size));
    }
    let shown = Field {
        history: match history.len() {
            1 => Vec::new(),
            _ => history.clone(),
        },
        range: drawn.range,
        ..field(history.pop().unwrap_or_default())
    };
    data.triangle_fields = vec![drawn];
    data.point_fields.clear();
    data.mesh.triangles = picture.triangles().to_vec();
    data.mesh.panel = picture.panels().to_vec();
    data.yarns = Some(ReportYarns {
        offsets,
        radii: yarns.radii.iter().map(|r| *r as f32).collect(),
        panels: yarns.panels.clone(),
        sides: view.tubes().sides,
        samples: view.tubes().samples,
        tube_points: flat.as_chunks::<3>().0.to_vec(),
        segment_fields: vec![shown],
    });
}
