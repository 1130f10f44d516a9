//! A running node: armed, captured, shown.

mod ending;
mod keys;
mod waiting;

use std::cell::RefCell;
use std::rc::Rc;

use isochrone_scope::Capture;
use isochrone_timing::units::duration;

use self::waiting::{Scope, waits_for};
use super::args::{Args, Mode};
use super::display::Display;
use super::level;
use super::output::{self, Output};
use super::probes::Probes;
use super::wanted::ScopeSelection;
use crate::failure::Failure;
use crate::operate::{NodeArgs, Purpose, failure};
use crate::top::{Screen, restore};
use crate::{stop, terminal};

/// Values that are kept, in bytes.
const MOST_BYTES: u64 = 1 << 30;

pub(super) fn capture(args: &Args, node: &NodeArgs, output: Option<Output>) -> Result<(), Failure> {
    let stop = stop::on_signal_after(None, restore)?;
    let (client, participant) = node.connect_until(stop.clone())?.into_parts();
    let client = Rc::new(RefCell::new(client));
    let with_level = |trigger| level::of_node(trigger, &participant, &client, &stop);
    let trigger = args.trigger.as_ref().map(with_level).transpose()?;
    let args = &Args { trigger, ..args.clone() };
    let wanted =
        ScopeSelection::find(&mut client.borrow_mut(), &args.names, args.trigger.as_ref())?;
    let tasks = wanted.shown_tasks();
    output::check_tasks(output.as_ref(), tasks.iter().copied())?;
    let probes = Probes::open(&participant, &client, &wanted)
        .map_err(|error| failure(error, Purpose::Look))?;
    let capture = armed(args, &node.node, &wanted, &probes)?;
    let is_live = Display::is_live(args.mode(), output.as_ref());
    if !is_live {
        let (waits, tasks) = (waits_for(args), wanted.shown_tasks().join(", "));
        terminal::note(&format!("{waits}; signals of {tasks}. Press Ctrl-C to end it."));
    }
    let screen = is_live.then(Screen::open).transpose()?;
    let display = Display::new(output, screen);
    let mut scope = Scope::new(args, probes, capture, display);
    let end = scope.run(&stop)?;
    scope.finish(end, &node.node)
}

/// The capture that is asked for; refuses one that would fill the memory.
fn armed(
    args: &Args,
    node: &str,
    wanted: &ScopeSelection,
    probes: &Probes<'_>,
) -> Result<Capture, Failure> {
    let (window, observed) = (args.window(), probes.observed(wanted));
    let bytes = observed.iter().map(|of| {
        let rows = window.rows(of.period_ns.unwrap_or_default());
        // A row has a head as well.
        rows.saturating_mul(8 * (of.signals.len() as u64 + 4))
    });
    let bytes = bytes.fold(0, u64::saturating_add);
    if bytes > MOST_BYTES {
        return Err(Failure::usage(format!(
            "{} of these signals are more than {} MiB of values, which is as much as scope keeps: shorten --pre \
             and --post, or name fewer signals",
            duration(window.length_ns() as f64),
            MOST_BYTES >> 20
        )));
    }
    let text = args.trigger.as_ref().map(ToString::to_string);
    Ok(match (wanted.trigger(), &args.trigger, text) {
        (Some((place, edge)), Some(trigger), Some(text)) => {
            let names = (trigger.signal.as_str(), text.as_str());
            Capture::armed(node, observed, window, place, names, edge)
        }
        _ if args.mode() == Mode::Auto => Capture::rolling(node, observed, window),
        _ => Capture::now(node, observed, window.after_ns),
    })
}
