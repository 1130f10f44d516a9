//! Process alarms of a task: changes are found in the slack of the cycle, and told to the ordinary thread.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use isochrone_engine::{AlarmEvent, AlarmPlan, AlarmWatch, TaskPlan};
use rtrb::{Consumer, Producer, RingBuffer};

/// How many changes may wait for the ordinary thread, which looks about sixty times a second. One that finds no room
/// is counted, and told later if it still holds then.
const ROOM: usize = 2048;

/// What the cycle tells.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Told {
    /// What follows is about the alarms of another configuration.
    Changed,
    /// An alarm changed.
    Event(AlarmEvent),
}

/// The cycle's end.
pub(crate) struct AlarmSender {
    ring: Producer<Told>,
    watch: AlarmWatch,
    /// How many other configurations are in place that have not been told yet.
    changes: usize,
    lost: Arc<AtomicU64>,
}

/// The ordinary thread's end.
pub(crate) struct AlarmReceiver {
    ring: Consumer<Told>,
    lost: Arc<AtomicU64>,
}

/// The alarms of another configuration.
#[derive(Debug)]
pub(crate) struct NewAlarms {
    watch: AlarmWatch,
    /// Of those that stay, the index before and the one now.
    kept: Box<[(usize, usize)]>,
}

/// Makes both ends for a task. Of the alarms that were `active` in an earlier run, its first cycle tells what they are.
pub(crate) fn ends(task: &TaskPlan, active: &[usize]) -> (AlarmSender, AlarmReceiver) {
    let (producer, consumer) = RingBuffer::new(ROOM);
    let lost = Arc::<AtomicU64>::default();
    let mut watch = AlarmWatch::of(task);
    active.iter().for_each(|alarm| watch.doubt(*alarm));
    let sender = AlarmSender { ring: producer, watch, changes: 0, lost: Arc::clone(&lost) };
    (sender, AlarmReceiver { ring: consumer, lost })
}

impl NewAlarms {
    /// The alarms of a task that come after others.
    pub(crate) fn following(task: &TaskPlan, old: &[AlarmPlan]) -> Self {
        let new = task.alarms.iter().enumerate();
        let kept = new.filter_map(|(to, alarm)| {
            Some((old.iter().position(|old| alarm.has_definition_of(old))?, to))
        });
        Self { kept: kept.collect(), watch: AlarmWatch::of(task) }
    }
}

impl AlarmSender {
    /// Tells of the alarms that a cycle changed; for the slack.
    pub(crate) fn look(&mut self, image: &[f64], cycle: u64) {
        let Self { ring, watch, changes, lost } = self;
        while *changes > 0 {
            if ring.push(Told::Changed).is_err() {
                return;
            }
            *changes -= 1;
        }
        watch.look(image, cycle, |event| {
            let is_told = ring.push(Told::Event(event)).is_ok();
            if !is_told {
                lost.fetch_add(1, Ordering::Relaxed);
            }
            is_told
        });
    }

    /// Changes to the alarms of another configuration, and leaves its own in their place.
    pub(crate) fn change(&mut self, new: &mut NewAlarms) {
        new.watch.follow(&self.watch, &new.kept);
        std::mem::swap(&mut self.watch, &mut new.watch);
        self.changes += 1;
    }
}

impl AlarmReceiver {
    /// The next that was told.
    pub(crate) fn next(&mut self) -> Option<Told> {
        self.ring.pop().ok()
    }

    /// How many changes found no room so far.
    pub(crate) fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use isochrone_engine::{Plan, Rules, Source, TaskEngine};

    use super::*;

    const NODE: &str = "[node]\nname = \"n\"\n[[task]]\nname = \"t\"\nperiod = \"1ms\"\n\
        [[variable]]\nname = \"level\"\ninitial = 0\n\
        [[alarm]]\nname = \"high\"\nwhen = \"level > 1.0\"\n";

    #[test]
    fn what_finds_no_room_is_counted_and_told_later_if_it_still_holds() {
        let plan = Plan::new(Source::new("n.toml", NODE), &Rules::default()).unwrap();
        let mut engine = TaskEngine::build(&plan).unwrap().remove(0);
        let (mut sender, mut receiver) = ends(&plan.tasks[0], &[]);
        // It changes in every cycle, and is active in the last one.
        let cycles = ROOM as u64 + 3;
        for cycle in 0..cycles {
            engine.give_variable(0, if cycle % 2 == 0 { 2.0 } else { 0.0 });
            engine.step(cycle);
            sender.look(engine.image(), cycle);
        }
        // The last change that was told is that it went, so only the cycles that differ from that count.
        assert_eq!(receiver.lost(), 2);
        let told = std::iter::from_fn(|| receiver.next()).count();
        assert_eq!(told, ROOM);
        sender.look(engine.image(), cycles);
        let Some(Told::Event(event)) = receiver.next() else { panic!("nothing was told") };
        assert!(event.active && event.cycle == cycles, "{event:?}");
        assert!(receiver.next().is_none());
    }
}
