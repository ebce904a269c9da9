//! Clamped strips against the elastica.

use approx::assert_relative_eq;
use selvedge_integrator::Term;
use selvedge_shell_model::{SharedScalar, seam_term, sheet};
use selvedge_tests::{Setup, mean, plain_fabric, point, rows, run, to_rest};

const G: f64 = 9.81;
const DENSITY: f64 = 0.2;

/// Angles below the horizontal at the middles of `cells` equal cells of an
/// elastica: `B θ'' = −(w (L − s) + P) cos θ`, `θ(0) = 0`, `θ'(L) = 0`, with
/// `s` from the clamp in lengths and weight and load in `B / L³`, `B / L²`.
fn angles(weight: f64, load: f64, at: impl Iterator<Item = f64>) -> Vec<f64> {
    let n = 4000;
    let h = 1.0 / n as f64;
    // Midpoint rule from the clamp, with the curvature there found by bisection.
    let shoot = |start: f64| {
        let (mut theta, mut kappa) = (0.0_f64, start);
        let mut all = vec![theta];
        for k in 0..n {
            let bend = |s: f64, t: f64| -(weight * (1.0 - s) + load) * t.cos();
            let s = k as f64 * h;
            let (tm, km) = (theta + 0.5 * h * kappa, kappa + 0.5 * h * bend(s, theta));
            theta += h * km;
            kappa += h * bend(s + 0.5 * h, tm);
            all.push(theta);
        }
        (kappa, all)
    };
    let (mut low, mut high) = (0.0, weight + load);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if shoot(middle).0 < 0.0 {
            low = middle
        } else {
            high = middle
        }
    }
    let all = shoot(low).1;
    at.map(|s| all[(s * n as f64).round() as usize]).collect()
}

/// Depth and reach of a clamped strip's end, both relative to its length.
///
/// Two rows are held. A hinge row stands for the curvature of half a cell on
/// either side, so that the clamp is half a cell before the second row and the
/// free length counts from there.
///
/// Rows are kept straight: the elastica bends to a cylinder. A free strip curls
/// the other way across its width and is softer, by up to the `1 / (1 − ν²)` of
/// a plate, with `ν = 1/3` for hinges on equilateral triangles.
fn cantilever(cells: usize, gamma: f64, load: Load) -> [f64; 2] {
    let length = 0.2;
    let spacing = length / (cells as f64 - 0.5);
    let edge = spacing / 0.75_f64.sqrt();
    let size = [edge * COLUMNS as f64, spacing * cells as f64];
    let sheet = sheet::equilateral(COLUMNS, cells, size).expect("sheet");
    let weight = DENSITY * G;
    let rigidity = weight * length.powi(3) / gamma;
    let all = rows(&sheet);
    // Start from the elastica itself, without any strain of the cells.
    let at = (0..cells).map(|k| k as f64 * spacing / length);
    let theta = match load {
        Load::Weight => angles(gamma, 0.0, at),
        Load::Tip => angles(0.0, gamma, at),
    };
    let mut places = vec![[0.0; 2]];
    for t in theta {
        let [y, z] = places[places.len() - 1];
        places.push([y - spacing * t.sin(), z + spacing * t.cos()]);
    }
    let mut positions = vec![[0.0; 3]; sheet.flat.len()];
    for (row, [y, z]) in all.iter().zip(places) {
        for &p in row {
            positions[p as usize] = [sheet.flat[p as usize][0], y, z];
        }
    }
    let tip = all.last().expect("rows");
    // Every row is kept on the straight line between its ends.
    let mut ties = Vec::new();
    for row in &all {
        let (a, b) = (row[0], row[row.len() - 1]);
        let inner = &row[1..row.len() - 1];
        ties.extend(
            inner
                .iter()
                .map(|&p| (p, [a, b], sheet.flat[p as usize][0] / size[0])),
        );
    }
    let straight = seam_term(&ties, SharedScalar::new(1e6));
    let mut setup = Setup::new(
        sheet.mesh,
        positions,
        plain_fabric(STIFFNESS, rigidity, DENSITY),
    );
    setup.pinned = all[..2].concat();
    to_rest(&mut setup, 1.0, 12);
    // Round-off of the strains leaves this much.
    setup.newton.tolerance = 1e-4;
    setup.terms.push(Term::fixed(straight));
    let mut s = setup.simulation();
    if load == Load::Tip {
        // `Γ B / L²` per width at the end; the strip itself weighs nothing.
        let total = weight * length * size[0] / G;
        let masses = &mut s.plan_mut().inertia.masses;
        let here: f64 = tip.iter().map(|p| masses[*p as usize]).sum();
        for (i, m) in masses.iter_mut().enumerate() {
            *m *= if tip.contains(&(i as u32)) {
                total / here
            } else {
                1e-3
            };
        }
    }
    run(&mut s).expect("a strip");
    let fastest = s.state().v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let end = mean(&s, tip);
    let side = tip
        .iter()
        .map(|p| (point(&s, *p)[1] - end[1]).abs())
        .fold(0.0, f64::max);
    println!(
        "  {cells} cells, Γ {gamma}: {end:?}, curl {side:.2e}, {:?}, speed {fastest:.1e}",
        s.counters()
    );
    assert!(fastest < 1e-4, "still moving at {fastest} m/s");
    [-end[1] / length, (end[2] - 0.5 * spacing) / length]
}

#[derive(Clone, Copy, PartialEq)]
enum Load {
    Weight,
    Tip,
}

const COLUMNS: usize = 4;
const STIFFNESS: f64 = 2e5;

/// Two meshes extrapolated to none, for errors of second order in the cell.
fn richardson(coarse: [f64; 2], fine: [f64; 2], cells: [usize; 2]) -> [f64; 2] {
    let [c, f] = cells.map(|n| (1.0 / (n as f64 - 0.5)).powi(2));
    std::array::from_fn(|i| fine[i] - (coarse[i] - fine[i]) * f / (c - f))
}

/// A clamped strip under its own weight takes the shape of the heavy elastica:
/// depth over reach for `Γ = w L³ / B` of 1, 10 and 100, extrapolated in the
/// mesh size, to half a percent.
#[test]
fn heavy_elastica() {
    for (gamma, exact) in [(1.0, 0.12456), (10.0, 1.06680), (100.0, 5.88810)] {
        let [coarse, fine] = [16, 32].map(|n| cantilever(n, gamma, Load::Weight));
        let [y, x] = richardson(coarse, fine, [16, 32]);
        println!(
            "elastica Γ = {gamma}: H/W {}, {} → {} against {exact}: {:.2e}",
            coarse[0] / coarse[1],
            fine[0] / fine[1],
            y / x,
            y / x / exact - 1.0
        );
        assert_relative_eq!(y / x, exact, max_relative = 5e-3);
    }
}

/// A clamped strip with a load at its end: shortening and depth at
/// `P L² / B = 2` are 0.16064 and 0.49346 of its length.
#[test]
fn elastica_with_a_load_at_its_end() {
    let [coarse, fine] = [16, 32].map(|n| cantilever(n, 2.0, Load::Tip));
    let [y, x] = richardson(coarse, fine, [16, 32]);
    println!("tip load: shortening {}, depth {y}", 1.0 - x);
    assert_relative_eq!(1.0 - x, 0.16064, max_relative = 5e-3);
    assert_relative_eq!(y, 0.49346, max_relative = 5e-3);
}

/// The error falls with the square of the mesh size.
#[test]
fn order_in_mesh_size() {
    let exact = 1.06680;
    let meshes = [8, 16, 32];
    let errors = meshes.map(|n| {
        let [y, x] = cantilever(n, 10.0, Load::Weight);
        (y / x / exact - 1.0).abs()
    });
    let spacing = meshes.map(|n| 1.0 / (n as f64 - 0.5));
    for k in 0..2 {
        let order = (errors[k] / errors[k + 1]).ln() / (spacing[k] / spacing[k + 1]).ln();
        println!("elastica: errors {errors:?}, order {order:.3}");
        assert_relative_eq!(order, 2.0, epsilon = 0.2);
    }
}
