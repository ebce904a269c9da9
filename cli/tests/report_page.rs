//! The report page as a whole: self-contained, bounded in size, robust.

use selvedge_cli::report::{
    AssemblyStage, Field, ReportData, ReportFrame, ReportMesh, ReportSurface, Series, render,
    render_within,
};
use serde_json::json;

#[path = "../examples/support/sheet.rs"]
mod sheet;

/// Every element that could load something: none but `data:` pictures.
#[test]
fn the_page_needs_no_network() {
    let html = render(&sheet::demo(24, 4));
    assert!(!html.contains("http:") && !html.contains("https:") && !html.contains("//cdn"));
    for attribute in ["src=\"", "href=\"", "url(", "@import", "import("] {
        for rest in html.split(attribute).skip(1) {
            let target: String = rest.chars().take(5).collect();
            let local = target.starts_with("data:") || target.starts_with('#');
            assert!(local, "{attribute}{target}");
        }
    }
    assert!(html.contains("default-src 'none'"));
    for part in [
        "pictures",
        "maps",
        "view",
        "plots",
        "assembly",
        "estimates",
        "effects",
        "cost",
        "settings",
    ] {
        assert!(html.contains(&format!("<section id=\"{part}\">")), "{part}");
    }
}

/// Names, reasons, notes and scene text from users are never markup.
#[test]
fn user_text_is_not_markup() {
    let evil = "</script><img src=x onerror=alert(1)>\"'&";
    let mut data = sheet::demo(6, 2);
    data.title = evil.into();
    data.scene_text = evil.into();
    data.notes = vec![evil.into()];
    data.summary = json!({ "status": evil, "reason": evil, "version": evil, evil: { evil: evil },
        "defects": [{ "kind": evil, "at": [evil], "parts": [evil] }], "stages": { evil: 1.0 }, "error": { "space": { "how": evil }, "decisions": [{ "setting": evil, "value": evil, "why": evil }],
        "effectivity": [{ "case": evil, "value": 1.0 }] },
        "effects": [{ "name": evil, "reason": evil, "on": true }] });
    data.settings = json!({ evil: { evil: [evil] }, "plain": evil });
    data.mesh.panel_names = vec![evil.into()];
    data.bodies[0].name = evil.into();
    for f in data
        .triangle_fields
        .iter_mut()
        .chain(&mut data.point_fields)
    {
        (f.name, f.unit) = (evil.into(), evil.into());
    }
    for s in &mut data.series {
        (s.group, s.name, s.unit) = (evil.into(), evil.into(), evil.into());
    }
    for s in &mut data.stages {
        (s.name, s.note) = (evil.into(), evil.into());
    }
    let html = render(&data);
    assert!(!html.contains("<img src=x"));
    // One closing tag for each script element of ours.
    assert_eq!(
        html.matches("<script").count(),
        html.matches("</script>").count()
    );
}

/// With less room there are fewer frames, never a larger page; the choice is told.
#[test]
fn the_size_is_bounded() {
    let data = sheet::demo(60, 40);
    let full = render(&data);
    assert!(full.contains("All 40 recorded frames."));
    let without = render_within(&data, 0);
    assert!(without.contains("The 3D view is left out"));
    for part in [0.3, 0.8] {
        let limit = without.len() + ((full.len() - without.len()) as f64 * part) as usize;
        let html = render_within(&data, limit);
        assert!(html.len() <= limit, "{} of {limit}", html.len());
        assert!(
            html.len() * 10 > limit * 8,
            "room is used: {} of {limit}",
            html.len()
        );
        assert!(html.contains(" of 40 recorded frames, evenly chosen"));
    }
}

/// The same data give the same page.
#[test]
fn the_page_is_repeatable() {
    let data = sheet::demo(20, 3);
    assert_eq!(render(&data), render(&data));
}

/// Empty, degenerate and non-finite data give a page, not a panic.
#[test]
fn any_data_give_a_page() {
    let nan = f32::NAN;
    let frame = |positions: Vec<[f32; 3]>| ReportFrame {
        time: f64::NAN,
        positions,
    };
    let triangle = ReportMesh {
        triangles: vec![[0, 1, 2]],
        ..ReportMesh::default()
    };
    let field = |values: Vec<f32>| Field {
        values,
        range: Some((nan, 1.0)),
        ..Field::default()
    };
    let cases = [
        ReportData::default(),
        ReportData {
            frames: vec![frame(vec![])],
            ..ReportData::default()
        },
        ReportData {
            frames: vec![frame(vec![[nan; 3]; 3])],
            mesh: triangle.clone(),
            ..ReportData::default()
        },
        ReportData {
            frames: vec![frame(vec![[1.0; 3]; 3])],
            mesh: triangle.clone(),
            ..ReportData::default()
        },
        ReportData {
            frames: vec![frame(vec![[1.0; 3]; 3])],
            ..ReportData::default()
        },
        ReportData {
            frames: vec![
                frame(vec![[3e38, -3e38, 0.0]]),
                frame(vec![[0.0; 3], [1.0, 0.0, nan], [0.0, 1.0, 0.0]]),
            ],
            mesh: ReportMesh {
                triangles: vec![[0, 1, 2], [7, 8, 9]],
                panel: vec![9, 65_535],
                ..triangle.clone()
            },
            bodies: vec![
                ReportSurface::default(),
                ReportSurface {
                    points: vec![[nan; 3], [0.0, -1.0, 0.0]],
                    triangles: vec![[0, 1, 5]],
                    motion: vec![vec![], vec![[0.0; 3]; 9]],
                    ..ReportSurface::default()
                },
            ],
            triangle_fields: vec![
                field(vec![]),
                field(vec![nan, f32::INFINITY]),
                field(vec![2.0]),
            ],
            point_fields: vec![Field {
                history: vec![vec![], vec![1.0]],
                ..field(vec![5.0; 3])
            }],
            series: vec![Series::default()],
            stages: vec![AssemblyStage {
                duration_s: f64::NAN,
                max_strain: Some(f64::NAN),
                ..AssemblyStage::default()
            }],
            notes: vec![String::new(); 300],
            summary: json!([1, 2]),
            settings: json!("no table"),
            ..ReportData::default()
        },
    ];
    for data in cases {
        let html = render(&data);
        assert!(html.starts_with("<!DOCTYPE html>") && html.ends_with("</html>\n"));
        let drawn = html.split("<script>").next().unwrap_or_default();
        assert!(!drawn.contains("NaN") && !drawn.contains(">inf"), "{drawn}");
    }
}
