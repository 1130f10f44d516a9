//! The operating state of one of two processes of a node: what the other one has to have, and what it has.

use std::collections::HashMap;
use std::mem;
use std::sync::Arc;

use isochrone_control::desk::{AlarmRecord, DeskCopy, OrderOutcome};
use isochrone_control::{LastTakeover, RedundancyDescription};
use serde::{Deserialize, Serialize};

use super::{Operating, RequestOutcome};
use crate::keeping::guard::WriteGuard;
use crate::redundancy::twin::Twin;
use crate::task::faults::Active;

/// Two takeovers within this time are an alarm, and the alarm stands for as long.
const OFTEN_NS: u64 = 1_000_000_000;
const SHOWN_NS: u64 = 60_000_000_000;

/// What a holder tells its standby besides the states.
#[derive(Serialize, Deserialize)]
struct DeskMessage {
    desk: DeskCopy,
    alarms: Vec<AlarmRecord>,
}

impl Operating {
    /// Makes this one of two processes of the node.
    pub(crate) fn join_twin(&mut self, twin: Arc<Twin>) {
        self.held = twin.holds();
        self.twin = Some(twin);
    }

    /// Whether this process holds the node. Where that has changed, the journal goes along: a thread of its own opens
    /// it, and what is done before it is open waits for that.
    pub(super) fn follow_role(&mut self) -> bool {
        let holds = self.twin.as_ref().is_none_or(|twin| twin.holds());
        if mem::replace(&mut self.held, holds) == holds {
            return holds;
        }
        if !holds {
            self.awaited.clear();
            self.keeping.give_up();
        } else if let Some(journal) = self.journal_at_takeover.clone() {
            // The numbers of what was done before are those of another process.
            self.operator.continue_after(0);
            let guard = WriteGuard::of_holder(self.twin.as_ref());
            self.keeping.go_on(journal.name(), move || journal.open(guard));
        }
        holds
    }

    /// The last cycle of the first task that is known.
    pub(crate) fn last_cycle(&self) -> u64 {
        self.lanes.first().and_then(|lane| lane.last).map_or(0, |last| last.cycle)
    }

    /// Lets outcomes wait until the standby has what was done, as long as one follows.
    pub(super) fn await_standby(&mut self, outcomes: Vec<RequestOutcome>) -> Vec<RequestOutcome> {
        self.awaited.extend(outcomes);
        let standby = self.twin.as_ref().and_then(|twin| twin.standby());
        let mut ready = Vec::new();
        while let Some(first) = self.awaited.front() {
            let is_known = match (&first.done, &standby) {
                (OrderOutcome::Applied(entry), Some(standby)) => {
                    let lanes = self.lanes.iter();
                    let task = lanes.enumerate().find(|(_, lane)| lane.name == entry.task);
                    let index = task.map_or(usize::MAX, |(index, _)| index);
                    standby.has(index, entry.cycle, entry.sequence)
                }
                _ => true,
            };
            if !is_known {
                break;
            }
            ready.extend(self.awaited.pop_front());
        }
        ready
    }

    /// What the desk has, for the standby.
    pub(crate) fn desk_copy(&self) -> Vec<u8> {
        let (desk, alarms) = (self.operator.copy(), self.process_alarms.records());
        // Strings and numbers only: nothing in it can fail.
        serde_json::to_vec(&DeskMessage { desk, alarms }).unwrap_or_default()
    }

    /// Takes over what the holder's desk has; the last entry of its journal. `next` is the next cycle of each task.
    pub(crate) fn adopt_desk(&mut self, message: &[u8], next: &[u64]) -> Option<u64> {
        let DeskMessage { desk, alarms } = serde_json::from_slice(message).ok()?;
        for (task, order) in self.operator.adopt(&desk, next) {
            if let Some(lane) = self.lanes.get_mut(task) {
                lane.orders.send(order);
            }
        }
        let records: HashMap<_, _> =
            alarms.iter().map(|record| (record.name.as_str(), record)).collect();
        self.process_alarms.restore(&records);
        Some(desk.sequence)
    }

    /// Who holds the node and who stands by.
    pub(crate) fn redundancy(&self) -> Option<RedundancyDescription> {
        let twin = self.twin.as_ref()?;
        let (standby, page) = (twin.standby(), twin.seat().page());
        let last = page.last_takeover();
        let next = self.last_cycle().saturating_add(1);
        let behind = |next_cycle: &u64| next.saturating_sub(*next_cycle);
        Some(RedundancyDescription {
            holder: std::process::id(),
            standby: standby.as_ref().map(|standby| standby.process),
            is_complete: standby.as_ref().is_some_and(|standby| standby.is_complete),
            behind_cycles: standby.as_ref().and_then(|it| it.next_cycles.first().map(behind)),
            takeovers: last.map_or(0, |last| last.count),
            last_takeover: last.map(|last| LastTakeover {
                unix_ns: last.unix_ns,
                was_asked: last.was_asked,
                lost_cycles: last.lost_cycles,
            }),
        })
    }

    /// The alarms about the other process: it is gone, or the node was taken over twice within a second.
    pub(crate) fn twin_alarms(&self, now_unix_ns: u64) -> impl Iterator<Item = Active> {
        let gone = self.standby_gone.map(|since| {
            let meaning = "the standby is gone, and nobody takes over from this process; see why it ended, and start it \
                           again (`run FILE --redundant`)";
            Active::of_node("standby", meaning.to_owned(), since, 1)
        });
        let last = self.twin.as_ref().and_then(|twin| twin.seat().page().last_takeover());
        let is_often = |last: &isochrone_ipc::Takeover| {
            last.after_ns.is_some_and(|after_ns| after_ns <= OFTEN_NS)
                && now_unix_ns.saturating_sub(last.unix_ns) <= SHOWN_NS
        };
        let often = last.filter(is_often).map(|last| {
            let meaning = "the node was taken over twice within a second: its two processes keep each other from their \
                           CPUs, or the machine stops them; give the standby a longer --after, or see `isochrone doctor`";
            Active::of_node("takeovers", meaning.to_owned(), self.last_cycle(), last.count)
        });
        gone.into_iter().chain(often)
    }
}
