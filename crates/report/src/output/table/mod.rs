//! A report as a table for a terminal: plain ASCII, human units, the same order as the JSON.

mod bench;
mod columns;

pub use bench::ComparisonTable;
pub use columns::{Alignment, Table};
use columns::{UNKNOWN, time};

use std::fmt::{Display, Formatter, Result};

use isochrone_machine::Environment;
use isochrone_model::AlarmTotals;
use isochrone_timing::units::{counted, duration, period, size, three_digits};
use isochrone_timing::{LinkReport, Summary, TaskReport, Warning};

use crate::output::groups::percent;
use crate::report::{RecordingReport, Report};

/// With the indent and the columns, a row has the 80 characters of a terminal.
const LABEL_WIDTH: usize = 15;
const COLUMN_WIDTH: usize = 9;
const COLUMNS: [&str; 7] = ["min", "p50", "p90", "p99", "p99.9", "p99.99", "max"];

impl Display for Report {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        writeln!(f, "isochrone {} {}", self.isochrone, self.command.join(" "))?;
        writeln!(f, "started {}", self.started)?;
        if self.ended_early {
            writeln!(f, "ended early: stopped before its time")?;
        }
        environment(f, &self.environment)?;
        for report in self.tasks.iter().filter(|task| task.turns.is_empty()) {
            task(f, &report.task)?;
        }
        for report in self.links.iter().filter(|link| link.turns.is_empty()) {
            link(f, &report.link)?;
        }
        if let Some(totals) = &self.process_alarms {
            process_alarms(f, totals)?;
        }
        if let Some(report) = &self.recording {
            recording(f, report)?;
        }
        bench::tables(f, self)?;
        if !self.warnings.is_empty() {
            writeln!(f)?;
        }
        self.warnings.iter().try_for_each(|report| warning(f, report))
    }
}

fn process_alarms(f: &mut Formatter<'_>, totals: &AlarmTotals) -> Result {
    /// Names that are shown.
    const NAMED: usize = 8;
    let AlarmTotals { came, standing, unacknowledged, lost, names, .. } = totals;
    let came = counted(*came, "occurrence");
    write!(f, "\nprocess alarms: {came}, {standing} standing, {unacknowledged} unacknowledged")?;
    if *lost > 0 {
        write!(f, ", {} lost", counted(*lost, "change"))?;
    }
    writeln!(f)?;
    if !names.is_empty() {
        let more = names.len().saturating_sub(NAMED);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        let named = names.get(..NAMED).unwrap_or(names);
        writeln!(f, "  standing: {}{more}", named.join(", "))?;
    }
    Ok(())
}

fn recording(f: &mut Formatter<'_>, recording: &RecordingReport) -> Result {
    let RecordingReport { file, cycles, lost, entries, bytes, .. } = recording;
    writeln!(
        f,
        "\nrecording {file}: {}, {lost} lost, {}, {}",
        counted(*cycles, "cycle"),
        counted(*entries, "operation"),
        size(*bytes),
    )
}

fn environment(f: &mut Formatter<'_>, environment: &Environment) -> Result {
    let known = |value: &Option<String>| value.clone().unwrap_or_else(|| UNKNOWN.to_owned());
    let reading =
        environment.clock_read_ns.map_or_else(String::new, |ns| format!(" ({ns} ns per reading)"));
    writeln!(
        f,
        "kernel {}, preempt {}, {} CPUs, hypervisor {}, clock {}{}",
        known(&environment.kernel),
        known(&environment.preempt),
        environment.cpus,
        known(&environment.hypervisor),
        known(&environment.clocksource),
        reading,
    )
}

fn task(f: &mut Formatter<'_>, task: &TaskReport) -> Result {
    writeln!(f)?;
    write!(
        f,
        "task {}: period {}, wake {}{}, scheduler {}",
        task.name,
        period(task.period_ns),
        task.wake,
        task.margin_ns.map_or_else(String::new, |ns| format!(" (margin {})", duration(ns as f64))),
        task.scheduler
    )?;
    match task.cpu {
        Some(cpu) => writeln!(f, ", CPU {cpu}")?,
        None => writeln!(f, ", any CPU")?,
    }
    if let Some(reason) = &task.cpu_reason {
        writeln!(f, "  CPU chosen: {reason}")?;
    }
    write!(
        f,
        "  {}, {} missed, {}, {} excluded",
        counted(task.cycles, "cycle"),
        task.missed,
        counted_or_unknown(task.overruns, "overrun"),
        counted(task.warm_up_cycles, "warm-up cycle")
    )?;
    if let Some(lost) = task.lost_records.filter(|lost| *lost > 0) {
        write!(f, ", {} lost", counted(lost, "record"))?;
    }
    if let Some(lost) = task.lost_snapshots.filter(|lost| *lost > 0) {
        write!(f, ", {} lost", counted(lost, "snapshot"))?;
    }
    writeln!(f)?;
    heading(f)?;
    row(f, "release jitter", &task.release_jitter_ns)?;
    row(f, "execution", &task.execution_ns)?;
    row(f, "response", &task.response_ns)?;
    row(f, "period error", &task.period_error_ns)?;
    if let (Some(wait), Some(latency)) = (&task.follow_wait_ns, &task.follow_latency_ns) {
        row(f, "follow wait", wait)?;
        row(f, "follow latency", latency)?;
        let followed = counted_or_unknown(task.followed, "cycle");
        let (ready, timed_out) = (known(task.found_ready), known(task.timed_out));
        writeln!(
            f,
            "  {followed} followed a frame, {ready} found it ready at the release, {timed_out} timed out"
        )?;
    }
    let TaskReport { allocations, ipc_allocations, minor_faults, major_faults, .. } = task;
    let TaskReport { voluntary_switches, involuntary_switches, block_errors, .. } = task;
    let TaskReport { input_rejects, connects, connect_errors, .. } = task;
    writeln!(
        f,
        "  CPU {} %, {} ({} more by the IPC library), {} minor and {}, {} voluntary and {} involuntary switches",
        percent(task.cpu_fraction).unwrap_or_else(|| UNKNOWN.to_owned()),
        counted_or_unknown(*allocations, "allocation"),
        known(*ipc_allocations),
        known(*minor_faults),
        counted_or_unknown(*major_faults, "major fault"),
        known(*voluntary_switches),
        known(*involuntary_switches)
    )?;
    writeln!(
        f,
        "  {}, {}, {} ({} failed at first)",
        counted_or_unknown(*block_errors, "block error"),
        counted_or_unknown(*input_rejects, "input reject"),
        counted_or_unknown(*connects, "connect"),
        known(*connect_errors)
    )
}

/// A count, or a dash where nobody counted.
fn known(count: Option<u64>) -> String {
    count.map_or_else(|| UNKNOWN.to_owned(), |count| count.to_string())
}

/// So many of a thing, with a dash where nobody counted.
fn counted_or_unknown(count: Option<u64>, thing: &str) -> String {
    count.map_or_else(|| format!("{UNKNOWN} {thing}s"), |count| counted(count, thing))
}

fn link(f: &mut Formatter<'_>, link: &LinkReport) -> Result {
    write!(f, "\nlink {}", link.service)?;
    if let Some(direction) = link.direction {
        write!(f, " ({})", direction.as_str())?;
    }
    if let Some(rate_hz) = link.rate_hz {
        write!(f, ": {} Hz", three_digits(rate_hz))?;
    }
    writeln!(f)?;
    write!(f, "  {}, {} lost", counted(link.frames, "frame"), link.lost)?;
    if let Some(restarts) = link.restarts {
        write!(f, ", {}", counted(restarts, "restart"))?;
    }
    for (count, what) in [
        (link.other_writers, "of other writers"),
        (link.future_stamps, "with stamps from the future"),
        (link.past_stamps, "with stamps from the past"),
        (link.unknown_layouts, "of unknown layout"),
    ] {
        if let Some(count) = count.filter(|count| *count > 0) {
            write!(f, ", {count} {what}")?;
        }
    }
    for (flag, count) in &link.flagged {
        write!(f, ", {count} {flag}")?;
    }
    writeln!(f)?;
    // Who only counts frames, as their sender does, has no latencies.
    let latencies = [("last hop", &link.one_way_ns), ("end to end", &link.end_to_end_ns)];
    if latencies.iter().any(|(_, summary)| summary.count > 0) {
        heading(f)?;
        for (label, summary) in latencies {
            row(f, label, summary)?;
        }
    }
    Ok(())
}

fn warning(f: &mut Formatter<'_>, warning: &Warning) -> Result {
    writeln!(f, "warning [{}]: {}", warning.code, warning.message)?;
    if !warning.remedy.is_empty() {
        writeln!(f, "  remedy: {}", warning.remedy)?;
    }
    Ok(())
}

fn heading(f: &mut Formatter<'_>) -> Result {
    cells(f, "", COLUMNS.map(str::to_owned))
}

fn row(f: &mut Formatter<'_>, label: &str, s: &Summary) -> Result {
    cells(f, label, [s.min, s.p50, s.p90, s.p99, s.p99_9, s.p99_99, s.max].map(time))
}

fn cells(f: &mut Formatter<'_>, label: &str, cells: [String; COLUMNS.len()]) -> Result {
    write!(f, "  {label:<LABEL_WIDTH$}")?;
    for cell in cells {
        write!(f, "{cell:>COLUMN_WIDTH$}")?;
    }
    writeln!(f)
}
