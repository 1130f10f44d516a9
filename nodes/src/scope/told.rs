//! What is said of a shot, in words.

use isochrone_engine::escaped;
use isochrone_scope::{Shot, Triggered};
use isochrone_timing::units::{counted, duration, period};

use super::Captured;
use super::chart::{Heading, MISSED};
use crate::operate::time;

impl Captured {
    /// What stands above a chart.
    pub(super) fn heading(&self) -> Heading {
        let shot = &self.shot;
        let node = escaped(&shot.node);
        let title = match &shot.trigger {
            Some(trigger) => format!("{node}: {}", triggered(trigger, shot)),
            None => format!("{node}: {}", duration(shot.duration_ns() as f64)),
        };
        let at = self.clock.map(|clock| time(clock.unix_ns(shot.zero_ns())));
        let task = |track: &isochrone_scope::Track| match track.period_ns {
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

    /// What is in it, in a line.
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

/// What a shot lacks, each in a sentence.
pub(super) fn notes(shot: &Shot) -> Vec<String> {
    let (begin_ns, end_ns) = shot.shortened_ns();
    let zero_ns = shot.zero_ns();
    let long = |ns: u64| period(ns);
    let begin = (begin_ns > 0).then(|| {
        let wanted_ns = zero_ns.saturating_sub(shot.begin_ns);
        let (has, wanted) = (long(wanted_ns.saturating_sub(begin_ns)), long(wanted_ns));
        format!(
            "the history is {has} long instead of {wanted}: the trigger came before there was more"
        )
    });
    let idle = shot.tracks.iter().filter(|track| track.rows.is_empty());
    let idle: Vec<_> = idle.map(|track| escaped(&track.task)).collect();
    let none =
        (!idle.is_empty()).then(|| format!("no cycle of {} came within the shot", idle.join(", ")));
    let end = (end_ns > 0 && none.is_none()).then(|| {
        let wanted_ns = shot.end_ns.saturating_sub(zero_ns);
        format!(
            "the shot ends {} instead of {} after {}",
            long(wanted_ns.saturating_sub(end_ns)),
            long(wanted_ns),
            if shot.trigger.is_some() { "the trigger" } else { "its beginning" }
        )
    });
    let (lost, missed) = shot.missing();
    let lost = (lost > 0).then(|| {
        format!("{} of the window did not arrive; they are shaded", counted(lost, "cycle"))
    });
    let missed = (missed > 0).then(|| {
        let missed = counted(missed, "cycle");
        format!("the task missed {missed}, in which the values before held; {MISSED} marks them")
    });
    let late = shot.trigger.as_ref().filter(|trigger| trigger.lost > 0).map(|trigger| {
        let lost = counted(trigger.lost, "cycle");
        format!(
            "{lost} did not arrive immediately before the trigger: it may have come in one of them"
        )
    });
    [begin, end, none, lost, missed, late].into_iter().flatten().collect()
}
