//! Exports, read back by other means.

mod common;

use std::fs;
use std::path::{Path, PathBuf};

use common::{DT, diagnostics, header, record, state};
use selvedge_record::export::{Format, FrameRange, export, write_obj, write_steps_csv};
use selvedge_record::{RecordError, Recording, Surface};

fn recording(folder: &Path) -> Recording {
    let path = folder.join("run.mcap");
    record(&path, &header(6), 9, 3);
    Recording::open(&path).unwrap()
}

/// Verifies that OBJ keeps every bit, has valid indices and is the same twice.
#[test]
fn obj() {
    let folder = tempfile::tempdir().unwrap();
    let recording = recording(folder.path());
    let path = folder.path().join("sub/final.obj");
    let files = export(&recording, Format::Obj, FrameRange::last(&recording), &path).unwrap();
    assert_eq!(files, std::slice::from_ref(&path));
    let text = fs::read_to_string(&path).unwrap();
    let numbers = |prefix: &str| -> Vec<f64> {
        text.lines()
            .filter_map(|l| l.strip_prefix(prefix))
            .flat_map(|l| {
                l.split(' ')
                    .map(|x| x.parse().unwrap())
                    .collect::<Vec<f64>>()
            })
            .collect()
    };
    let (q, _) = state(recording.header(), 8);
    assert_eq!(numbers("v "), q[..108]);
    let vt = numbers("vt ");
    assert_eq!(vt.len(), 2 * 36, "no seams: as many as points");
    let mut faces = 0;
    for (line, triangle) in text
        .lines()
        .filter_map(|l| l.strip_prefix("f "))
        .zip(&recording.header().triangles)
    {
        for (corner, p) in line.split(' ').zip(triangle) {
            let (v, t) = corner.split_once('/').unwrap();
            assert_eq!(v.parse::<u32>().unwrap(), p + 1);
            let t: usize = t.parse().unwrap();
            let (x, z) = (q[3 * *p as usize], q[3 * *p as usize + 2]);
            assert_eq!(vt[2 * t - 2..2 * t], [x, z], "material is the flat sheet");
        }
        faces += 1;
    }
    assert_eq!(faces, 50);
    assert!(text.contains("\ng front\n") && text.contains("\ng back\n"));
    let again = folder.path().join("again.obj");
    write_obj(&again, &Surface::of(recording.header(), &q)).unwrap();
    assert_eq!(fs::read_to_string(again).unwrap(), text);
}

/// Verifies that a point on a seam gets one texture coordinate a panel.
#[test]
fn obj_seam() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("seam.obj");
    let surface = Surface {
        positions: &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0],
        points: 4,
        triangles: &[[0, 1, 2], [1, 3, 2]],
        material: &[
            [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
            [[5.0, 0.0], [6.0, 1.0], [5.0, 1.0]],
        ],
        ..Surface::default()
    };
    write_obj(&path, &surface).unwrap();
    let text = fs::read_to_string(&path).unwrap();
    assert_eq!(text.matches("vt ").count(), 6);
    assert!(text.contains("f 1/1 2/2 3/3\nf 2/4 4/5 3/6\n"), "{text}");
}

/// Verifies size and content of PLY, and the numbering of several frames.
#[test]
fn ply() {
    let folder = tempfile::tempdir().unwrap();
    let recording = recording(folder.path());
    let path = folder.path().join("cloth.ply");
    let range = FrameRange {
        first: 2,
        last: 8,
        stride: 3,
    };
    let files = export(&recording, Format::Ply, range, &path).unwrap();
    let name = |i: usize| -> PathBuf { folder.path().join(format!("cloth.000{i}.ply")) };
    assert_eq!(files, [name(2), name(5), name(8)]);
    let bytes = fs::read(name(5)).unwrap();
    let end = bytes
        .windows(11)
        .position(|w| w == b"end_header\n")
        .unwrap()
        + 11;
    let (q, _) = state(recording.header(), 5);
    assert_eq!(bytes.len() - end, 36 * 24 + 50 * (1 + 12 + 2));
    let x: Vec<f64> = bytes[end..end + 36 * 24]
        .chunks(8)
        .map(|c| f64::from_le_bytes(c.try_into().unwrap()))
        .collect();
    assert_eq!(x, q[..108]);
}

/// Verifies the point cache against its header and the frames.
#[test]
fn pc2() {
    let folder = tempfile::tempdir().unwrap();
    let recording = recording(folder.path());
    let path = folder.path().join("cloth.pc2");
    export(&recording, Format::Pc2, FrameRange::ALL, &path).unwrap();
    let bytes = fs::read(&path).unwrap();
    assert_eq!(bytes.len(), 32 + 9 * 36 * 12);
    let int = |at: usize| i32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let float = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    assert_eq!(&bytes[..12], b"POINTCACHE2\0");
    assert_eq!((int(12), int(16), int(28)), (1, 36, 9));
    assert!((float(24) - (24.0 * DT) as f32).abs() < 1e-6);
    let (q, _) = state(recording.header(), 8);
    assert_eq!(float(32 + 8 * 36 * 12 + 4), q[1] as f32);
}

/// Verifies with an independent reader that glTF is valid and that its morph
/// targets give back every frame.
#[test]
fn glb() {
    let folder = tempfile::tempdir().unwrap();
    let recording = recording(folder.path());
    let path = folder.path().join("cloth.glb");
    export(&recording, Format::Glb, FrameRange::ALL, &path).unwrap();
    let gltf = gltf::Gltf::open(&path).unwrap(); // validates
    let blob = gltf.blob.clone().unwrap();
    let mesh = gltf.meshes().next().unwrap();
    assert_eq!(mesh.name(), Some("cloth"));
    let primitive = mesh.primitives().next().unwrap();
    let reader = primitive.reader(|_| Some(&blob));
    let base: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
    let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
    assert_eq!(indices.len(), 150);
    let (mut step, mut worst) = (1, 0.0_f32);
    for (shift, _, _) in reader.read_morph_targets() {
        let (q, _) = state(recording.header(), step);
        let shift: Vec<[f32; 3]> = shift.unwrap().collect();
        for (i, p) in indices
            .iter()
            .zip(recording.header().triangles.as_flattened())
        {
            for c in 0..3 {
                let x = base[*i as usize][c] + shift[*i as usize][c];
                worst = worst.max((x - q[3 * *p as usize + c] as f32).abs());
            }
        }
        step += 1;
    }
    assert_eq!(step, 9);
    assert!(worst <= 1.2e-7, "{worst}");
    let animation = gltf.animations().next().unwrap();
    let channel = animation.channels().next().unwrap();
    let times: Vec<f32> = channel
        .reader(|_| Some(&blob))
        .read_inputs()
        .unwrap()
        .collect();
    assert_eq!(times.len(), 9);
    assert!((times[8] - 8.0 / 60.0).abs() < 1e-7);
    assert_eq!(gltf.meshes().count(), 2, "the body too");
}

/// Verifies the time samples of USD as text.
#[test]
fn usda() {
    let folder = tempfile::tempdir().unwrap();
    let recording = recording(folder.path());
    let path = folder.path().join("cloth.usda");
    export(&recording, Format::Usda, FrameRange::ALL, &path).unwrap();
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.starts_with("#usda 1.0\n"));
    let samples = text.split("points.timeSamples = {").nth(1).unwrap();
    assert_eq!(samples.lines().filter(|l| l.contains(": [(")).count(), 9);
    let (q, _) = state(recording.header(), 3);
    let code = 3.0 * DT * 24.0;
    let first = format!(
        "{code}: [({}, {}, {})",
        q[0] as f32, q[1] as f32, q[2] as f32
    );
    assert!(samples.contains(&first), "{first}");
    assert_eq!(text.matches('{').count(), text.matches('}').count());
}

/// Verifies that impossible wishes are refused, leave an earlier file as it
/// was and no litter.
#[test]
fn refusals() {
    let folder = tempfile::tempdir().unwrap();
    let recording = recording(folder.path());
    let path = folder.path().join("out.obj");
    fs::write(&path, "earlier").unwrap();
    let (mut q, _) = state(recording.header(), 0);
    q[4] = f64::INFINITY;
    let error = write_obj(&path, &Surface::of(recording.header(), &q)).unwrap_err();
    assert!(matches!(error, RecordError::Surface { .. }), "{error}");
    for range in [
        FrameRange {
            first: 9,
            last: 12,
            stride: 1,
        },
        FrameRange {
            first: 3,
            last: 2,
            stride: 1,
        },
        FrameRange {
            first: 0,
            last: 2,
            stride: 0,
        },
    ] {
        for format in Format::ALL {
            let error = export(&recording, format, range, &path).unwrap_err();
            assert!(matches!(error, RecordError::Export { .. }), "{error}");
        }
    }
    assert_eq!(fs::read_to_string(&path).unwrap(), "earlier");
    let folder_in_the_way = folder.path().join("folder.obj");
    fs::create_dir(&folder_in_the_way).unwrap();
    let error = export(
        &recording,
        Format::Obj,
        FrameRange::last(&recording),
        &folder_in_the_way,
    );
    assert!(error.unwrap_err().to_string().contains("folder.obj"));
    let left = fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(left, 3, "no temporary files");
    assert!(
        "fbx"
            .parse::<Format>()
            .unwrap_err()
            .to_string()
            .contains("obj, ply, glb")
    );
    assert_eq!("gltf".parse::<Format>().unwrap(), Format::Glb);
}

/// Verifies that every accepted step is a row of the table, to the last bit.
#[test]
fn csv() {
    let folder = tempfile::tempdir().unwrap();
    let recording = recording(folder.path());
    let path = folder.path().join("run.csv");
    write_steps_csv(&recording, &path).unwrap();
    let text = fs::read_to_string(&path).unwrap();
    let mut lines = text.lines().map(|l| l.split(',').collect::<Vec<_>>());
    let head = lines.next().unwrap();
    let column = |name: &str| head.iter().position(|h| *h == name).unwrap();
    let rows: Vec<_> = lines.collect();
    let steps = recording.diagnostics().iter().filter(|d| d.accepted);
    assert_eq!(rows.len(), steps.clone().count());
    assert!(!rows.is_empty());
    for (row, d) in rows.iter().zip(steps) {
        assert_eq!(row.len(), head.len());
        let number = |name: &str| row[column(name)].parse::<f64>().unwrap().to_bits();
        let expected = diagnostics(d.step);
        assert_eq!(number("time [s]"), expected.time.to_bits());
        assert_eq!(number("bending [J]"), expected.energies[1].1.to_bits());
        assert_eq!(
            number("pin.0 force y [N]"),
            expected.pins[0].force[1].to_bits()
        );
        assert_eq!(
            number("pin.0 place z [m]"),
            expected.pins[0].place[2].to_bits()
        );
    }
}
