//! One mistake in a configuration that is valid otherwise, and the one finding that it must give.

use isochrone_engine::{Diagnostic, Diagnostics, Plan, Problem, Rules, Source};

pub(crate) const VALID: &str = r#"[node]
name = "level"

[[task]]
name = "fast"
period = "1ms"
ob = 35
phase = "100us"
priority = 80
cpu = 1
wake = "hybrid"
overrun = "skip"

[[input]]
name = "raw"
type = "LREAL"
service = "plant/analog"
channel = 7
task = "fast"
default = 0.5
max_age = "20ms"
on_stale = "hold"

[[input]]
name = "start"
type = "INT"

[[block]]
name = "scale"
type = "ScaleLinear"
task = "fast"
[block.in]
x = "raw"
x1 = 0.0
y1 = 0.0
x2 = 27648.0
y2 = 1.7
yMin = 0.0
yMax = 1.75

[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
count = 3
[block.in]
value = "scale.y"
setChangeRate = 10.0

[[block]]
name = "saw"
type = "SawTooth"
[block.in]
startValue = "start"
timeRange = 50
endlessSteps = true

[[output]]
service = "plant/level"
task = "fast"
signals = ["scale.y", "ramp.0.delayedValue"]
"#;

pub(crate) fn plan(text: &str) -> Result<Plan, Diagnostics> {
    let source = Source { name: "level.toml".into(), text: text.into() };
    Plan::new(source, &Rules::default())
}

/// The value of a pin of the first task when the node starts.
pub(crate) fn start_value(plan: &Plan, name: &str) -> f64 {
    let image = &plan.tasks[0].image;
    let slot = (0..image.len()).find(|slot| plan.slot_name(0, *slot) == name);
    image[slot.unwrap_or_else(|| panic!("no {name}"))]
}

/// The findings about a text in which `«` stands where the first of them must point.
pub(crate) fn findings(marked: &str) -> Vec<Diagnostic> {
    match plan(&marked.replace('«', "")) {
        Ok(plan) => plan.warnings,
        Err(findings) => findings.all,
    }
}

/// Line and column of the mark, both from 1.
fn mark(marked: &str) -> (usize, usize) {
    let before: Vec<&str> = marked.split('«').next().unwrap_or_default().split('\n').collect();
    (before.len(), before.last().map_or(0, |line| line.chars().count()) + 1)
}

/// Asserts that a text gives one finding, where the mark stands, with these words.
#[track_caller]
pub(crate) fn assert_one(name: &str, marked: &str, problem: Problem, message: &str, help: &str) {
    assert_found(name, marked, &format!("{problem:?}"), message, help);
}

#[track_caller]
fn assert_found(name: &str, marked: &str, problem: &str, message: &str, help: &str) {
    assert_eq!(marked.matches('«').count(), 1, "{name}: one mark");
    let found = findings(marked);
    let [finding] = &found[..] else { panic!("{name}: {} findings: {found:#?}", found.len()) };
    assert_eq!(format!("{:?}", finding.problem), problem, "{name}: {finding:?}");
    let source = Source { name: String::new(), text: marked.replace('«', "").into() };
    assert_eq!(source.position(finding.span.start), mark(marked), "{name}: {finding:?}");
    assert!(finding.message.contains(message), "{name}: {:?}", finding.message);
    let written = finding.help.as_deref().unwrap_or_default();
    assert!(written.contains(help), "{name}: {:?} has help {written:?}", finding.message);
}

/// Asserts what is found of mistakes in [`VALID`], each made alone.
///
/// A row is `mistake | words of the message | words of the help`, with `\n` for the end of a line. It
/// stands below the problem and the place, of which the mistake is another value (`value of`), or
/// `instead of`, `before` or `after` which it stands; without a place it is `text -> what stands instead`.
#[track_caller]
pub(crate) fn assert_mistakes(table: &str) {
    let (mut problem, mut place, mut rows) = ("", String::new(), 1);
    for line in table.lines().map(str::trim).filter(|line| !line.is_empty()) {
        let Some((mistake, finding)) = line.split_once(" | ") else {
            assert!(rows > 0, "no row stands above {line:?}");
            let (of, at) = line.split_once(": ").unwrap_or((line, ""));
            (problem, place, rows) = (of, at.replace("\\n", "\n"), 0);
            continue;
        };
        rows += 1;
        let (message, help) = finding.split_once(" | ").unwrap_or((finding, ""));
        let (from, to) = made(&place, &mistake.trim_end().replace("\\n", "\n"));
        assert_eq!(VALID.matches(&from).count(), 1, "{line}: {from:?} must stand once");
        assert_found(line, &VALID.replace(&from, &to), problem, message.trim_end(), help);
    }
    assert!(rows > 0, "the last row is none");
}

/// The text that a mistake replaces, and by what.
fn made(place: &str, mistake: &str) -> (String, String) {
    let (how, place) = match place.split_once(" of ") {
        Some((how, place)) => (how, place),
        None => place.split_once(' ').unwrap_or_default(),
    };
    let key = place.split('=').next().unwrap_or_default();
    let to = match how {
        "value" => format!("{key}= «{mistake}"),
        "instead" => mistake.to_owned(),
        "before" => format!("{mistake}\n{place}"),
        "after" => format!("{place}\n{mistake}"),
        _ => {
            let (from, to) = mistake.split_once(" -> ").expect("text -> what stands instead");
            return (from.trim_end_matches(' ').to_owned(), to.to_owned());
        }
    };
    (place.to_owned(), to)
}
