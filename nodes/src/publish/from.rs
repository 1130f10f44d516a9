//! Publishing what was recorded.

mod frames;
mod lateness;
mod ports;

use std::path::{Path, PathBuf};
use std::thread;

use isochrone_cyclic::{Clock, Monotonic, PromptWakeUps};
use isochrone_engine::escaped;
use isochrone_timing::units::counted;

use self::frames::{Frames, Layouts};
use self::lateness::{Lateness, long};
use self::ports::{Ports, Sum};
use super::pace::sleep_until;
use super::{Args, HEAD_START_NS, refuse_reserved};
use crate::failure::Failure;
use crate::mcap_file::{accept_undamaged, warn_of_damage};
use crate::{numbers, stop, suggestion, terminal};

/// How long a pause may be before it is reported.
const LONG_NS: u64 = 10_000_000_000;
/// Most services that are published without being named: opening one takes the domain's lock for some
/// milliseconds, and each has a thread.
const MOST_UNNAMED: usize = 100;

/// A recording that is published.
#[derive(clap::Args)]
pub(super) struct FromArgs {
    /// Recording (MCAP) whose services are published again, from `record` or `run --record`: all of them, or
    /// those that are named. Each frame has its values, cycle and flags, and follows the one before at the
    /// distance of their releases, also across services
    #[arg(long, value_name = "FILE.mcap")]
    pub(super) from: Option<PathBuf>,
    /// How fast a recording is published: 1 as it was recorded, 0.5 half as fast, max without waiting between
    /// frames, also not for readers: what does not fit into a reader's buffer is lost to it
    #[arg(
        long,
        value_name = "FACTOR|max",
        default_value = "1",
        conflicts_with_all = ["value", "wave", "csv"],
        value_parser = Speed::parse,
        allow_negative_numbers = true
    )]
    speed: Speed,
}

/// The summary of what was published from a recording.
#[derive(serde::Serialize)]
struct Summary<'a> {
    file: &'a Path,
    services: Vec<Sum>,
    /// Parts of the recording that were left out.
    damaged: u64,
    /// Of the frame that was sent the latest after it was due; `None`: none was to wait.
    latest_ns: Option<u64>,
}

/// How fast a recording is published.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Speed {
    /// This many times as fast as it was recorded.
    Times(f64),
    /// Without waiting.
    Max,
}

impl Speed {
    const RANGE: std::ops::RangeInclusive<f64> = 0.001..=1000.0;

    fn parse(text: &str) -> Result<Self, String> {
        match text.parse::<f64>() {
            _ if text == "max" => Ok(Self::Max),
            Ok(times) if Self::RANGE.contains(&times) => Ok(Self::Times(times)),
            _ => Err("give a factor from 0.001 to 1000, such as 0.5, or max".into()),
        }
    }

    /// When a frame is sent that stood so far behind the first one, if it is to wait.
    fn after_ns(self, recorded_ns: u64) -> Option<u64> {
        match self {
            Self::Times(1.0) => Some(recorded_ns),
            Self::Times(times) => Some((recorded_ns as f64 / times).round() as u64),
            Self::Max => None,
        }
    }

    /// How many times as fast as recorded; `None`: nobody knows.
    fn times(self) -> Option<f64> {
        match self {
            Self::Times(times) => Some(times),
            Self::Max => None,
        }
    }

    fn words(self) -> String {
        match self {
            Self::Times(1.0) => "as it was recorded".into(),
            Self::Times(times) => format!("{} times as fast", numbers::six_digits(times)),
            Self::Max => "as fast as it goes".into(),
        }
    }
}

pub(super) fn run(args: &Args, file: &Path) -> Result<(), Failure> {
    args.services.iter().try_for_each(|service| refuse_reserved(service))?;
    let stop = stop::on_signal(None)?;
    let Some(layouts) = Layouts::read(file, &stop)? else {
        let file = file.display();
        terminal::note(&format!("note: ended while {file} was first read; nothing was published"));
        return Ok(());
    };
    let services = chosen(&layouts, &args.services, file)
        .inspect_err(|_| warn_of_damage(file, &layouts.condition))?;
    let layouts = layouts.only(&services, args.from.speed.times())?;
    let participant = args.take_over.of(args.domain.join("isochrone/publish")?);
    let names: Vec<_> = services.iter().map(String::as_str).collect();
    participant.refuse_far_writers(&names).map_err(Failure::found)?;
    let (mut lateness, mut condition) = (Lateness::default(), Default::default());
    let mut sums = Vec::new();
    thread::scope(|scope| {
        let mut ports = Ports::open(scope, &participant, &layouts, &stop)?;
        let several = counted(services.len() as u64, "service");
        terminal::note(&format!(
            "publishing {several} of {}, {}: {}. Press Ctrl-C to end it.",
            file.display(),
            args.from.speed.words(),
            services.join(", ")
        ));
        // Readers that wait learn first what the frames will be.
        let stop = stop::after(stop, args.seconds, HEAD_START_NS);
        stop.keep_time()?;
        let mut frames = Frames::open(file, &layouts)?;
        let mut next = frames.next()?;
        let epoch_ns = Monotonic.now_ns() + HEAD_START_NS;
        sleep_until(epoch_ns, &stop.flag());
        let _prompt = PromptWakeUps::in_this_thread();
        let (mut first_ns, mut sent) = (None, 0);
        while let Some(frame) = next {
            if stop.is_due() || args.count.is_some_and(|count| sent >= count) {
                break;
            }
            ports.enter(frame.layout)?;
            let first_ns = *first_ns.get_or_insert(frame.due_ns);
            // A frame that is earlier than the first one, although after it in the file, is due with it.
            let release_ns = match args.from.speed.after_ns(frame.due_ns.saturating_sub(first_ns)) {
                None => Monotonic.now_ns(),
                Some(after_ns) => {
                    let release_ns = epoch_ns.saturating_add(after_ns);
                    let ahead_ns = release_ns.saturating_sub(Monotonic.now_ns());
                    if ahead_ns > LONG_NS {
                        let ahead = long(ahead_ns);
                        terminal::note(&format!("note: the next frame is due in {ahead}"));
                    }
                    if sleep_until(release_ns, &stop.flag()).is_none() {
                        break;
                    }
                    lateness.add(Monotonic.now_ns().saturating_sub(release_ns));
                    release_ns
                }
            };
            ports.send(&frame, release_ns);
            sent += 1;
            next = frames.next()?;
        }
        condition = frames.condition();
        sums = ports.sums();
        lateness.changes = ports.changes;
        Ok::<_, Failure>(())
    })?;
    lateness.note();
    if args.json {
        let latest_ns = (args.from.speed != Speed::Max).then_some(lateness.latest_ns);
        let damaged = condition.damaged;
        terminal::print_json(&Summary { file, services: sums, damaged, latest_ns })?;
    } else {
        sums.iter().try_for_each(|sum| terminal::print(&sum.text()))?;
    }
    accept_undamaged(file, &condition)
}

/// The services that are published: those that are named, or all that are not reserved.
fn chosen(layouts: &Layouts, named: &[String], file: &Path) -> Result<Vec<String>, Failure> {
    let there = layouts.services();
    let path = file.display();
    if there.is_empty() {
        return Err(match layouts.other_messages {
            0 => Failure::found(format!("{path} has no frames")),
            others => Failure::usage(format!(
                "{path} has no frames, only {} of another program",
                counted(others, "message")
            )),
        });
    }
    if named.is_empty() {
        let (reserved, free): (Vec<_>, Vec<_>) =
            there.into_iter().partition(|service| refuse_reserved(service).is_err());
        if !reserved.is_empty() {
            terminal::note(&format!(
                "note: left out, as these names are for what nodes say of themselves: {}",
                listed(&reserved)
            ));
        }
        if free.is_empty() {
            return Err(Failure::usage(format!("{path} has no other frames")));
        }
        if free.len() > MOST_UNNAMED {
            return Err(Failure::usage(format!(
                "{path} has {} services, and without names at most {MOST_UNNAMED} are published; name those that \
                 you want, such as {}",
                free.len(),
                listed(free.get(..3).unwrap_or_default())
            )));
        }
        return Ok(free);
    }
    let mut chosen: Vec<String> = Vec::new();
    for service in named {
        if !there.contains(service) {
            let question = suggestion::question(service, there.iter().map(String::as_str));
            let there = listed(&there);
            return Err(Failure::usage(format!(
                "{path} has no frames of \"{service}\"; it has: {there}{question}"
            )));
        }
        if !chosen.contains(service) {
            chosen.push(service.clone());
        }
    }
    Ok(chosen)
}

fn listed(services: &[String]) -> String {
    services.iter().map(|service| escaped(service).into_owned()).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_stand_as_far_from_each_other_as_the_speed_says() {
        let after = |text: &str| Speed::parse(text).map(|speed| speed.after_ns(1_000_000_007));
        assert_eq!(after("1"), Ok(Some(1_000_000_007)));
        assert_eq!(after("0.5"), Ok(Some(2_000_000_014)));
        assert_eq!(after("max"), Ok(None));
        for bad in ["0", "-1", "NaN", "fast", "1001", ""] {
            assert!(after(bad).is_err(), "{bad}");
        }
    }
}
