//! Descriptions of a shot, as text.

use isochrone_engine::escaped;
use isochrone_scope::{Head, Shot, Track, Triggered, Undrawable};
use isochrone_timing::units::{counted, duration, period};

use super::captured::Captured;
use super::chart::{Heading, MISSED};
use crate::operate::time;
use crate::terminal;

impl Captured {
    /// The heading of a chart.
    pub(super) fn heading(&self) -> Heading {
        let shot = &self.shot;
        let node = escaped(&shot.node);
        let title = match &shot.trigger {
            Some(trigger) => format!("{node}: {}", triggered(trigger, shot)),
            // How long a single row lasts is not known.
            None if shot.tracks.iter().all(is_instant) => format!("{node}: 1 cycle"),
            None => format!("{node}: {}", duration(shot.duration_ns() as f64)),
        };
        let at = self.clock.map(|clock| time(clock.unix_ns(shot.zero_ns())));
        let task = |track: &Track| match track.period_ns {
            Some(period_ns) => {
                format!("{} every {}", escaped(&track.task), period(period_ns)).trim().to_owned()
            }
            None => escaped(&track.task).into_owned(),
        };
        let tasks = shot.tracks.iter().map(task).collect::<Vec<_>>().join(", ");
        let parts = at.into_iter().chain(Some(tasks)).chain(missing(shot));
        Heading {
            title,
            about: parts.filter(|part| !part.is_empty()).collect::<Vec<_>>().join("; "),
        }
    }

    /// Its contents, in a line.
    pub(super) fn contents(&self) -> String {
        let Shot { tracks, .. } = &self.shot;
        let cycles: usize = tracks.iter().map(|track| track.rows.len()).sum();
        let signals: usize = tracks.iter().map(|track| track.signals.len()).sum();
        let trigger = self.shot.trigger.as_ref();
        let trigger = trigger.map(|it| format!("; {}", triggered(it, &self.shot)));
        let (cycles, signals) =
            (counted(cycles as u64, "cycle"), counted(signals as u64, "signal"));
        format!("{cycles} of {signals}{}", trigger.unwrap_or_default())
    }
}

fn is_instant(track: &Track) -> bool {
    track.period_ns.is_none() && track.rows.len() == 1
}

fn triggered(trigger: &Triggered, shot: &Shot) -> String {
    let is_other = shot.tracks.len() != 1 || shot.tracks.iter().any(|it| it.task != trigger.task);
    let of = if is_other { format!(" of {}", escaped(&trigger.task)) } else { String::new() };
    format!("{} in cycle {}{of}", escaped(&trigger.text), trigger.cycle)
}

/// Rows and cycles that are missing, if there are some.
fn missing(shot: &Shot) -> Option<String> {
    let (lost, missed) = shot.missing();
    let lost = (lost > 0).then(|| format!("{} lost", counted(lost, "cycle")));
    let missed = (missed > 0).then(|| format!("{} missed", counted(missed, "cycle")));
    let both: Vec<String> = lost.into_iter().chain(missed).collect();
    (!both.is_empty()).then(|| both.join(", "))
}

/// Says that a file has less than what was wanted.
pub(super) fn note_short(captured: &Captured) {
    for note in notes(&captured.shot) {
        terminal::note(&format!("note: {note}"));
    }
}

/// The shortcomings of a shot, each in a sentence.
pub(super) fn notes(shot: &Shot) -> Vec<String> {
    let late = shot.trigger.as_ref().filter(|trigger| trigger.lost > 0).map(|trigger| {
        let lost = counted(trigger.lost, "cycle");
        format!(
            "{lost} did not arrive immediately before the trigger: it may have come in one of them"
        )
    });
    let parts = [begins_late(shot), ends_early(shot), lost(shot), missed(shot), late];
    parts.into_iter().flatten().chain(undrawable(shot)).collect()
}

/// The tasks that are so, as the end of a phrase; empty if all of them are.
fn of_those(shot: &Shot, is_so: impl Fn(&Track) -> bool) -> String {
    let those: Vec<_> = shot.tracks.iter().filter(|track| is_so(track)).map(name).collect();
    if those.len() == shot.tracks.len() { String::new() } else { format!(" of {}", listed(those)) }
}

fn begins_late(shot: &Shot) -> Option<String> {
    let (short_ns, _) = shot.shortened_ns();
    let of = of_those(shot, |track| shot.lacks(track).0.is_some());
    let wanted_ns = shot.zero_ns().saturating_sub(shot.begin_ns);
    Some(match short_ns {
        0 => return None,
        _ if wanted_ns == 0 => format!("there is nothing{of} in the first {}", period(short_ns)),
        _ => format!(
            "the history{of} is {} long instead of {}: the trigger came before there was more",
            period(wanted_ns.saturating_sub(short_ns)),
            period(wanted_ns)
        ),
    })
}

fn ends_early(shot: &Shot) -> Option<String> {
    let idle = shot.tracks.iter().filter(|track| track.rows.is_empty());
    let idle: Vec<_> = idle.map(name).collect();
    if !idle.is_empty() {
        return Some(format!("no cycle of {} came within the shot", listed(idle)));
    }
    let (_, short_ns) = shot.shortened_ns();
    let of = of_those(shot, |track| shot.lacks(track).1.is_some());
    let wanted_ns = shot.end_ns.saturating_sub(shot.zero_ns());
    (short_ns > 0).then(|| {
        format!(
            "the shot{of} ends {} instead of {} after {}",
            period(wanted_ns.saturating_sub(short_ns)),
            period(wanted_ns),
            if shot.trigger.is_some() { "the trigger" } else { "its beginning" }
        )
    })
}

fn lost(shot: &Shot) -> Option<String> {
    let mut is_csv = false;
    let lost = by_task(shot, |head| head.lost).map(|(task, lost)| {
        is_csv = task.is_empty();
        let of = if is_csv { String::new() } else { format!(" of {task}") };
        format!("{}{of}", counted(lost, "cycle"))
    });
    let lost: Vec<_> = lost.collect();
    // Whether they were lost or missed, a CSV says only if it has a column for that.
    let what = if is_csv { "are not in the file" } else { "did not arrive" };
    (!lost.is_empty()).then(|| format!("{} {what}; they are shaded", listed(lost)))
}

fn missed(shot: &Shot) -> Option<String> {
    let missed = by_task(shot, |head| head.missed);
    let missed = missed.map(|(task, missed)| match &*task {
        // A CSV does not say which.
        "" => format!("the task missed {}", counted(missed, "cycle")),
        task => format!("{task} missed {}", counted(missed, "cycle")),
    });
    let missed: Vec<_> = missed.collect();
    let held = format!("in which the values before held; {MISSED} marks them");
    (!missed.is_empty()).then(|| format!("{}, {held}", listed(missed)))
}

/// The tasks with what is not 0 of all of their cycles.
fn by_task(shot: &Shot, of: impl Fn(&Head) -> u64) -> impl Iterator<Item = (String, u64)> {
    let each =
        shot.tracks.iter().map(move |track| (name(track), track.rows.heads().map(&of).sum()));
    each.filter(|(_, sum)| *sum > 0)
}

/// The signals of which there is no curve, though there are values. Only NaN is what a `callOB` has that nothing was
/// given to: the chart says it.
fn undrawable(shot: &Shot) -> Vec<String> {
    let reasons = [Undrawable::Infinite, Undrawable::Both];
    let of = |why: Undrawable| {
        let names = shot.tracks.iter().flat_map(|track| {
            let signals = track.signals.iter().enumerate();
            let those = signals.filter(move |(place, _)| track.undrawable(*place) == Some(why));
            those.map(|(_, signal)| escaped(&signal.name).into_owned())
        });
        let names: Vec<_> = names.collect();
        (!names.is_empty()).then(|| {
            format!("no curve can be drawn of {}: {} throughout", listed(names), why.as_str())
        })
    };
    reasons.into_iter().filter_map(of).collect()
}

fn name(track: &Track) -> String {
    escaped(&track.task).into_owned()
}

fn listed(names: Vec<String>) -> String {
    match names.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        _ => names.concat(),
    }
}
