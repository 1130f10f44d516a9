//! From TOML to [`Config`].

use isochrone_blocks::{PinType, is_cyclic_ob};
use isochrone_schedule::{Margin, MissLimit, Overrun, Wake, phase_between_ticks_ns};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::config::{Binding, Block, Config, Connection, Input, OnStale, Output, Task};
use crate::finding::Problem;
use crate::section::{Errors, Rule, Section, parse_integer};
use crate::time::{TIME_FORMS, parse_time_ms};
use crate::{Finding, Source};

/// Most instances that one entry may have.
const MAX_COUNT: i64 = 10_000_000;
/// A frame's channels are counted in 16 bits.
const MAX_CHANNEL: i64 = 65_535;
const PERIOD_NS: std::ops::RangeInclusive<u64> = 10_000..=3_600_000_000_000;

const CPU_BUDGET: std::ops::RangeInclusive<f64> = 0.01..=0.5;

const NODE_NAME: Rule = Rule {
    accepts: |name| {
        name.starts_with(|c: char| c.is_ascii_lowercase())
            && name.chars().all(|c| matches!(c, 'a'..='z' | '0'..='9' | '_' | '-'))
    },
    form: "a lowercase letter, then lowercase letters, digits, _ and -",
};

/// The one name that no node may have.
const LAYOUT: &str = "layout";

const NAME: Rule = Rule {
    accepts: |name| {
        name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-')
    },
    form: "a letter or _, then letters, digits, _ and -",
};

/// Reads a configuration. Whatever could be read is in the [`Config`], the rest in the findings.
pub(crate) fn parse(source: &Source) -> (Config, Vec<Finding>) {
    let (document, syntax_errors) = DeTable::parse_recoverable(&source.text);
    if !syntax_errors.is_empty() {
        // What a broken file seems to say would only add errors that are none.
        let findings = syntax_errors.iter().map(|error| {
            let message = format!("this is not TOML: {}", error.message());
            Finding::new(Problem::Syntax, error.span().unwrap_or_default(), message)
        });
        return (Config::default(), findings.collect());
    }
    let errors = Errors::default();
    let file = Section::new("the file", document.get_ref(), 0..0, &errors);
    let config = Config {
        node: node(&file),
        tasks: file.tables("task", "[[task]]").into_iter().map(task).collect(),
        inputs: file.tables("input", "[[input]]").into_iter().map(input).collect(),
        blocks: file.tables("block", "[[block]]").into_iter().map(block).collect(),
        outputs: file.tables("output", "[[output]]").into_iter().map(output).collect(),
    };
    let tasks =
        file.get("task").map(|tasks| tasks.get_ref().as_array().is_some_and(|a| a.is_empty()));
    if tasks.unwrap_or(true) {
        let finding = Finding::new(Problem::MissingKey, 0..0, "the file has no [[task]]");
        file.report(finding.help(
            "a task gives the blocks their period: [[task]] name = \"main\", period = \"1ms\"",
        ));
    }
    file.finish();
    (config, errors.into_inner())
}

fn node(file: &Section<'_>) -> Option<Spanned<String>> {
    let Some(section) = file.table("node", "[node]") else {
        if file.get("node").is_none() {
            let finding = Finding::new(Problem::MissingKey, 0..0, "the file has no [node]");
            file.report(finding.help("begin with [node] and name = \"…\""));
        }
        return None;
    };
    let name = section.name("name", &NODE_NAME);
    if let Some(name) = name.as_ref().filter(|name| name.get_ref() == LAYOUT) {
        let message = format!("[node] name \"{LAYOUT}\" is taken");
        let help = "layouts of frames are announced on isochrone/layout/…; choose another name";
        section.report(Finding::new(Problem::BadName, name.span(), message).help(help));
    }
    section.finish();
    name
}

fn task(section: Section<'_>) -> Task {
    section.required("period", "\"1ms\"");
    let period_ns = section.duration_ns(
        "period",
        |period_ns| PERIOD_NS.contains(&period_ns),
        "from \"10us\" to \"1h\"",
    );
    let task = Task {
        name: section.name("name", &NAME),
        ob: section
            .integer(
                "ob",
                |ob| i16::try_from(ob).is_ok_and(is_cyclic_ob),
                "30 to 38 or 123 to 32767",
            )
            .map(narrow),
        phase_ns: phase(&section, period_ns.as_ref()),
        priority: section
            .integer(
                "priority",
                |priority| (1..=89).contains(&priority),
                "a SCHED_FIFO priority from 1 to 89",
            )
            .map(|priority| narrow(priority).into_inner()),
        cpu: section
            .integer("cpu", |cpu| (0..=1023).contains(&cpu), "the number of a CPU, from 0 to 1023")
            .map(|cpu| narrow(cpu).into_inner()),
        wake: wake(&section, period_ns.as_ref()),
        overrun: section
            .choice("overrun", &Overrun::ALL.map(|overrun| (overrun.as_str(), overrun)))
            .map_or(Overrun::Skip, Spanned::into_inner),
        on_overrun: section.table("on_overrun", "[task.on_overrun]").and_then(overrun_limit),
        period_ns,
    };
    section.finish();
    task
}

/// `phase = "auto"` puts the releases between the kernel's ticks.
fn phase(section: &Section<'_>, period_ns: Option<&Spanned<u64>>) -> Option<Spanned<u64>> {
    let automatic = section.get("phase").filter(|phase| phase.get_ref().as_str() == Some("auto"));
    if let Some(automatic) = automatic {
        let phase_ns = phase_between_ticks_ns(*period_ns?.get_ref());
        return Some(Spanned::new(automatic.span(), phase_ns));
    }
    let phase = section.duration_ns("phase", |_| true, "less than the period, or \"auto\"")?;
    let help = "phase moves the releases within the period";
    less_than_period(section, "phase", &phase, period_ns, help);
    Some(phase)
}

/// How a task waits, and how long before its release it is awake.
fn wake(section: &Section<'_>, period_ns: Option<&Spanned<u64>>) -> Wake {
    let margin = section.duration_ns("margin", |margin_ns| margin_ns > 0, "longer than 0");
    if let Some(margin) = &margin {
        let help = "margin is the part of the period that is not slept before a release";
        less_than_period(section, "margin", margin, period_ns, help);
    }
    let cpu_budget =
        section.read("cpu_budget", "a number such as 0.10", |value| match connection(value) {
            Some(Connection::Float(budget)) if CPU_BUDGET.contains(&budget) => Ok(budget),
            Some(Connection::Float(budget)) => Err(Some(section.out_of_range(
                "cpu_budget",
                &budget.to_string(),
                "a part of one CPU, from 0.01 to 0.5",
            ))),
            _ => Err(None),
        });
    if let (Some(_), Some(cpu_budget)) = (&margin, &cpu_budget) {
        let message = "[[task]] has both margin and cpu_budget";
        let help = "margin fixes how long before a release the task is awake, cpu_budget bounds a \
                    margin that adapts; keep one";
        section.report(Finding::new(Problem::Conflict, cpu_budget.span(), message).help(help));
    }
    let written = section.choice("wake", &Wake::ALL.map(|wake| (wake.as_str(), wake)));
    let wake = match &written {
        Some(wake) => *wake.get_ref(),
        None if section.get("priority").is_none() && section.get("wake").is_none() => Wake::Sleep,
        None => Wake::Hybrid(Margin::DEFAULT),
    };
    if !matches!(wake, Wake::Hybrid(_)) {
        let margin = margin.as_ref().map(|margin| ("margin", margin.span()));
        let cpu_budget = cpu_budget.as_ref().map(|budget| ("cpu_budget", budget.span()));
        for (key, span) in margin.into_iter().chain(cpu_budget) {
            let why = match written {
                Some(_) => format!("wake = \"{}\" has no margin", wake.as_str()),
                None => "without a priority the task sleeps until its release".into(),
            };
            let message = format!("[[task]] {key} is for wake = \"hybrid\" only: {why}");
            let help = format!("write wake = \"hybrid\", or leave {key} out");
            section.report(Finding::new(Problem::Conflict, span, message).help(help));
        }
        return wake;
    }
    Wake::Hybrid(match (margin, cpu_budget) {
        (Some(margin_ns), _) => Margin::Fixed(margin_ns.into_inner()),
        (None, Some(budget)) => Margin::Adaptive { cpu_budget: budget.into_inner() },
        (None, None) => Margin::DEFAULT,
    })
}

/// Reports a time that is as long as the period, or longer.
fn less_than_period(
    section: &Section<'_>,
    key: &str,
    time_ns: &Spanned<u64>,
    period_ns: Option<&Spanned<u64>>,
    help: &str,
) {
    if period_ns.is_some_and(|period_ns| time_ns.get_ref() >= period_ns.get_ref()) {
        let message = format!("[[task]] {key} is not less than the period");
        section.report(Finding::new(Problem::OutOfRange, time_ns.span(), message).help(help));
    }
}

fn overrun_limit(section: Section<'_>) -> Option<MissLimit> {
    section.required("misses", "3");
    section.required("cycles", "1000");
    let misses = section.integer("misses", |misses| (1..=1000).contains(&misses), "from 1 to 1000");
    let cycles = section.integer("cycles", |cycles| cycles > 0, "greater than 0");
    if let (Some(misses), Some(cycles)) = (&misses, &cycles)
        && misses.get_ref() > cycles.get_ref()
    {
        let message = "[task.on_overrun] misses is greater than cycles";
        let help = format!("of {0} releases at most {0} can be missed", cycles.get_ref());
        section.report(Finding::new(Problem::OutOfRange, misses.span(), message).help(help));
    }
    section.finish();
    Some(MissLimit { misses: narrow(misses?).into_inner(), cycles: narrow(cycles?).into_inner() })
}

fn input(section: Section<'_>) -> Input {
    let types = PinType::ALL.map(|pin_type| (pin_type.as_str(), pin_type));
    // WORD is a type of outputs: no pin of a library block takes one.
    let value_type = section.choice("type", types.get(..4).unwrap_or_default());
    let value_type = match (value_type, section.get("type")) {
        (None, Some(_)) => None,
        (value_type, _) => Some(value_type.map_or(PinType::Lreal, Spanned::into_inner)),
    };
    let input = Input {
        name: section.name("name", &NAME),
        value_type,
        service: section.string("service"),
        binding: binding(&section),
        task: section.string("task"),
        default: default_of(&section, value_type),
        max_age_ns: section
            .duration_ns("max_age", |age_ns| age_ns > 0, "longer than 0")
            .map(Spanned::into_inner),
        on_stale: section
            .choice("on_stale", &[("hold", OnStale::Hold), ("default", OnStale::Default)])
            .map_or(OnStale::Hold, Spanned::into_inner),
    };
    section.finish();
    input
}

/// Where an input's value is: `signal` or `channel`; neither is the first channel.
fn binding(section: &Section<'_>) -> Binding {
    let channel = section.integer(
        "channel",
        |channel| (0..=MAX_CHANNEL).contains(&channel),
        "from 0 to 65535",
    );
    let signal = section.string("signal");
    if let (Some(_), Some(signal)) = (section.get("channel"), &signal) {
        let message = "[[input]] has both signal and channel";
        let help = "signal finds the value by the name that its publisher gives it, channel by its \
                    place in the frame; keep one";
        section.report(Finding::new(Problem::Duplicate, signal.span(), message).help(help));
    }
    match signal {
        Some(signal) if signal.get_ref().is_empty() => {
            let message = "[[input]] signal is empty";
            let help = "name a signal of the publisher, such as \"level.y\"";
            section.report(Finding::new(Problem::OutOfRange, signal.span(), message).help(help));
            Binding::Signal(String::new())
        }
        Some(signal) => Binding::Signal(signal.into_inner()),
        None => Binding::Channel(
            channel.map_or(0, |channel| narrow::<u32>(channel).into_inner()) as usize
        ),
    }
}

/// An input's default: a number, for a BOOL also true or false, for a TIME also `"T#100ms"`.
fn default_of(section: &Section<'_>, value_type: Option<PinType>) -> Option<Spanned<f64>> {
    section.read("default", "a number", |value| {
        let number = match (connection(value), value_type) {
            (Some(Connection::Integer(integer)), _) => integer as f64,
            (Some(Connection::Float(float)), _) => float,
            (Some(Connection::Bool(bool)), Some(PinType::Bool) | None) => f64::from(u8::from(bool)),
            (Some(Connection::Wire(text)), Some(PinType::Time)) => match parse_time_ms(&text) {
                Ok(ms) => f64::from(ms),
                Err(reason) => {
                    let message = format!("[[input]] default \"{text}\": {reason}");
                    let finding = Finding::new(Problem::OutOfRange, 0..0, message);
                    return Err(Some(finding.help(TIME_FORMS)));
                }
            },
            _ => return Err(None),
        };
        if number.is_nan() || value_type.is_some_and(|value_type| !value_type.holds(number)) {
            let range = value_type.map_or("LREAL", PinType::as_str);
            return Err(Some(section.out_of_range(
                "default",
                &number.to_string(),
                &format!("a number that {range} can hold, and not NaN"),
            )));
        }
        Ok(number)
    })
}

fn block(section: Section<'_>) -> Block {
    section.required("type", "\"LimRateOfChangeCI\"");
    let pins = section.table("in", "[block.in]").map_or_else(Vec::new, |pins| {
        pins.entries()
            .map(|(pin, value)| {
                let connection = connection(value.get_ref());
                if connection.is_none() {
                    let message = format!(
                        "pin \"{}\" takes a number, true or false, or a wire, not {}",
                        pin.get_ref(),
                        value.get_ref().type_str()
                    );
                    pins.report(Finding::new(Problem::WrongType, value.span(), message));
                }
                (pin, connection.map(|connection| Spanned::new(value.span(), connection)))
            })
            .collect()
    });
    let count =
        section.integer("count", |count| (1..=MAX_COUNT).contains(&count), "from 1 to 10000000");
    let block = Block {
        name: section.name("name", &NAME),
        block_type: section.string("type"),
        task: section.string("task"),
        count_is_wrong: count.is_none() && section.get("count").is_some(),
        count: count.map(narrow),
        pins,
    };
    section.finish();
    block
}

fn output(section: Section<'_>) -> Output {
    section.required("service", "\"plant/level\"");
    section.required("signals", "[\"block.pin\"]");
    let signals = section
        .read("signals", "an array of strings", |value| {
            let array = value.as_array().ok_or(None)?;
            if array.is_empty() {
                let finding =
                    Finding::new(Problem::OutOfRange, 0..0, "[[output]] signals is empty");
                return Err(Some(finding.help("name at least one \"block.pin\"")));
            }
            array
                .iter()
                .map(|item| match item.get_ref().as_str() {
                    Some(signal) => Ok(Spanned::new(item.span(), signal.to_owned())),
                    None => Err(None),
                })
                .collect()
        })
        .map_or_else(Vec::new, Spanned::into_inner);
    let output =
        Output { service: section.string("service"), task: section.string("task"), signals };
    section.finish();
    output
}

fn connection(value: &DeValue<'_>) -> Option<Connection> {
    match value {
        DeValue::Integer(integer) => Some(match parse_integer(integer) {
            Some(integer) => Connection::Integer(integer),
            // Digits of another radix would parse as a decimal number, and a wrong one.
            None if integer.radix() == 10 => Connection::Float(integer.as_str().parse().ok()?),
            None => return None,
        }),
        DeValue::Float(float) => Some(Connection::Float(float.as_str().parse().ok()?)),
        DeValue::Boolean(bool) => Some(Connection::Bool(*bool)),
        DeValue::String(wire) => Some(Connection::Wire(wire.to_string())),
        _ => None,
    }
}

/// Narrows a number whose range was checked.
fn narrow<T: TryFrom<i64> + Default>(number: Spanned<i64>) -> Spanned<T> {
    let span = number.span();
    Spanned::new(span, T::try_from(number.into_inner()).unwrap_or_default())
}
