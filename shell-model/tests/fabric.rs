//! Fabric files, the library and the reader of measured tables.

use proptest::prelude::*;
use selvedge_shell_model::fabric::{
    FabricError, MembraneModuli, SourceKind, library, read_fabric, read_measured,
};

/// Every file of the library reads, is valid under its own name, says where
/// its numbers come from, and bends on the scale of cloth in every direction.
#[test]
fn library_is_sound() {
    assert!(library::names().len() >= 12);
    assert!(library::names().is_sorted());
    for name in library::names() {
        let record = library::record(name).unwrap_or_else(|e| panic!("{e}"));
        let fabric = &record.fabric;
        assert_eq!(fabric.name, name);
        assert!(!record.description.is_empty(), "{name}");
        assert!(record.provenance.source.is_some(), "{name}");
        assert_eq!(
            record.provenance.kind,
            Some(SourceKind::Estimated),
            "{name}"
        );
        assert_eq!((fabric.drag, fabric.membrane_damping), (5.0, 1e-2));
        assert_eq!(fabric.bending_damping, 1e-1);
        let c = nalgebra::Matrix3::from(fabric.membrane.matrix());
        assert!(c.symmetric_eigenvalues().min() > 0.0, "{name}");
        for degrees in (0..180).step_by(5) {
            let length = fabric.bending_length(f64::from(degrees).to_radians());
            assert!((5e-3..60e-3).contains(&length), "{name}: {length} m");
        }
    }
}

/// Strip moduli read off a library fabric give its stiffness matrix back.
#[test]
fn anisotropy_round_trip() {
    for name in library::names() {
        let m = library::get(name).unwrap().membrane;
        let at = |degrees: f64| m.modulus(degrees.to_radians());
        let nu_uv = m.poisson();
        let back = MembraneModuli::from_moduli(at(0.0), at(90.0), at(45.0), nu_uv).unwrap();
        for (a, b) in [
            (m.warp, back.warp),
            (m.weft, back.weft),
            (m.shear, back.shear),
            (m.coupling, back.coupling),
        ] {
            assert!((a / b - 1.0).abs() < 1e-10, "{name}: {a} against {b}");
        }
    }
}

/// A misspelt name is answered with the name that was meant.
#[test]
fn misspelt_name() {
    match library::get("silk-charmuse").unwrap_err() {
        FabricError::UnknownFabric { nearest, .. } => {
            assert_eq!(nearest.as_deref(), Some("silk-charmeuse"));
        }
        other => panic!("{other}"),
    }
}

const GOOD: &str = "name = \"x\"\ndensity = 0.1\n[membrane]\nwarp = 10\nweft = 10\nshear = 5\n\
                    [bending]\nwarp = 1e-6\nweft = 1e-6\n";

/// Messages of faulty files carry place, finding and what is allowed.
#[test]
fn messages() {
    let message = |from: &str, to: &str| {
        read_fabric(&GOOD.replacen(from, to, 1), "f.toml")
            .unwrap_err()
            .to_string()
    };
    assert!(read_fabric(GOOD, "f.toml").is_ok());
    assert_eq!(
        message("density = 0.1", "densty = 0.1"),
        "f.toml:2:1: unknown key `densty` (did you mean `density`?); known: name, description, \
         source, year, kind, density, thickness, friction, membrane, bending, damping"
    );
    assert_eq!(
        message("shear = 5", "shear = \"5\""),
        "f.toml:6:9: `membrane.shear`: expected a number, found the string \"5\""
    );
    assert_eq!(
        message("shear = 5", "shear = 5\ncoupling = 11"),
        "f.toml:7:12: membrane.coupling = 11.0: must be between -10.0000 and 10.0000 N/m \
         (the square root of warp times weft)"
    );
    assert_eq!(
        message(
            "density = 0.1",
            "density = { value = -1.0, kind = \"measured\" }"
        ),
        "f.toml:2:11: density = -1.0: must be positive and finite"
    );
    assert!(message("shear = 5\n", "").contains("`membrane.shear` is missing"));
    assert!(message("weft = 1e-6", "weft = = 3").starts_with("f.toml:9:8: "));
    assert!(
        message("shear", "form = \"mudoli\"\nshear").contains("one of direct, moduli, isotropic")
    );
}

/// What a file says about one number is kept with it.
#[test]
fn provenance_of_one_quantity() {
    let text = GOOD.replace(
        "shear = 5",
        "shear = { value = 5, kind = \"measured\", source = \"KES-FB1\", year = 2021 }",
    );
    let record = read_fabric(&text, "f.toml").unwrap();
    let about = &record.quantities["membrane.shear"];
    assert_eq!(about.kind, Some(SourceKind::Measured));
    assert_eq!(about.year, Some(2021));
    assert_eq!(record.fabric.membrane.shear, 5.0);
}

const MEASURED: &str = r#"{"density": 0.3,
 "stretching": [[200,10,900,40],[1,0,1,1],[1,0,1,1],[1,0,1,1],[1,0,1,1],[1,0,1,1]],
 "bending": [[3e-5,1,1,1,1],[4e-5,1,1,1,1],[5e-5,1,1,1,1]]}"#;

/// The small-strain row and the small-curvature column become the fabric.
#[test]
fn measured_table() {
    let fabric = read_measured(MEASURED, "m.json")
        .unwrap()
        .to_fabric("m")
        .unwrap();
    let m = fabric.membrane;
    assert_eq!(
        (m.warp, m.weft, m.shear, m.coupling),
        (200.0, 900.0, 20.0, 10.0)
    );
    let b = fabric.bending;
    assert_eq!((b.warp, b.bias, b.weft), (3e-5, 4e-5, 5e-5));
    let short = MEASURED.replace("[1,0,1,1],[1,0,1,1]],", "[1,0,1,1]],");
    assert_eq!(
        read_measured(&short, "m.json").unwrap_err().to_string(),
        "m.json:0:0: `stretching`: expected 6 rows of 4 numbers, found a list of 5"
    );
}

/// The two measured fabrics that ARCSim users have read and are valid.
#[test]
fn measured_files() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/fabrics");
    let Ok(entries) = std::fs::read_dir(folder) else {
        println!("skipped: {folder} is absent");
        return;
    };
    let mut count = 0;
    for entry in entries {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        let origin = path.display().to_string();
        let fabric = read_measured(&text, &origin)
            .unwrap()
            .to_fabric("m")
            .unwrap();
        let length = fabric.bending_length_warp();
        assert!((0.02..0.03).contains(&length), "{origin}: {length} m");
        count += 1;
    }
    assert!(count > 0, "no fabric in {folder}");
}

proptest! {
    /// Cut, spliced and random text is an error or a valid fabric, never a panic.
    #[test]
    fn never_panics(cut in 0usize..200, at in 0usize..200, noise in ".{0,12}") {
        for text in [GOOD, MEASURED] {
            let mut text: String = text.to_owned();
            text.truncate(cut.max(1).min(text.len()));
            text.insert_str(at.min(text.len()), &noise);
            if let Ok(record) = read_fabric(&text, "f") {
                prop_assert!(record.fabric.validate().is_ok());
            }
            if let Ok(measured) = read_measured(&text, "f") {
                let _ = measured.to_fabric("m").map(|f| f.validate().unwrap());
            }
        }
        let _ = read_fabric(&noise, "f");
        let _ = read_measured(&noise, "f");
    }

    /// Any numbers give a positive definite sheet or an error.
    #[test]
    fn moduli_are_definite(e in prop::array::uniform3(-1e4f64..1e4), nu in -3f64..3.0) {
        if let Ok(m) = MembraneModuli::from_moduli(e[0], e[1], e[2], nu) {
            let c = nalgebra::Matrix3::from(m.matrix());
            prop_assert!(c.symmetric_eigenvalues().min() > 0.0);
        }
    }
}

/// Stress, tangent, moments and their derivatives are differences of the
/// energy, which is that of the membrane term for stretched and sheared cloth
/// and `½ B l²` for a bent strip; strains that no cloth can have are refused.
#[test]
fn states_of_a_fabric() {
    use selvedge_energy::{DofLayout, EvalPoint};
    use selvedge_shell_model::{DampingKind, membrane_term, sheet};

    let fabric = library::get("denim-12oz").unwrap();
    let (e, l) = ([0.02, -0.015, 0.01], [30.0, -50.0]);
    let state = fabric.evaluate(e, l).unwrap();
    let energy = |e, l| {
        let s = fabric.evaluate(e, l).unwrap();
        s.membrane_energy + s.bending_energy
    };
    let (h, k) = (1e-4, 1e-1);
    for i in 0..3 {
        let at = |d: f64| {
            let mut moved = e;
            moved[i] += d;
            moved
        };
        // The shear strain enters the energy twice.
        let factor = if i == 1 { 2.0 } else { 1.0 };
        let slope = (energy(at(h), l) - energy(at(-h), l)) / (2.0 * h);
        assert!((slope - factor * state.stress[i]).abs() < 1e-8 * state.stress[0].abs());
        let [a, b] = [h, -h].map(|d| fabric.evaluate(at(d), l).unwrap().stress);
        for j in 0..3 {
            let slope = (a[j] - b[j]) / (2.0 * h);
            assert!((slope - state.tangent[j][i]).abs() < 1e-8 * fabric.membrane.warp);
        }
    }
    for i in 0..2 {
        let at = |d: f64| {
            let mut moved = l;
            moved[i] += d;
            moved
        };
        let slope = (energy(e, at(k)) - energy(e, at(-k))) / (2.0 * k);
        assert!((slope / state.moments[i] - 1.0).abs() < 1e-8);
        assert_eq!(state.moments[i], state.bending_tangent[i][i] * l[i]);
    }

    // Columns U, V of a homogeneous deformation.
    let (u, v) = ([1.03, 0.02, -0.01], [-0.015, -0.97, 0.02]);
    let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| a[i] * b[i]).sum::<f64>();
    let green = [
        0.5 * (dot(u, u) - 1.0),
        0.5 * dot(u, v),
        0.5 * (dot(v, v) - 1.0),
    ];
    let sheet = sheet::equilateral(5, 5, [0.1, 0.2]).unwrap();
    let q = sheet.positions(|[s, t]| std::array::from_fn(|i| s * u[i] + t * v[i]));
    let term = membrane_term(&sheet.mesh, std::slice::from_ref(&fabric), DampingKind::Off).unwrap();
    let at = EvalPoint {
        layout: DofLayout::points(sheet.mesh.points()),
        q: &q,
        q_start: &q,
        dt: 1e-3,
    };
    let expected = term.value(&at, 0..term.len());
    let found = 0.02 * fabric.evaluate(green, [0.0; 2]).unwrap().membrane_energy;
    assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
    let bent = fabric.evaluate([0.0; 3], [100.0, 0.0]).unwrap();
    assert_eq!(bent.membrane_energy, 0.0);
    assert!((bent.bending_energy / (0.5 * fabric.bending.warp * 1e4) - 1.0).abs() < 1e-14);

    for (e, l) in [
        ([f64::NAN, 0.0, 0.0], [0.0; 2]),
        ([-0.5, 0.0, 0.0], [0.0; 2]),
        ([0.0, 0.51, 0.0], [0.0; 2]),
        ([0.0; 3], [0.0, f64::INFINITY]),
    ] {
        assert!(fabric.evaluate(e, l).is_err(), "{e:?} {l:?}");
    }
}
