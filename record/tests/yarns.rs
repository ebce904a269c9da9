//! Recordings of cloth made of yarns.

use std::fs;
use std::path::Path;

use selvedge_record::export::{Format, FrameRange, Skin, export, export_skinned, write_obj_lines};
use selvedge_record::{
    RecordError, Recorder, RecorderOptions, Recording, RunHeader, TOPIC_CLOTH, YarnPaths,
};

/// Two yarns that cross in point 1.
fn header() -> RunHeader {
    RunHeader {
        scene_name: "cross".into(),
        points: 5,
        panel_names: vec!["warp ends".into(), "weft".into()],
        yarns: YarnPaths {
            offsets: vec![0, 3, 6],
            points: vec![0, 1, 2, 3, 1, 4],
            layers: vec![0, 0, 0, 0, 1, 0],
            arcs: vec![0.0, 0.01, 0.02, 0.5, 0.512, 0.53],
            radii: vec![1e-3, 5e-4],
            panels: vec![0, 1],
            sides: vec![-1],
        },
        ..RunHeader::default()
    }
}

const START: [f64; 15] = [
    -0.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 0.0, -0.01, 0.0, 0.0, 0.01,
];

fn record(path: &Path, header: &RunHeader) -> Recording {
    let mut recorder = Recorder::create(path, header, RecorderOptions::default()).unwrap();
    for step in 0..3 {
        let q = START.map(|x| x * (1.0 + 0.1 * step as f64));
        recorder
            .frame(0.5 * step as f64, step, &q, &[0.0; 15])
            .unwrap();
    }
    recorder.finish(&serde_json::json!({})).unwrap();
    Recording::open(path).unwrap()
}

/// A triangle around each yarn's first point.
struct Flags;

impl Skin for Flags {
    fn points(&self) -> usize {
        3
    }
    fn triangles(&self) -> &[[u32; 3]] {
        &[[0, 1, 2], [0, 2, 1]]
    }
    fn panels(&self) -> &[u16] {
        &[0, 1]
    }
    fn positions(&self, recorded: &[f64]) -> Vec<f64> {
        assert_eq!(recorded.len(), 15);
        recorded[..9].to_vec()
    }
}

/// The yarns come back as they were, and a run with others is another run; so
/// is one without yarns, whose recording does not mention them.
#[test]
fn round_trip() {
    let folder = tempfile::tempdir().unwrap();
    let header = header();
    let recording = record(&folder.path().join("run.mcap"), &header);
    assert!(recording.is_complete() && recording.warnings().is_empty());
    assert_eq!(recording.header().yarns, header.yarns);
    assert_eq!(recording.frame(0).unwrap().positions, START);
    assert_eq!(header.difference(recording.header()), None);
    let mut other = header.clone();
    other.yarns.sides[0] = 1;
    let difference = other.difference(recording.header());
    assert_eq!(difference.as_deref(), Some("the yarns differ"));
    let bare = RunHeader {
        yarns: YarnPaths::default(),
        ..header.clone()
    };
    let without = record(&folder.path().join("bare.mcap"), &bare);
    assert!(without.header().yarns.is_empty());
    assert_ne!(bare.digest(), header.digest());
}

/// The display channel holds a line list for each thickness.
#[test]
fn display_lines() {
    use foxglove::{Decode, messages::SceneUpdate};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    record(&path, &header());
    let bytes = fs::read(&path).unwrap();
    let mut shown = 0;
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        if message.channel.topic != TOPIC_CLOTH {
            continue;
        }
        let update = SceneUpdate::decode(&message.data[..]).unwrap();
        let lines = &update.entities[0].lines;
        assert_eq!(lines.len(), 2);
        assert_eq!([lines[0].thickness, lines[1].thickness], [2e-3, 1e-3]);
        assert_eq!(lines[0].indices, [0, 1, 1, 2]);
        assert_eq!(lines[1].points.len(), 3);
        shown += 1;
    }
    assert_eq!(shown, 3);
}

/// Formats with triangles take those of the skin, the point cache the recorded
/// points; without a skin the error says what is missing.
#[test]
fn exports() {
    let folder = tempfile::tempdir().unwrap();
    let recording = record(&folder.path().join("run.mcap"), &header());
    for format in Format::ALL {
        let path = folder.path().join(format!("out.{format}"));
        let range = FrameRange::ALL;
        assert_eq!(range.count(&recording), 3);
        let bare = export(&recording, format, range, &path);
        if format == Format::Pc2 {
            bare.unwrap();
        } else {
            let Err(RecordError::Export { reason }) = bare else {
                panic!("{format} without triangles");
            };
            assert!(reason.contains("no triangles"), "{reason}");
            assert!(!path.exists());
        }
        let files = export_skinned(&recording, format, range, &path, Some(&Flags)).unwrap();
        assert_eq!(files.len(), if files[0] == path { 1 } else { 3 });
        let bytes = fs::read(&files[files.len() - 1]).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        match format {
            Format::Obj => {
                assert_eq!(text.lines().filter(|l| l.starts_with("v ")).count(), 3);
                assert!(
                    text.contains("g warp_ends\nf 1 2 3\ng weft\nf 1 3 2\n"),
                    "{text}"
                );
                assert!(text.contains("v -0.012 0 0\n"), "{text}");
            }
            Format::Ply => assert!(text.contains("element vertex 3\n")),
            Format::Usda => {
                assert!(text.contains("faceVertexIndices = [0, 1, 2, 0, 2, 1]"));
                assert!(
                    text.contains("24: [(-0.012, 0, 0), (0, 0, 0), (0.012, 0, 0)]"),
                    "{text}"
                );
            }
            Format::Glb => {
                let glb = gltf::Gltf::from_slice(&bytes).unwrap();
                let mesh = glb.meshes().next().unwrap();
                let primitive = mesh.primitives().next().unwrap();
                assert_eq!(primitive.indices().unwrap().count(), 6);
                assert_eq!(primitive.morph_targets().len(), 2);
            }
            Format::Pc2 => {
                assert_eq!(bytes[16..20], 5_i32.to_le_bytes());
                assert_eq!(bytes.len(), 32 + 3 * 5 * 12);
            }
        }
    }
}

/// Yarns as lines, by pieces; ways that do not fit are refused, also in a header.
#[test]
fn lines_and_faults() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("final.obj");
    let header = header();
    write_obj_lines(&path, &START, &header.yarns, &header.panel_names).unwrap();
    let text = fs::read_to_string(&path).unwrap();
    assert!(
        text.ends_with("g warp_ends\nl 1 2 3\ng weft\nl 4 2 5\n"),
        "{text}"
    );
    let broken = |change: fn(&mut YarnPaths)| {
        let mut header = header.clone();
        change(&mut header.yarns);
        header.validate().unwrap_err()
    };
    broken(|y| y.points[0] = 5);
    broken(|y| y.offsets[1] = 5);
    broken(|y| y.radii[0] = 0.0);
    broken(|y| y.arcs[0] = f64::NAN);
    broken(|y| y.layers.truncate(2));
    broken(|y| y.radii.clear());
    header.validate().unwrap();
}
