use super::{Outline, PanelError};
use crate::{Draft, NetworkBuilder, Visit, YarnMaterial, YarnNetwork};

/// Least distance of a crossing from the border along either yarn, in spacings:
/// the last segment of a yarn must not be too short to bend.
const MARGIN: f64 = 0.25;

/// How panels are woven.
#[derive(Clone, Debug, PartialEq)]
pub struct PanelWeave {
    /// Distance between warps, between wefts \[m\].
    pub spacing: [f64; 2],
    /// Rest length of a warp's and a weft's yarn over the length that it spans
    /// when flat \[1\].
    pub crimp: [f64; 2],
    /// Kinds of yarn.
    pub materials: Vec<YarnMaterial>,
    /// Indices of the warps' materials, repeated without end.
    pub warp_materials: Vec<u32>,
    /// Indices of the wefts' materials, repeated without end.
    pub weft_materials: Vec<u32>,
}

/// A piece of yarn within the outline.
struct Piece {
    /// Place of its line among those of its family.
    line: usize,
    /// Coordinate of the line \[m\].
    at: f64,
    /// Where it begins and ends \[m\].
    span: [f64; 2],
    /// Nodes of its crossings with their coordinates along it and their layer.
    crossed: Vec<(u32, f64, u8)>,
}

/// Weaves the part of a draft that lies within a panel, flat, with warps along
/// y and wefts along x. `None` if nothing crosses.
///
/// Every yarn is cut where it leaves the panel and ends there in a node of its
/// own; a re-entrant outline cuts it into several. Warp and weft cross where
/// both are within the panel, unless an end of either is nearer than a quarter
/// of the spacing. Pieces that cross nothing are left out. As many whole
/// spacings as the bounding box holds lie centred in it.
///
/// # Errors
/// [`PanelError`] for values outside their range.
pub fn woven_panel(
    draft: &Draft,
    weave: &PanelWeave,
    outline: &Outline,
) -> Result<Option<YarnNetwork>, PanelError> {
    // What the rectangle would refuse.
    let mut swatch = crate::Woven::new([1, 1], weave.spacing, YarnMaterial::default());
    swatch.crimp = weave.crimp;
    swatch.materials.clone_from(&weave.materials);
    swatch.warp_materials.clone_from(&weave.warp_materials);
    swatch.weft_materials.clone_from(&weave.weft_materials);
    swatch.build(draft)?;

    let mut families = [0, 1].map(|axis| pieces(outline, axis, weave.spacing[axis]));
    let mut builder = NetworkBuilder::new(weave.materials.clone());
    let front = [0.0, 0.0, 1.0];
    let mut crossings = Vec::new();
    let [warps, wefts] = &mut families;
    // Warps by line, so that a weft finds those that it crosses.
    let first_of = |line: usize, warps: &[Piece]| warps.partition_point(|w| w.line < line);
    let lines = warps.last().map_or(0, |w| w.line + 1);
    for weft in wefts.iter_mut() {
        let margin = MARGIN * weave.spacing[0];
        for line in 0..lines {
            let from = first_of(line, warps);
            let to = first_of(line + 1, warps);
            for warp in &mut warps[from..to] {
                let along = weave.spacing[1] * MARGIN;
                let on_weft = within(weft.span, warp.at, margin);
                if !on_weft || !within(warp.span, weft.at, along) {
                    continue;
                }
                let place = [warp.at, weft.at];
                let node = builder.node([place[0], place[1], 0.0], place, front);
                let over = draft.warp_over(warp.line, weft.line);
                warp.crossed.push((node, weft.at, u8::from(!over)));
                weft.crossed.push((node, warp.at, u8::from(over)));
                crossings.push(node);
            }
        }
    }
    if crossings.is_empty() {
        return Ok(None);
    }
    let kinds = [&weave.warp_materials, &weave.weft_materials];
    for (axis, family) in families.iter().enumerate() {
        for piece in family.iter().filter(|p| !p.crossed.is_empty()) {
            let mut end = |along: f64| {
                let place = if axis == 0 {
                    [piece.at, along]
                } else {
                    [along, piece.at]
                };
                builder.node([place[0], place[1], 0.0], place, front)
            };
            let [low, high] = piece.span;
            let (first, last) = (end(low), end(high));
            let visit = |node: u32, along: f64, layer: u8, held: bool| Visit {
                node,
                layer,
                arc: weave.crimp[axis] * (along - low),
                held,
            };
            let mut visits = vec![visit(first, low, 0, true)];
            let crossed = piece.crossed.iter();
            visits.extend(crossed.map(|(node, along, layer)| visit(*node, *along, *layer, false)));
            visits.push(visit(last, high, 0, true));
            builder.yarn(kinds[axis][piece.line % kinds[axis].len()], visits);
        }
    }
    for node in crossings {
        builder.crossing(node);
    }
    Ok(Some(builder.build()?))
}

/// Pieces of the yarns of a family, warps for axis 0.
fn pieces(outline: &Outline, axis: usize, spacing: f64) -> Vec<Piece> {
    let [low, high] = outline.bounds();
    let extent = high[axis] - low[axis];
    let count = (extent / spacing + 1e-6).floor();
    let start = low[axis] + 0.5 * (extent - count * spacing) + 0.5 * spacing;
    let lines = (0..count as usize).flat_map(|line| {
        let at = start + line as f64 * spacing;
        outline.spans(axis, at).into_iter().map(move |span| Piece {
            line,
            at,
            span,
            crossed: Vec::new(),
        })
    });
    lines.collect()
}

fn within([low, high]: [f64; 2], at: f64, margin: f64) -> bool {
    at >= low + margin && at <= high - margin
}
