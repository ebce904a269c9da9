//! Mesh building: what it finds and what it refuses.

mod common;

use common::{Random, at, fabric};
use selvedge_shell_model::strain::{edge_strain, principal_stretches};
use selvedge_shell_model::{
    BendingOptions, DampingKind, ModelError, NONE, ShellMesh, bending_term, hinge_rest,
    lumped_masses, membrane_term, shape, sheet, uncalibrated,
};

const A: [[f64; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
const B: [[f64; 2]; 3] = [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

fn build(triangles: &[[u32; 3]], material: &[[[f64; 2]; 3]]) -> Result<ShellMesh, ModelError> {
    ShellMesh::new(
        5,
        triangles.to_vec(),
        material.to_vec(),
        vec![0; triangles.len()],
    )
}

/// Two triangles: the hinge in its convention, edges, boundary, isolated point.
#[test]
fn square() {
    let mesh = build(&[[0, 1, 3], [1, 2, 3]], &[A, B]).unwrap();
    assert_eq!(mesh.edges().len(), 5);
    let [hinge] = mesh.hinges() else {
        panic!("one hinge")
    };
    assert_eq!((hinge.points, hinge.triangles), ([1, 3, 0, 2], [0, 1]));
    assert_eq!(hinge.corners, [0, 1]);
    assert_eq!(mesh.neighbours(0), [1, NONE, NONE]);
    assert_eq!(mesh.boundary_points(), [0, 1, 2, 3]);
    assert_eq!(mesh.isolated(), [4]);
    let [one, two] = mesh.wings(hinge);
    assert!(
        (one.length - 2.0_f64.sqrt()).abs() < 1e-15 && (two.height - 0.5_f64.sqrt()).abs() < 1e-15
    );
    assert!((one.foot - 0.5).abs() < 1e-15);
    let masses = lumped_masses(&mesh, &[fabric()]).unwrap();
    assert_eq!(masses[4], 0.0);
    assert!((masses[1] - 0.2 / 3.0).abs() < 1e-15 && (masses[0] - 0.1 / 3.0).abs() < 1e-15);
}

/// Each kind of broken mesh is refused by name.
#[test]
fn refusals() {
    let fail = |t: &[[u32; 3]], m: &[[[f64; 2]; 3]]| build(t, m).unwrap_err();
    assert_eq!(
        fail(&[[0, 1, 9]], &[A]),
        ModelError::PointOutOfRange {
            triangle: 0,
            point: 9,
            points: 5
        }
    );
    assert_eq!(
        fail(&[[0, 1, 1]], &[A]),
        ModelError::RepeatedPoint {
            triangle: 0,
            point: 1
        }
    );
    assert_eq!(
        fail(&[[0, 1, 2], [3, 4, 0], [2, 0, 1]], &[A, A, A]),
        ModelError::DuplicateTriangle {
            first: 0,
            second: 2
        }
    );
    assert_eq!(
        fail(&[[0, 1, 2], [1, 0, 3], [0, 1, 4]], &[A, A, A]),
        ModelError::NonManifoldEdge {
            edge: [0, 1],
            triangles: vec![0, 1, 2]
        }
    );
    assert_eq!(
        fail(&[[0, 1, 2], [0, 1, 3]], &[A, A]),
        ModelError::InconsistentWinding {
            edge: [0, 1],
            triangles: [0, 1]
        }
    );
    let turned = [A[0], A[2], A[1]];
    assert_eq!(
        fail(&[[0, 1, 2], [2, 1, 3]], &[A, turned]),
        ModelError::InvertedTriangle {
            triangle: 1,
            area: -0.5
        }
    );
    let mut holed = A;
    holed[1][0] = f64::NAN;
    assert!(matches!(
        fail(&[[0, 1, 2]], &[holed]),
        ModelError::NotFinite { index: 0, .. }
    ));
    assert_eq!(
        fail(&[[0, 1, 2]], &[]),
        ModelError::Length {
            what: "material",
            expected: 1,
            found: 0
        }
    );
    for height in [0.0, 1e-30, 5e-5] {
        let thin = [[0.0, 0.0], [1.0, 0.0], [0.5, height]];
        let error = fail(&[[0, 1, 2]], &[thin]);
        assert!(
            matches!(error, ModelError::DegenerateTriangle { triangle: 0, .. }),
            "{error}"
        );
        let slivers = ShellMesh::with_slivers(3, vec![[0, 1, 2]], vec![thin], vec![0]);
        assert_eq!(slivers.is_ok(), height == 5e-5);
    }
    let point = fail(&[[0, 1, 2]], &[[[1.0, 1.0]; 3]]);
    assert!(
        matches!(point, ModelError::DegenerateTriangle { aspect: 0.0, .. }),
        "{point}"
    );
    assert!(
        fail(&[[0, 1, 2], [1, 0, 3], [0, 1, 4]], &[A; 3])
            .to_string()
            .contains("0-1")
    );

    let mesh = ShellMesh::new(3, vec![[0, 1, 2]], vec![A], vec![3]).unwrap();
    let error = membrane_term(&mesh, &[fabric()], DampingKind::Off)
        .map(|_| ())
        .unwrap_err();
    assert_eq!(
        error,
        ModelError::FabricOutOfRange {
            triangle: 0,
            fabric: 3,
            fabrics: 1
        }
    );
    let mut broken = fabric();
    broken.membrane.coupling = 1e6;
    let mesh = ShellMesh::new(3, vec![[0, 1, 2]], vec![A], vec![0]).unwrap();
    let error = membrane_term(&mesh, &[broken], DampingKind::Off)
        .map(|_| ())
        .unwrap_err();
    assert!(matches!(
        error,
        ModelError::Fabric {
            what: "membrane.coupling",
            ..
        }
    ));
}

/// Nothing at all is a mesh too, and so is cloth without any stiffness.
#[test]
fn empty_and_slack() {
    let empty = ShellMesh::new(0, vec![], vec![], vec![]).unwrap();
    let bending = bending_term(&empty, &[], &BendingOptions::default()).unwrap();
    assert!(bending.is_empty() && empty.hinge_quality().is_none());
    assert_eq!(edge_strain(&empty, &[]).mean_abs, 0.0);

    let sheet = sheet::grid(2, 2, [0.02, 0.02]).unwrap();
    let mut slack = fabric();
    slack.membrane = selvedge_shell_model::MembraneModuli {
        warp: 0.0,
        weft: 0.0,
        shear: 0.0,
        coupling: 0.0,
    };
    slack.bending = selvedge_shell_model::BendingRigidity {
        warp: 0.0,
        weft: 0.0,
        bias: 0.0,
    };
    let q = sheet.positions(|[u, v]| [2.0 * u, u * v, v]);
    let at = at(&q, &q, 1e-3);
    for term in [
        membrane_term(&sheet.mesh, &[slack.clone()], DampingKind::Rate).unwrap(),
        bending_term(&sheet.mesh, &[slack], &BendingOptions::default()).unwrap(),
    ] {
        assert_eq!(term.value(&at, 0..term.len()), 0.0);
    }
}

/// Renumbered points: the same sheet, the same energies.
#[test]
fn renumbering() {
    let sheet = sheet::equilateral(4, 5, [0.04, 0.04]).unwrap();
    let n = sheet.mesh.points() as u32;
    let new_of_old: Vec<u32> = (0..n).map(|i| (i * 7 + 3) % n).collect();
    let other = sheet.mesh.renumbered(&new_of_old).unwrap();
    let mut random = Random(5);
    let q: Vec<f64> = sheet
        .positions(|[u, v]| [u, v, 0.0])
        .iter()
        .map(|x| x + 1e-3 * random.next())
        .collect();
    let mut p = vec![0.0; q.len()];
    for (old, new) in new_of_old.iter().enumerate() {
        p[3 * *new as usize..3 * *new as usize + 3].copy_from_slice(&q[3 * old..3 * old + 3]);
    }
    let energies = |mesh: &ShellMesh, q: &[f64]| {
        let fabrics = [fabric()];
        let at = at(q, q, 1e-3);
        let m = membrane_term(mesh, &fabrics, DampingKind::Off).unwrap();
        let b = bending_term(mesh, &fabrics, &BendingOptions::default()).unwrap();
        [m.value(&at, 0..m.len()), b.value(&at, 0..b.len())]
    };
    let (a, b) = (energies(&sheet.mesh, &q), energies(&other, &p));
    assert!(
        (a[0] / b[0] - 1.0).abs() < 1e-13 && (a[1] / b[1] - 1.0).abs() < 1e-12,
        "{a:?} {b:?}"
    );
    assert!(other.edges().is_sorted_by_key(|e| e.points));
    assert_eq!(
        sheet.mesh.renumbered(&vec![0; n as usize]).unwrap_err(),
        ModelError::NotAPermutation { index: 1, value: 0 }
    );
}

/// Generated sheets cover their rectangle; the hinges of the equilateral one
/// carry the continuum's bending in every direction, those of the grid do not.
#[test]
fn sheets() {
    for (nu, nv) in [(1, 1), (2, 1), (1, 2), (3, 4), (7, 5)] {
        for sheet in [
            sheet::grid(nu, nv, [0.3, 0.2]),
            sheet::equilateral(nu, nv, [0.3, 0.2]),
        ] {
            let mesh = sheet.unwrap().mesh;
            assert!((mesh.total_area() / 0.06 - 1.0).abs() < 1e-14);
            assert!(mesh.isolated().is_empty());
            let euler = mesh.points() + mesh.triangles().len() - mesh.edges().len();
            assert_eq!(euler, 1, "a disc");
        }
    }
    let fine = sheet::equilateral_edge([0.5, 0.5], 0.01)
        .unwrap()
        .mesh
        .hinge_quality()
        .unwrap();
    assert!(
        (fine.mean - 1.0).abs() < 0.02 && fine.max < 1.05 && fine.min > 0.95,
        "{fine:?}"
    );
    let grid = sheet::grid(50, 50, [0.5, 0.5])
        .unwrap()
        .mesh
        .hinge_quality()
        .unwrap();
    assert!(grid.max > 1.5 * grid.min, "{grid:?}");
    assert!(sheet::grid(0, 1, [1.0, 1.0]).is_err());
    assert!(sheet::equilateral(1, 1, [1.0, -1.0]).is_err());
    assert!(sheet::equilateral_edge([1.0, 1.0], f64::NAN).is_err());
}

/// Stretches and edge strains of a homogeneous deformation.
#[test]
fn strains() {
    let sheet = sheet::equilateral(6, 7, [0.06, 0.06]).unwrap();
    let q = sheet.positions(|[u, v]| [1.2 * u, 0.0, 0.5 * v]);
    for [high, low] in principal_stretches(&sheet.mesh, &q) {
        assert!((high - 1.2).abs() < 1e-13 && (low - 0.5).abs() < 1e-13);
    }
    let strain = edge_strain(&sheet.mesh, &q);
    let worst = &sheet.mesh.edges()[strain.worst];
    assert!(strain.max_abs <= 0.5 + 1e-13 && strain.mean_abs < strain.max_abs);
    let [a, b] = worst.points.map(|p| sheet.flat[p as usize]);
    assert!((sheet.mesh.rest_length(worst) - (a[0] - b[0]).hypot(a[1] - b[1])).abs() < 1e-16);
    let point = vec![0.7; q.len()];
    assert!(
        principal_stretches(&sheet.mesh, &point)
            .iter()
            .all(|s| *s == [0.0; 2])
    );
}

/// A seam between pieces of different fabric, grain and edge length takes the
/// mean of both sides; rest angles of a curved rest shape cost no energy there.
#[test]
fn seams_and_rest_angles() {
    // The second piece is cut at 90° and 10 % longer along the seam.
    let second = [[0.0, 0.0], [0.0, 1.1], [-1.0, 0.5]];
    let first = [[0.0, 0.0], [1.0, 0.0], [0.5, 0.9]];
    let mesh = ShellMesh::new(
        4,
        vec![[0, 1, 2], [1, 0, 3]],
        vec![first, second],
        vec![0, 1],
    )
    .unwrap();
    let (mut soft, mut stiff) = (fabric(), fabric());
    (soft.bending.warp, soft.bending.weft, soft.bending.bias) = (1e-5, 1e-5, 1e-5);
    (stiff.bending.warp, stiff.bending.weft, stiff.bending.bias) = (3e-5, 3e-5, 3e-5);
    let rest = hinge_rest(
        &mesh,
        &[soft.clone(), stiff.clone()],
        &BendingOptions::default(),
    )
    .unwrap();
    let want = 2e-5 * 1.05 * 1.05 / (0.45 + 0.55);
    assert!(
        (rest[0].stiffness / want - 1.0).abs() < 1e-14,
        "{:?}",
        rest[0]
    );

    let q = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.5, 0.9, 0.0, 0.5, -0.3, -0.8];
    let angles = shape::hinge_angles(&mesh, &q);
    assert!((angles[0] - 0.8_f64.atan2(0.3)).abs() < 1e-14);
    let options = BendingOptions {
        rest_angles: Some(&angles),
        ..Default::default()
    };
    let bending = bending_term(&mesh, &[soft.clone(), stiff.clone()], &options).unwrap();
    assert_eq!(bending.value(&at(&q, &q, 1e-3), 0..1), 0.0);
    let options = BendingOptions {
        rest_angles: Some(&[]),
        ..Default::default()
    };
    assert!(bending_term(&mesh, &[soft, stiff], &options).is_err());
    let mut extreme = fabric();
    (extreme.bending.warp, extreme.bending.weft) = (1e-4, 1e-5);
    assert_eq!(uncalibrated(&[fabric(), extreme]), vec![1]);
}
