use super::{Outline, PanelError};
use crate::chart::StitchPattern;
use crate::knit::{KnitOptions, Knitted, knitted_within};

/// Part of a stitch's cell that must lie inside: round-off at the border of a
/// whole number of stitches must not count.
const CELL: f64 = 0.98;

/// Knits the part of a pattern that lies within a panel, flat, with wales along
/// y. `None` if no stitch fits.
///
/// A stitch is knitted if its cell, a course wide and a row high, lies within
/// the outline with its corners and its centre. As many whole cells as the
/// bounding box holds lie centred in it. A row is cut where it leaves the
/// panel; its yarn ends in a node of its own half a stitch out. Heads without
/// child and feet without parent end in two nodes of a single yarn. Stitches
/// that hold no other and are held by none are left out.
///
/// # Errors
/// [`PanelError`] for charts that do not fit a width and for values outside
/// their range.
pub fn knitted_panel(
    pattern: &StitchPattern,
    options: &KnitOptions,
    outline: &Outline,
) -> Result<Option<Knitted>, PanelError> {
    let (course, row) = (options.template.course, options.template.row);
    if pattern.multiple() == 0 {
        let name = pattern.name().to_owned();
        return Err(PanelError::FixedChart { name });
    }
    let [low, high] = outline.bounds();
    let whole = |k: usize, pitch: f64| ((high[k] - low[k]) / pitch + 1e-6).floor();
    let cells = [whole(0, course), whole(1, row)];
    if cells[0] < 1.0 || cells[1] < 1.0 {
        return Ok(None);
    }
    // A column and a row more all around: the chart's own edges, which would
    // be a cast-on, a bind-off and turning yarns, are never within.
    let [across, up] = cells.map(|n| n as usize + 2);
    let repeats = across
        .saturating_sub(pattern.plus())
        .div_ceil(pattern.multiple());
    let width = pattern.plus() + repeats.max(1) * pattern.multiple();
    let chart = pattern.chart_of(width, up)?;
    // Centre of the chart's first loop, whose cell reaches up by a row.
    let origin = [
        0.5 * (low[0] + high[0] - cells[0] * course) - 0.5 * course,
        0.5 * (low[1] + high[1] - cells[1] * row) - row,
    ];
    let inside = |centre: [f64; 2]| {
        let middle = [origin[0] + centre[0], origin[1] + centre[1] + 0.5 * row];
        let corner = |x: f64, y: f64| {
            let (x, y) = (0.5 * CELL * course * x, 0.5 * CELL * row * y);
            outline.contains([middle[0] + x, middle[1] + y])
        };
        corner(-1.0, -1.0)
            && corner(1.0, -1.0)
            && corner(-1.0, 1.0)
            && corner(1.0, 1.0)
            && corner(0.0, 0.0)
    };
    let Some(mut knitted) = knitted_within(&chart, options, |_, centre| inside(centre))? else {
        return Ok(None);
    };
    for p in &mut knitted.network.points {
        *p = [p[0] + origin[0], p[1] + origin[1], p[2]];
    }
    for p in &mut knitted.network.flat {
        *p = [p[0] + origin[0], p[1] + origin[1]];
    }
    for l in &mut knitted.map.loops {
        l.centre = [l.centre[0] + origin[0], l.centre[1] + origin[1]];
    }
    Ok(Some(knitted))
}
