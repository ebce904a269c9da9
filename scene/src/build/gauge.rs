//! Gauges at which yarns lie inside each other.

use super::yarns::find_yarn;
use crate::diagnostic::Diagnostics;
use crate::file::Parsed;
use crate::file::model::{Cloth, ClothShape};

/// Least distance of stitches in a row over the yarn's radius: the two legs of a
/// loop, half a stitch apart, beside each other.
const COURSE: f64 = 4.0;

/// Least distance of rows over the yarn's radius: one yarn above the other.
const WALE: f64 = 2.0;

/// Least distance of parallel woven yarns over their radius.
const WOVEN: f64 = 2.0;

/// Warns of neighbours that are closer than their radii allow.
///
/// Bounds are those below which nothing fits, not those of cloth that can be made.
pub(super) fn examine(parsed: &Parsed, index: usize, cloth: &Cloth, findings: &mut Diagnostics) {
    let mut least = |key: &str, value: f64, yarn: &str, factor: f64, what: &str| {
        // A yarn that does not exist is an error of its own.
        let Ok(radius) = find_yarn(parsed, yarn).map(|m| m.radius) else {
            return;
        };
        let least = factor * radius;
        // What was written as the least is not below it by rounding.
        if value >= least * (1.0 - 1e-9) {
            return;
        }
        let message = format!(
            "at {value} m {what} of `{yarn}`, {radius} m in radius, lie inside each other; \
             from {least} m on they fit"
        );
        let path = format!("cloth.{index}.{key}");
        findings.push(parsed.locations.warning("scene::gauge", &path, message));
    };
    match &cloth.shape {
        ClothShape::Knit {
            yarn,
            course_pitch,
            wale_pitch,
            ..
        } => knitted(&mut least, yarn, *course_pitch, *wale_pitch),
        ClothShape::KnitMesh { knit, .. } | ClothShape::KnitPattern { knit, .. } => {
            knitted(&mut least, &knit.yarn, knit.course_pitch, knit.wale_pitch);
        }
        ClothShape::Woven {
            spacing,
            yarn,
            weft_yarn,
            ..
        }
        | ClothShape::WovenMesh {
            spacing,
            yarn,
            weft_yarn,
            ..
        } => {
            let radius = |y: &String| find_yarn(parsed, y).map_or(0.0, |m| m.radius);
            let thicker = weft_yarn.as_ref().filter(|w| radius(w) > radius(yarn));
            let of = thicker.unwrap_or(yarn);
            least("spacing", *spacing, of, WOVEN, "neighbouring yarns");
        }
        _ => {}
    }
}

/// Pitches that are left out suit the yarn, or follow from the course's.
fn knitted(
    least: &mut impl FnMut(&str, f64, &str, f64, &str),
    yarn: &str,
    course: Option<f64>,
    wale: Option<f64>,
) {
    if let Some(course) = course {
        least("course_pitch", course, yarn, COURSE, "the legs of loops");
    }
    if let Some(wale) = wale {
        least("wale_pitch", wale, yarn, WALE, "rows of loops");
    }
}
