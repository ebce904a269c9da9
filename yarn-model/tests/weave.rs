//! Weave drafts, their text, and the networks woven from them.

use proptest::prelude::*;
use selvedge_yarn_model::{
    Draft, NONE, NodeContact, WeaveError, Woven, YarnError, YarnMaterial, YarnNetwork,
};

fn error(text: &str) -> (String, String) {
    let error = text.parse::<Draft>().unwrap_err();
    let at = error.place().map_or(String::new(), |s| s.to_string());
    (at, error.to_string())
}

fn plain(counts: [usize; 2]) -> YarnNetwork {
    Woven::new(counts, [1e-3, 2e-3], YarnMaterial::default())
        .build(&Draft::named("plain").unwrap())
        .unwrap()
}

/// The formulas of the four weaves, over more than one repeat, against the
/// strands' order in the built network.
#[test]
fn stack_order_follows_the_draft() {
    type Over = fn(i64, i64) -> bool;
    let weaves: [(&str, Over); 4] = [
        ("plain", |i, j| (i + j) % 2 == 0),
        ("twill-2-2", |i, j| (i - j).rem_euclid(4) < 2),
        ("satin-5", |i, j| (i + 2 * j) % 5 == 0),
        ("basket-2-2", |i, j| (i / 2 + j / 2) % 2 == 0),
    ];
    assert_eq!(weaves.map(|w| w.0), Draft::NAMES);
    for (name, over) in weaves {
        let draft = Draft::named(name).unwrap();
        let cloth = Woven::new([7, 11], [1e-3; 2], YarnMaterial::default());
        let network = cloth.build(&draft).unwrap();
        assert_eq!(network.crossings.len(), 77);
        for (k, crossing) in network.crossings.iter().enumerate() {
            let (i, j) = (k % 7, k / 7);
            assert_eq!(crossing.node as usize, k);
            assert_eq!(network.contacts[k], NodeContact::Crossing(k as u32));
            assert_eq!(network.strands[crossing.warp as usize].yarn as usize, i);
            assert_eq!(network.strands[crossing.weft as usize].yarn as usize, 7 + j);
            let front = network.strands_of(crossing.node).start;
            let on_top = over(i as i64, j as i64);
            assert_eq!(front == crossing.warp, on_top, "{name} {i} {j}");
            assert_eq!(draft.warp_over(i, j), on_top);
            assert_eq!(network.front[k], [0.0, 0.0, 1.0]);
        }
    }
}

#[test]
fn counts_lengths_and_neighbours() {
    let network = plain([3, 4]);
    assert_eq!(network.nodes(), 12 + 2 * 3 + 2 * 4);
    assert_eq!(network.strands.len(), 2 * 12 + 2 * 3 + 2 * 4);
    assert_eq!(network.yarns.len(), 7);
    assert_eq!(network.segments().count(), 3 * 5 + 4 * 4);
    for (y, yarn) in network.yarns.iter().enumerate() {
        let along: Vec<u32> = network.along(y as u32).collect();
        assert_eq!(along.len() as u32, yarn.strands);
        let ends = [along[0], along[along.len() - 1]];
        for (k, &s) in along.iter().enumerate() {
            let strand = network.strands[s as usize];
            assert_eq!(strand.held, ends.contains(&s));
            let rod = network.contacts[strand.node as usize] == NodeContact::Rod;
            assert_eq!(rod, ends.contains(&s));
            assert_eq!(strand.prev, if k == 0 { NONE } else { along[k - 1] });
            // Rest lengths are distances: the flat cloth is unstretched.
            if k > 0 {
                let before = network.strands[along[k - 1] as usize];
                let (p, q) = (before.node as usize, strand.node as usize);
                let d = |a: usize| network.points[q][a] - network.points[p][a];
                let axis = usize::from(y < 3);
                let rest = strand.arc - before.arc;
                assert!((d(axis) - rest).abs() < 1e-15 && d(1 - axis) == 0.0);
                let inner = k > 1 && k + 1 < along.len();
                let spacing = [1e-3, 2e-3][axis] * if inner { 1.0 } else { 0.5 };
                assert!((rest - spacing).abs() < 1e-15, "{y} {k} {rest}");
            }
        }
    }
    assert_eq!(network.points[4], [0.5e-3 + 1e-3, 1e-3 + 2e-3, 0.0]);
}

#[test]
fn fringe_crimp_size_and_stripes() {
    let draft = Draft::named("plain").unwrap();
    let mut cloth = Woven::of_size([10.2e-3, 6e-3], [1e-3, 2e-3], YarnMaterial::default());
    assert_eq!(cloth.counts, [10, 3]);
    cloth.fringe = [0.0; 2];
    cloth.crimp = [1.0, 1.05];
    cloth.materials.push(YarnMaterial::default());
    cloth.warp_materials = vec![0, 0, 1];
    let network = cloth.build(&draft).unwrap();
    assert_eq!(network.nodes(), 30);
    let materials: Vec<u32> = network.yarns.iter().map(|y| y.material).collect();
    assert_eq!(materials, [0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0]);
    let weft = network.yarns[10];
    let length = network.strands[weft.last as usize].arc;
    assert!((length - 1.05 * 9e-3).abs() < 1e-15);
    assert!(network.strands[weft.first as usize].held);
    // A single warp without fringe leaves the wefts one visit each.
    cloth.counts = [1, 3];
    let short = WeaveError::Network(YarnError::ShortYarn { yarn: 1, visits: 1 });
    assert_eq!(cloth.build(&draft), Err(short));
    let mut cloth = Woven::new([1, 1], [1e-3; 2], YarnMaterial::default());
    assert_eq!(cloth.build(&draft).unwrap().nodes(), 5);
    cloth.counts = [0, 1];
    assert!(cloth.build(&draft).is_err());
    cloth.counts = [usize::MAX, 2];
    assert!(cloth.build(&draft).is_err());
    let nan = Woven::of_size([f64::NAN, 1.0], [0.0, 1.0], YarnMaterial::default());
    assert!(nan.build(&draft).is_err());
}

#[test]
fn loom_and_picture_agree() {
    let loom: Draft = "# 2/2 twill\nthreading 1 2\n  3 4\ntie-up\n 1: 1 2\n 2: 2 3\n\
                       3: 3 4\n 4 :4 1\ntreadling 1 2 3 4"
        .parse()
        .unwrap();
    assert_eq!(loom, Draft::named("twill-2-2").unwrap());
    let picture: Draft = "matrix\n . X X .\n X1|.\n X..X   # second weft\n\n - - x X"
        .parse()
        .unwrap();
    assert_eq!(picture.wefts(), 4);
    assert!(picture.warp_over(2, 0) && !picture.warp_over(0, 0));
    // Two treadles at once raise the shafts of both.
    let both: Draft = "threading 1 2 3\ntie-up 1: 1 2: 2 3: 3\ntreadling 1+2 3 + 1 2"
        .parse()
        .unwrap();
    assert_eq!(both, "matrix\n.X.\nX.X\nXX.".parse().unwrap());
}

#[test]
fn mistakes_name_place_and_reason() {
    let cases = [
        ("", "1:1", "a matrix is missing"),
        ("matrix", "1:1", "no weft"),
        ("matrix\nX.\n.X.\n", "3:1", "row 2 has 3 symbols"),
        ("matrix\nX.\n. q\n", "3:3", "unknown symbol `q`"),
        ("matrix\nXX.\nX.X\n", "2:1", "warp 1 floats over every weft"),
        ("matrix\nX.\n..\n.X", "3:1", "weft 2 floats over every warp"),
        ("matrix\nX.\nmatrix\n", "3:1", "matrix is given twice"),
        (
            "cloth\n",
            "1:1",
            "expected matrix, threading, tie-up or treadling",
        ),
        ("threading 1 2\ntreadling 1 2", "2:14", "tie-up is missing"),
        ("threading 1 2\nmatrix X.", "2:1", "not both"),
        (
            "threading 1 0\n",
            "1:13",
            "`0`: expected the number of a shaft",
        ),
        (
            "threading\ntie-up 1: 1\ntreadling 1",
            "1:1",
            "the draft has no warp",
        ),
        (
            "threading 1 2\ntie-up 1: 1 2: 3\ntreadling 1 2",
            "2:16",
            "shaft 3 does not exist: there are 2",
        ),
        (
            "threading 1 2\ntie-up 1: 1 2: 2\ntreadling 1 3",
            "3:13",
            "treadle 3 does not exist: there are 2",
        ),
        (
            "threading 1 2\ntie-up 1: 1 1: 2\ntreadling 1",
            "2:13",
            "treadle 1 is given twice",
        ),
        (
            "threading 1 2\ntie-up 1: 1 3: 2\ntreadling 1",
            "2:13",
            "treadle 3 does not exist",
        ),
        (
            "threading 1 2\ntie-up 1: 1 2: 2\ntreadling 1 2 +",
            "3:15",
            "after +",
        ),
        (
            "threading 1 2\ntie-up 1: 1 2: 1\ntreadling 1 2",
            "1:11",
            "warp 1 floats",
        ),
        (
            "threading 99999999999 1\ntie-up 1: 1\ntreadling 1",
            "1:11",
            "at most",
        ),
    ];
    for (text, at, message) in cases {
        let found = error(text);
        assert_eq!(found.0, at, "{text}: {}", found.1);
        assert!(found.1.contains(message), "{text}: {}", found.1);
    }
    assert!(
        Draft::named("tweed")
            .unwrap_err()
            .to_string()
            .contains("satin-5")
    );
    let text = "# é\r\nmatrix\r\n X . é\n";
    let error = text.parse::<Draft>().unwrap_err();
    assert_eq!(&text[error.place().unwrap().span.clone()], "é");
    assert_eq!(error.place().unwrap().column, 6);
    assert!(Draft::from_rows::<Vec<bool>>(&[]).is_err());
    assert!(Draft::from_rows(&[vec![], vec![]]).is_err());
}

proptest! {
    #[test]
    fn text_goes_round(warps in 1usize..7, bits in prop::collection::vec(any::<bool>(), 1..42)) {
        let rows: Vec<&[bool]> = bits.chunks_exact(warps).collect();
        if let Ok(draft) = Draft::from_rows(&rows) {
            prop_assert_eq!(draft.to_string().parse::<Draft>().unwrap(), draft);
        }
    }

    #[test]
    fn any_text_is_answered(text in "\\PC*") {
        let _ = text.parse::<Draft>();
    }

    #[test]
    fn words_in_any_order_are_answered(
        words in prop::collection::vec(
            prop::sample::select(vec![
                "matrix", "threading", "tie-up", "treadling", "\n", "1", "2", "1:", "2 :", "+",
                "1+2", "X.", ".X", "#", "0", "18446744073709551616", "é",
            ]),
            0..40,
        )
    ) {
        let text = words.join(" ");
        if let Err(error) = text.parse::<Draft>() {
            let at = error.place().unwrap();
            prop_assert!(text.get(at.span.clone()).is_some());
            let lines = text.lines().count().max(1);
            prop_assert!(at.line >= 1 && at.line <= lines && at.column >= 1);
        }
    }
}
