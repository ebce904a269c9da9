//! The page: order of its parts, style, limits of its size.

use std::fmt::Write as _;

use super::data::ReportData;
use super::gallery::gallery;
use super::plot::plots;
use super::summary;
use super::tables;
use super::text::{count, escape};
use super::viewer::{Viewer, viewer};

/// Largest page \[bytes\]; the 3D view shows fewer frames when it would be larger.
pub const MAX_BYTES: usize = 25 * 1024 * 1024;

/// Scene text shown at most \[bytes\].
const SCENE_BYTES: usize = 256 * 1024;

pub(super) const STYLE: &str = include_str!("report.css");

/// A page's part: anchor, heading, content.
type Part = (&'static str, &'static str, String);

/// The whole report as one self-contained HTML page of at most about
/// [`MAX_BYTES`].
///
/// A content security policy in the page forbids every request, so opening it
/// never touches the network. All texts are escaped; parts without data are left
/// out.
pub fn render(data: &ReportData) -> String {
    render_within(data, MAX_BYTES)
}

/// [`render`] with another limit; only the 3D view gives way to it.
pub fn render_within(data: &ReportData, max_bytes: usize) -> String {
    let (pictures, maps) = gallery(data);
    let mut parts: Vec<Part> = vec![
        ("pictures", "Drape", pictures),
        ("maps", "Strain and contact maps", maps),
        ("view", "3D view", String::new()),
        ("plots", "Over time", wrapped("plots", plots(&data.series))),
        (
            "assembly",
            "Assembly",
            tables::assembly(&data.stages, &data.summary),
        ),
        (
            "estimates",
            "Error estimates",
            summary::estimates(&data.summary),
        ),
        ("effects", "Effects", tables::effects(&data.summary)),
        ("cost", "Where the time went", tables::cost(&data.summary)),
        ("settings", "Settings", settings(data)),
    ];
    let head = head(data);
    let used = head.len() + STYLE.len() + parts.iter().map(|p| p.2.len()).sum::<usize>() + 8192;
    if !data.frames.is_empty() {
        parts[2].2 = match viewer(data, max_bytes.saturating_sub(used)) {
            Viewer::Html(html) => html,
            Viewer::Absent(why) => format!("<p class=\"card\">{}</p>\n", escape(&why)),
        };
    }
    parts.retain(|p| !p.2.is_empty());
    assemble(data, &head, &parts)
}

fn assemble(data: &ReportData, head: &str, parts: &[Part]) -> String {
    let title = escape(title(data));
    let mut out = String::with_capacity(parts.iter().map(|p| p.2.len()).sum::<usize>() + 65_536);
    let _ = write!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <link rel=\"icon\" href=\"data:,\">\n\
         <title>{title} – selvedge report</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n{head}<nav>"
    );
    for (id, name, _) in parts {
        let _ = write!(out, "<a href=\"#{id}\">{name}</a>");
    }
    out.push_str("</nav>\n<main>\n");
    for (id, name, html) in parts {
        let _ = write!(
            out,
            "<section id=\"{id}\">\n<h2>{name}</h2>\n{html}</section>\n"
        );
    }
    out.push_str("</main>\n</body>\n</html>\n");
    out
}

fn title(data: &ReportData) -> &str {
    if data.title.trim().is_empty() {
        "untitled scene"
    } else {
        &data.title
    }
}

/// Title, status, figures, warnings.
fn head(data: &ReportData) -> String {
    format!(
        "<header>\n<p class=\"brand\">selvedge report</p>\n<h1>{}</h1>\n{}{}{}{}{}{}</header>\n",
        escape(title(data)),
        summary::status(&data.summary),
        summary::tiles(&data.summary),
        tables::defects(&data.summary),
        summary::notes(&data.notes, &data.summary),
        summary::further(&data.summary),
        summary::origin(&data.summary),
    )
}

fn settings(data: &ReportData) -> String {
    let mut out = tables::settings(&data.settings);
    if !data.scene_text.trim().is_empty() {
        let mut end = data.scene_text.len().min(SCENE_BYTES);
        while !data.scene_text.is_char_boundary(end) {
            end -= 1;
        }
        let cut = data.scene_text.len() - end;
        let _ = writeln!(
            out,
            "<details class=\"card\"><summary>Scene file</summary><pre>{}</pre>{}</details>",
            escape(&data.scene_text[..end]),
            if cut > 0 {
                format!(
                    "<p class=\"small\">{} further bytes are not shown.</p>",
                    count(cut as u64)
                )
            } else {
                String::new()
            },
        );
    }
    out
}

fn wrapped(class: &str, html: String) -> String {
    if html.is_empty() {
        html
    } else {
        format!("<div class=\"{class}\">\n{html}</div>\n")
    }
}
