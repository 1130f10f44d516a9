//! The state of the screen: the node, and the actions under way.

use std::collections::VecDeque;

use isochrone_control::{ActiveAlarm, DescribeResult, Force, ProcessAlarm};

use super::cursor::{Cursor, Motion};
use super::dialog::{Asks, Dialog, Next, Question};
use super::history::{History, shown_as};
use super::input::{Action, Focus, Page};
use super::message::{Space, message_lines};
use super::signals::Signals;
use crate::base::session::{Absence, CompletedOrder, News, Order, Timings, Windows};

/// A node that answers is heard at least once a second.
const SILENCE_NS: u64 = 1_500_000_000;
/// How long the last event is shown.
const NOTE_NS: u64 = 15_000_000_000;

/// The state of the screen.
#[derive(Debug, Default)]
pub(super) struct Model {
    /// As it last described itself; `None` until it did.
    pub(super) node: Option<DescribeResult>,
    /// The state of the node while it does not answer, and why it does not.
    pub(super) lost: Option<(Absence, String)>,
    pub(super) page: Page,
    pub(super) signals: Signals,
    /// The process alarms, which are listed first, and what is wrong with the node.
    pub(super) process: Vec<ProcessAlarm>,
    pub(super) alarms: Vec<ActiveAlarm>,
    pub(super) alarm_cursor: Cursor,
    pub(super) forces: Vec<Force>,
    pub(super) force_cursor: Cursor,
    pub(super) task_cursor: Cursor,
    pub(super) dialog: Option<Dialog>,
    /// Messages that wait until nothing is asked or typed.
    waiting: VecDeque<Dialog>,
    /// The search before the one that is being typed.
    searched: Option<String>,
    /// The last event, and its time.
    note: String,
    noted_ns: u64,
    pub(super) history: History,
    timings: Timings,
    /// Whether there were news since the last tick, and when there last were.
    has_heard: bool,
    heard_ns: u64,
    now_ns: u64,
    message_space: Space,
}

impl Model {
    /// Takes in what the session has to tell.
    pub(super) fn take(&mut self, news: News) {
        self.has_heard = true;
        match news {
            News::Joined { node, signals } => {
                if self.lost.take().is_some() {
                    self.say(format!("node \"{}\" answers again", node.node));
                }
                self.describe(node);
                self.signals.set_all(signals);
            }
            News::Described(node) => self.describe(node),
            News::Values(read) => self.signals.read(read),
            News::Alarms(alarms) => {
                self.signals.set_alarmed(alarms.iter().map(|alarm| alarm.name.clone()));
                self.alarms = alarms;
                self.alarm_cursor.set_len(self.count_alarms());
            }
            News::ProcessAlarms(process) => {
                self.process = process;
                self.alarm_cursor.set_len(self.count_alarms());
            }
            News::Forces(forces) => {
                self.signals.set_forced(&forces);
                self.forces = forces;
                self.force_cursor.set_len(self.forces.len());
            }
            News::Journal(entries) => self.history.take(entries),
            News::Timing(samples) => self.timings.take(samples),
            News::Done(done) => self.note_done(&done),
            News::Refused { order, why } => {
                let title = format!("Not done: {order}");
                self.say(title.clone());
                self.tell(title, why);
            }
            News::Lost { absence, why } => {
                self.lost = Some((absence, why));
                self.signals.forget_values();
                if absence == Absence::Ended {
                    self.take(News::Alarms(Vec::new()));
                    self.take(News::ProcessAlarms(Vec::new()));
                    self.take(News::Forces(Vec::new()));
                }
            }
        }
    }

    /// How many alarms of both kinds there are.
    pub(super) fn count_alarms(&self) -> usize {
        self.process.len() + self.alarms.len()
    }

    fn describe(&mut self, node: DescribeResult) {
        let has_restarted =
            self.node.as_ref().is_some_and(|known| known.started_unix_ns != node.started_unix_ns);
        if has_restarted {
            // Its numbers are those of another run.
            self.history = History::default();
            self.timings = Timings::default();
        }
        self.task_cursor.set_len(node.tasks.len());
        self.node = Some(node);
    }

    fn note_done(&mut self, done: &CompletedOrder) {
        let cycles = done.cycles.iter().map(|(task, cycle)| format!("{task} cycle {cycle}"));
        let before = done.before.iter().map(|(name, value)| shown_as(&self.signals, name, value));
        let (cycles, before) = (joined(cycles), joined(before));
        self.say(match done.transaction {
            Some(number) => format!("#{number} from {cycles}: {} (was {before})", done.order),
            None => format!("done: {}", done.order),
        });
        if !done.warnings.is_empty() {
            let title = format!("Done, with a warning: {}", done.order);
            self.tell(title, done.warnings.join("\n"));
        }
    }

    /// Says something below the list.
    pub(super) fn say(&mut self, text: impl Into<String>) {
        self.note = text.into();
        self.noted_ns = self.now_ns;
    }

    /// The last event; nothing after a while, or on another page.
    pub(super) fn note(&self) -> &str {
        let is_old = self.now_ns.saturating_sub(self.noted_ns) > NOTE_NS;
        if is_old { "" } else { &self.note }
    }

    /// Shows a message, as soon as the keyboard is free: the next key is meant for what is there now.
    fn tell(&mut self, title: String, text: String) {
        self.waiting.push_back(Dialog::Message { title, text, first: 0 });
        self.show_waiting();
    }

    fn show_waiting(&mut self) {
        if self.focus() == Focus::List {
            self.dialog = self.waiting.pop_front();
        }
    }

    /// Time goes on.
    pub(super) fn tick(&mut self, now_ns: u64) {
        self.now_ns = now_ns;
        if std::mem::take(&mut self.has_heard) {
            self.heard_ns = now_ns;
        }
        self.timings.tick(now_ns);
    }

    /// Why what is shown is not that of now.
    pub(super) fn doubt(&self) -> Option<String> {
        if let Some((_, why)) = &self.lost {
            return Some(format!("looking for the node: {why}"));
        }
        let silent_ns = self.now_ns.saturating_sub(self.heard_ns);
        let seconds = silent_ns as f64 / 1e9;
        (silent_ns > SILENCE_NS && self.node.is_some())
            .then(|| format!("no answer for {seconds:.1} s: the values are old"))
    }

    /// The timing of a task.
    pub(super) fn windows(&self, task: &str) -> Windows {
        self.timings.windows(task)
    }

    /// A page of a list has so many lines.
    pub(super) fn set_rows(&mut self, rows: Rows) {
        self.signals.set_rows(rows.signals);
        self.task_cursor.set_rows(rows.tasks);
        self.alarm_cursor.set_rows(rows.alarms);
        self.force_cursor.set_rows(rows.forces);
        self.message_space = rows.message;
    }

    /// The signals whose values are wanted: those on the screen, and that of a question.
    pub(super) fn watched(&self) -> Vec<String> {
        let tasks = self.node.as_ref().map_or(&[][..], |node| &node.tasks);
        let waits: Vec<_> = tasks.iter().filter(|task| task.last_cycle.is_none()).collect();
        let has_run = |name: &str| !waits.iter().any(|task| task.name == name);
        let mut names = match self.page {
            Page::Signals => self.signals.watched(has_run),
            Page::Tasks | Page::Alarms | Page::Forces => Vec::new(),
        };
        if let Some(Dialog::Question(question)) = &self.dialog
            && let Some(name) = question.asks.signal()
            && !names.iter().any(|it| it == name)
            && self.signals.find(name).is_some_and(|signal| has_run(&signal.task))
        {
            names.push(name.to_owned());
        }
        names
    }

    /// Whether what waits to be confirmed can be given a reason.
    pub(super) fn takes_reason(&self) -> bool {
        matches!(
            &self.dialog,
            Some(Dialog::Question(Question { asks: Asks::Confirm(order), .. })) if order.takes_reason()
        )
    }

    /// The part of the screen that gets the keys.
    pub(super) fn focus(&self) -> Focus {
        match &self.dialog {
            Some(Dialog::Help | Dialog::Message { .. }) => Focus::Message,
            Some(Dialog::Question(Question { asks: Asks::Confirm(_), .. })) => Focus::Confirmation,
            Some(Dialog::Question(_)) => Focus::Answer,
            None if self.searched.is_some() => Focus::Search,
            None => Focus::List,
        }
    }

    /// Does what a key asks for; returns what the node shall do.
    pub(super) fn act(&mut self, action: Action) -> Option<Order> {
        let order = self.take_action(action);
        self.show_waiting();
        order
    }

    fn take_action(&mut self, action: Action) -> Option<Order> {
        match action {
            // Those concern the program.
            Action::Quit | Action::Redraw => {}
            Action::Help => self.dialog = Some(Dialog::Help),
            Action::Show(page) => self.turn_to(page),
            Action::NextPage => self.turn(1),
            Action::PreviousPage => self.turn(Page::ALL.len() - 1),
            Action::Go(motion) => self.go(motion),
            Action::List(filter) => {
                self.turn_to(Page::Signals);
                self.signals.set_filter(filter);
            }
            Action::Search => {
                self.turn_to(Page::Signals);
                self.searched = Some(self.signals.search().to_owned());
            }
            Action::Set => self.ask_for_value(),
            Action::Force => self.ask_for_force(),
            Action::Release => self.ask_for_release(),
            Action::Undo => self.ask_for_undo(),
            Action::Acknowledge => self.ask_to_acknowledge(),
            Action::Type(character) => self.edit(|text| text.push(character)),
            Action::Erase => self.edit(|text| {
                text.pop();
            }),
            Action::EraseAll => self.edit(String::clear),
            Action::Accept => return self.accept(),
            Action::Comment => {
                if let Some(Dialog::Question(question)) = self.dialog.take() {
                    self.dialog = Some(Dialog::Question(question.for_comment()));
                }
            }
            Action::Cancel => self.cancel(),
        }
        None
    }

    fn turn(&mut self, by: usize) {
        let place = Page::ALL.iter().position(|page| *page == self.page).unwrap_or_default();
        self.turn_to(Page::ALL[(place + by) % Page::ALL.len()]);
    }

    fn turn_to(&mut self, page: Page) {
        if self.page != page {
            self.note.clear();
        }
        self.page = page;
    }

    fn go(&mut self, motion: Motion) {
        match &mut self.dialog {
            Some(Dialog::Message { title, text, first }) => {
                let lines = message_lines(title, text, self.message_space).len();
                let last = lines.saturating_sub(self.message_space.lines);
                *first = match motion {
                    Motion::Up => first.saturating_sub(1),
                    Motion::Down => *first + 1,
                    Motion::PageUp | Motion::First => 0,
                    Motion::PageDown | Motion::Last => last,
                }
                .min(last);
            }
            Some(_) => {}
            None => match self.page {
                Page::Signals => self.signals.go(motion),
                Page::Tasks => self.task_cursor.go(motion),
                Page::Alarms => self.alarm_cursor.go(motion),
                Page::Forces => self.force_cursor.go(motion),
            },
        }
    }

    fn edit(&mut self, change: impl FnOnce(&mut String)) {
        match &mut self.dialog {
            Some(Dialog::Question(question)) => {
                change(&mut question.input);
                // It was about what was typed before.
                question.error = None;
            }
            Some(_) => {}
            None if self.searched.is_some() => {
                let mut search = self.signals.search().to_owned();
                change(&mut search);
                self.signals.set_search(search);
            }
            None => {}
        }
    }

    fn accept(&mut self) -> Option<Order> {
        match self.dialog.take() {
            Some(Dialog::Question(question)) => match question.answer(&self.history, &self.signals)
            {
                Next::Ask(question) => self.dialog = Some(Dialog::Question(question)),
                Next::Send(order) => {
                    self.say(format!("asked to {order} …"));
                    return Some(order);
                }
            },
            Some(_) => {}
            None => self.searched = None,
        }
        None
    }

    fn cancel(&mut self) {
        if self.dialog.take().is_some() {
            return;
        }
        match self.searched.take() {
            Some(before) => self.signals.set_search(before),
            // Out of a search that was accepted.
            None => self.signals.set_search(String::new()),
        }
    }
}

fn joined(parts: impl Iterator<Item = String>) -> String {
    parts.collect::<Vec<_>>().join(", ")
}

/// How many lines the lists have on the screen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Rows {
    pub(super) signals: usize,
    pub(super) tasks: usize,
    pub(super) alarms: usize,
    pub(super) forces: usize,
    pub(super) message: Space,
}
