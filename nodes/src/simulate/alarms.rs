//! What process alarms did in a simulation.

use isochrone_engine::{AlarmEvent, AlarmWatch, Plan, escaped};
use isochrone_report::Table;

use crate::base::numbers::{Digits, shown};
use crate::base::terminal;

/// Most rows of the list. The column of an alarm in an output has all of it.
const ROWS: usize = 40;

/// The changes of all alarms, in order.
pub(super) struct AlarmList<'a> {
    plan: &'a Plan,
    /// For each task.
    watches: Vec<AlarmWatch>,
    events: Vec<(usize, AlarmEvent)>,
    left_out: u64,
}

impl<'a> AlarmList<'a> {
    pub(super) fn of(plan: &'a Plan) -> Self {
        let watches = plan.tasks.iter().map(AlarmWatch::of).collect();
        Self { plan, watches, events: Vec::new(), left_out: 0 }
    }

    /// Takes the changes of a cycle.
    pub(super) fn look(&mut self, task: usize, image: &[f64], cycle: u64) {
        let Self { watches, events, left_out, .. } = self;
        watches[task].look(image, cycle, |event| {
            if events.len() < ROWS {
                events.push((task, event));
            } else {
                *left_out += 1;
            }
            true
        });
    }

    /// Lists them for people.
    pub(super) fn note(&self) {
        if self.events.is_empty() {
            return;
        }
        let mut table = Table::default();
        table.row(["alarm", "", "cycle", "time", "value", "text"]);
        // What an alarm was before.
        let mut active = vec![false; self.plan.alarms().count()];
        let first = |task: usize| {
            self.plan.tasks.iter().take(task).map(|it| it.alarms.len()).sum::<usize>()
        };
        for (task, event) in &self.events {
            let plan = &self.plan.tasks[*task];
            let alarm = &plan.alarms[event.alarm];
            let was_active =
                std::mem::replace(&mut active[first(*task) + event.alarm], event.active);
            let change = match (was_active, event.active, event.ok) {
                (false, true, _) => "came",
                (true, false, _) => "went",
                (_, _, false) => "cannot be evaluated",
                (_, _, true) => "is evaluated",
            };
            let settings = &plan.settings;
            let due_ns = u128::from(settings.phase_ns)
                + u128::from(event.cycle) * u128::from(settings.period_ns);
            let time = format!("{:?} s", due_ns as f64 / 1e9);
            let value =
                format!("{} = {}", alarm.signal, shown(event.value, alarm.value_type, Digits::Six));
            let (cycle, text) = (event.cycle.to_string(), escaped(&alarm.text));
            table.row([&alarm.name, change, &cycle, &time, &value, &text]);
        }
        let mut text = format!("process alarms\n{}", table.draw(2));
        if self.left_out > 0 {
            text += &format!("  … and {} more changes\n", self.left_out);
        }
        terminal::note(text.trim_end());
    }
}
