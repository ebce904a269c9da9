//! Cloth made of yarns.

use std::path::Path;

use selvedge_energy::{Batch, EnergyBatch, MassBatch, StencilEnergy};
use selvedge_integrator::{Fixed, Inertia, Pins, Term};
use selvedge_linsolve::BlockFilter;
use selvedge_yarn_model::chart::{BUILT_IN_CHARTS, Chart, Knitout, StitchPattern, read_knitout};
use selvedge_yarn_model::knit::{KnitLoop, KnitOptions, LoopGraph, knitted_part};
use selvedge_yarn_model::{
    Draft, FrictionSettings, InertiaForce, JammingBending, Locked, LockedBending, LockedGravity,
    LockedInertia, LockedStretch, ParallelYarns, PlainBending, RayleighDamping, SegmentInertia,
    SlidingFriction, StitchLength, StitchWrapping, Woven, Yarn, YarnGravity, YarnMaterial,
    YarnNetwork, YarnShear, YarnStretch, lumped_point_masses, lumped_scalar_masses,
    segment_damping, stencil_damping,
};

use super::{gauge, rest_shape, yarn_panels};
use crate::diagnostic::{Diagnostics, Finding, SourceText};
use crate::driver::Progress;
use crate::file::Parsed;
use crate::file::model::{Cloth, ClothShape, RestShape, yarn_named};

/// All yarns of a scene, in the solver's order.
#[derive(Clone)]
pub struct YarnCloth {
    /// The network.
    pub network: YarnNetwork,
    /// Whether arc lengths are unknowns.
    pub sliding: bool,
}

/// Yarns of a piece of cloth, flat and centred in the x-z plane with the right
/// side up; `None` for cloth of another kind. Warnings go to the findings.
pub(super) fn network(
    parsed: &Parsed,
    index: usize,
    cloth: &Cloth,
    progress: &mut (dyn Progress + Send),
    findings: &mut Diagnostics,
) -> Option<Result<YarnNetwork, Diagnostics>> {
    let fail = |key: &str, message: String| {
        let path = format!("cloth.{index}.{key}");
        Diagnostics::from(parsed.locations.error("scene::yarns", &path, message))
    };
    let yarn =
        |key: &str, name: &str| find_yarn(parsed, name).map_err(|message| fail(key, message));
    gauge::examine(parsed, index, cloth, findings);
    let built = match &cloth.shape {
        ClothShape::Knit {
            chart,
            stitches,
            yarn: name,
            course_pitch,
            wale_pitch,
            bind_off,
            rest_shape,
            ..
        } => yarn("yarn", name).and_then(|material| {
            let mut options = knit_options(material, *course_pitch, *wale_pitch);
            if *rest_shape == RestShape::Relaxed {
                let of = relaxed_options(parsed, chart, &options);
                options = of.map_err(|m| fail("rest_shape", m))?;
            }
            let chart = match pattern_named(parsed, chart).map_err(|m| fail("chart", m))? {
                Construction::Pattern(pattern) => {
                    let [width, rows] = *stitches;
                    let of_size = pattern.chart_of(width, rows);
                    of_size.map_err(|e| fail("chart", format!("{chart}: {e}")))?
                }
                Construction::Chart(fixed, warnings) => {
                    findings.extend(warnings);
                    if let Some(warning) = ignored_size(parsed, index, *stitches, &fixed) {
                        findings.push(warning);
                    }
                    fixed
                }
            };
            // Row 0 of the loops is the cast-on, the last one the bind-off.
            let last = LoopGraph::new(&chart).loops.iter().map(|l| l.row).max();
            let kept = |l: &KnitLoop| *bind_off || Some(l.row) != last;
            let knitted = knitted_part(&chart, &options, |l, _| kept(l));
            knitted
                .map(|k| k.network)
                .map_err(|e| fail("chart", e.to_string()))
        }),
        ClothShape::Woven {
            draft,
            yarns,
            spacing,
            crimp,
            yarn: name,
            weft_yarn,
            ..
        } => yarn("yarn", name).and_then(|warp| {
            let draft = draft_named(parsed, draft).map_err(|m| fail("draft", m))?;
            let mut woven = Woven::new(*yarns, [*spacing; 2], warp);
            woven.crimp = [*crimp; 2];
            if let Some(name) = weft_yarn {
                woven.materials.push(yarn("weft_yarn", name)?);
                woven.weft_materials = vec![1];
            }
            woven
                .build(&draft)
                .map_err(|e| fail("yarns", e.to_string()))
        }),
        ClothShape::KnitMesh { .. }
        | ClothShape::KnitPattern { .. }
        | ClothShape::WovenMesh { .. } => {
            let network = yarn_panels::network(parsed, index, cloth, progress);
            let settings = &parsed.scene.topology;
            let tail = settings.changes && settings.tail > 0.0;
            return Some(network.map(|n| match tail {
                true => n.with_tails(settings.tail),
                false => n,
            }));
        }
        _ => return None,
    };
    let settings = &parsed.scene.topology;
    let tail = settings.changes.then_some(settings.tail);
    let tailed = |n: YarnNetwork| match tail {
        Some(tail) if tail > 0.0 => n.with_tails(tail),
        _ => n,
    };
    Some(built.map(tailed).map(laid_flat))
}

/// A yarn of the scene or of the library.
pub(super) fn find_yarn(parsed: &Parsed, name: &str) -> Result<YarnMaterial, String> {
    yarn_named(&parsed.scene.yarn, name).ok_or_else(|| {
        let known = parsed.scene.yarn.keys().map(String::as_str);
        let known: Vec<&str> = known.chain(LIBRARY).collect();
        format!("there is no yarn `{name}`; there are {}", known.join(", "))
    })
}

/// Loops of a yarn at a gauge [m], or at the gauge that suits it.
pub(super) fn knit_options(
    material: YarnMaterial,
    course: Option<f64>,
    wale: Option<f64>,
) -> KnitOptions {
    let course = course.unwrap_or(5.2 * material.radius);
    KnitOptions::with_gauge(material, course, wale.unwrap_or(0.75 * course), 1.0)
}

/// Loops of a chart that repeats, relaxed.
pub(super) fn relaxed_options(
    parsed: &Parsed,
    chart: &str,
    options: &KnitOptions,
) -> Result<KnitOptions, String> {
    match pattern_named(parsed, chart)? {
        Construction::Pattern(pattern) => rest_shape::relaxed(chart, &pattern, options),
        Construction::Chart(..) => Err(format!(
            "{chart} is of fixed size: its loops can only be `laid`"
        )),
    }
}

/// Yarns of the library.
const LIBRARY: [&str; 4] = ["sweater", "shirt", "pullover", "weaving"];

/// A warning where the scene asks for another size than a chart of fixed size has.
fn ignored_size(
    parsed: &Parsed,
    index: usize,
    [width, rows]: [usize; 2],
    chart: &Chart,
) -> Option<Finding> {
    let path = format!("cloth.{index}.stitches");
    let own = [chart.cast_on(), chart.rows().len()];
    if own == [width, rows] || !parsed.locations.is_set(&path) {
        return None;
    }
    let message = format!(
        "[{width}, {rows}] is ignored: {} has a fixed size of [{}, {}]",
        chart.name(),
        own[0],
        own[1]
    );
    let warning = parsed.locations.warning("scene::yarns", &path, message);
    Some(warning.help("leave `stitches` out, or write the size of the file"))
}

/// A knitout file's chart, with its warnings where they stand.
fn fixed(name: &str, text: &str, knitout: Knitout) -> Construction {
    let source = SourceText::new(name, text);
    let mut findings = Diagnostics::new();
    for w in knitout.warnings {
        let warning = Finding::warning("scene::knitout", name, w.message);
        findings.push(warning.at(&source, w.at.span));
    }
    Construction::Chart(knitout.chart, findings)
}

/// What a chart's name stands for.
pub(super) enum Construction {
    /// A pattern that repeats.
    Pattern(StitchPattern),
    /// A chart of fixed size, and what its file says that is left out.
    Chart(Chart, Diagnostics),
}

pub(super) fn pattern_named(parsed: &Parsed, name: &str) -> Result<Construction, String> {
    if BUILT_IN_CHARTS.contains(&name) {
        let pattern = StitchPattern::built_in(name).map_err(|e| e.to_string())?;
        return Ok(Construction::Pattern(pattern));
    }
    let text = file_text(parsed, name, &BUILT_IN_CHARTS)?;
    if name.ends_with(".k") || name.ends_with(".knitout") || text.starts_with(";!knitout") {
        return read_knitout(&text)
            .map(|k| fixed(name, &text, k))
            .map_err(|e| format!("{name}: {e}"));
    }
    let pattern = StitchPattern::parse(&text).map_err(|e| format!("{name}:{e}"))?;
    Ok(Construction::Pattern(pattern))
}

pub(super) fn draft_named(parsed: &Parsed, name: &str) -> Result<Draft, String> {
    const BUILT_IN: [&str; 4] = ["plain", "twill-2-2", "satin-5", "basket-2-2"];
    if BUILT_IN.contains(&name) {
        return Draft::named(name).map_err(|e| e.to_string());
    }
    let text = file_text(parsed, name, &BUILT_IN)?;
    text.parse::<Draft>().map_err(|e| format!("{name}:{e}"))
}

fn file_text(parsed: &Parsed, name: &str, built_in: &[&str]) -> Result<String, String> {
    let path = parsed.scene.resolve(Path::new(name));
    std::fs::read_to_string(&path).map_err(|e| {
        format!(
            "`{name}` is neither built in ({}) nor a file that can be read: {e}",
            built_in.join(", ")
        )
    })
}

/// From the x-y plane of the construction, right side towards +z, to that of
/// sheets.
fn laid_flat(mut network: YarnNetwork) -> YarnNetwork {
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    for p in &network.flat {
        for i in 0..2 {
            low[i] = low[i].min(p[i]);
            high[i] = high[i].max(p[i]);
        }
    }
    let [cx, cy] = [0, 1].map(|i| 0.5 * (low[i] + high[i]));
    for p in &mut network.points {
        *p = [p[0] - cx, p[2], cy - p[1]];
    }
    for n in &mut network.front {
        *n = [n[0], n[2], -n[1]];
    }
    for p in &mut network.flat {
        *p = [p[0] - low[0], p[1] - low[1]];
    }
    network
}

/// Coordinates by which corners and edges are selected [m]: what is within a
/// stitch or a spacing of an edge lies on it.
pub(super) fn selectable(network: &YarnNetwork, cloth: &Cloth) -> Vec<[f64; 2]> {
    let margin = match &cloth.shape {
        ClothShape::Woven { spacing, .. } => [0.75 * spacing; 2],
        ClothShape::Knit {
            course_pitch,
            wale_pitch,
            ..
        } => {
            let radius = network.materials.first().map_or(0.0, |m| m.radius);
            let course = course_pitch.unwrap_or(5.2 * radius);
            [0.6 * course, 0.6 * wale_pitch.unwrap_or(0.75 * course)]
        }
        _ => [0.0; 2],
    };
    let high = network.flat.iter().fold([0.0; 2], |h, p| {
        [f64::max(h[0], p[0]), f64::max(h[1], p[1])]
    });
    let snap = |x: f64, i: usize| match x {
        x if x <= margin[i] => 0.0,
        x if x >= high[i] - margin[i] => high[i],
        x => x,
    };
    let snapped = network.flat.iter().map(|p| [snap(p[0], 0), snap(p[1], 1)]);
    snapped.collect()
}

/// Energies, inertia and unknowns of yarns.
pub(super) struct YarnParts {
    pub terms: Vec<Term>,
    pub inertia: Inertia,
    pub owners: Vec<u32>,
}

/// Which losses act.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Dissipation {
    pub damping: bool,
    pub friction: bool,
}

impl Dissipation {
    /// All of them, as in motion.
    pub const ALL: Self = Self {
        damping: true,
        friction: true,
    };
}

/// Elastic terms, each with the damping of its yarns.
struct Elastic<'a> {
    network: &'a YarnNetwork,
    damped: bool,
    terms: Vec<Box<dyn EnergyBatch>>,
}

impl Elastic<'_> {
    fn add<E, const N: usize, const M: usize>(&mut self, name: &str, energy: E)
    where
        E: StencilEnergy<N, M> + 'static,
    {
        let beta = stencil_damping(&energy, self.network);
        self.push(Box::new(Batch::new(name, energy)), beta);
    }

    fn add_locked<E, const N: usize, const M: usize, const P: usize, const X: usize>(
        &mut self,
        name: &str,
        energy: Locked<E, N, M, P, X>,
    ) where
        E: StencilEnergy<N, M> + 'static,
    {
        // Its points do not tell which of their yarns it is.
        let beta = stencil_damping(energy.energy(), self.network);
        self.push(Box::new(Batch::new(name, energy)), beta);
    }

    fn push(&mut self, batch: Box<dyn EnergyBatch>, beta: Vec<f64>) {
        if batch.is_empty() {
            return;
        }
        let damped = self.damped && beta.iter().any(|b| *b > 0.0);
        self.terms.push(match damped {
            true => Box::new(RayleighDamping::added_to(batch, beta)),
            false => batch,
        });
    }
}

impl YarnCloth {
    /// Everything that the yarns call for, under gravity [m/s²].
    pub(super) fn parts(&self, gravity: [f64; 3], dissipates: Dissipation) -> YarnParts {
        let n = &self.network;
        let yarn = |of: fn(&YarnMaterial) -> f64| n.materials.iter().map(of).fold(0.0, f64::max);
        let knit = !n.stitches.is_empty();
        let mut elastic = Elastic {
            network: n,
            damped: dissipates.damping,
            terms: Vec::new(),
        };
        let pulled = gravity.iter().any(|g| *g != 0.0);
        match self.sliding {
            true => elastic.add("yarn stretch", YarnStretch::new(n)),
            false => elastic.add_locked("yarn stretch", LockedStretch::stretch(n)),
        }
        if yarn(|m| m.bending_modulus) > 0.0 {
            let (jams, plain) = (|y: &Yarn| y.jams, |y: &Yarn| !y.jams);
            if self.sliding {
                elastic.add("yarn bending", JammingBending::of_yarns(n, jams));
                elastic.add("yarn bending", PlainBending::of_yarns(n, plain));
            } else {
                let jamming = LockedBending::<true>::of_yarns(n, jams);
                elastic.add_locked("yarn bending", jamming);
                let plain = LockedBending::<false>::of_yarns(n, plain);
                elastic.add_locked("yarn bending", plain);
            }
        }
        if knit && yarn(|m| m.wrapping) > 0.0 {
            elastic.add("stitch wrapping", StitchWrapping::new(n));
        }
        if !n.crossings.is_empty() && yarn(|m| m.shear_modulus) > 0.0 {
            elastic.add("yarn shear", YarnShear::new(n));
        }
        if self.sliding {
            elastic.add("parallel yarns", ParallelYarns::new(n));
            elastic.add("stitch length", StitchLength::new(n));
        }
        let mut terms = elastic.terms;
        if self.sliding
            && dissipates.friction
            && let Some(friction) = SlidingFriction::new(n, FrictionSettings::default())
        {
            terms.push(Box::new(Batch::new("yarn friction", friction)));
        }
        if pulled {
            terms.push(match self.sliding {
                true => Box::new(Batch::new("yarn gravity", YarnGravity::new(n, gravity))),
                false => {
                    let gravity = LockedGravity::gravity(n, gravity);
                    Box::new(Batch::new("yarn gravity", gravity))
                }
            });
        }
        let coupled: Box<dyn MassBatch> = match self.sliding {
            true => Box::new(SegmentInertia::new(n, InertiaForce::Full)),
            false => Box::new(LockedInertia::new(n)),
        };
        YarnParts {
            terms: terms.into_iter().map(Term::fixed).collect(),
            inertia: Inertia {
                masses: lumped_point_masses(n),
                scalar_masses: match self.sliding {
                    true => lumped_scalar_masses(n),
                    false => Vec::new(),
                },
                coupled: Some(coupled),
                damping: match dissipates.damping {
                    true => segment_damping(n),
                    false => Vec::new(),
                },
                ..Inertia::default()
            },
            owners: match self.sliding {
                true => n.owners(),
                false => Vec::new(),
            },
        }
    }

    /// Least and largest damping of the yarns in proportion to mass [1/s] and to
    /// stiffness [s].
    pub(super) fn damping(&self) -> [[f64; 2]; 2] {
        let of: [fn(&YarnMaterial) -> f64; 2] = [|m| m.mass_damping, |m| m.stiffness_damping];
        of.map(|of| {
            let all = self.network.materials.iter().map(of);
            let low = all.clone().fold(f64::INFINITY, f64::min);
            [low, all.fold(0.0, f64::max)]
        })
    }

    /// Friction coefficient of the yarn at every point.
    pub(super) fn point_friction(&self) -> Vec<f64> {
        let n = &self.network;
        let first = (0..n.nodes() as u32).map(|p| n.material_of(n.strands_of(p).start).friction);
        first.collect()
    }

    /// Adds the arc lengths that are held to what is prescribed.
    pub(super) fn hold(&self, pins: &mut Option<Pins>) {
        let first = 3 * self.network.nodes() as u32;
        let held = self.network.strands.iter().zip(first..);
        for (_, place) in held.filter(|(s, _)| s.held) {
            let none = || Pins {
                filter: BlockFilter::new(),
                points: Vec::new(),
                trajectory: Box::new(Fixed(Vec::new())),
            };
            pins.get_or_insert_with(none).filter.fix_scalar(place);
        }
    }
}
