//! Loops as they are in relaxed fabric [Cirio2017].
//!
//! A knit laid flat is far from rest: its yarns bend and wrap. A small sample
//! is relaxed once, without gravity; its interior gives the shape of the loops
//! that the whole cloth is laid with.

use selvedge_integrator::Outcome;
use selvedge_yarn_model::chart::StitchPattern;
use selvedge_yarn_model::knit::{KnitOptions, LoopGraph, LoopTemplate, TemplateCells, knitted};

use super::BuiltScene;
use super::alone::{alone, load, store};
use super::bodies::cache_folder;
use crate::file::Parsed;
use crate::file::model::{
    Cloth, ClothShape, IntegratorKind, RestShape, Rotation, YarnEntry, YarnLibrary,
};

/// Changes with anything that changes the relaxed loops.
const VERSION: &str = "loops-1";
/// Extent of a sample [m], at least five repeats and at most 24 stitches if
/// that holds them.
const EXTENT: f64 = 0.05;
const MOST: usize = 24;
const REPEATS: usize = 5;
/// Greatest rate of any unknown at which a sample is at rest [m/s].
const AT_REST: f64 = 1e-4;
/// Time after which it is taken as it is [s].
const LIMIT: f64 = 2.0;
/// Before this time nothing has begun to move [s].
const BEGUN: f64 = 0.02;
const STEP: f64 = 2e-3;
/// Damping in proportion to mass [1/s].
const DAMPING: f64 = 20.0;

/// What ended a relaxation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relaxed {
    /// Simulated time [s].
    pub time: f64,
    /// Greatest rate of an unknown in the end [m/s].
    pub rate: f64,
    /// Whether that was under the threshold, not the time over the limit.
    pub at_rest: bool,
}

/// Loops of a pattern relaxed, from the cache or from a sample.
///
/// # Errors
/// A sentence, for charts that increase or decrease, samples that fail and
/// those that do not come to rest.
pub(super) fn relaxed(
    parsed: &Parsed,
    chart: &str,
    pattern: &StitchPattern,
    yarn: &str,
    options: &KnitOptions,
) -> Result<(KnitOptions, Relaxed), String> {
    let repeat = [pattern.multiple().max(1), pattern.rows().max(1)];
    let pitch = [options.template.course, options.template.row];
    let size = [0, 1].map(|k| {
        let within = ((EXTENT / pitch[k]).ceil() as usize).min(MOST);
        within.div_ceil(repeat[k]).max(REPEATS) * repeat[k]
    });
    let size = [size[0] + pattern.plus(), size[1]];
    let laid = pattern
        .chart_of(size[0], size[1])
        .map_err(|e| format!("{chart}: {e}"))?;
    if !LoopGraph::new(&laid).is_regular() {
        return Err(format!(
            "{chart} increases or decreases: its loops can only be `laid`"
        ));
    }
    let content = format!(
        "{VERSION} {laid:?} {:?} {:?} {AT_REST} {LIMIT} {STEP} {DAMPING}",
        options.material, options.template
    );
    let key = blake3::hash(content.as_bytes());
    let path = cache_folder().join(format!("{}.loops", key.to_hex()));
    if let Some(found) = load(&path).and_then(|n| decode(&n, repeat, options)) {
        return at_rest(chart, found);
    }
    let map = knitted(&laid, options).map_err(|e| e.to_string())?;
    let cloth = Cloth {
        name: "sample".to_owned(),
        fabric: String::new(),
        center: [0.0; 3],
        rotation: Rotation::Euler([0.0; 3]),
        stretch: 1.0,
        noise: 0.0,
        noise_seed: 1,
        layer: 0,
        shape: ClothShape::Knit {
            chart: chart.to_owned(),
            stitches: size,
            yarn: yarn.to_owned(),
            course_pitch: Some(pitch[0]),
            wale_pitch: Some(pitch[1]),
            rest_shape: RestShape::Laid,
            sliding: true,
            bind_off: true,
        },
    };
    let damping = options.material.mass_damping.max(DAMPING);
    let sample = alone(parsed, cloth, |scene| {
        scene.body.clear();
        scene.simulation.gravity = [0.0; 3];
        scene.simulation.duration = LIMIT;
        scene.integrator.kind = IntegratorKind::LinearisedEuler;
        scene.integrator.max_step = STEP;
        scene.integrator.min_step = STEP / (1u32 << 20) as f64;
        let entry = scene.yarn.entry(yarn.to_owned());
        let entry = entry.or_insert_with(|| YarnEntry {
            library: YarnLibrary::named(yarn).unwrap_or_default(),
            ..YarnEntry::default()
        });
        entry.mass_damping = Some(damping);
    });
    let failed = |e: String| format!("the sample of {chart} could not be relaxed: {e}");
    let told = |e: crate::diagnostic::Diagnostics| {
        let first = e.findings().first().map(ToString::to_string);
        failed(first.unwrap_or_default())
    };
    let built = BuiltScene::new(sample).map_err(told)?;
    let start = built.geometry.start();
    let made = built.simulation(start, &built.drape_stage());
    let mut simulation = made.map_err(told)?.simulation;
    let points = 3 * map.network.nodes();
    let relaxed = loop {
        let outcome = simulation.advance().map_err(|e| failed(e.to_string()))?;
        let state = simulation.state();
        let (v, slid) = state.v.split_at(points);
        let speeds = v
            .as_chunks::<3>()
            .0
            .iter()
            .map(|v| v[0].hypot(v[1]).hypot(v[2]));
        let slid = slid.iter().map(|s| s.abs());
        let rate = speeds.chain(slid).fold(0.0, f64::max);
        let time = state.time;
        let at_rest = time > BEGUN && rate < AT_REST;
        if at_rest || matches!(outcome, Outcome::Ended(_)) {
            break Relaxed {
                time,
                rate,
                at_rest,
            };
        }
    };
    let q = built.geometry.flat_to_scene(&simulation.state().q);
    let arcs = arcs(&built, &simulation.state().q[points..], &map.network);
    let node = |s: u32| map.network.strands[s as usize].node;
    let found = options
        .measured(&map.map, repeat, node, q.as_chunks::<3>().0, &arcs)
        .map_err(|e| failed(e.to_string()))?;
    // Without a cache the next run relaxes again.
    let _ = store(&path, &encode(&found, &relaxed));
    at_rest(chart, (found, relaxed))
}

/// Refuses the loops of a sample that ran out of time: irregular loops have
/// averages that are shorter than their yarns.
fn at_rest(
    chart: &str,
    (options, relaxed): (KnitOptions, Relaxed),
) -> Result<(KnitOptions, Relaxed), String> {
    let Relaxed {
        time,
        rate,
        at_rest,
    } = relaxed;
    if at_rest {
        return Ok((options, relaxed));
    }
    Err(format!(
        "the sample of {chart} still moves at {rate:.1e} m/s after {time:.1} s (at rest it would \
         be below {AT_REST:.0e}): its loops can only be `laid`"
    ))
}

/// Arc lengths by strand of the network as it was knitted.
fn arcs(
    built: &BuiltScene,
    scalars: &[f64],
    knitted: &selvedge_yarn_model::YarnNetwork,
) -> Vec<f64> {
    let mut arcs = vec![0.0; knitted.strands.len()];
    if let Some(yarns) = &built.geometry.yarns {
        // Yarns and what they pass keep their order when points are renumbered.
        for y in 0..knitted.yarns.len() as u32 {
            for (old, new) in knitted.along(y).zip(yarns.network.along(y)) {
                arcs[old as usize] = scalars[new as usize];
            }
        }
    }
    arcs
}

fn encode(options: &KnitOptions, relaxed: &Relaxed) -> Vec<f64> {
    let at_rest = f64::from(u8::from(relaxed.at_rest));
    let pitch = [options.template.course, options.template.row];
    let mut numbers = vec![relaxed.time, relaxed.rate, at_rest, pitch[0], pitch[1]];
    for t in options.cells.iter().flat_map(|c| c.templates().1) {
        numbers.extend(t.nodes.as_flattened());
        numbers.extend(t.arcs);
    }
    numbers
}

fn decode(
    numbers: &[f64],
    repeat: [usize; 2],
    options: &KnitOptions,
) -> Option<(KnitOptions, Relaxed)> {
    let ([time, rate, at_rest, course, row], rest) = numbers.split_first_chunk::<5>()?;
    let (loops, over) = rest.as_chunks::<32>();
    if !over.is_empty() || loops.len() != repeat[0] * repeat[1] {
        return None;
    }
    let templates = loops.iter().map(|n| LoopTemplate {
        course: *course,
        row: *row,
        nodes: std::array::from_fn(|k| [n[3 * k], n[3 * k + 1], n[3 * k + 2]]),
        arcs: std::array::from_fn(|k| n[24 + k]),
    });
    let cells = TemplateCells::new(repeat[0] as u32, templates.collect()).ok()?;
    let contact = options.template.contact();
    let found = KnitOptions {
        material: options.material.clone(),
        template: LoopTemplate::flat(*course, *row, 1.0, contact),
        cells: Some(cells),
    };
    let relaxed = Relaxed {
        time: *time,
        rate: *rate,
        at_rest: *at_rest > 0.0,
    };
    Some((found, relaxed))
}
