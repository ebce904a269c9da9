//! Stitch charts: golden counts and rows, mistakes with row and stitch, and
//! readers that never panic.

use proptest::prelude::*;
use selvedge_yarn_model::chart::{
    BUILT_IN_CHARTS, Chart, ChartError, ChartRow, KnitoutError, Op, StitchPattern, read_knitout,
};
use serde_json::Value;

/// Repeats across and upwards of the golden charts.
const GOLDEN: [(&str, usize, usize); 6] = [
    ("stockinette", 20, 5),
    ("garter", 20, 5),
    ("rib_2x2", 5, 5),
    ("feather_and_fan", 2, 3),
    ("openwork_diamonds", 4, 2),
    ("flame_chevron", 4, 1),
];

fn oracle() -> Value {
    serde_json::from_str(include_str!("oracles/knit.json")).unwrap()
}

fn row_text(row: &ChartRow) -> String {
    let words: Vec<String> = row.stitches.iter().map(Op::to_string).collect();
    words.join(" ")
}

/// Widths, rows, loops and yarn-overs, and the rows as the right side shows
/// them.
#[test]
fn golden_charts() {
    let oracle = oracle();
    for (name, across, upwards) in GOLDEN {
        let pattern = StitchPattern::built_in(name).unwrap();
        let golden = &oracle["charts"][name];
        let written = &oracle["written"][name];
        assert_eq!(pattern.multiple() as u64, written["multiple"], "{name}");
        assert_eq!(pattern.plus() as u64, written["plus"], "{name}");
        let chart = pattern.chart(across, upwards).unwrap();
        assert_eq!(chart.cast_on() as u64, golden["width"], "{name}");
        assert_eq!(chart.rows().len() as u64, golden["rows"], "{name}");
        assert_eq!(chart.loops() as u64, golden["loops"], "{name}");
        let stitches = chart.rows().iter().flat_map(|r| &r.stitches);
        let yarn_overs = stitches.filter(|s| **s == Op::YarnOver).count();
        assert_eq!(yarn_overs as u64, golden["yarn_overs"], "{name}");
        let rows = golden["rs_view_first_rows"].as_array().unwrap();
        for (row, golden) in chart.rows().iter().zip(rows) {
            assert_eq!(row_text(row), golden.as_str().unwrap(), "{name}");
        }
        let same = pattern.chart_of(chart.cast_on(), chart.rows().len());
        assert_eq!(same, Ok(chart), "{name}");
    }
}

/// Knit and purl alternate in both directions.
#[test]
fn seed_is_a_checkerboard() {
    let chart = StitchPattern::built_in("seed")
        .unwrap()
        .chart(3, 2)
        .unwrap();
    for (r, row) in chart.rows().iter().enumerate() {
        for (j, op) in row.stitches.iter().enumerate() {
            assert_eq!(op.purl(), (r + j) % 2 == 0, "row {r}, column {j}");
        }
    }
}

/// What knitters write on one line, and the same written out.
#[test]
fn notation() {
    let row = |text: &str| {
        let text = format!("plus: 12\nmultiple: 0\nrow 1: {text}\n");
        row_text(
            &StitchPattern::parse(&text)
                .unwrap()
                .chart(0, 1)
                .unwrap()
                .rows()[0],
        )
    };
    assert_eq!(row("k6 p6"), "p p p p p p k k k k k k");
    assert_eq!(
        row("(k p)x2, ssk, K2, (yo k) x4"),
        row("k p k p ssk k k yo k yo k yo k yo k")
    );
    assert_eq!(
        row("((k p)x2 yo)x3"),
        row("k p k p yo k p k p yo k p k p yo")
    );
    assert_eq!(row("k *p2* k"), row("k p10 k"));
    assert_eq!(row("*k* k2 # the rest"), row("k12"));
    assert_eq!(
        row("k4tog p4tog kinc4 k1to5 k2"),
        "k k kinc5 kinc4 p4tog k4tog"
    );
    let shared = "row 1-2, 4 RS: *k*\nrow 3: *p*";
    assert!(matches!(
        StitchPattern::parse(shared),
        Err(ChartError::Side { row: 2, .. })
    ));
    let shared = "row 1, 3: *k*\nrows 2,4 ws: *p*";
    assert_eq!(StitchPattern::parse(shared).unwrap().rows(), 4);
}

/// Wrong-side rows turn every operation over and run the other way.
#[test]
fn wrong_side() {
    let text = "multiple: 0\nplus: 9\nrow 1 WS: k p ssk p2tog s2kp\n";
    let chart = StitchPattern::parse(text).unwrap().chart(0, 1).unwrap();
    assert!(chart.rows()[0].ws);
    assert_eq!(row_text(&chart.rows()[0]), "p k ssp k2tog s2pp");
}

fn mistake(text: &str) -> (ChartError, String) {
    let error = StitchPattern::parse(text).unwrap_err();
    let message = error.to_string();
    (error, message)
}

/// Every mistake names its row and stitch, and its place in the text.
#[test]
fn mistakes() {
    let (error, message) = mistake("multiple: 2\nrow 1: *k p*\nrow 2: *k pp*\n");
    let ChartError::UnknownOperation { at, nearest, .. } = error else {
        panic!("{message}");
    };
    assert_eq!((at.line, at.column, at.span.clone()), (3, 11, 35..37));
    assert_eq!(nearest, Some("p"));
    assert!(
        message.starts_with("3:11: row 2, stitch 2: unknown operation `pp`"),
        "{message}"
    );
    let (_, message) = mistake("row 1: *k2tgo yo*");
    assert!(message.contains("did you mean `k2tog`?"), "{message}");

    let (error, message) = mistake("multiple: 0\nplus: 8\nrow 1: k2tog k6\nrow 2: k8\n");
    let expected = "4:8: row 2, stitch 8: the row takes 8 stitches, the row before leaves 7";
    assert_eq!(message, expected);
    assert!(matches!(error, ChartError::Unbalanced { left: 7, .. }));
    let (_, message) = mistake("multiple: 0\nplus: 8\nrow 1: k8\nrow 2: k6 yo\n");
    let expected = "4:11: row 2, stitch 7: the row takes 6 stitches, the row before leaves 8";
    assert_eq!(message, expected);

    let (_, message) = mistake("multiple: 0\nplus: 5\nrow 1: k4 k3tog\n");
    let expected = "3:11: row 1, stitch 5: `k3tog` at the border takes 3 stitches, 1 are left";
    assert_eq!(message, expected);
    let (_, message) = mistake("multiple: 2\nplus: 1\nrow 1: *yo ssk*\n");
    let expected = "3:12: row 1, stitch 6: `ssk` at the border takes 2 stitches, 1 are left";
    assert_eq!(message, expected);

    // Six stitches fit; the fault shows at odd widths.
    let (error, message) = mistake("multiple: 3\nrow 1: *k*\nrow 2: k *p2* k\nrow 3: *k*");
    assert!(
        matches!(
            error,
            ChartError::Repeat {
                row: 2,
                stitch: 2,
                over: 1,
                ..
            }
        ),
        "{message}"
    );
}

/// Mistakes of the rest of the format.
#[test]
fn more_mistakes() {
    let (error, message) = mistake("multiple: 3\nrow 1: k *p4* k");
    assert!(
        matches!(
            error,
            ChartError::Repeat {
                row: 1,
                stitch: 2,
                ..
            }
        ),
        "{message}"
    );
    assert!(
        message.starts_with("2:11: row 1, stitch 2: the repeat takes 4"),
        "{message}"
    );

    let (error, message) = mistake("row 1: *k3to2 k*");
    assert!(
        matches!(
            error,
            ChartError::SplitStack {
                row: 1,
                stitch: 1,
                ..
            }
        ),
        "{message}"
    );
    assert!(message.contains("the stack would split"), "{message}");

    for (text, expected) in [
        ("", "the chart has no rows"),
        ("row 1:", "1:7: the chart has no stitches in this row"),
        ("multiple: 0\nrow 1: *k*", "the chart has no stitches"),
        ("row 2: *k*", "row 1 is missing"),
        ("row 1: *k*\nrow 1: *p*", "2:5: row 1 is given twice"),
        ("row 0: *k*", "1:5: rows are numbered from 1"),
        ("row 3-2: *k*", "1:5: rows are numbered from 1"),
        (
            "rwo 1: *k*",
            "1:1: unknown key `rwo 1` (did you mean `row`?)",
        ),
        ("hello", "1:1: expected `key: value`"),
        (
            "multiple: many",
            "1:11: expected a whole number, found `many`",
        ),
        ("multiple: 2\nmultiple: 2", "2:1: given twice"),
        ("row 1: *k", "1:8: the repeat is never closed"),
        ("row 1: *k* *p*", "1:12: one repeat a row"),
        ("row 1: *yo*", "1:11: a repeat that takes no stitch"),
        ("row 1: (k *p*)", "1:11: `*` within a group"),
        ("row 1: (k", "1:8: `(` is never closed"),
        ("row 1: k)", "1:9: `)` without `(`"),
        ("row 1: x3", "1:8: a count needs something to repeat"),
        ("row 1: k é", "1:10: unexpected `é`"),
        (
            "row 1: k12tog",
            "1:8: row 1, stitch 1: `k12tog` needs 2 to 9 loops",
        ),
        ("row 1: k999999", "1:9: number: 999999 is more than 100000"),
        ("row 1: (k9999)x9999", "1:15: stitches of a row"),
        ("row 1 WS: *k*\nrow 2 WS: *k*", "2:5: row 2 is marked WS"),
    ] {
        let (_, message) = mistake(text);
        assert!(message.starts_with(expected), "{text:?}: {message}");
    }

    let pattern = StitchPattern::built_in("openwork-diamonds").unwrap();
    let message = pattern.chart_of(26, 8).unwrap_err().to_string();
    assert_eq!(
        message,
        "26 stitches: the chart needs 6·n + 1 (for example 25)"
    );
    // A row alone marked as a right-side row cannot be worked again from the
    // wrong side.
    let odd = StitchPattern::parse("row 1 RS: *k*").unwrap();
    assert!(odd.chart(4, 1).is_ok());
    assert!(matches!(
        odd.chart(4, 2),
        Err(ChartError::Side { row: 1, .. })
    ));
    let error = StitchPattern::built_in("stokinette").unwrap_err();
    assert!(error.to_string().contains("did you mean `stockinette`?"));
}

/// Charts that were not read from text are checked too.
#[test]
fn charts_by_hand() {
    let row = |ws, stitches: &[Op]| ChartRow {
        ws,
        stitches: stitches.to_vec(),
    };
    let good = vec![row(false, &[Op::KNIT; 3]), row(true, &[Op::PURL; 3])];
    assert_eq!(Chart::new("good", 3, good.clone()).unwrap().loops(), 6);
    let error = Chart::new("wide", 4, good.clone()).unwrap_err();
    assert!(matches!(
        error,
        ChartError::Unbalanced {
            row: 1,
            stitch: 3,
            ..
        }
    ));
    let twice = vec![good[0].clone(), good[0].clone()];
    assert!(matches!(
        Chart::new("", 3, twice),
        Err(ChartError::Side { row: 2, .. })
    ));
    assert!(matches!(
        Chart::new("", 3, vec![]),
        Err(ChartError::Empty { .. })
    ));
    assert!(matches!(
        Chart::new("", 0, good),
        Err(ChartError::Empty { .. })
    ));
}

const HEAD: &str = ";!knitout-2\n;;Carriers: 1 2\ninhook + 1\n\
    tuck - f3 1\ntuck - f1 1\ntuck + f0 1\ntuck + f2 1\nreleasehook 1\n";

fn knitout(body: &str) -> Result<Vec<String>, KnitoutError> {
    let knitout = read_knitout(&format!("{HEAD}{body}"))?;
    Ok(knitout.chart.rows().iter().map(row_text).collect())
}

/// Knit, purl by transfer, lace by transfer, and the edges.
#[test]
fn knitout_maps() {
    let row = |text: &str| text.to_owned();
    let plain = "knit - f3 1\nknit - f2 1\nknit - f1 1\nknit - f0 1\n";
    assert_eq!(knitout(plain).unwrap(), ["k k k k"]);
    let rib = format!(
        "{plain}xfer f1 b1\nxfer f3 b3\nknit + f0 1\nknit + b1 1\nknit + f2 1\nknit + b3 1\nouthook 1\n"
    );
    assert_eq!(knitout(&rib).unwrap(), ["k k k k", "k p k p"]);
    // Loop 1 goes over to needle 2 and lies behind the loop there; the empty
    // needle makes a yarn-over.
    let lace = format!(
        "{plain}xfer f1 b1\nrack -1\nrack +1\nxfer b1 f2\nrack 0\n\
         knit + f0 1\nknit + f1 1\nknit + f2 1\nknit + f3 1\n"
    );
    assert_eq!(knitout(&lace).unwrap(), [row("k k k k"), row("k yo ssk k")]);
    let lace = lace.replace(
        "xfer f1 b1\nrack -1\nrack +1\nxfer b1 f2\nrack 0",
        "xfer f2 b2\nrack -1\nxfer b2 f1\nrack 0",
    );
    assert_eq!(
        knitout(&lace).unwrap(),
        [row("k k k k"), row("k k2tog yo k")]
    );
    let dropped = format!("{plain}drop f0\ndrop f1\nx-presser on\n");
    let result = read_knitout(&format!("{HEAD}{dropped}")).unwrap();
    assert_eq!(result.warnings.len(), 2);
    assert_eq!(result.chart.cast_on(), 4);
}

/// What does not map names line and operation.
#[test]
fn knitout_refuses() {
    let plain = "knit - f3 1\nknit - f2 1\nknit - f1 1\nknit - f0 1\n";
    let second = "knit + f0 1\nknit + f1 1\nknit + f2 1\nknit + f3 1\n";
    for (body, expected) in [
        (
            format!("{plain}tuck + f0 1\n"),
            "13:1: `tuck + f0 1` cannot be charted: a tuck",
        ),
        (
            format!("{plain}split + f0 b0 1\n"),
            "13:1: `split + f0 b0 1` cannot be charted",
        ),
        (
            format!("{plain}drop f1\n{second}"),
            "13:1: `drop f1` cannot be charted",
        ),
        (
            format!("{plain}{plain}"),
            "13:1: `knit - f3 1` cannot be charted: a second row",
        ),
        (
            format!("{plain}knit + f0 1\nknit + f2 1\nknit + f3 1\n"),
            "11:1: `knit - f1 1` cannot be charted: the next row does not work this loop",
        ),
        (
            format!("{plain}xfer f1 b1\nrack 2\nxfer b1 f3\nrack 0\n{second}"),
            "19:1: `knit + f2 1` cannot be charted: its loops have crossed others (a cable)",
        ),
        (
            format!("{plain}xfer f1 b2\n"),
            "13:1: `xfer f1 b2`: the needles are not aligned",
        ),
        (
            format!("{plain}xfer f1 f2\n"),
            "13:1: `xfer f1 f2`: a transfer goes to the other bed",
        ),
        (
            format!("{plain}knti + f0 1\n"),
            "13:1: unknown operation `knti` (did you mean `knit`?)",
        ),
        (format!("{plain}knit f0\n"), "13:1: `knit f0`: wrong number"),
        (
            format!("{plain}knit + q0 1\n"),
            "13:1: `knit + q0 1`: expected a needle",
        ),
        (
            format!("{plain}knit ? f0 1\n"),
            "13:1: `knit ? f0 1`: expected direction",
        ),
        (String::new(), "the chart has no rows"),
    ] {
        let result = knitout(&body);
        let message = result.map_err(|e| e.to_string()).err().unwrap_or_default();
        assert!(message.starts_with(expected), "{body}: {message}");
    }
    assert_eq!(read_knitout("knit + f0 1"), Err(KnitoutError::Magic));
}

/// Valid text with one character changed, left out or put in.
fn mutated(text: &'static str) -> impl Strategy<Value = String> {
    let chars: Vec<char> = text.chars().collect();
    (
        0..chars.len(),
        any::<char>(),
        0..4u8,
        "[kp2 x*()yost:,0-9-]",
    )
        .prop_map(move |(at, odd, how, usual)| {
            let mut chars = chars.clone();
            match how {
                0 => chars[at] = odd,
                1 => drop(chars.remove(at)),
                2 => chars.insert(at, odd),
                _ => chars.splice(at..=at, usual.chars()).for_each(drop),
            }
            chars.into_iter().collect()
        })
}

const LACE: &str = "name: a\nmultiple: 18 # b\nrow 1 RS: *k*\nrow 2 WS: *p*\n\
    row 3: *(k2tog)x3 (yo k1)x6 (k2tog)x3*\nrow 4: *k*\n";
const MACHINE: &str = ";!knitout-2\n;;Carriers: 1\ntuck - f2 1\ntuck + f1 1\n\
    knit - f2 1\nknit - f1 1\nxfer f1 b1\nrack -1\nrack +1\nxfer b1 f2\nrack 0\n\
    knit + f1 1\nknit + f2 1\nmiss + f3 1\ndrop f1\n";

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Readers return errors whatever the text, with a place inside it.
    #[test]
    fn never_panics(text in "\\PC{0,80}", rows in "(row [0-9]{1,2}: [kpyostg0-9x()* ,]{0,20}\n){0,5}") {
        for text in [text, rows] {
            if let Err(ChartError::Syntax { at, .. }) = StitchPattern::parse(&text) {
                prop_assert!(text.get(at.span).is_some());
            }
            let _ = read_knitout(&text);
            let _ = read_knitout(&format!(";!knitout-2\n{text}"));
        }
    }

    /// The same for text that was once right.
    #[test]
    fn never_panics_on_near_misses(chart in mutated(LACE), machine in mutated(MACHINE)) {
        if let Err(ChartError::Syntax { at, .. }) = StitchPattern::parse(&chart) {
            prop_assert!(chart.get(at.span).is_some());
        }
        let _ = read_knitout(&machine);
    }

    /// Any sequence of machine operations.
    #[test]
    fn never_panics_on_operations(
        ops in prop::collection::vec((0..6u8, any::<bool>(), 0..5i32, any::<bool>(), -1..2i32), 0..40)
    ) {
        let mut text = String::from(";!knitout-2\n");
        for (what, right, needle, back, rack) in ops {
            let d = if right { '+' } else { '-' };
            let (bed, other) = if back { ('b', 'f') } else { ('f', 'b') };
            text += &match what {
                0..=2 => format!("knit {d} {bed}{needle} 1\n"),
                3 => format!("tuck {d} {bed}{needle} 1\n"),
                4 => {
                    let to = if back { needle + rack } else { needle - rack };
                    format!("rack {rack}\nxfer {bed}{needle} {other}{to}\n")
                }
                _ => format!("drop {bed}{needle}\n"),
            };
        }
        let _ = read_knitout(&text);
    }
}

/// All built-in charts fit at several widths.
#[test]
fn built_in_charts_fit() {
    for name in BUILT_IN_CHARTS {
        let pattern = StitchPattern::built_in(name).unwrap();
        assert_eq!(pattern.name(), name);
        for across in 1..5 {
            let chart = pattern.chart(across, 2).unwrap();
            assert_eq!(
                chart.cast_on(),
                across * pattern.multiple() + pattern.plus()
            );
        }
    }
}
