//! The active alarms of a node, for the method `alarms` and the program that runs the node.

use isochrone_control::desk::Acknowledgement;
use isochrone_cyclic::{Clock, Monotonic};

use crate::keeping::recorder::Recording;
use crate::keeping::state::StateWriting;
use crate::node::operating::Operating;
use crate::node::running::Running;
use crate::task::alarms::AlarmReceiver;
use crate::task::clocks::unix_ns;
use crate::task::faults::Active;
use isochrone_control::{ActiveAlarm, AskedBy, ProcessAlarm, Refusal};

impl Running {
    /// The active alarms: blocks that report an error or need a caution, inputs that are not ok, services whose
    /// frames are not as expected, and files that cannot be written. The method `alarms` answers with these rows; the
    /// program has them with `control = "off"` too.
    ///
    /// They are some milliseconds old.
    pub fn active_alarms(&self) -> Vec<ActiveAlarm> {
        self.shared.lock().active_alarms().collect()
    }
}

impl Running {
    /// The process alarms that stand, that nobody has acknowledged, or that cannot be evaluated. The method `alarms`
    /// answers with these rows; the program has them with `control = "off"` too.
    ///
    /// They are some milliseconds old.
    pub fn process_alarms(&self) -> Vec<ProcessAlarm> {
        self.shared.lock().process_alarms.standing(0).collect()
    }

    /// Acknowledges the occurrences of a process alarm up to one, or all of them.
    ///
    /// # Errors
    /// There is no such alarm, or nothing to acknowledge.
    pub fn acknowledge(
        &self,
        alarm: &str,
        occurrence: Option<u64>,
    ) -> Result<ProcessAlarm, Refusal> {
        self.shared.lock().acknowledge(alarm, occurrence, AskedBy::default())
    }
}

impl Operating {
    /// Takes in what the cycles of a task told of its process alarms.
    pub(crate) fn take_alarms(&mut self, task: usize, receiver: &mut AlarmReceiver) {
        let (now_ns, now_unix_ns) = (Monotonic.now_ns(), unix_ns());
        let mut alarms = std::mem::take(&mut self.process_alarms);
        alarms.take(task, receiver, |cycle| {
            now_unix_ns.saturating_sub(now_ns.saturating_sub(self.release_ns(task, cycle)))
        });
        self.process_alarms = alarms;
    }

    /// Acknowledges the occurrences of a process alarm up to one, or all of them.
    pub(crate) fn acknowledge(
        &mut self,
        name: &str,
        occurrence: Option<u64>,
        by: AskedBy,
    ) -> Result<ProcessAlarm, Refusal> {
        let lasts = self.lanes.iter().map(|lane| lane.last.map_or(0, |last| last.cycle));
        let lasts: Vec<u64> = lasts.collect();
        let (task, done) = self.process_alarms.acknowledge(name, occurrence, &lasts, by)?;
        let Acknowledgement { before, entry, alarm } = done;
        let entry = self.operator.acknowledged(task, before, &entry);
        self.note(entry);
        self.state.iter_mut().for_each(StateWriting::hurry);
        Ok(alarm)
    }

    /// The active alarms: first those about files, then those of each task.
    pub(crate) fn active_alarms(&self) -> impl Iterator<Item = ActiveAlarm> {
        let (now_ns, now_unix_ns) = (Monotonic.now_ns(), unix_ns());
        let of_files = self.alarms_of_files().map(|active| (None, active));
        let of_tasks = self.lanes.iter().enumerate();
        let of_tasks = of_tasks
            .flat_map(|(task, lane)| lane.faults.active().map(move |active| (Some(task), active)));
        of_files.chain(of_tasks).map(move |(task, active)| {
            let since_unix_ns = task.map(|task| {
                let since_ns = self.release_ns(task, active.since_cycle);
                now_unix_ns.saturating_sub(now_ns.saturating_sub(since_ns))
            });
            let lane = task.and_then(|task| self.lanes.get(task));
            ActiveAlarm {
                name: active.name,
                code: active.code,
                status: active.status,
                meaning: active.meaning,
                task: lane.map_or_else(String::new, |lane| lane.name.clone()),
                since_cycle: active.since_cycle,
                since_unix_ns,
                count: active.count,
            }
        })
    }

    /// How many there are now.
    pub(crate) fn count_alarms(&self) -> usize {
        let of_tasks: usize = self.lanes.iter().map(|lane| lane.faults.total()).sum();
        of_tasks + self.alarms_of_files().count()
    }

    fn alarms_of_files(&self) -> impl Iterator<Item = Active> {
        let of_recording = self.recording.as_ref().and_then(Recording::alarm);
        let of_state = self.state.iter().flat_map(StateWriting::alarms);
        self.journal_alarm()
            .into_iter()
            .chain(of_recording)
            .chain(of_state)
            .chain(self.held_alarm())
            .chain(self.twin_alarms(unix_ns()))
    }
}
