//! The faults of a task: blocks that report an error, inputs that are not ok, services with alarms.

use std::collections::{BTreeMap, HashMap, VecDeque};
use std::sync::Arc;

use isochrone_blocks::{Caution, status};
use isochrone_timing::WarningCode;

use crate::node::event::Event;
use crate::node::standing::StateChange;
use crate::task::messages::{Messages, Moved};

/// The blocks of a task that report or reported an error, and its inputs that are or were not ok.
pub(crate) struct Faults {
    messages: Arc<Messages>,
    /// By index: blocks in the order of the image, then inputs.
    known: BTreeMap<usize, Fault>,
    active: usize,
    /// Faults of services, current and past.
    states: Vec<State>,
    /// Why inputs take no sample of their service, by name.
    reasons: HashMap<String, String>,
    /// Configurations that are on their way to the task.
    next: VecDeque<(Arc<Messages>, Arc<Moved>)>,
}

/// Of one block or input.
struct Fault {
    /// Its latest event.
    event: Event,
    is_active: bool,
    since_cycle: u64,
    count: u64,
}

/// Of one service, or an input of it.
struct State {
    code: WarningCode,
    name: String,
    /// `None`: it is over.
    meaning: Option<String>,
    since_cycle: u64,
    count: u64,
}

/// Something that is wrong.
pub(crate) struct Active {
    pub(crate) name: String,
    /// Its code, unless it is about a block or about whether an input is ok.
    pub(crate) code: Option<String>,
    /// A block's status word, if it has one.
    pub(crate) status: Option<u16>,
    pub(crate) meaning: String,
    pub(crate) since_cycle: u64,
    pub(crate) count: u64,
}

impl Active {
    /// One of the node, with neither code nor status.
    pub(crate) fn of_node(name: &str, meaning: String, since_cycle: u64, count: u64) -> Self {
        Self { name: name.to_owned(), code: None, status: None, meaning, since_cycle, count }
    }
}

impl Faults {
    pub(crate) fn new(messages: Arc<Messages>) -> Self {
        Self {
            messages,
            known: BTreeMap::new(),
            active: 0,
            states: Vec::new(),
            reasons: HashMap::new(),
            next: VecDeque::new(),
        }
    }

    /// Records events, in order.
    pub(crate) fn note(&mut self, events: &[Event]) {
        for event in events {
            let (is_active, cycle) = match *event {
                Event::Block { status, cycle, .. } => (status != status::OK, cycle),
                Event::Input { state, cycle, .. } => (!state.is_ok(), cycle),
                Event::Changed => {
                    self.change();
                    continue;
                }
            };
            let none = Fault { event: *event, is_active: false, since_cycle: cycle, count: 0 };
            let fault = self.known.entry(self.messages.speaker(event)).or_insert(none);
            match (fault.is_active, is_active) {
                (false, true) => {
                    (fault.since_cycle, fault.count) = (cycle, fault.count + 1);
                    self.active += 1;
                }
                (true, false) => self.active -= 1,
                _ => {}
            }
            (fault.event, fault.is_active) = (*event, is_active);
        }
    }

    /// Records why inputs take no sample of their service; `None`: they can.
    pub(crate) fn explain(&mut self, reasons: Vec<(String, Option<String>)>) {
        for (input, reason) in reasons {
            match reason {
                Some(reason) => drop(self.reasons.insert(input, reason)),
                None => drop(self.reasons.remove(&input)),
            }
        }
    }

    /// Records faults of services that began or ended at a cycle.
    pub(crate) fn change_states(&mut self, changes: Vec<StateChange>, cycle: u64) {
        for StateChange { code, name, meaning } in changes {
            let known =
                self.states.iter_mut().find(|state| state.code == code && state.name == name);
            let Some(state) = known else {
                self.states.push(State { code, name, meaning, since_cycle: cycle, count: 1 });
                continue;
            };
            if state.meaning.is_none() {
                (state.since_cycle, state.count) = (cycle, state.count + 1);
            }
            state.meaning = meaning;
        }
    }

    /// The name of a block or input.
    pub(crate) fn messages(&self) -> Arc<Messages> {
        Arc::clone(&self.messages)
    }

    /// Adds a configuration, which takes effect with its first event.
    pub(crate) fn expect(&mut self, messages: Arc<Messages>, moved: Arc<Moved>) {
        self.next.push_back((messages, moved));
    }

    fn change(&mut self) {
        let Some((messages, moved)) = self.next.pop_front() else { return };
        let known = std::mem::take(&mut self.known).into_iter();
        self.known = known
            .filter_map(|(speaker, mut fault)| {
                let place = moved.place(speaker)?;
                if let Event::Block { instance, .. } = &mut fault.event {
                    *instance = place;
                }
                Some((place, fault))
            })
            .collect();
        self.active = self.known.values().filter(|fault| fault.is_active).count();
        self.messages = messages;
    }

    /// How many faults there are now.
    pub(crate) fn total(&self) -> usize {
        self.active + self.states.iter().filter(|state| state.meaning.is_some()).count()
    }

    /// The current faults.
    pub(crate) fn active(&self) -> impl Iterator<Item = Active> {
        let active = self.known.values().filter(|fault| fault.is_active);
        let states = self.states.iter().filter_map(|state| {
            let (name, code) = (state.name.clone(), Some(state.code.as_str().to_owned()));
            let (meaning, status) = (state.meaning.clone()?, None);
            let State { since_cycle, count, .. } = *state;
            Some(Active { name, code, status, meaning, since_cycle, count })
        });
        let faults = active.filter_map(|fault| {
            let Fault { since_cycle, count, .. } = *fault;
            if let Some((name, Caution { code, meaning, remedy, .. })) =
                self.messages.caution(&fault.event)
            {
                let (code, meaning) = (Some(code.to_string()), format!("{meaning}; {remedy}"));
                return Some(Active { name, code, status: None, meaning, since_cycle, count });
            }
            let (name, status, meaning) = self.messages.explain(&fault.event, &self.reasons)?;
            Some(Active { name, code: None, status, meaning, since_cycle, count })
        });
        faults.chain(states)
    }
}
