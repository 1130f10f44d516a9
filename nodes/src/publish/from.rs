//! Publishing what was recorded.

mod args;
mod frames;
mod lateness;
mod ports;

use std::path::Path;
use std::sync::Arc;

use isochrone_cyclic::{Clock, Monotonic, PromptWakeUps};
use isochrone_engine::escaped;
use isochrone_ipc::Announcing;
use isochrone_recording::Uncarried;
use isochrone_timing::units::counted;

pub(super) use self::args::FromArgs;
use self::args::Speed;
use self::frames::{Frames, Layouts};
use self::lateness::{Lateness, long};
use self::ports::{Ports, Sum};
use super::args::{Args, refuse_reserved};
use super::pace::sleep_until;
use crate::base::failure::Failure;
use crate::base::mcap_file::{accept_undamaged, note_uncarried, warn_of_damage};
use crate::base::{stop, suggestion, terminal};

/// How long a pause may be before it is reported.
const LONG_NS: u64 = 10_000_000_000;
/// Most services that are published without being named: opening one takes the domain's lock for some
/// milliseconds, and each has a thread.
const MOST_UNNAMED: usize = 100;

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

pub(super) fn run(args: &Args, file: &Path) -> Result<(), Failure> {
    args.services.iter().try_for_each(|service| refuse_reserved(service))?;
    let stop = stop::on_signal(None)?;
    let Some(layouts) = Layouts::read(file, &stop)? else {
        let file = file.display();
        terminal::note(&format!("note: ended while {file} was first read; nothing was published"));
        return Ok(());
    };
    let services = chosen(&layouts, &args.services, file)
        .inspect_err(|_| warn_of_damage(file, &layouts.condition));
    let is_wanted =
        |it: &&Uncarried| args.services.is_empty() || args.services.contains(&it.service);
    note_uncarried(layouts.uncarried.iter().filter(is_wanted));
    let services = services?;
    let layouts = layouts.only(&services, args.from.speed.times())?;
    let participant = Arc::new(args.take_over.of(args.domain.join("isochrone/publish")?));
    let names: Vec<_> = services.iter().map(String::as_str).collect();
    participant.refuse_far_writers(&names).map_err(Failure::found)?;
    let mut lateness = Lateness::default();
    let mut ports = Ports::open(&participant, &layouts, &stop)?;
    let several = counted(services.len() as u64, "service");
    terminal::note(&format!(
        "publishing {several} of {}, {}: {}. Press Ctrl-C to end it.",
        file.display(),
        args.from.speed.words(),
        services.join(", ")
    ));
    // Readers that wait learn first what the frames will be.
    let stop = stop::after(stop, args.seconds, Announcing::HEAD_START_NS);
    stop.keep_time()?;
    let mut frames = Frames::open(file, &layouts)?;
    let mut next = frames.next()?;
    let epoch_ns = Monotonic.now_ns() + Announcing::HEAD_START_NS;
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
    let condition = frames.condition();
    let sums = ports.sums();
    lateness.changes = ports.changes;
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
