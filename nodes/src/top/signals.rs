//! The signals of a node: which are listed, and what is known of them.

use std::collections::{HashMap, HashSet};

use isochrone_control::{Force, Role, SignalDescription, Value};

use super::cursor::{Cursor, Motion};
use super::trace::{NO_LEVEL, Trace, UNSET};
use crate::base::numbers::number;
use crate::base::session::{Marks, ReadValues, Readings};
use crate::operate::ok_of;

/// Which signals are listed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum Filter {
    #[default]
    All,
    /// Inputs, with their `ok` and `age`.
    Inputs,
    /// Parameters and variables.
    Parameters,
    Wired,
    Outputs,
}

impl Filter {
    pub(super) const ALL: [Self; 5] =
        [Self::All, Self::Inputs, Self::Parameters, Self::Wired, Self::Outputs];

    pub(super) fn as_str(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::Inputs => "inputs",
            Self::Parameters => "parameters",
            Self::Wired => "wired",
            Self::Outputs => "outputs",
        }
    }

    /// The key that chooses it.
    pub(super) fn key(self) -> char {
        match self {
            Self::All => 'a',
            Self::Inputs => 'i',
            Self::Parameters => 'p',
            Self::Wired => 'w',
            Self::Outputs => 'o',
        }
    }

    fn shows(self, role: Role) -> bool {
        match self {
            Self::All => true,
            Self::Inputs => matches!(role, Role::Input | Role::Ok | Role::Age),
            Self::Parameters => role.is_settable(),
            Self::Wired => role == Role::Wired,
            Self::Outputs => role == Role::Output,
        }
    }
}

/// All signals, and those of them that are listed.
#[derive(Debug, Default)]
pub(super) struct Signals {
    all: Vec<SignalDescription>,
    /// Characters of the longest name.
    longest_name: usize,
    /// Places in `all`.
    listed: Vec<usize>,
    filter: Filter,
    search: String,
    cursor: Cursor,
    readings: Readings,
    traces: HashMap<String, Trace>,
}

impl Signals {
    /// The node has these signals now. The selected one stays selected if there still is one of its name.
    pub(super) fn set_all(&mut self, all: Vec<SignalDescription>) {
        let selected = self.selected().map(|signal| signal.name.clone());
        let lengths = all.iter().map(|signal| signal.name.chars().count());
        self.longest_name = lengths.max().unwrap_or_default();
        self.all = all;
        self.forget_values();
        self.list(selected.as_deref());
    }

    pub(super) fn total(&self) -> usize {
        self.all.len()
    }

    pub(super) fn longest_name(&self) -> usize {
        self.longest_name
    }

    pub(super) fn listed(&self) -> usize {
        self.listed.len()
    }

    pub(super) fn filter(&self) -> Filter {
        self.filter
    }

    pub(super) fn search(&self) -> &str {
        &self.search
    }

    pub(super) fn set_filter(&mut self, filter: Filter) {
        self.filter = filter;
        self.list_again();
    }

    /// Lists only names that contain this, in capitals or not.
    pub(super) fn set_search(&mut self, search: String) {
        self.search = search;
        self.list_again();
    }

    fn list_again(&mut self) {
        let selected = self.selected().map(|signal| signal.name.clone());
        self.list(selected.as_deref());
    }

    fn list(&mut self, selected: Option<&str>) {
        let search = self.search.to_lowercase();
        let is_listed = |signal: &SignalDescription| {
            self.filter.shows(signal.role) && signal.name.to_lowercase().contains(&search)
        };
        let listed = self.all.iter().enumerate().filter(|(_, signal)| is_listed(signal));
        self.listed = listed.map(|(place, _)| place).collect();
        self.cursor.set_len(self.listed.len());
        let is_selected = |place: &usize| {
            self.all.get(*place).is_some_and(|signal| Some(signal.name.as_str()) == selected)
        };
        self.cursor.select(self.listed.iter().position(is_selected).unwrap_or_default());
    }

    pub(super) fn set_rows(&mut self, rows: usize) {
        self.cursor.set_rows(rows);
    }

    pub(super) fn go(&mut self, motion: Motion) {
        self.cursor.go(motion);
    }

    /// The signal of a name.
    pub(super) fn find(&self, name: &str) -> Option<&SignalDescription> {
        self.all.iter().find(|signal| signal.name == name)
    }

    pub(super) fn selected(&self) -> Option<&SignalDescription> {
        self.all.get(*self.listed.get(self.cursor.selected())?)
    }

    /// The signals on the screen, and whether each is the selected one.
    pub(super) fn on_screen(&self) -> impl Iterator<Item = (&SignalDescription, bool)> {
        let window = self.cursor.window();
        let places = self.listed.get(window.clone()).unwrap_or_default();
        let lines = window.zip(places);
        lines.filter_map(|(line, place)| {
            self.all.get(*place).map(|signal| (signal, line == self.cursor.selected()))
        })
    }

    /// The names whose values the screen needs: those on it, and what its inputs are worth.
    /// None of a task that has not run yet: the node would answer after its first cycle, for all of them.
    pub(super) fn watched(&self, has_run: impl Fn(&str) -> bool) -> Vec<String> {
        let mut names = Vec::new();
        for (signal, _) in self.on_screen().filter(|(signal, _)| has_run(&signal.task)) {
            names.push(signal.name.clone());
            if signal.role == Role::Input {
                names.push(ok_of(&signal.name));
            }
        }
        // A name that is asked for twice would be answered once.
        let mut asked = HashSet::new();
        names.retain(|name| asked.insert(name.clone()));
        names
    }

    /// Replaces the values. Signals that are not among them have none any more.
    pub(super) fn read(&mut self, read: ReadValues) {
        let mut traces = std::mem::take(&mut self.traces);
        for (name, value) in read.values.iter() {
            let mut trace = traces.remove(name).unwrap_or_default();
            trace.push(number(value));
            self.traces.insert(name.to_owned(), trace);
        }
        self.readings.take(read);
    }

    /// The flags of a signal's value, with blanks between them; nothing for none.
    pub(super) fn flags(&self, name: &str) -> String {
        self.readings.flags(name).join(" ")
    }

    /// Forgets all values: they are no news any more.
    pub(super) fn forget_values(&mut self) {
        self.readings.forget();
        self.traces.clear();
    }

    pub(super) fn value(&self, name: &str) -> Option<Value> {
        self.readings.value(name)
    }

    pub(super) fn trace(&self, signal: &SignalDescription, width: usize) -> String {
        // An INT that is NaN was given nothing.
        let no_level = if signal.value_type == "INT" { UNSET } else { NO_LEVEL };
        let trace = self.traces.get(&signal.name);
        trace.map_or_else(String::new, |trace| trace.draw(width, no_level))
    }

    pub(super) fn set_forced(&mut self, forces: &[Force]) {
        self.readings.set_forced(forces);
    }

    /// These blocks report an error, and these inputs are not ok.
    pub(super) fn set_alarmed(&mut self, names: impl IntoIterator<Item = String>) {
        self.readings.set_alarmed(names);
    }

    pub(super) fn marks(&self, signal: &SignalDescription) -> Marks {
        self.readings.marks(signal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::top::fixtures::{force, read, signal};

    fn plant() -> Signals {
        let mut signals = Signals::default();
        let mut all = vec![
            signal("level", Role::Input, "LREAL"),
            signal("level.ok", Role::Ok, "BOOL"),
            signal("level.age", Role::Age, "LREAL"),
            signal("setpoint", Role::Variable, "LREAL"),
            signal("ramp.value", Role::Wired, "LREAL"),
            signal("ramp.setChangeRate", Role::Parameter, "LREAL"),
            signal("ramp.delayedValue", Role::Output, "LREAL"),
        ];
        all.extend((0..5000).map(|n| signal(&format!("bank.{n}.y"), Role::Output, "LREAL")));
        signals.set_all(all);
        signals.set_rows(20);
        signals
    }

    fn names(signals: &Signals) -> Vec<&str> {
        signals.on_screen().map(|(signal, _)| signal.name.as_str()).collect()
    }

    #[test]
    fn a_filter_and_a_search_together_say_what_is_listed() {
        let mut signals = plant();
        signals.set_filter(Filter::Outputs);
        signals.set_search("RAMP".into());
        assert_eq!(names(&signals), ["ramp.delayedValue"]);
        signals.set_filter(Filter::Inputs);
        assert_eq!((names(&signals).len(), signals.listed()), (0, 0));
        assert_eq!(signals.selected(), None);
        signals.set_search(String::new());
        assert_eq!(names(&signals), ["level", "level.ok", "level.age"]);
        signals.set_filter(Filter::Parameters);
        assert_eq!(names(&signals), ["setpoint", "ramp.setChangeRate"], "whatever can be set");
    }

    #[test]
    fn the_selected_signal_stays_selected_while_it_is_listed() {
        let mut signals = plant();
        signals.go(Motion::Last);
        let last = "bank.4999.y";
        signals.set_filter(Filter::Outputs);
        assert_eq!(signals.selected().unwrap().name, last);
        signals.set_search("49".into());
        assert_eq!(signals.selected().unwrap().name, last);
        assert!(names(&signals).contains(&last));
        signals.set_search("48".into());
        assert_eq!(signals.selected().unwrap().name, "bank.48.y");
    }

    #[test]
    fn of_thousands_of_signals_only_those_on_the_screen_are_asked_for_and_what_inputs_are_worth() {
        let mut signals = plant();
        assert_eq!(signals.watched(|_| true).len(), 20);
        signals.go(Motion::Last);
        let watched = signals.watched(|_| true);
        assert_eq!((watched.len(), watched[19].as_str()), (20, "bank.4999.y"));
        signals.set_filter(Filter::All);
        signals.set_search("level".into());
        assert_eq!(signals.watched(|_| true), ["level", "level.ok", "level.age"]);
        signals.set_rows(1);
        assert_eq!(signals.watched(|_| true), ["level", "level.ok"]);
        assert!(signals.watched(|task| task != "fast").is_empty());
    }

    #[test]
    fn a_value_that_is_not_asked_for_any_more_is_not_shown_as_if_it_were_new() {
        let mut signals = plant();
        signals.read(read([("level", 1.5)]));
        assert_eq!(signals.value("level"), Some(Value::Number(1.5)));
        signals.read(read([("ramp.value", 2.0)]));
        let trace = |name: &str| signals.trace(signals.find(name).unwrap(), 9);
        assert_eq!((signals.value("level"), trace("level")), (None, String::new()));
        assert_eq!(trace("ramp.value").chars().count(), 1);
    }

    #[test]
    fn a_pin_without_a_value_leaves_its_trend_empty_where_a_number_that_is_none_does_not() {
        let mut signals = Signals::default();
        signals.set_all(vec![
            signal("ramp.callOB", Role::Parameter, "INT"),
            signal("ramp.delayedValue", Role::Output, "LREAL"),
        ]);
        signals.set_rows(20);
        for value in [f64::NAN, 35.0] {
            signals.read(read([("ramp.callOB", value), ("ramp.delayedValue", value)]));
        }
        let trace = |name: &str| signals.trace(signals.find(name).unwrap(), 9);
        assert_eq!((&*trace("ramp.callOB"), &*trace("ramp.delayedValue")), (" ▁", "?▁"));
    }

    #[test]
    fn an_input_that_is_not_ok_a_pin_of_a_failed_block_and_a_forced_signal_are_marked() {
        let mut signals = plant();
        signals.set_forced(&[force("ramp.delayedValue", 1.0)]);
        signals.set_alarmed(["ramp".to_owned(), "bank.7".to_owned()]);
        let stale = [("level", "STALE"), ("bank.9.y", "UPSTREAM"), ("bank.8.y", "FORCED")];
        let flags = |(name, flag): (&str, &str)| (name.to_owned(), vec![flag.to_owned()]);
        let quality = stale.into_iter().map(flags).collect();
        signals.read(ReadValues { quality, ..read([("level.ok", false)]) });
        let marks = |name: &str| signals.marks(signals.find(name).unwrap());
        let bad = Marks { bad: true, ..Marks::default() };
        assert_eq!(marks("level"), Marks { in_doubt: true, ..bad });
        assert_eq!(marks("level.ok"), bad);
        assert_eq!(marks("ramp.delayedValue"), Marks { forced: true, ..bad });
        assert_eq!(marks("ramp.value"), bad);
        assert_eq!(marks("bank.7.y"), bad);
        assert_eq!(marks("bank.8.y"), Marks { from_forced: true, ..Marks::default() });
        assert_eq!(marks("bank.9.y"), Marks { in_doubt: true, ..Marks::default() });
    }
}
