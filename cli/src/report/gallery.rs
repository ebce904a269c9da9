//! The page's pictures: which views, at which common scale, drawn in parallel.

use std::fmt::Write as _;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::camera::View;
use super::data::{Field, Point, ReportData};
use super::error::ReportError;
use super::picture::{Paint, Picture, PictureStyle, Subject, fit, picture, subject_extent};
use super::quantise::base64;
use super::scalebar::{colour_bar, figures, length_bar};
use super::stats::FieldStats;
use super::text::{count, escape};

/// Width of the small pictures \[pixels\].
const SMALL: u32 = 520;
/// Width of the largest picture \[pixels\].
const LARGE: u32 = 1000;
const SMALL_VIEWS: [View; 4] = [View::Front, View::Side, View::Back, View::Top];
/// Fields with maps; more than these are in the 3D view only.
const MAPS: usize = 12;

struct Job<'a> {
    paint: Paint<'a>,
    view: View,
    size: [u32; 2],
    style: PictureStyle,
}

type Drawn = Result<Picture, ReportError>;

/// The shaded pictures and the maps, as two blocks of HTML.
pub(super) fn gallery(data: &ReportData) -> (String, String) {
    let Some(frame) = data.frames.last() else {
        return Default::default();
    };
    let drawn = data.yarns.as_ref().map(|y| &y.tube_points);
    let positions = drawn.unwrap_or(&frame.positions);
    let subject = |paint| Subject {
        mesh: &data.mesh,
        positions,
        bodies: &data.bodies,
        paint,
    };
    let base = subject(Paint::Fabric);
    let (size, scale) = match common_size(&base) {
        Ok(found) => found,
        Err(error) => {
            return (
                format!("<p class=\"card\">{}</p>", escape(&error.to_string())),
                String::new(),
            );
        }
    };
    let many_panels = data.mesh.panel.iter().any(|&p| p != 0);
    let cloth = if many_panels {
        Paint::Panels
    } else {
        Paint::Fabric
    };
    let small = PictureStyle {
        metres_per_pixel: Some(scale),
        ..PictureStyle::default()
    };
    let large = [LARGE, LARGE * size[1] / size[0]];
    let mut jobs = vec![Job {
        paint: cloth,
        view: View::THREE_QUARTER,
        size: large,
        style: PictureStyle {
            ground_shadow: true,
            ..PictureStyle::default()
        },
    }];
    jobs.extend(SMALL_VIEWS.map(|view| Job {
        paint: cloth,
        view,
        size,
        style: small,
    }));
    let fields: Vec<(&Field, Paint<'_>)> = data
        .triangle_fields
        .iter()
        .map(|f| (f, Paint::Triangles(f)))
        .chain(data.point_fields.iter().map(|f| (f, Paint::Points(f))))
        .collect();
    let map_views = map_views(positions, &data.mesh.triangles);
    for (_, paint) in fields.iter().take(MAPS) {
        jobs.extend(map_views.map(|view| Job {
            paint: *paint,
            view,
            size,
            style: match view {
                // Seen from a corner it is wider than in the views of the scale.
                View::THREE_QUARTER => PictureStyle::default(),
                _ => small,
            },
        }));
    }
    let pictures = draw_all(&jobs, |job| {
        picture(&subject(job.paint), job.view, job.size, &job.style)
    });
    let tagged: Vec<String> = jobs
        .iter()
        .zip(&pictures)
        .map(|(j, p)| image(j, p, &data.title))
        .collect();
    let (shaded, maps) = tagged.split_at(1 + SMALL_VIEWS.len());
    (
        format!("<div class=\"views\">\n{}</div>\n", shaded.concat()),
        map_cards(data, &fields, maps),
    )
}

/// One card a field: two views, colour scale, figures.
fn map_cards(data: &ReportData, fields: &[(&Field, Paint<'_>)], images: &[String]) -> String {
    let mut out = String::new();
    for (i, ((field, paint), pair)) in fields.iter().zip(images.chunks(2)).enumerate() {
        let stats = FieldStats::of(field);
        let all = stats.finite + stats.missing;
        let (places, number) = match (paint, &data.yarns) {
            (Paint::Triangles(_), Some(y)) => ("segments", y.segments),
            (Paint::Triangles(_), None) => ("triangles", all),
            _ => ("points", all),
        };
        let _ = writeln!(
            out,
            "<article class=\"card map\"><h3>{}</h3><div class=\"pair\">{}</div>{}{}<p class=\"small\">{} {places}; bars above the scale: how often each value occurs (square-root height).</p></article>",
            escape(&field.name),
            pair.concat(),
            colour_bar(field, &stats, i),
            figures(field, &stats),
            count(number as u64),
        );
    }
    if out.is_empty() {
        return out;
    }
    let more = fields.len().saturating_sub(MAPS);
    let rest = if more > 0 {
        format!("<p class=\"small\">{more} further fields can be chosen in the 3D view.</p>\n")
    } else {
        String::new()
    };
    format!("<div class=\"maps\">\n{out}</div>\n{rest}")
}

fn image(job: &Job<'_>, drawn: &Drawn, title: &str) -> String {
    let label = job.view.label();
    let what = match job.paint {
        Paint::Fabric | Paint::Panels => "shaded picture".to_owned(),
        Paint::Triangles(f) | Paint::Points(f) => format!("map of {}", f.name),
    };
    match drawn {
        Ok(p) => format!(
            "<figure class=\"picture {label}\"><img alt=\"{}\" width=\"{}\" height=\"{}\" src=\"data:image/png;base64,{}\">{}<figcaption>{label}</figcaption></figure>\n",
            escape(&format!("{what} of {title}, {label} view")),
            p.width,
            p.height,
            base64(p.png.iter().copied()),
            length_bar(p),
        ),
        Err(error) => format!(
            "<figure class=\"picture {label}\"><p>{}</p></figure>\n",
            escape(&error.to_string())
        ),
    }
}

/// Size of the small pictures and the metres per pixel that show every view of them.
fn common_size(subject: &Subject<'_>) -> Result<([u32; 2], f64), ReportError> {
    let mut half = [0.0f64; 2];
    for view in SMALL_VIEWS {
        let e = subject_extent(subject, &view.basis())?;
        half = [half[0].max(e.half[0]), half[1].max(e.half[1])];
    }
    let aspect = (half[1] / half[0]).clamp(0.75, 1.5);
    let size = [SMALL, (f64::from(SMALL) * aspect).round() as u32];
    let extent = super::camera::Extent {
        centre: [0.0; 2],
        half,
    };
    Ok((size, fit(&extent, size, PictureStyle::default().margin)))
}

/// Two views in which the cloth shows most of its area.
fn map_views(points: &[Point], triangles: &[[u32; 3]]) -> [View; 2] {
    let mut seen = [0.0f64; 3];
    for t in triangles {
        let Some([a, b, c]) = corners(points, t) else {
            continue;
        };
        let u: [f64; 3] = std::array::from_fn(|k| b[k] - a[k]);
        let v: [f64; 3] = std::array::from_fn(|k| c[k] - a[k]);
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            seen[k] += (u[i] * v[j] - u[j] * v[i]).abs();
        }
    }
    let [side, top, front] = seen;
    if top > 0.9 * front.max(side) {
        [View::THREE_QUARTER, View::Top]
    } else {
        [View::Front, View::Back]
    }
}

fn corners(points: &[Point], t: &[u32; 3]) -> Option<[[f64; 3]; 3]> {
    let mut out = [[0.0; 3]; 3];
    for (o, &i) in out.iter_mut().zip(t) {
        let p = points
            .get(i as usize)
            .filter(|p| super::camera::drawable(p))?;
        *o = p.map(f64::from);
    }
    Some(out)
}

/// Draws on all processors, the next free one taking the next job; the order of
/// the results is that of the jobs.
fn draw_all<'a>(jobs: &[Job<'a>], draw: impl Fn(&Job<'a>) -> Drawn + Sync) -> Vec<Drawn> {
    let workers = std::thread::available_parallelism()
        .map_or(1, usize::from)
        .min(jobs.len());
    let next = AtomicUsize::new(0);
    let work = || {
        let take = || {
            let i = next.fetch_add(1, Ordering::Relaxed);
            jobs.get(i).map(|job| (i, draw(job)))
        };
        std::iter::from_fn(take).collect::<Vec<_>>()
    };
    let mut drawn: Vec<(usize, Drawn)> = std::thread::scope(|scope| {
        let handles: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        let join = |h: std::thread::ScopedJoinHandle<'_, Vec<_>>| match h.join() {
            Ok(drawn) => drawn,
            Err(panic) => std::panic::resume_unwind(panic),
        };
        handles.into_iter().flat_map(join).collect()
    });
    drawn.sort_by_key(|d| d.0);
    drawn.into_iter().map(|d| d.1).collect()
}
