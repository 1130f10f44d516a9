//! Keys of `[[task]]` whose values depend on others.

use isochrone_model::Followed;
use isochrone_model::{Margin, MissLimit, Wake, phase_between_ticks_ns};
use toml::Spanned;

use super::section::Section;
use crate::Diagnostic;
use crate::config::Cpu;
use crate::diagnostic::Problem;
use crate::keys::{Key, follow, on_overrun, task as keys};

/// The phase, and why it is chosen: `phase = "auto"` puts the releases between the kernel's ticks, until the node
/// starts and knows what else runs.
pub(crate) fn phase(
    section: &Section<'_>,
    period_ns: Option<&Spanned<u64>>,
) -> (u64, Option<String>) {
    if section.get(&keys::PHASE).is_some_and(|phase| phase.get_ref().as_str() == Some("auto")) {
        let phase_ns =
            period_ns.map_or(0, |period_ns| phase_between_ticks_ns(*period_ns.get_ref()));
        return (phase_ns, Some("between the kernel's ticks".into()));
    }
    let Some(phase) = section.duration_ns(&keys::PHASE) else { return (0, None) };
    let help = "phase moves the releases within the period";
    less_than_period(section, &keys::PHASE, &phase, period_ns, help);
    (phase.into_inner(), None)
}

/// A real-time task stays on one CPU, whatever else the configuration leaves open.
pub(crate) fn cpu(section: &Section<'_>) -> Cpu {
    match section.get(&keys::CPU) {
        None if section.get(&keys::PRIORITY).is_some() => Cpu::Auto { chosen: None },
        None => Cpu::Any,
        Some(value) if value.get_ref().is_str() => {
            section.choice(&keys::CPU, &Cpu::WORDS).map_or(Cpu::Any, Spanned::into_inner)
        }
        Some(_) => {
            section.integer(&keys::CPU).map_or(Cpu::Any, |cpu| Cpu::Number(cpu.into_inner()))
        }
    }
}

/// How a task waits, and how long before its release it is awake.
pub(crate) fn wake(section: &Section<'_>, period_ns: Option<&Spanned<u64>>) -> Wake {
    let margin = section.duration_ns(&keys::MARGIN);
    if let Some(margin) = &margin {
        let help = "margin is the part of the period that is not slept before a release";
        less_than_period(section, &keys::MARGIN, margin, period_ns, help);
    }
    let cpu_budget = section.number(&keys::CPU_BUDGET);
    let written = section.choice(&keys::WAKE, &Wake::ALL);
    let wake = match &written {
        Some(wake) => *wake.get_ref(),
        None if section.get(&keys::PRIORITY).is_none() && section.get(&keys::WAKE).is_none() => {
            Wake::Sleep
        }
        None => Wake::Hybrid(Margin::DEFAULT),
    };
    if !matches!(wake, Wake::Hybrid(_)) {
        let (keys, span, remedy) = match (&margin, &cpu_budget) {
            (None, None) => return wake,
            (Some(margin), None) => ("margin is", margin.span(), "or leave margin out"),
            (None, Some(budget)) => ("cpu_budget is", budget.span(), "or leave cpu_budget out"),
            (Some(margin), Some(_)) => (
                "margin and cpu_budget are",
                margin.span(),
                "and keep one of them, or leave both out",
            ),
        };
        let why = match written {
            Some(_) => format!("wake = \"{}\" has no margin", wake.as_str()),
            None => "without a priority the task sleeps until its release".into(),
        };
        let message = format!("[[task]] {keys} for wake = \"hybrid\" only: {why}");
        let help = format!("write wake = \"hybrid\", {remedy}");
        section.report(Diagnostic::new(Problem::Conflict, span, message).help(help));
        return wake;
    }
    if let (Some(_), Some(cpu_budget)) = (&margin, &cpu_budget) {
        let message = "[[task]] has both margin and cpu_budget";
        let help = "margin fixes how long before a release the task is awake, cpu_budget bounds a \
                    margin that adapts; keep one";
        section.report(Diagnostic::new(Problem::Conflict, cpu_budget.span(), message).help(help));
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
    key: &Key,
    time_ns: &Spanned<u64>,
    period_ns: Option<&Spanned<u64>>,
    help: &str,
) {
    if period_ns.is_some_and(|period_ns| time_ns.get_ref() >= period_ns.get_ref()) {
        let message = format!("{} {} is not less than the period", section.title(), key.name);
        section.report(Diagnostic::new(Problem::OutOfRange, time_ns.span(), message).help(help));
    }
}

/// What the cycles begin with. The time for it is watched as a margin is, and both together are less
/// than the period.
pub(crate) fn follow(
    section: &Section<'_>,
    wake: Wake,
    period_ns: Option<&Spanned<u64>>,
) -> Option<Spanned<Followed>> {
    let within = section.duration_ns(&follow::WITHIN);
    if let Some(within) = &within {
        let help = "within is the part of the period in which a cycle waits for its frame; it needs \
                    the rest to run";
        less_than_period(section, &follow::WITHIN, within, period_ns, help);
        let margin_ns = wake.margin().and_then(Margin::fixed_ns).unwrap_or(0);
        let watched_ns = within.get_ref().saturating_add(margin_ns);
        if period_ns.map(Spanned::get_ref).is_some_and(|period_ns| {
            *within.get_ref() < *period_ns && margin_ns < *period_ns && watched_ns >= *period_ns
        }) {
            let message =
                "[task.follow] within and the margin together are not less than the period";
            let help = "the task watches the clock for both; shorten one of them";
            let diagnostic = Diagnostic::new(Problem::OutOfRange, within.span(), message);
            section.report(diagnostic.help(help));
        }
    }
    let service = section.string(&follow::SERVICE)?;
    let span = service.span();
    let within_ns = within.map_or(0, Spanned::into_inner);
    Some(Spanned::new(span, Followed { service: service.into_inner(), within_ns }))
}

pub(crate) fn miss_limit(section: &Section<'_>) -> Option<MissLimit> {
    let misses = section.integer::<u32>(&on_overrun::MISSES);
    let cycles = section.integer::<u64>(&on_overrun::CYCLES);
    if let (Some(misses), Some(cycles)) = (&misses, &cycles)
        && u64::from(*misses.get_ref()) > *cycles.get_ref()
    {
        let message = "[task.on_overrun] misses is greater than cycles";
        let help = format!("of {0} releases at most {0} can be missed", cycles.get_ref());
        section.report(Diagnostic::new(Problem::OutOfRange, misses.span(), message).help(help));
    }
    Some(MissLimit { misses: misses?.into_inner(), cycles: cycles?.into_inner() })
}
