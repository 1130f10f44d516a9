//! Process alarms of a task as it runs: what changed in a cycle.

use crate::plan::{AlarmPlan, TaskPlan};

/// A process alarm that came, went, can be evaluated again, or cannot be.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct AlarmEvent {
    /// Its index among the alarms of the task.
    pub alarm: usize,
    /// The cycle in which it changed.
    pub cycle: u64,
    /// Whether it is active.
    pub active: bool,
    /// Whether its condition can be evaluated.
    pub ok: bool,
    /// The value of the signal that its condition names first.
    pub value: f64,
}

/// Finds the process alarms that a cycle changed. For the real-time path: no allocation, no lock, no system call.
#[derive(Debug, Default)]
pub struct AlarmWatch(Box<[Watched]>);

/// An alarm as it was last told.
#[derive(Clone, Debug)]
struct Watched {
    active_slot: usize,
    ok_slot: usize,
    value_slot: usize,
    active: f64,
    ok: f64,
}

impl AlarmWatch {
    /// The alarms of a task, none of which is active.
    pub fn of(task: &TaskPlan) -> Self {
        let watched = |alarm: &AlarmPlan| Watched {
            active_slot: alarm.active_slot(),
            ok_slot: alarm.ok_slot(),
            value_slot: alarm.value_slot,
            active: 0.0,
            ok: 1.0,
        };
        Self(task.alarms.iter().map(watched).collect())
    }

    /// Has the next look tell of an alarm, whether it changed or not.
    pub fn doubt(&mut self, alarm: usize) {
        if let Some(known) = self.0.get_mut(alarm) {
            known.active = f64::NAN;
        }
    }

    /// Takes over what was told of the alarms of another watch: of each pair the index there, and the index here.
    pub fn follow(&mut self, old: &Self, kept: &[(usize, usize)]) {
        for (from, to) in kept {
            if let (Some(from), Some(to)) = (old.0.get(*from), self.0.get_mut(*to)) {
                (to.active, to.ok) = (from.active, from.ok);
            }
        }
    }

    /// Tells of each alarm that a cycle changed. Where `tell` is `false`, it is told again in the next cycle, if that
    /// still holds.
    pub fn look(&mut self, image: &[f64], cycle: u64, mut tell: impl FnMut(AlarmEvent) -> bool) {
        let value = |slot: usize| image.get(slot).copied().unwrap_or_default();
        for (alarm, known) in self.0.iter_mut().enumerate() {
            let (active, ok) = (value(known.active_slot), value(known.ok_slot));
            if active == known.active && ok == known.ok {
                continue;
            }
            let event = AlarmEvent {
                alarm,
                cycle,
                active: active != 0.0,
                ok: ok != 0.0,
                value: value(known.value_slot),
            };
            if tell(event) {
                (known.active, known.ok) = (active, ok);
            }
        }
    }
}
