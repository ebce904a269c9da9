//! Loops as they are in fabric at rest [Cirio2017].
//!
//! A knit laid flat is far from rest: its yarns bend and wrap. The smallest
//! repeating rectangle of its pattern is brought to rest once, without borders
//! and gravity, and the whole cloth is laid with its loops.

use selvedge_yarn_model::chart::StitchPattern;
use selvedge_yarn_model::knit::{KnitOptions, LoopGraph, LoopTemplate, TemplateCells};

use super::alone::{load, store};
use super::bodies::cache_folder;

/// Changes with anything that changes the relaxed loops.
const VERSION: &str = "loops-2";

/// Loops of a pattern at rest, from the cache or solved for.
///
/// # Errors
/// A sentence, for charts that increase or decrease and loops without a state
/// of rest.
pub(super) fn relaxed(
    chart: &str,
    pattern: &StitchPattern,
    options: &KnitOptions,
) -> Result<KnitOptions, String> {
    let size = [pattern.multiple().max(1), 2 * pattern.rows().max(1)];
    let laid = pattern
        .chart_of(size[0] + pattern.plus(), size[1])
        .map_err(|e| format!("{chart}: {e}"))?;
    if !LoopGraph::new(&laid).is_regular() {
        return Err(format!(
            "{chart} increases or decreases: its loops can only be `laid`"
        ));
    }
    let content = format!(
        "{VERSION} {size:?} {laid:?} {:?} {:?}",
        options.material, options.template
    );
    let key = blake3::hash(content.as_bytes());
    let path = cache_folder().join(format!("{}.loops", key.to_hex()));
    if let Some(found) = load(&path).and_then(|n| decode(&n, options)) {
        return Ok(found);
    }
    let (found, _) = options
        .at_rest(pattern)
        .map_err(|e| format!("{chart}: {e}; its loops can only be `laid`"))?;
    // Without a cache the next run solves again.
    let _ = store(&path, &encode(&found));
    Ok(found)
}

fn encode(options: &KnitOptions) -> Vec<f64> {
    let pitch = [options.template.course, options.template.row];
    let columns = options.cells.as_ref().map_or(0, |c| c.templates().0);
    let spacing = options.material.spacing.unwrap_or(0.0);
    let mut numbers = vec![spacing, f64::from(columns), pitch[0], pitch[1]];
    for t in options.cells.iter().flat_map(|c| c.templates().1) {
        numbers.extend(t.nodes.as_flattened());
        numbers.extend(t.arcs);
    }
    numbers
}

fn decode(numbers: &[f64], options: &KnitOptions) -> Option<KnitOptions> {
    let ([spacing, columns, course, row], rest) = numbers.split_first_chunk::<4>()?;
    let (loops, over) = rest.as_chunks::<32>();
    if !over.is_empty() {
        return None;
    }
    let templates = loops.iter().map(|n| LoopTemplate {
        course: *course,
        row: *row,
        nodes: std::array::from_fn(|k| [n[3 * k], n[3 * k + 1], n[3 * k + 2]]),
        arcs: std::array::from_fn(|k| n[24 + k]),
    });
    let cells = TemplateCells::new(*columns as u32, templates.collect()).ok()?;
    let mut material = options.material.clone();
    material.spacing = Some(*spacing);
    Some(KnitOptions {
        material,
        template: LoopTemplate::flat(*course, *row, 1.0, options.template.contact()),
        cells: Some(cells),
    })
}
