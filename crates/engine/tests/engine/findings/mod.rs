//! One mistake in a configuration that is valid otherwise, and the one finding that it must give.

use isochrone_engine::{Finding, Findings, Plan, Problem, Rules, Source};

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

pub(crate) fn plan(text: &str) -> Result<Plan, Findings> {
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
pub(crate) fn findings(marked: &str) -> Vec<Finding> {
    match plan(&marked.replace('«', "")) {
        Ok(plan) => plan.warnings,
        Err(findings) => findings.findings,
    }
}

/// Line and column of the mark, both from 1.
fn mark(marked: &str) -> (usize, usize) {
    let before: Vec<&str> = marked.split('«').next().unwrap_or_default().split('\n').collect();
    (before.len(), before.last().map_or(0, |line| line.chars().count()) + 1)
}

/// Asserts that a text gives one finding, where the mark stands, with these words.
pub(crate) fn assert_one(name: &str, marked: &str, problem: Problem, message: &str, help: &str) {
    assert_eq!(marked.matches('«').count(), 1, "{name}: one mark");
    let found = findings(marked);
    let [finding] = &found[..] else { panic!("{name}: {} findings: {found:#?}", found.len()) };
    assert_eq!(finding.problem, problem, "{name}: {finding:?}");
    let source = Source { name: String::new(), text: marked.replace('«', "").into() };
    assert_eq!(source.position(finding.span.start), mark(marked), "{name}: {finding:?}");
    assert!(finding.message.contains(message), "{name}: {:?}", finding.message);
    let written = finding.help.as_deref().unwrap_or_default();
    assert!(written.contains(help), "{name}: {:?} has help {written:?}", finding.message);
}

/// Mistakes at one place of [`VALID`] that are one problem.
pub(crate) struct Mistakes {
    problem: Problem,
    place: &'static str,
    /// What stands there instead, around what is mistaken.
    around: (String, String),
}

/// Mistakes that stand instead of a text, each with its mark.
pub(crate) fn instead_of(problem: Problem, place: &'static str) -> Mistakes {
    Mistakes { problem, place, around: Default::default() }
}

/// Other values of a key, which are what the finding points to; the place is the key's line.
pub(crate) fn value_of(problem: Problem, place: &'static str) -> Mistakes {
    let (key, _) = place.split_once('=').unwrap();
    Mistakes { problem, place, around: (format!("{key}= «"), String::new()) }
}

/// Lines before a text, each with its mark.
pub(crate) fn before(problem: Problem, place: &'static str) -> Mistakes {
    Mistakes { problem, place, around: (String::new(), format!("\n{place}")) }
}

/// Lines behind a text, each with its mark.
pub(crate) fn after(problem: Problem, place: &'static str) -> Mistakes {
    Mistakes { problem, place, around: (format!("{place}\n"), String::new()) }
}

impl Mistakes {
    /// Asserts that a mistake gives one finding, with these words and this help.
    pub(crate) fn finds(self, mistake: &str, message: &str, help: &str) -> Self {
        let Self { problem, place, around: (open, close) } = &self;
        assert_eq!(VALID.matches(place).count(), 1, "{place:?} must stand once");
        let marked = VALID.replace(place, &format!("{open}{mistake}{close}"));
        assert_one(&format!("{place:?}: {mistake}"), &marked, *problem, message, help);
        self
    }
}
