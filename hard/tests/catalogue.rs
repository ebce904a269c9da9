//! The catalogue: every case has the status that it is recorded with.

use std::collections::BTreeSet;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use selvedge_hard::{Case, Expected, HardError, Is, Pace, Report, Status, cases, find, run};

/// Runs cases on two threads; what ended otherwise than recorded.
fn surprises(chosen: &[&'static Case]) -> Vec<String> {
    let next = AtomicUsize::new(0);
    let wrong = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some(case) = chosen.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let report = run(case, &[], 1200.0);
                    println!("{:?} {:.2} s {}", report.status, report.seconds, case.name);
                    if report.status != recorded(case) {
                        wrong.lock().expect("a lock").push(told(&report));
                    }
                }
            });
        }
    });
    wrong.into_inner().expect("a lock")
}

fn recorded(case: &Case) -> Status {
    match case.expected {
        Expected::Passes => Status::Pass,
        Expected::Fails(_) => Status::Fail,
        Expected::NotYet(_) => Status::Skipped,
    }
}

fn told(report: &Report) -> String {
    format!(
        "{} {}: {:?}, {:?} {:#?}",
        report.number, report.case, report.status, report.note, report.figures
    )
}

fn paced(pace: Pace) -> Vec<&'static Case> {
    let all = cases::all().iter().copied();
    all.filter(|c| c.pace == pace).collect()
}

/// Quick cases pass or fail as they are recorded: a change either way shows.
#[test]
fn quick_cases_are_as_recorded() {
    let wrong = surprises(&paced(Pace::Quick));
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The same for the slow ones, some of which take minutes.
#[test]
#[ignore = "slow: cargo test -p selvedge-hard --release -- --ignored"]
fn slow_cases_are_as_recorded() {
    let wrong = surprises(&paced(Pace::Slow));
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Numbers and names are there once, the 48 of the suite and at least twelve
/// of ours are there, and every case says what is measured.
#[test]
fn the_catalogue_is_whole() {
    let all = cases::all();
    let numbers: BTreeSet<u16> = all.iter().map(|c| c.number).collect();
    let names: BTreeSet<&str> = all.iter().map(|c| c.name).collect();
    assert_eq!(numbers.len(), all.len());
    assert_eq!(names.len(), all.len());
    assert!((1..=60).all(|n| numbers.contains(&n)), "{numbers:?}");
    for case in all {
        assert!(
            case.bounds.iter().any(|b| b.is != Is::Told),
            "{}: nothing is required",
            case.name
        );
        assert!(!case.setup.is_empty() && !case.naive.is_empty());
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        assert!(case.name.chars().all(plain), "{}", case.name);
    }
}

/// A wrong name is answered with the nearest one.
#[test]
fn a_wrong_name_is_put_right() {
    let Err(HardError::Unknown { nearest, .. }) = find("free-fal") else {
        panic!("there is no such case");
    };
    assert_eq!(nearest, "free-fall");
    assert_eq!(find("47").expect("a number").name, "crumple");
}

/// A setting that does not exist, or that breaks every scene, is a failed case
/// that says why, and no panic.
#[test]
fn broken_settings_fail_with_a_reason() {
    let case = find("compressed-start").expect("a case");
    for (key, value) in [("solver.kindd", "cg"), ("integrator.max_step", "-1")] {
        let report = run(case, &[(key.to_owned(), value.to_owned())], 10.0);
        assert_eq!(report.status, Status::Fail);
        let note = report.note.expect("a reason");
        assert!(note.contains(key), "{note}");
    }
    // No time at all.
    let report = run(case, &[], 0.0);
    assert_eq!(report.status, Status::Fail);
    assert!(report.note.expect("a reason").contains("not done"));
}
