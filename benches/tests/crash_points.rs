//! A death at any instruction is harmless, and so is a process that is stopped.
//!
//! These are samples. All points: `cargo run --release -p isochrone-benches --bin crash-points`.

use std::sync::OnceLock;
use std::time::Duration;

use isochrone_benches::crash_points::{
    Blow, Circumstance, Point, Role, Selection, Stage, Verdict, can_trace, spread,
};
use isochrone_benches::{Profile, find};
use isochrone_testing::{not_tested, volume};

/// Whoever is held up by the dead is held up for good. How soon others work is measured by the program,
/// on a machine that does nothing else.
const WITHIN: Duration = Duration::from_secs(20);

/// A stage and all points on it, or nothing where this process may not trace others.
fn stage() -> Option<&'static (Stage, Vec<Point>)> {
    static STAGE: OnceLock<Option<(Stage, Vec<Point>)>> = OnceLock::new();
    let set = || {
        if let Err(why) = can_trace() {
            assert!(std::env::var_os("CI").is_none(), "{why}");
            not_tested("death at every instruction", &why.to_string());
            return None;
        }
        let program = find(Profile::own()).unwrap();
        let stage = Stage::new(program, WITHIN).unwrap();
        let points = stage.points(&Selection::default()).unwrap();
        Some((stage, points))
    };
    STAGE.get_or_init(set).as_ref()
}

#[track_caller]
fn assert_harmless(stage: &Stage, points: &[Point], blow: Blow) {
    let mut struck = 0;
    let mut failed = Vec::new();
    for point in points {
        let outcome = stage.strike(*point, blow);
        match outcome.verdict {
            Verdict::Pass => struck += 1,
            Verdict::NotReached => {}
            Verdict::Fail(wrong) => failed.push(format!("{point}: {}", wrong.join("; "))),
        }
    }
    assert!(
        failed.is_empty(),
        "{} of {} points:\n{}",
        failed.len(),
        points.len(),
        failed.join("\n")
    );
    // System calls vary a little between runs: a tenth of the points may be missed, or one of a few.
    let missed = points.len() - struck;
    assert!(missed <= (points.len() / 10).max(1), "{missed} of {} points", points.len());
}

#[test]
fn a_process_that_is_killed_in_its_start_or_end_keeps_nobody_from_working() {
    let Some((stage, points)) = stage() else { return };
    assert_harmless(stage, &spread(points, volume(60)), Blow::Kill);
    // What a process writes to shared memory it writes between two calls.
    let after = |point: Point| Point { steps: 300, ..point };
    let between: Vec<Point> = spread(points, volume(40)).into_iter().map(after).collect();
    assert_harmless(stage, &between, Blow::Kill);
}

#[test]
fn a_process_that_is_stopped_in_its_start_or_end_holds_nobody_up_without_a_word() {
    let Some((stage, points)) = stage() else { return };
    assert_harmless(stage, &spread(points, volume(30)), Blow::Stop);
}

#[test]
fn what_the_killed_leave_does_not_grow() {
    let Some((stage, points)) = stage() else { return };
    let cold: Vec<Point> = points.iter().filter(|point| is_cold(point)).copied().collect();
    let pile = stage.pile_up(&spread(&cold, volume(50))).unwrap();
    assert_eq!(pile.wrong, Vec::<String>::new());
    assert_eq!(pile.first, pile.last);
}

#[test]
fn each_role_has_points_in_its_start_and_its_end() {
    let Some((_, points)) = stage() else { return };
    for role in [Role::Publisher, Role::Node, Role::Subscriber] {
        for call in ["start:fchmod", "start:openat", "end:unlink", "end:exit_group"] {
            let is_one = |point: &Point| {
                point.role == role && is_cold(point) && point.to_string().contains(call)
            };
            assert!(points.iter().any(is_one), "{role:?} {call}");
        }
    }
}

fn is_cold(point: &Point) -> bool {
    point.circumstance == Circumstance::Cold
}
