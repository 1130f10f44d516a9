//! A scope that waits for rows and triggers.

use std::thread;
use std::time::{Duration, Instant};

use isochrone_control::ClientError;
use isochrone_processes::Stop;
use isochrone_runtime::read_clocks;
use isochrone_scope::{Capture, Shot, Window};
use isochrone_timing::units::{counted, duration};

use super::super::args::{Args, Mode};
use super::super::captured::Captured;
use super::super::display::Display;
use super::super::probes::Probes;
use super::keys::{self, KeyAction};
use crate::failure::Failure;
use crate::terminal;

/// Between two looks for rows: the node keeps those of a second.
const TURN: Duration = Duration::from_millis(10);
/// How long after it should be complete a shot is shown as it is: a task may stand still.
const OVERDUE: Duration = Duration::from_secs(2);
/// The beginning of a shot that takes this long is reported.
const LONG_S: f64 = 0.5;
/// With --auto, the current rows are shown if no trigger comes for this long, and redrawn as often.
const AUTO: Duration = Duration::from_millis(500);
const AUTO_INTERVAL: Duration = Duration::from_millis(200);

/// Why no more is captured.
pub(super) enum End {
    /// There is what was wanted.
    Done,
    /// A signal, or a key.
    Stopped,
    Timeout,
    /// The node, or what was traced of it.
    Gone(ClientError),
}

/// What waits, and what it shows meanwhile.
pub(super) struct Scope<'a> {
    pub(super) args: &'a Args,
    pub(super) probes: Probes<'a>,
    pub(super) capture: Capture,
    pub(super) display: Display,
    /// The contents of the screen.
    pub(super) shown: Option<Captured>,
    pub(super) captured: u64,
    /// Since when the trigger is there whose shot is not whole yet.
    triggered: Option<Instant>,
    /// When the last shot was shown.
    shown_at: Instant,
    state: State,
    /// The screen shows what is old.
    is_stale: bool,
}

/// The message while no shot is shown.
#[derive(Debug, Clone, PartialEq, Eq)]
enum State {
    Waiting,
    /// In this cycle, and the rest of the shot takes a while.
    Triggered(u64),
    /// No rows come, for this reason.
    Trouble(String),
}

impl<'a> Scope<'a> {
    pub(super) fn new(
        args: &'a Args,
        probes: Probes<'a>,
        capture: Capture,
        display: Display,
    ) -> Self {
        Self {
            args,
            probes,
            capture,
            display,
            shown: None,
            captured: 0,
            triggered: None,
            shown_at: Instant::now(),
            state: State::Waiting,
            is_stale: true,
        }
    }

    pub(super) fn run(&mut self, stop: &Stop) -> Result<End, Failure> {
        let begun = Instant::now();
        let timeout = self.args.timeout.and_then(|it| Duration::try_from_secs_f64(it).ok());
        loop {
            let cared = self.probes.care();
            // Rows that came before the end are rows.
            if self.take()? {
                return Ok(End::Done);
            }
            if stop.is_due() {
                return Ok(End::Stopped);
            }
            if let Err(error) = cared.and_then(|()| self.probes.reopen()) {
                return Ok(if stop.is_due() { End::Stopped } else { End::Gone(error) });
            }
            if self.is_overdue() && self.take_shot()? {
                return Ok(End::Done);
            }
            let waits = !self.capture.is_triggered() && self.captured == 0;
            if timeout.is_some_and(|timeout| waits && begun.elapsed() >= timeout) {
                return Ok(End::Timeout);
            }
            self.show_latest()?;
            self.say_state();
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

    /// Shows the shot as it is; `true` if that was all.
    pub(super) fn take_shot(&mut self) -> Result<bool, Failure> {
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

    pub(super) fn is_on_screen(&self) -> bool {
        matches!(self.display, Display::Live(_))
    }

    /// Says what has become of the waiting.
    fn say_state(&mut self) {
        let now = match (self.probes.trouble(), self.capture.triggered()) {
            (Some(trouble), _) => State::Trouble(trouble),
            (None, Some(trigger)) if self.args.post_s() >= LONG_S => {
                State::Triggered(trigger.cycle)
            }
            _ => State::Waiting,
        };
        let before = std::mem::replace(&mut self.state, now);
        if before == self.state {
            return;
        }
        self.is_stale = true;
        if self.is_on_screen() {
            return;
        }
        match (&self.state, before) {
            (State::Trouble(why), _) => terminal::note(why),
            (_, State::Trouble(_)) => terminal::note("cycles come again"),
            _ => {}
        }
        if let State::Triggered(cycle) = self.state {
            let rest = duration(self.args.post_s() * 1e9);
            terminal::note(&format!("triggered in cycle {cycle}; capturing {rest} from there"));
        }
    }

    /// The line below the chart.
    fn status(&self) -> String {
        let trigger = self.args.trigger.as_ref();
        let shots = trigger.map(|_| counted(self.captured, "shot"));
        let state = match &self.state {
            State::Trouble(why) => Some(why.clone()),
            State::Triggered(cycle) => Some(format!("triggered in cycle {cycle}")),
            State::Waiting => trigger.map(|_| waits_for(self.args)),
        };
        let parts = [Some(" q quits".to_owned()), shots, state];
        parts.into_iter().flatten().collect::<Vec<_>>().join("   ")
    }

    /// Draws what is new, and waits a little; `true` if it is to end.
    fn pause(&mut self) -> Result<bool, Failure> {
        if !self.is_on_screen() {
            thread::sleep(TURN);
            return Ok(false);
        }
        if std::mem::take(&mut self.is_stale) {
            let status = self.status();
            self.display.draw(self.shown.as_ref(), &status)?;
        }
        let asked = keys::wait_for(TURN, &mut self.display)?;
        self.is_stale |= asked == KeyAction::Draw;
        Ok(asked == KeyAction::End)
    }
}

fn of(shot: Shot) -> Captured {
    Captured { shot, clock: Some(read_clocks()) }
}

/// What is said while it waits.
pub(super) fn waits_for(args: &Args) -> String {
    match &args.trigger {
        Some(trigger) => format!("armed: waiting for {trigger}"),
        None => "capturing".to_owned(),
    }
}
