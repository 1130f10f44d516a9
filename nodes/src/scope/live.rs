//! A running node: armed, captured, shown.

use std::cell::RefCell;
use std::rc::Rc;
use std::thread;
use std::time::{Duration, Instant};

use isochrone_processes::Stop;
use isochrone_runtime::control::{Client, ClientError};
use isochrone_runtime::read_clocks;
use isochrone_scope::{Capture, Shot, Window};
use isochrone_timing::units::counted;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

use super::display::Display;
use super::output::{self, Output};
use super::probes::{Probes, Wanted, not_fired};
use super::{Args, Captured, Mode};
use crate::failure::Failure;
use crate::operate::{Asked, NodeArgs, failure};
use crate::top::{Screen, Wait, restore, wait};
use crate::{stop, terminal};

/// Between two looks for rows: the node keeps those of a second.
const TURN: Duration = Duration::from_millis(10);
/// How much later than it should be a shot is taken as it is: a task may stand still.
const OVERDUE: Duration = Duration::from_secs(2);
/// With --auto, what there is is shown if no trigger comes for so long, and drawn as often.
const AUTO: Duration = Duration::from_millis(500);
const AUTO_INTERVAL: Duration = Duration::from_millis(200);
/// Values that are kept, in bytes.
const MOST_BYTES: u64 = 1 << 30;

/// Why no more is captured.
enum End {
    /// There is what was wanted.
    Done,
    /// A signal, or a key.
    Stopped,
    Timeout,
    /// The node, or a trace of it.
    Gone(Option<ClientError>),
}

pub(super) fn capture(args: &Args, node: &NodeArgs, output: Option<Output>) -> Result<(), Failure> {
    let stop = stop::on_signal_after(None, restore)?;
    let (mut client, participant) = node.connect_until(stop.clone())?.into_parts();
    let wanted = Wanted::find(&mut client, &args.names, args.trigger.as_ref())?;
    let tasks = wanted.shown_tasks();
    output::check_tasks(output.as_ref(), tasks.iter().copied())?;
    let client = Rc::new(RefCell::new(client));
    let probes = Probes::open(&participant, &client, &wanted)
        .map_err(|error| failure(error, Asked::ToLook))?;
    let capture = armed(args, &node.node, &wanted, &probes)?;
    let is_live = Display::is_live(args.mode(), output.as_ref());
    if !is_live {
        let (waits, tasks) = (waits_for(args), wanted.shown_tasks().join(", "));
        terminal::note(&format!("{waits}; signals of {tasks}. Press Ctrl-C to end it."));
    }
    let screen = is_live.then(Screen::open).transpose()?;
    let mut scope = Scope {
        args,
        probes,
        capture,
        display: Display::new(output, screen),
        shown: None,
        captured: 0,
        triggered: None,
        shown_at: Instant::now(),
        waits: waits_for(args),
        is_stale: true,
    };
    let end = scope.run(&stop)?;
    scope.finish(end, &client)
}

/// The capture that is asked for; refuses one that would fill the memory.
fn armed(args: &Args, node: &str, wanted: &Wanted, probes: &Probes) -> Result<Capture, Failure> {
    let (window, observed) = (args.window(), probes.observed(wanted));
    let bytes = observed.iter().map(|of| {
        let rows = window.rows(of.period_ns.unwrap_or_default());
        // A row has a head as well.
        rows.saturating_mul(8 * (of.signals.len() as u64 + 4))
    });
    let bytes = bytes.fold(0, u64::saturating_add);
    if bytes > MOST_BYTES {
        return Err(Failure::usage(format!(
            "that is {} MiB of values; scope keeps at most {}: shorten --pre and --post, or name fewer signals",
            bytes >> 20,
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

fn waits_for(args: &Args) -> String {
    match &args.trigger {
        Some(trigger) => format!("armed: waiting for {trigger}"),
        None => "capturing".to_owned(),
    }
}

/// What waits, and what it shows meanwhile.
struct Scope<'a> {
    args: &'a Args,
    probes: Probes,
    capture: Capture,
    display: Display,
    /// What stands on the screen.
    shown: Option<Captured>,
    captured: u64,
    /// Since when the trigger is there whose shot is not whole yet.
    triggered: Option<Instant>,
    /// When the last shot was shown.
    shown_at: Instant,
    waits: String,
    /// The screen shows what is old.
    is_stale: bool,
}

impl Scope<'_> {
    fn run(&mut self, stop: &Stop) -> Result<End, Failure> {
        let begun = Instant::now();
        let timeout = self.args.timeout.and_then(|it| Duration::try_from_secs_f64(it).ok());
        loop {
            let cared = self.probes.care();
            // Rows that came before the end are rows.
            let has_ended = self.probes.have_ended();
            if self.take()? {
                return Ok(End::Done);
            }
            if stop.is_due() {
                return Ok(End::Stopped);
            }
            match cared {
                Err(error) => return Ok(End::Gone(Some(error))),
                Ok(()) if has_ended => return Ok(End::Gone(None)),
                Ok(()) => {}
            }
            if self.is_overdue() && self.take_shot()? {
                return Ok(End::Done);
            }
            let waits = !self.capture.is_triggered() && self.captured == 0;
            if timeout.is_some_and(|timeout| waits && begun.elapsed() >= timeout) {
                return Ok(End::Timeout);
            }
            self.show_latest()?;
            if self.pause()? {
                return Ok(End::Stopped);
            }
        }
    }

    /// Takes what came; `true` if that is all that was wanted.
    fn take(&mut self) -> Result<bool, Failure> {
        loop {
            let mut is_complete = false;
            let capture = &mut self.capture;
            self.probes.take(|track, head, values| {
                is_complete = capture.push(track, head, values);
                is_complete
            });
            if !is_complete {
                return Ok(false);
            }
            if self.take_shot()? {
                return Ok(true);
            }
        }
    }

    /// Shows the shot as it is; `true` if that is all that was wanted.
    fn take_shot(&mut self) -> Result<bool, Failure> {
        self.triggered = None;
        let Some(shot) = self.capture.take() else { return Ok(false) };
        self.captured += 1;
        self.shown_at = Instant::now();
        let captured = of(shot);
        self.display.show(&captured)?;
        self.shown = Some(captured);
        self.is_stale = true;
        Ok(self.args.mode() == Mode::Single)
    }

    /// Whether the rest of a shot should have come long ago.
    fn is_overdue(&mut self) -> bool {
        if !self.capture.is_triggered() {
            self.triggered = None;
            return false;
        }
        let since = *self.triggered.get_or_insert_with(Instant::now);
        let Window { after_ns, .. } = self.args.window();
        // A slow task may have no cycle in the window, and the next one only in an hour.
        since.elapsed() >= Duration::from_nanos(after_ns) + OVERDUE
    }

    /// With --auto: shows what there is if nothing else comes.
    fn show_latest(&mut self) -> Result<(), Failure> {
        if self.args.mode() != Mode::Auto || self.capture.is_triggered() {
            return Ok(());
        }
        let window = Duration::from_nanos(self.args.window().length_ns());
        let is_quiet = self.shown_at.elapsed() >= window.max(AUTO);
        let is_first = self.shown.is_none();
        let is_untriggered = self.shown.as_ref().is_some_and(|it| it.shot.trigger.is_none());
        let interval = if self.is_on_screen() { AUTO_INTERVAL } else { window.max(AUTO) };
        let is_due = is_first || is_untriggered || is_quiet;
        if !is_due || (!is_first && self.shown_at.elapsed() < interval) {
            return Ok(());
        }
        let shot = self.capture.latest();
        if shot.tracks.iter().all(|track| track.rows.is_empty()) {
            return Ok(());
        }
        self.shown_at = Instant::now();
        let captured = of(shot);
        if !self.is_on_screen() && !is_first {
            self.display.show(&captured)?;
        }
        self.shown = Some(captured);
        self.is_stale = true;
        Ok(())
    }

    fn is_on_screen(&self) -> bool {
        matches!(self.display, Display::Live(_))
    }

    /// Draws what is new, and waits a little; `true` if it is to end.
    fn pause(&mut self) -> Result<bool, Failure> {
        if !self.is_on_screen() {
            thread::sleep(TURN);
            return Ok(false);
        }
        if std::mem::take(&mut self.is_stale) {
            let status = match &self.args.trigger {
                Some(_) => {
                    format!(" q quits   {}   {}", counted(self.captured, "shot"), self.waits)
                }
                None => " q quits".to_owned(),
            };
            self.display.draw(self.shown.as_ref(), &status)?;
        }
        let failed = |error| Failure::found(format!("cannot use the terminal: {error}"));
        if wait(TURN).map_err(failed)? == Wait::HungUp {
            return Ok(true);
        }
        while event::poll(Duration::ZERO).map_err(failed)? {
            // A new size is drawn as well.
            self.is_stale = true;
            match event::read().map_err(failed)? {
                Event::Key(key) if quits(key) => return Ok(true),
                Event::Key(key) if redraws(key) => self.display.clear(),
                _ => {}
            }
        }
        Ok(false)
    }

    /// Shows what was captured in part, and says how it ended.
    fn finish(mut self, end: End, client: &Rc<RefCell<Client>>) -> Result<(), Failure> {
        // Whoever leaves a screen has seen enough.
        let is_left = self.is_on_screen() && matches!(end, End::Stopped);
        let is_partial = self.capture.is_triggered() && !is_left && !matches!(end, End::Done);
        if is_partial {
            self.take_shot()?;
        }
        let Self { args, capture, captured, probes, display, shown, .. } = self;
        let is_on_screen = matches!(display, Display::Live(_));
        // The terminal is given back before anything is said.
        drop((display, probes));
        if is_on_screen && let Some(last) = shown.filter(|_| !matches!(end, End::Done)) {
            Display::Printed.show(&last)?;
        }
        let node = client.borrow().node().to_owned();
        match end {
            End::Done => Ok(()),
            End::Stopped if captured > 0 || args.mode() == Mode::Auto => Ok(()),
            End::Stopped => Err(Failure::inconclusive(match &args.trigger {
                Some(trigger) => {
                    format!("ended before the trigger came: {}", not_fired(trigger, &capture))
                }
                None => "ended before anything was captured".to_owned(),
            })),
            End::Timeout => {
                let seconds = args.timeout.unwrap_or_default();
                let trigger = args.trigger.as_ref();
                let why = trigger.map(|trigger| not_fired(trigger, &capture)).unwrap_or_default();
                Err(Failure::inconclusive(format!(
                    "the trigger did not come within {seconds} s: {why}"
                )))
            }
            End::Gone(cause) => {
                let is_end = matches!(cause, None | Some(ClientError::Ended { .. }));
                let why = match cause {
                    Some(cause) if !is_end => failure(cause, Asked::ToLook),
                    _ if captured == 0 && args.trigger.is_some() => {
                        Failure::nobody(format!("node \"{node}\" ended before the trigger came"))
                    }
                    _ if is_partial => Failure::found(format!("node \"{node}\" ended")),
                    _ => Failure::nobody(format!("node \"{node}\" ended")),
                };
                Err(why)
            }
        }
    }
}

fn of(shot: Shot) -> Captured {
    Captured { shot, clock: Some(read_clocks()) }
}

fn quits(key: KeyEvent) -> bool {
    let is_ctrl = key.modifiers.contains(KeyModifiers::CONTROL);
    key.kind != KeyEventKind::Release
        && match key.code {
            KeyCode::Char('c') => is_ctrl,
            KeyCode::Char('q') | KeyCode::Esc => !is_ctrl,
            _ => false,
        }
}

fn redraws(key: KeyEvent) -> bool {
    key.modifiers.contains(KeyModifiers::CONTROL) && key.code == KeyCode::Char('l')
}
