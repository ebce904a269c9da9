//! The doctor finds what was broken on purpose, and where.

mod common;

use selvedge_garment::pattern::{
    EdgeId, Finding, Place, Severity, Stitch, examine, examine_on_body,
};
use selvedge_garment::{GarmentError, GarmentMesh, MeshSettings, Pattern};

fn tshirt() -> Pattern {
    Pattern::from_json(&common::tshirt()).unwrap()
}

fn find<'a>(findings: &'a [Finding], text: &str) -> &'a Finding {
    findings
        .iter()
        .find(|f| f.message.contains(text))
        .unwrap_or_else(|| panic!("no \"{text}\" in {findings:#?}"))
}

/// The T-shirt is sound; its back panels are drawn clockwise.
#[test]
fn sound() {
    let findings = examine(&tshirt());
    assert!(
        findings.iter().all(|f| f.severity == Severity::Note),
        "{findings:?}"
    );
    find(&findings, "`back` is drawn clockwise");
    assert!(examine_on_body(&tshirt(), &common::person).is_empty());
}

/// An outline with a gap, and one that crosses itself, are errors with the
/// panel, the edge and the place; the mesher refuses both.
#[test]
fn outlines() {
    let mut p = tshirt();
    p.panels[0].edges.remove(0);
    let findings = examine(&p);
    let f = find(&findings, "outline is open");
    assert_eq!(
        (f.severity, f.panel.as_deref()),
        (Severity::Error, Some("front"))
    );
    let mesh = GarmentMesh::build(&p, &MeshSettings::default());
    assert!(matches!(mesh, Err(GarmentError::OpenOutline { .. })));

    let mut p = tshirt();
    p.panels[0].vertices.swap(0, 1); // a bow tie
    let findings = examine(&p);
    let f = find(&findings, "meets edge");
    let Some(Place::Panel(at)) = f.place else {
        panic!("{f:?}");
    };
    assert!(at[0].abs() < 1e-9 && (at[1] - 0.22).abs() < 1e-9, "{at:?}");
    let mesh = GarmentMesh::build(&p, &MeshSettings::default());
    assert!(matches!(mesh, Err(GarmentError::OutlineCrosses { .. })));
}

/// Edges without length are reported with their place.
#[test]
fn zero_length() {
    let mut p = tshirt();
    let v = p.panels[0].vertices[0];
    p.panels[0].vertices[1] = v;
    let findings = examine(&p);
    let f = find(&findings, "m long");
    assert_eq!((f.edge, f.place), (Some(0), Some(Place::Panel(v))));
}

/// Stitches: missing edges, unlike lengths, the wrong direction.
#[test]
fn stitches() {
    let mut p = tshirt();
    let edge = |panel, edge| EdgeId { panel, edge };
    p.stitches[0].b = edge(1, 99);
    p.stitches.push(Stitch {
        a: edge(0, 0), // hem, 52 cm
        b: edge(0, 3), // shoulder, 11.9 cm
        right_wrong: false,
    });
    p.stitches[4].right_wrong = true;
    let findings = examine(&p);
    assert_eq!(find(&findings, "edge 99").severity, Severity::Error);
    find(&findings, "ratio 4.3");
    let f = find(&findings, "runs the other way");
    assert!(f.message.starts_with("stitch 4 ") && f.help.contains("remove \"right_wrong\""));
    let mesh = GarmentMesh::build(&p, &MeshSettings::default());
    assert!(matches!(
        mesh,
        Err(GarmentError::BadStitch {
            stitch: 0,
            panel: 1,
            edge: 99
        })
    ));
}

/// A file whose unit is off by 100 is recognised, a lonely panel too.
#[test]
fn unit_and_isolation() {
    let text = String::from_utf8(common::tshirt()).unwrap();
    let wrong = text.replace("\"units_in_meter\": 100", "\"units_in_meter\": 1");
    let findings = examine(&Pattern::from_json(wrong.as_bytes()).unwrap());
    let f = find(&findings, "the garment measures");
    assert!(f.help.contains("divided by 100"), "{}", f.help);

    let mut p = tshirt();
    p.stitches.retain(|s| s.a.panel != 2 && s.b.panel != 2);
    let findings = examine(&p);
    let f = find(&findings, "not sewn");
    assert_eq!(f.panel.as_deref(), Some("left_sleeve_front"));
}

/// A panel pushed into the body is reported with the share that is inside.
#[test]
fn inside_the_body() {
    let mut p = tshirt();
    p.panels[0].translation[2] = 0.0;
    let findings = examine_on_body(&p, &common::person);
    assert_eq!(findings.len(), 1);
    let f = find(&findings, "`front` starts");
    assert!(matches!(f.place, Some(Place::World(_))));
}
