//! Operating a running node from the program that embeds it.

use std::sync::{Arc, MutexGuard};

use isochrone_control::desk::{
    Operator, PreparedRequest, RequestTerms, SaveError, Selection, Signals,
};
use isochrone_cyclic::{Clock, Monotonic};
use isochrone_model::{AskedBy, Entry, Force, Hold, Refusal, Value};

use crate::error::{ApplyError, SendError};
use crate::node::apply::{Applying, IfMissed, PreparedApply};
use crate::node::operating::{Operating, Sent};
use crate::node::running::Running;

/// The most values that one [`Running::get`] reads.
const MAX_READ: usize = 4096;

impl Running {
    /// Gives parameters (`"block.pin"`: input pins that nothing is wired to), variables (`"variable"`), and
    /// inputs that are read from no service (`"input"`), new values.
    ///
    /// A value is an `f64`, a `bool` or an integer, as the signal's type says. All of a call's values
    /// for one task are applied together, at the start of one of its next cycles, before it reads its
    /// inputs; [`Batch::applied`](crate::Batch::applied) says in which cycle that was, and what was there
    /// before. A pin that its block reads in the first call only takes the value without effect.
    ///
    /// # Errors
    /// A name or value is wrong, something else writes the signal, the configuration does not allow it (`control`,
    /// `[[protect]]`, `[limits]`), or a task is more than 64 requests behind. Nothing is written then, and everything
    /// that is wrong is reported.
    pub fn set<'a, V: Into<Value>>(
        &self,
        values: impl IntoIterator<Item = (&'a str, V)>,
    ) -> Result<Sent, SendError> {
        let values = taken(values);
        self.send(|operator, next| operator.set(values, RequestTerms::default(), next))
    }

    /// Holds signals at values, whatever else writes them: an input after it was read, an input pin after its wires
    /// were copied, an output pin after its block has stepped. Everything but the age of an input can be forced.
    ///
    /// A force that lasts some seconds ends exactly at its cycle. Then, or when it is
    /// [released](Self::release), a signal has the value that it would have had. The node's end ends
    /// all forces.
    ///
    /// # Errors
    /// As [`set`](Self::set); the configuration must say `control = "force"`.
    pub fn force<'a, V: Into<Value>>(
        &self,
        values: impl IntoIterator<Item = (&'a str, V)>,
        hold: Hold,
    ) -> Result<Sent, SendError> {
        let values = taken(values);
        self.send(|operator, next| operator.force(values, hold, RequestTerms::default(), next))
    }

    /// Ends forces. In a name, `*` stands for any characters within one part, and all signals that are
    /// forced and match are released; where there are none, nothing happens.
    ///
    /// # Errors
    /// A name is wrong or is not forced; otherwise as [`force`](Self::force).
    pub fn release<'a>(&self, names: impl IntoIterator<Item = &'a str>) -> Result<Sent, SendError> {
        let names: Vec<&str> = names.into_iter().collect();
        let names = || names.iter().copied();
        let (operating, unmatched) =
            self.shared.search(|signals| Ok(signals.unmatched(names())))?;
        self.send_under(operating, |operator, next| {
            operator.release(names(), unmatched, RequestTerms::default(), next)
        })
    }

    /// Undoes a transaction that set parameters: a new transaction sets the values from before, all of them or none.
    ///
    /// # Errors
    /// It did not set parameters, has not been applied yet, or one of the parameters has changed since; otherwise as
    /// [`set`](Self::set).
    pub fn undo(&self, transaction: u64) -> Result<Sent, SendError> {
        self.send(|operator, next| operator.undo(transaction, RequestTerms::default(), next))
    }

    /// Asks for the values of signals, which arrive in [`Batch::readings`](crate::Batch::readings): the values of a
    /// task are all of one cycle, after its blocks have stepped. In a name, `*` stands for any characters within one
    /// part; of more than 4096 signals, the first are read.
    ///
    /// # Errors
    /// A name or a pattern matches no signal, or a task is more than 64 requests behind.
    pub fn get<'a>(&self, names: impl IntoIterator<Item = &'a str>) -> Result<Sent, SendError> {
        let names: Vec<&str> = names.into_iter().collect();
        let (operating, selection) = self.shared.search(|signals| {
            Ok(Selection::of(signals, names.iter().copied(), 0, MAX_READ)?.with_quality())
        })?;
        self.send_under(operating, |operator, _| Ok(operator.read(selection)))
    }

    /// Prepares another configuration for the running node, and says what it would change and cost. Its
    /// tasks, inputs and outputs must be those of the running one; its blocks, wires and constants may
    /// be others.
    ///
    /// # Errors
    /// It has errors, or it cannot replace the running one; everything that is wrong.
    pub fn prepare_apply(
        &self,
        configuration: &str,
        by: AskedBy,
    ) -> Result<PreparedApply, ApplyError> {
        let request = RequestTerms { by, ..RequestTerms::default() };
        PreparedApply::new(&self.shared, configuration, None, request)
    }

    /// Runs another configuration without a stop. Blocks of the same name, type and task go on with
    /// their state and outputs, new ones start from rest. A parameter whose constant differs between
    /// the two configurations takes the new one; all others keep the values that they have now.
    ///
    /// Each task has it from its first cycle on that is released at or after one instant, a period of
    /// the slowest task and 20 ms from now. Until all have it, no other configuration is taken, and
    /// [`set`](Self::set), [`force`](Self::force) and [`undo`](Self::undo) are refused for signals that it
    /// takes away, and set and undo also for those that it gives another value; all else goes on.
    ///
    /// # Errors
    /// As [`prepare_apply`](Self::prepare_apply), or something has changed since, or the tasks have no time for it
    /// between two cycles.
    pub fn apply(
        &self,
        prepared: PreparedApply,
        if_missed: IfMissed,
    ) -> Result<Applying, ApplyError> {
        let mut operating = self.shared.lock();
        if if_missed == IfMissed::Refuse {
            operating.check_slack(&prepared)?;
        }
        let applying = operating.send_change(prepared, Monotonic.now_ns())?;
        drop(operating);
        self.wake();
        Ok(applying)
    }

    /// Sends a request that `prepare` makes with the node's operator and the first cycle of each task that has not
    /// begun. Use it for requests that name a cycle, a client or a comment. The node is locked meanwhile and its
    /// supervisor waits: `prepare` must not take long, and must not call this node, which would deadlock.
    ///
    /// # Errors
    /// Those of the operator, or a task is more than 64 requests behind, or the node has ended.
    pub fn send(
        &self,
        prepare: impl FnOnce(&Operator, &[u64]) -> Result<PreparedRequest, Refusal>,
    ) -> Result<Sent, SendError> {
        self.send_under(self.shared.lock(), prepare)
    }

    fn send_under(
        &self,
        mut operating: MutexGuard<'_, Operating>,
        prepare: impl FnOnce(&Operator, &[u64]) -> Result<PreparedRequest, Refusal>,
    ) -> Result<Sent, SendError> {
        let next = operating.next_cycles(Monotonic.now_ns());
        let prepared = prepare(&operating.operator, &next)?;
        let sent = operating.send(prepared)?;
        drop(operating);
        self.wake();
        Ok(sent)
    }

    /// The node's names.
    pub fn signals(&self) -> Arc<Signals> {
        Arc::clone(self.shared.lock().operator.signals())
    }

    /// The forces that are in place.
    pub fn forces(&self) -> impl Iterator<Item = Force> + use<> {
        let forces: Vec<Force> = self.shared.lock().operator.forces().collect();
        forces.into_iter()
    }

    /// The journal of the node from a sequence number on.
    pub fn journal(&self, since: u64) -> impl Iterator<Item = Entry> + use<> {
        let entries: Vec<Entry> = self.shared.lock().operator.journal(since).collect();
        entries.into_iter()
    }

    /// The text of the node's configuration with the current values in place of the constants of parameters that were
    /// changed; everything else, including comments and order, stays.
    ///
    /// # Errors
    /// `text` is not the configuration of this node.
    pub fn save(&self, text: &str) -> Result<String, SaveError> {
        let changes = self.shared.lock().hand_out_changes();
        changes.save(text)
    }
}

/// Collected before anything is locked, as the iterator may read them from this node.
fn taken<'a, V: Into<Value>>(
    values: impl IntoIterator<Item = (&'a str, V)>,
) -> Vec<(&'a str, Value)> {
    values.into_iter().map(|(name, value)| (name, value.into())).collect()
}
