//! Reading scene files: defaults, overrides, exact places of mistakes.

use std::path::Path;

use selvedge_scene::diagnostic::Diagnostics;
use selvedge_scene::file::{self, Parsed, model};

fn parse(text: &str) -> Result<Parsed, Diagnostics> {
    file::parse(text, Path::new("s.toml"), &[])
}

fn with(text: &str, set: &[(&str, &str)]) -> Result<Parsed, Diagnostics> {
    let set: Vec<_> = set
        .iter()
        .map(|(k, v)| (k.to_string(), v.to_string()))
        .collect();
    file::parse(text, Path::new("s.toml"), &set)
}

/// The findings, one line each.
fn lines(text: &str) -> Vec<String> {
    let findings = parse(text).expect_err("a mistake should be found");
    findings.findings().iter().map(|f| f.to_string()).collect()
}

const SHEET: &str = "[[cloth]]\nkind = \"sheet\"\n";

/// The smallest scene is filled with the documented defaults.
#[test]
fn defaults() {
    let scene = parse(SHEET).unwrap().scene;
    assert_eq!(scene.name, "s");
    assert_eq!(scene.simulation.duration, 2.0);
    assert_eq!(scene.simulation.gravity, [0.0, -9.81, 0.0]);
    assert_eq!(scene.integrator.max_step, 1e-3);
    assert_eq!(scene.integrator.min_step, 1e-3 / 1048576.0);
    assert_eq!(scene.integrator.newton_tolerance, 1e-2);
    assert_eq!(scene.integrator.newton_iterations, 5);
    assert_eq!(scene.integrator.line_search_halvings, 5);
    assert_eq!(scene.integrator.step_splitting, 0.75);
    assert_eq!(scene.relaxation.step_fraction, 1.0 / 16.0);
    assert_eq!(scene.stop.percentile, 99.0);
    assert_eq!(scene.solver.tolerance, 1e-2);
    assert_eq!(scene.solver.max_iterations, 500);
    assert_eq!(scene.solver.matrix, model::MatrixKind::Dual);
    assert_eq!(scene.contact.self_contact, model::Switch::Auto);
    assert_eq!(scene.contact.stiffness, 100.0);
    assert_eq!(scene.output.directory, Path::new("out/s"));
    assert_eq!(scene.cloth[0].name, "cloth");
    assert_eq!(scene.cloth[0].fabric, "cotton-poplin");
    let settings = scene.effective();
    assert_eq!(settings["solver.preconditioner"], "auto");
    assert_eq!(settings["cloth.0.size"], serde_json::json!([1.0, 1.0]));
    let paper = format!("{SHEET}[integrator]\nresidual_norm = \"paper\"\n");
    assert_eq!(
        parse(&paper).unwrap().scene.integrator.newton_tolerance,
        1e-3
    );
}

/// Every precision goes with conjugate gradients; single precision throughout
/// with nothing else.
#[test]
fn precisions() {
    for (name, value) in [
        ("mixed", model::Precision::Mixed),
        ("f64", model::Precision::F64),
        ("f32", model::Precision::F32),
    ] {
        let parsed = with(SHEET, &[("solver.precision", name)]).unwrap();
        assert_eq!(parsed.scene.solver.precision, value);
    }
    for kind in ["direct", "refined"] {
        let text = format!("{SHEET}[solver]\nkind = \"{kind}\"\nprecision = \"f32\"\n");
        assert_eq!(
            lines(&text),
            [
                "s.toml:5:13: `solver.precision` = \"f32\" needs `solver.kind` = \"cg\": the others \
                 work in double precision (`solver.precision = \"mixed\"` or `\"f64\"`)"
            ]
        );
    }
}

/// Mistakes are found at their line and column, with what to do.
#[test]
fn places_of_mistakes() {
    let cases: &[(&str, &str)] = &[
        (
            "[solver]\ntolerence = 1e-3\n",
            "s.toml:4:1: unknown key `tolerence` in `solver` (did you mean `tolerance`? known \
             keys: kind, preconditioner, tolerance, forcing, max_iterations, precision, matrix, \
             product)",
        ),
        (
            "[slover]\n",
            "s.toml:3:2: unknown key `slover` (did you mean `solver`? known keys: name, \
             description, simulation, cloth, body, pin, attachment, button, buttonhole, fabric, yarn, topology, cut, \
             mesh, contact, damping, integrator, relaxation, stop, solver, assembly, assemble, watchdog, output)",
        ),
        (
            "[solver]\nnewton_tolerance = 1e-3\n",
            "s.toml:4:1: unknown key `newton_tolerance` in `solver` (`newton_tolerance` belongs \
             into `[integrator]`)",
        ),
        (
            "[solver]\ntolerance = 2\n",
            "s.toml:4:13: `solver.tolerance` = 2 is out of range (it has to be greater than 0 \
             and less than 1)",
        ),
        (
            "[solver]\npreconditioner = \"block-jacoby\"\n",
            "s.toml:4:18: `solver.preconditioner`: there is no \"block-jacoby\" (did you mean \
             `block-jacobi`? one of auto, none, diagonal, block-jacobi, node-jacobi, node-ic, incomplete-cholesky, chebyshev, multigrid)",
        ),
        (
            "[contact]\nthickness = \"2 mm\"\n",
            "s.toml:4:13: `contact.thickness`: expected a number in m, found the string \
             \"2 mm\" (write 0.002: the unit is always m)",
        ),
        (
            "[contact]\nself = 3\n",
            "s.toml:4:8: `contact.self`: expected true, false or \"auto\", found the number 3",
        ),
        (
            "[integrator]\nnewton_iterations = 0.5\n",
            "s.toml:4:21: `integrator.newton_iterations`: expected a whole number, found the \
             number 0.5",
        ),
        (
            "[[body]]\nkind = \"sphere\"\n",
            "s.toml:3:1: `radius` is missing in `body.0` (add `radius = …`: Radius.)",
        ),
        (
            "[[body]]\nradius = 1\n",
            "s.toml:3:1: `kind` is missing in `body.0` (add `kind = \"…\"`, one of sphere, \
             capsule, ellipsoid, box, plane, union, mesh, mannequin)",
        ),
        (
            "[[body]]\nkind = \"box\"\nsize = [1, 1, 1]\nradius = 0.1\n",
            "s.toml:6:1: unknown key `radius` in `body.0` (`radius` belongs to kind = \
             \"sphere\", this is \"box\")",
        ),
        (
            "[[body]]\nkind = \"shpere\"\nradius = 1\n",
            "s.toml:4:8: `body.0.kind`: there is no \"shpere\" (did you mean `sphere`? one of \
             sphere, capsule, ellipsoid, box, plane, union, mesh, mannequin)",
        ),
        (
            "[[body]]\nkind = \"union\"\nshapes = [{ kind = \"sphere\", radius = -1 }]\n",
            "s.toml:5:39: `body.0.shapes.0.radius` = -1 m is out of range (it has to be greater \
             than 0 and at most 100 m; m, not cm or mm)",
        ),
        (
            "[pin]\nselect = { corner = \"all\" }\n",
            "s.toml:3:1: `pin`: expected a list of tables, found a table (write `[[pin]]`, with \
             two brackets)",
        ),
        (
            "[[pin]]\nkind = \"fixed\"\nselect = { corner = \"all\", points = [1] }\n",
            "s.toml:5:10: `pin.0.select` needs exactly one key, it has 2 (one of corner, edge, \
             box, points, label, nearest, yarn)",
        ),
        (
            "[[pin]]\nkind = \"fixed\"\ncloth = \"cloht\"\nselect = { edge = \"top\" }\n",
            "s.toml:5:9: `pin.0.cloth`: there is no cloth \"cloht\" (did you mean `cloth`? \
             known: cloth)",
        ),
        (
            "[fabric.mine]\nlibrary = \"denim-12oz\"\ndensity = 407\n",
            "s.toml:5:11: `fabric.mine.density` = 407 kg/m² is out of range (it has to be \
             greater than 0 and at most 5 kg/m²; kg/m², not g/m²: 150 g/m² is 0.15)",
        ),
        (
            "[fabric.mine]\nlibrary = \"denim-12oz\"\nmembrane = { coupling = 1e5 }\n",
            "s.toml:5:25: `fabric.mine.membrane.coupling` = 100000 is impossible (it has to be \
             between -7035.6236 and 7035.6236 N/m (the square root of warp times weft))",
        ),
        (
            "[simulation]\nduration = nan\n",
            "s.toml:4:12: `simulation.duration` = NaN is not a finite number (it has to be at \
             least 0 and at most 100000 s; s, not ms)",
        ),
        (
            "[[cloth]]\nkind = \"mesh\"\nfile = \"absent.obj\"\n",
            "s.toml:5:8: there is no file absent.obj (paths are relative to the folder of the \
             scene file)",
        ),
        (
            "[[body]]\nkind = \"plane\"\nmotion = [{ time = 1 }, { time = 1 }]\n",
            "s.toml:5:34: `body.0.motion.1.time` = 1 s does not come after 1 s (times of \
             keyframes have to increase)",
        ),
        (
            "[solver\n",
            "s.toml:3:8: not valid TOML: unclosed table, expected `]`",
        ),
        (
            "[mesh]\nedge_length = 3\n",
            "s.toml:4:15: the edge length 3 m is longer than the sheet of 1 m × 1 m (a tenth of \
             the shorter side or less; lengths are in m)",
        ),
    ];
    for (text, want) in cases {
        let text = format!("{SHEET}{text}");
        assert_eq!(lines(&text), [*want], "{text}");
    }
}

/// All mistakes of a file are reported, in the order of the text.
#[test]
fn all_findings() {
    let text = "name = 3\n[[cloth]]\nkind = \"sheet\"\nsize = [1]\nfabric = \"silk\"\ncolor = 1\n\
                [[pin]]\nkind = \"line\"\nselect = { points = [-1, 2.5] }\n[solver]\nkind = \"lu\"\n";
    let found = lines(text);
    let places: Vec<&str> = found
        .iter()
        .map(|l| l.split(": ").next().unwrap())
        .collect();
    assert_eq!(
        places,
        [
            "s.toml:1:8",
            "s.toml:4:8",
            "s.toml:5:10",
            "s.toml:6:1",
            "s.toml:7:1",
            "s.toml:9:22",
            "s.toml:9:26",
            "s.toml:11:8"
        ],
        "{found:#?}"
    );
}

/// Columns count characters, not bytes.
#[test]
fn columns_are_characters() {
    let text = format!("{SHEET}[fabric]\n\"Wäsche\" = {{ densty = 1 }}\n");
    let unknown = lines(&text).pop().unwrap();
    assert!(
        unknown.starts_with("s.toml:4:14: unknown key `densty`"),
        "{unknown}"
    );
}

/// Missing and empty files are said to be so.
#[test]
fn missing_and_empty() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("none.toml");
    let error = file::read(&path, &[]).unwrap_err().to_string();
    assert!(error.contains("cannot read the scene"), "{error}");
    for text in ["", "  \n\n"] {
        std::fs::write(&path, text).unwrap();
        let error = file::read(&path, &[]).unwrap_err().to_string();
        assert!(error.contains("the file is empty"), "{error}");
    }
    std::fs::write(&path, [0xff, 0xfe, 0x00]).unwrap();
    let error = file::read(&path, &[]).unwrap_err().to_string();
    assert!(error.contains("byte 0 is not UTF-8"), "{error}");
    assert_eq!(
        lines("name = \"x\"\n"),
        [
            "s.toml: the scene has no cloth (add `[[cloth]]` with `kind = \"sheet\"`, \"mesh\", \
             \"pattern\", \"knit\" or \"woven\")"
        ]
    );
    std::fs::write(folder.path().join("empty.obj"), "").unwrap();
    std::fs::write(&path, "[[cloth]]\nkind = \"mesh\"\nfile = \"empty.obj\"\n").unwrap();
    let error = file::read(&path, &[]).unwrap_err().to_string();
    assert!(error.contains(":3:8: the file "), "{error}");
    assert!(error.contains("is empty"), "{error}");
}

/// `--set` overrides any key, adds tables, and reaches into lists.
#[test]
fn overrides() {
    let text = format!("{SHEET}[[cloth]]\nkind = \"sheet\"\nname = \"b\"\n");
    let scene = with(
        &text,
        &[
            ("solver.tolerance", "1e-5"),
            ("solver.kind", "direct"),
            ("cloth.0.size", "[2, 3]"),
            ("cloth.b.fabric", "linen"),
            ("output.directory", "/tmp/some where"),
            ("name", "2026"),
            ("contact.self", "false"),
            ("fabric.x", "{ library = \"linen\" }"),
        ],
    )
    .unwrap()
    .scene;
    assert_eq!(scene.solver.tolerance, 1e-5);
    assert_eq!(scene.solver.kind, model::SolverKind::Direct);
    assert_eq!(scene.cloth[1].fabric, "linen");
    assert_eq!(scene.output.directory, Path::new("/tmp/some where"));
    assert_eq!(scene.name, "2026");
    assert_eq!(scene.contact.self_contact, model::Switch::Off);
    assert!(scene.fabric.contains_key("x"));
    match &scene.cloth[0].shape {
        model::ClothShape::Sheet { size, .. } => assert_eq!(*size, [2.0, 3.0]),
        other => panic!("{other:?}"),
    }
}

/// Mistakes in `--set` point into the override.
#[test]
fn faulty_overrides() {
    let line = |key: &str, value: &str| with(SHEET, &[(key, value)]).unwrap_err().to_string();
    assert_eq!(
        line("solver.tolerence", "1e-3")
            .split(" known")
            .next()
            .unwrap(),
        "--set solver.tolerence=1e-3:1:8: unknown key `tolerence` in `solver` (did you mean \
         `tolerance`?"
    );
    assert_eq!(
        line("solver.tolerance", "7"),
        "--set solver.tolerance=7:1:18: `solver.tolerance` = 7 is out of range (it has to be \
         greater than 0 and less than 1)"
    );
    assert_eq!(
        line("cloth.4.size", "[1, 1]"),
        "--set cloth.4.size=[1, 1]:1:7: no item `4`: the list has 1, numbered from 0"
    );
    assert_eq!(
        line("cloth.0.size", "[1, "),
        "--set cloth.0.size=[1, :1:17: the value is not valid TOML: unclosed array, expected `]`"
    );
    assert!(line("", "1").contains("is not a path"));
    assert!(line("cloth.0.kind.x", "1").contains("has no keys"));
}

/// Thick contact on a fine mesh is a warning, not an error.
#[test]
fn thickness_warning() {
    let parsed = parse(&format!("{SHEET}edge_length = 0.002\n")).unwrap();
    assert_eq!(
        parsed.warnings.to_string(),
        "s.toml:3:15: warning: `contact.thickness` = 0.001 m is more than a quarter of the edge \
         length 0.002 m of `cloth.0`: neighbours repel each other (`contact.thickness` = 0.0005 \
         or less)"
    );
}

/// Inline fabrics change what their base has.
#[test]
fn inline_fabrics() {
    let text = format!(
        "{SHEET}fabric = \"a\"\n[fabric.a]\nlibrary = \"linen\"\nmembrane.shear = 77\n\
         damping = {{ bending = 0 }}\n[fabric.b]\ndensity = 0.2\nfriction = 0.1\n\
         [fabric.b.membrane]\nform = \"isotropic\"\nstiffness = 100\npoisson = 0.3\n\
         [fabric.b.bending]\nform = \"isotropic\"\nrigidity = 1e-5\n"
    );
    let scene = parse(&text).unwrap().scene;
    let linen = scene.fabric_named("linen").unwrap();
    let a = scene.fabric_named("a").unwrap();
    assert_eq!(a.membrane.shear, 77.0);
    assert_eq!(a.membrane.warp, linen.membrane.warp);
    assert_eq!(a.bending_damping, 0.0);
    assert_eq!(a.membrane_damping, linen.membrane_damping);
    assert_eq!(a.name, "a");
    let b = scene.fabric_named("b").unwrap();
    assert_eq!(b.membrane.coupling, 0.3 * b.membrane.warp);
    assert_eq!(b.friction, 0.1);
    assert!(scene.fabric_named("c").is_err());
    let bare = format!("{SHEET}[fabric.a]\ndensity = 0.1\n");
    assert_eq!(
        lines(&bare),
        [
            "s.toml:3:1: `fabric.a` lacks `membrane` (give it, or a base to start from: `library = \
          \"cotton-poplin\"`)"
        ]
    );
}

/// A scene with every table reads, and its effective values read back alike.
#[test]
fn everything_at_once() {
    let text = r#"
name = "all"
description = "one of each"
[simulation]
gravity = [0, -1.62, 0]
[[cloth]]
name = "s"
kind = "sheet"
size = [1, 0.5]
points = [21, 11]
lattice = "alternating"
rotation = { axis = [1, 0, 0], angle = 90 }
[[body]]
kind = "capsule"
from = [0, 0, 0]
to = [0, 1, 0]
radius = 0.1
radius_to = 0.05
motion = [{ time = 0 }, { time = 1, rotation = { axis = [0, 1, 0], angle = 3600 } }]
[[body]]
kind = "union"
smooth = 0.01
shapes = [
    { kind = "ellipsoid", radii = [0.1, 0.2, 0.3], rotation = [0, 90, 0] },
    { kind = "box", size = [1, 1, 1], rounding = 0.1 },
]
[[body]]
kind = "plane"
[[body]]
kind = "mannequin"
[[pin]]
kind = "plane"
normal = [0, 1, 0]
select.box = { min = [0, 0, 0], max = [1, 1, 1] }
[[pin]]
kind = "line"
direction = [1, 0, 0]
select.nearest = { to = [0, 0, 0] }
[[pin]]
kind = "fixed"
select.points = [0, 1, 2]
[[attachment]]
select.edge = "left"
body = "body"
"#;
    let parsed = parse(text).unwrap();
    assert!(parsed.warnings.is_empty(), "{}", parsed.warnings);
    let scene = parsed.scene;
    let json = serde_json::to_value(&scene).unwrap();
    let mut back: model::SceneFile = serde_json::from_value(json).unwrap();
    back.folder.clone_from(&scene.folder);
    assert_eq!(back, scene);
    assert_eq!(
        parsed.locations.line_column("pin.2.select.points"),
        Some(("s.toml", 41, 17))
    );
    assert_eq!(scene.body[3].name, "body-3");
}

/// Findings can be drawn with their source and given as JSON.
#[test]
fn shown_to_people_and_programs() {
    let findings = parse(&format!("{SHEET}[solver]\nkind = \"lu\"\n")).unwrap_err();
    let drawn = findings.render(100, false);
    assert!(drawn.contains("s.toml:4:8"), "{drawn}");
    assert!(drawn.contains("kind = \"lu\""), "{drawn}");
    assert!(
        drawn.contains("help: one of cg, direct, refined"),
        "{drawn}"
    );
    let json = findings.to_json();
    assert_eq!(json[0]["code"], "scene::unknown-name");
    assert_eq!(json[0]["line"], 4);
    assert_eq!(json[0]["column"], 8);
    assert_eq!(json[0]["path"], "solver.kind");
}
