//! Texts of scenes that several cases share.

/// One thread, no relaxation, no early end, no air.
pub const BARE: &str = r#"
[relaxation]
enabled = false
[stop]
early = false
[assembly]
threads = 1
[output]
report = false
"#;

/// As [`BARE`], with the gentle start that scenes have by default.
pub const GENTLE: &str = r#"
[stop]
early = false
[assembly]
threads = 1
[output]
report = false
"#;

/// The stiff fabric of the catalogue, without dissipation.
pub const STIFF: &str = r#"
[fabric.f]
density = 0.2
membrane = { warp = 2000.0, weft = 1500.0, shear = 50.0, coupling = 100.0 }
bending = { warp = 2e-5, weft = 1.5e-5, bias = 1e-5 }
damping = { drag = 0.0, membrane = 0.0, bending = 0.0 }
"#;

/// The soft fabric of the catalogue, without dissipation.
pub const SOFT: &str = r#"
[fabric.f]
density = 0.2
membrane = { warp = 60.0, weft = 90.0, shear = 30.0, coupling = 15.0 }
bending = { form = "isotropic", rigidity = 5e-6 }
damping = { drag = 0.0, membrane = 0.0, bending = 0.0 }
"#;

/// The stiff fabric with the default dissipation.
pub const DAMPED: &str = r#"
[fabric.f]
density = 0.2
membrane = { warp = 2000.0, weft = 1500.0, shear = 50.0, coupling = 100.0 }
bending = { warp = 2e-5, weft = 1.5e-5, bias = 1e-5 }
"#;

/// A sheet of 0.2 m and 10 × 10 points at the origin.
pub const SHEET: &str = r#"
[[cloth]]
kind = "sheet"
size = [0.2, 0.2]
points = [10, 10]
fabric = "f"
"#;

/// A ball of 0.1 m whose top is at the origin.
pub const BALL: &str = r#"
[[body]]
kind = "sphere"
center = [0.0, -0.102, 0.0]
radius = 0.1
"#;

/// The floor, 2 mm below the origin.
pub const FLOOR: &str = r#"
[[body]]
kind = "plane"
point = [0.0, -0.002, 0.0]
"#;

/// Joins texts; tables of the scene must come before lists of tables.
pub fn scene(parts: &[&str]) -> String {
    parts.concat()
}

/// An OBJ file.
pub fn obj(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> String {
    let mut text = String::new();
    for [x, y, z] in points {
        text += &format!("v {x:?} {y:?} {z:?}\n");
    }
    for [a, b, c] in triangles {
        text += &format!("f {} {} {}\n", a + 1, b + 1, c + 1);
    }
    text
}

/// An OBJ file with a texture point for every point: what is at rest.
pub fn obj_with_rest(points: &[[f64; 3]], rest: &[[f64; 2]], triangles: &[[u32; 3]]) -> String {
    let mut text = String::new();
    for [x, y, z] in points {
        text += &format!("v {x:?} {y:?} {z:?}\n");
    }
    for [u, v] in rest {
        text += &format!("vt {u:?} {v:?}\n");
    }
    for t in triangles {
        let [a, b, c] = t.map(|p| p + 1);
        text += &format!("f {a}/{a} {b}/{b} {c}/{c}\n");
    }
    text
}

/// A closed unit sphere: an icosahedron divided `n` times, facing outwards.
pub fn icosphere(n: usize, radius: f64) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let g = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut points: Vec<[f64; 3]> = vec![
        [-1.0, g, 0.0],
        [1.0, g, 0.0],
        [-1.0, -g, 0.0],
        [1.0, -g, 0.0],
        [0.0, -1.0, g],
        [0.0, 1.0, g],
        [0.0, -1.0, -g],
        [0.0, 1.0, -g],
        [g, 0.0, -1.0],
        [g, 0.0, 1.0],
        [-g, 0.0, -1.0],
        [-g, 0.0, 1.0],
    ];
    let mut triangles: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..n {
        let mut middles = std::collections::BTreeMap::new();
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let mut middle = |p: u32, q: u32| {
                *middles.entry((p.min(q), p.max(q))).or_insert_with(|| {
                    let (x, y) = (points[p as usize], points[q as usize]);
                    points.push(std::array::from_fn(|i| 0.5 * (x[i] + y[i])));
                    points.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    for p in &mut points {
        let size = p.iter().map(|x| x * x).sum::<f64>().sqrt();
        *p = p.map(|x| radius * x / size);
    }
    (points, triangles)
}
