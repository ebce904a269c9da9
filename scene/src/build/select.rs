//! Points of cloth by place, edge, label or yarn.

use super::geometry::{Geometry, Part};
use crate::file::model::{Corner, Edge, Select, YarnEnd};

/// Points of a piece, in the scene's order.
pub(super) fn select(
    geometry: &Geometry,
    part: &Part,
    select: &Select,
    positions: &[[f64; 3]],
) -> Result<Vec<u32>, String> {
    let of_sheet = || {
        part.material.as_deref().ok_or_else(|| {
            format!(
                "cloth `{}` is no sheet and has no corners or edges of this kind",
                part.name
            )
        })
    };
    let chosen: Vec<u32> = match select {
        Select::Corner(corner) => {
            let m = of_sheet()?;
            let nearest = |u: f64, v: f64| {
                let size = extent(m);
                let far = |p: &[f64; 2]| (p[0] - u * size[0]).hypot(p[1] - v * size[1]);
                let best = (0..m.len()).min_by(|a, b| far(&m[*a]).total_cmp(&far(&m[*b])));
                best.map(|i| part.points.start + i as u32)
            };
            let corners: &[[f64; 2]] = match corner {
                Corner::All => &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]],
                Corner::TopLeft => &[[0.0, 1.0]],
                Corner::TopRight => &[[1.0, 1.0]],
                Corner::BottomLeft => &[[0.0, 0.0]],
                Corner::BottomRight => &[[1.0, 0.0]],
            };
            corners.iter().filter_map(|c| nearest(c[0], c[1])).collect()
        }
        Select::Edge(edge) => {
            let m = of_sheet()?;
            let size = extent(m);
            let close = |a: f64, b: f64, s: f64| (a - b).abs() < 1e-9 * s;
            let on = |p: &[f64; 2]| {
                let left = close(p[0], 0.0, size[0]);
                let right = close(p[0], size[0], size[0]);
                let bottom = close(p[1], 0.0, size[1]);
                let top = close(p[1], size[1], size[1]);
                match edge {
                    Edge::Left => left,
                    Edge::Right => right,
                    Edge::Bottom => bottom,
                    Edge::Top => top,
                    Edge::All => left || right || bottom || top,
                }
            };
            let all = (0..m.len()).filter(|i| on(&m[*i]));
            all.map(|i| part.points.start + i as u32).collect()
        }
        Select::Box { min, max } => part
            .points
            .clone()
            .filter(|&p| {
                let x = positions[p as usize];
                (0..3).all(|i| min[i] <= x[i] && x[i] <= max[i])
            })
            .collect(),
        Select::Points(list) => {
            let count = part.points.len() as u32;
            if let Some(p) = list.iter().find(|p| **p >= count) {
                return Err(format!(
                    "point {p} does not exist; cloth `{}` has points 0 to {}",
                    part.name,
                    count.saturating_sub(1)
                ));
            }
            list.iter().map(|p| part.points.start + p).collect()
        }
        Select::Label(label) => part.labels.get(label).cloned().ok_or_else(|| {
            let known: Vec<&str> = part.labels.keys().map(String::as_str).collect();
            format!(
                "no edge is labelled `{label}`; cloth `{}` has {}",
                part.name,
                if known.is_empty() {
                    "no labels".into()
                } else {
                    known.join(", ")
                }
            )
        })?,
        Select::Nearest { to, within } => {
            let far = |p: u32| {
                let x = positions[p as usize];
                (0..3).map(|i| (x[i] - to[i]).powi(2)).sum::<f64>().sqrt()
            };
            let nearest = part
                .points
                .clone()
                .min_by(|a, b| far(*a).total_cmp(&far(*b)));
            part.points
                .clone()
                .filter(|&p| Some(p) == nearest || far(p) <= *within)
                .collect()
        }
        Select::Yarn { index, end } => yarn_ends(geometry, part, *index, *end)?,
    };
    if chosen.is_empty() {
        return Err(format!(
            "no point of cloth `{}` is selected: compare the places with the cloth's `center` and size",
            part.name
        ));
    }
    Ok(chosen)
}

/// Points at the ends of a yarn of a piece.
fn yarn_ends(
    geometry: &Geometry,
    part: &Part,
    index: i64,
    end: YarnEnd,
) -> Result<Vec<u32>, String> {
    if geometry.yarns.is_none() {
        return Err(format!("cloth `{}` is not made of yarns", part.name));
    }
    let all = geometry.yarn_ends();
    let own: Vec<[u32; 2]> = all
        .into_iter()
        .filter(|[first, _]| part.points.contains(first))
        .collect();
    let count = own.len() as i64;
    let place = if index < 0 { count + index } else { index };
    let Some([first, last]) = usize::try_from(place).ok().and_then(|k| own.get(k)) else {
        return Err(format!(
            "yarn {index} does not exist; cloth `{}` has {count} yarns",
            part.name
        ));
    };
    Ok(match end {
        YarnEnd::First => vec![*first],
        YarnEnd::Last => vec![*last],
        YarnEnd::Both => vec![*first, *last],
    })
}

fn extent(material: &[[f64; 2]]) -> [f64; 2] {
    material.iter().fold([0.0; 2], |m, p| {
        [f64::max(m[0], p[0]), f64::max(m[1], p[1])]
    })
}
