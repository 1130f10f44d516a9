//! Questions of the screen before a change, and changes that it refuses beforehand.

use isochrone_control::{Access, Role, SignalDescription};

use super::dialog::{Asks, Dialog, Question};
use super::input::Page;
use super::model::Model;
use crate::base::session::{Order, Target};

impl Model {
    /// What operators may do; nothing is known before the node has answered.
    pub(super) fn access(&self) -> Access {
        self.node.as_ref().map_or(Access::Off, |node| node.control)
    }

    pub(super) fn ask_for_value(&mut self) {
        let Some(signal) = self.chosen(Access::Set) else { return };
        if signal.role.is_settable() {
            self.ask(Asks::NewValue(Target::new(&signal)));
        } else {
            let instead = match (signal.role, self.access()) {
                (Role::Age, _) | (_, Access::Off | Access::Read | Access::Set) => "",
                (_, Access::Force) => "; f forces it",
            };
            self.say(format!("{} is no parameter{instead}", signal.name));
        }
    }

    pub(super) fn ask_for_force(&mut self) {
        let Some(signal) = self.chosen(Access::Force) else { return };
        if signal.role == Role::Age {
            self.say(format!("{} is measured, and cannot be forced", signal.name));
        } else {
            self.ask(Asks::ForcedValue(Target::new(&signal)));
        }
    }

    pub(super) fn ask_for_release(&mut self) {
        let Some(signal) = self.chosen(Access::Force) else { return };
        if self.forces.iter().any(|force| force.name == signal.name) {
            self.ask(Asks::Confirm(Order::Release { name: signal.name }));
        } else {
            self.say(format!("{} is not forced", signal.name));
        }
    }

    pub(super) fn ask_to_acknowledge(&mut self) {
        if self.page != Page::Alarms || !self.is_allowed(Access::Set) {
            return;
        }
        match self.process.get(self.alarm_cursor.selected()) {
            Some(alarm) if alarm.state.is_unacknowledged() => {
                let (alarm, occurrence) = (alarm.name.clone(), alarm.occurrence);
                let comment = None;
                self.ask(Asks::Confirm(Order::Acknowledge { alarm, occurrence, comment }));
            }
            Some(alarm) => self.say(format!("nothing of {} is left to acknowledge", alarm.name)),
            None => self.say("select a process alarm: the node is well again by itself"),
        }
    }

    pub(super) fn ask_for_undo(&mut self) {
        if !self.is_allowed(Access::Set) {
            return;
        }
        let newest = self.history.undoable().map(|number| number.to_string());
        let question = Question::new(Asks::Transaction);
        let question = Question { input: newest.unwrap_or_default(), ..question };
        self.dialog = Some(Dialog::Question(question));
    }

    /// The selected signal, if it may be changed; else it is said why not.
    fn chosen(&mut self, access: Access) -> Option<SignalDescription> {
        if !self.is_allowed(access) {
            return None;
        }
        let signal = match self.page {
            Page::Signals => self.signals.selected(),
            Page::Forces => {
                let force = self.forces.get(self.force_cursor.selected());
                force.and_then(|force| self.signals.find(&force.name))
            }
            Page::Tasks | Page::Alarms => None,
        };
        let Some(signal) = signal.cloned() else {
            self.say("select a signal first (page 1)");
            return None;
        };
        if signal.protected == Some(true) {
            let name = &signal.name;
            self.say(format!("{name} is protected ([[protect]] in the configuration)"));
            return None;
        }
        Some(signal)
    }

    fn is_allowed(&mut self, access: Access) -> bool {
        let is_allowed = self.access() >= access;
        if !is_allowed {
            let allowed = match self.access() {
                Access::Off | Access::Read => "read",
                Access::Set | Access::Force => "set",
            };
            self.say(format!(
                "the node's configuration does not allow it (control = \"{allowed}\")"
            ));
        }
        is_allowed
    }

    fn ask(&mut self, asks: Asks) {
        self.dialog = Some(Dialog::Question(Question::new(asks)));
    }
}
