//! A task beside its twin: in the holder its cycle sends the state, in the standby it follows and takes over.
//!
//! What the cycle calls is a trait, so that a node without a twin runs the instructions that it would run without any
//! of this.

use std::cmp::Ordering;
use std::sync::Arc;

use isochrone_cyclic::{Clock, Cyclic, Monotonic, Release, Schedule};
use isochrone_engine::TaskEngine;
use isochrone_ipc::{
    Depth, ForRealTime, FramePublisher, FrameSubscriber, OpenError, RealTime, Service, Stamp,
};

use super::lateness::Lateness;
use super::rules::{Look, Rules, Verdict};
use super::twin::Twin;
use crate::task::alarms::AlarmSender;
use crate::task::inputs::InputPorts;
use crate::task::orders::Applier;
use crate::task::outputs::OutputPorts;

/// Words of a frame before those of the engine: the number of the next frame of the outputs, and when the cycle began.
const WORDS_BEFORE: usize = 2;

/// What a cycle does because of a twin.
pub(crate) trait Pairing<S: Service> {
    /// Gives the outputs of a holder the node's term, before its first cycle.
    fn begin(&self, outputs: &mut OutputPorts<S>);
    /// Follows the holder while the other process is that.
    fn stand_by(
        &mut self,
        cyclic: &mut Cyclic<Monotonic>,
        following: FollowingTask<'_, S>,
    ) -> Standing;
    /// Whether this process holds the node now.
    fn holds(&self) -> bool;
    /// How many cycles before this one were left out since the takeover, whose frames the other process may have sent.
    fn left_out(&mut self, cycle: u64) -> u64;
    /// Claims the frames of a cycle; `false`: they are not to be sent.
    fn claim(&self, cycle: u64) -> bool;
    /// Sends the state after a cycle to a standby, if there is one; for the slack. `next_sequence` is the number of the
    /// next frame of the outputs.
    fn publish(&mut self, engine: &TaskEngine, release: &Release, next_sequence: u64);
    /// Connects to a twin that joined; for the slack.
    fn maintain(&mut self);
    /// Whether somebody goes on as the writer of the outputs when this process ends.
    fn is_followed(&self) -> bool;
}

/// What became of standing by.
pub(crate) enum Standing {
    /// This process holds the node: the next cycle begins at its release.
    Holds,
    /// It has taken the node over, and runs this cycle at once.
    TookOver(Release),
    /// The task is to end.
    Ended,
}

/// The parts of a task that go along while it follows.
pub(crate) struct FollowingTask<'a, S: Service> {
    pub(crate) engine: &'a mut TaskEngine,
    pub(crate) inputs: &'a mut InputPorts<S>,
    pub(crate) outputs: &'a mut OutputPorts<S>,
    pub(crate) orders: &'a mut Applier,
    pub(crate) alarms: &'a mut AlarmSender,
}

/// A task without a twin.
pub(crate) struct Alone;

impl<S: Service> Pairing<S> for Alone {
    fn begin(&self, _: &mut OutputPorts<S>) {}

    #[inline(always)]
    fn stand_by(&mut self, _: &mut Cyclic<Monotonic>, _: FollowingTask<'_, S>) -> Standing {
        Standing::Holds
    }

    #[inline(always)]
    fn holds(&self) -> bool {
        true
    }

    #[inline(always)]
    fn left_out(&mut self, _: u64) -> u64 {
        0
    }

    #[inline(always)]
    fn claim(&self, _: u64) -> bool {
        true
    }

    #[inline(always)]
    fn publish(&mut self, _: &TaskEngine, _: &Release, _: u64) {}

    #[inline(always)]
    fn maintain(&mut self) {}

    fn is_followed(&self) -> bool {
        false
    }
}

/// What a task with a twin needs before its ports are open.
pub(crate) struct NewPaired<S: Service> {
    pub(crate) participant: Arc<RealTime<S>>,
    pub(crate) twin: Arc<Twin>,
    /// Its index in the plan.
    pub(crate) task: usize,
    /// The service of its state.
    pub(crate) service: String,
    pub(crate) schedule: Schedule,
}

impl<S: Service> NewPaired<S> {
    /// The number of the task's first cycle: that of the holder, or its own.
    pub(crate) fn first_cycle(&self, own: u64) -> u64 {
        if self.twin.holds() { own } else { self.twin.first_cycle(self.task) }
    }
}

/// A task of one of two processes.
pub(crate) struct Paired<S: Service> {
    twin: Arc<Twin>,
    task: usize,
    states: FramePublisher<S>,
    received: FrameSubscriber<S>,
    rules: Rules,
    lateness: Lateness,
    follow_within_ns: Option<u64>,
    /// The term with which this task runs its cycles; `None` while it follows.
    active: Option<u64>,
    /// The newest state that came since it follows.
    loaded: Option<Loaded>,
    /// Its first cycle after a takeover, until one has run.
    first: Option<u64>,
}

/// The state that a standby would go on from.
#[derive(Clone, Copy)]
struct Loaded {
    term: u64,
    cycle: u64,
    next_sequence: u64,
    missed: u64,
}

impl<S: Service> Paired<S> {
    /// Opens both ends of the service of the task's state.
    pub(crate) fn open(new: NewPaired<S>) -> Result<ForRealTime<Self>, OpenError> {
        let NewPaired { participant, twin, task, service, schedule } = new;
        let words = WORDS_BEFORE + twin.most_words().get(task).copied().unwrap_or_default();
        let states = participant.twin_publisher(&service, words, twin.configuration())?;
        let received = participant.subscriber(&service, words, Depth::Newest)?;
        Ok(states.and(received).map(|(mut states, received)| {
            let active = twin.term();
            active.iter().for_each(|term| states.go_on(*term, 0));
            Self {
                rules: Rules::new(twin.after),
                lateness: Lateness::new(schedule.period_ns),
                follow_within_ns: schedule.follow_within_ns,
                twin,
                task,
                states,
                received,
                active,
                loaded: None,
                first: None,
            }
        }))
    }

    /// Follows the holder until the task ends or runs its cycles itself.
    fn follow(
        &mut self,
        cyclic: &mut Cyclic<Monotonic>,
        mut task: FollowingTask<'_, S>,
    ) -> Standing {
        loop {
            let delay_ns = self.lateness.delay_ns() + self.follow_within_ns.unwrap_or(0);
            let Some(release) = cyclic.wait_behind(delay_ns, |_| ()) else {
                return Standing::Ended;
            };
            // An order that is in the ring now was carried out by the holder before it sent a state that has not come.
            task.orders.receive();
            let has_come = self.take_state(&mut task, &release);
            task.orders.apply_received(task.engine, &release);
            match self.judge(&release, has_come) {
                Verdict::Follow => {}
                Verdict::RunNext => {
                    self.activate(cyclic, &mut task, release.cycle.saturating_add(1));
                    return Standing::Holds;
                }
                // Where the holder has claimed it before it was taken over, its state is still to come.
                Verdict::RunThis if self.twin.claim(self.task, release.cycle) => {
                    let missed = self.activate(cyclic, &mut task, release.cycle);
                    return Standing::TookOver(Release { missed, ..release });
                }
                Verdict::RunThis => {}
                Verdict::TakeOver => {
                    if self.take_over(&release, false) && self.twin.claim(self.task, release.cycle)
                    {
                        let missed = self.activate(cyclic, &mut task, release.cycle);
                        return Standing::TookOver(Release { missed, ..release });
                    }
                }
                Verdict::TakeOverAsAsked => {
                    // A state that has come meanwhile has cycles that are not to be run again.
                    if self.take_over(&release, true) && !self.take_state(&mut task, &release) {
                        self.activate(cyclic, &mut task, release.cycle.saturating_add(1));
                        return Standing::Holds;
                    }
                }
            }
            if has_come {
                task.engine.check_sharing();
            }
            task.alarms.look(task.engine.image(), release.cycle);
            task.inputs.maintain();
            task.outputs.maintain();
            Pairing::maintain(self);
        }
    }

    /// Takes the newest state that has come into the engine, and the inputs beside it, so that a takeover finds the newest
    /// of both; whether one has come.
    fn take_state(&mut self, task: &mut FollowingTask<'_, S>, release: &Release) -> bool {
        let configuration = self.twin.configuration();
        let now_ns = Monotonic.now_ns();
        if !self.received.has_newer(now_ns, |header| header.layout == configuration) {
            return false;
        }
        task.inputs.read(task.engine, release);
        let Some(frame) = self.received.newest(now_ns) else { return false };
        let header = *frame.header();
        let Some((before, words)) = frame.values().split_first_chunk::<WORDS_BEFORE>() else {
            return false;
        };
        // Behind them is what the holder has room for.
        let words = words.get(..task.engine.state_words());
        let Some(words) = words.filter(|_| header.layout == configuration) else { return false };
        let [next_sequence, start_ns] = before.map(f64::to_bits);
        task.engine.load_words(header.cycle, words);
        let from_ns = if self.follow_within_ns.is_some() { start_ns } else { header.release_ns };
        self.lateness.note(header.publish_ns.saturating_sub(from_ns));
        let (term, cycle, missed) = (header.term, header.cycle, header.missed);
        self.loaded = Some(Loaded { term, cycle, next_sequence, missed });
        self.twin.receive(self.task, term, cycle);
        true
    }

    fn judge(&mut self, release: &Release, has_come: bool) -> Verdict {
        let page = self.twin.seat().page();
        let loaded = self.loaded;
        self.rules.judge(Look {
            has_come,
            newest: loaded.map_or(Ordering::Less, |loaded| loaded.cycle.cmp(&release.cycle)),
            was_met: release.newly_missed == 0,
            holds: self.twin.holds(),
            is_complete: loaded.is_some_and(|loaded| self.twin.is_complete(loaded.term)),
            is_asked: loaded.is_some_and(|loaded| page.is_asked_to_take_over(loaded.term)),
        })
    }

    /// Takes over from the holder whose state came last; whether that worked.
    fn take_over(&self, release: &Release, was_asked: bool) -> bool {
        let Some(Loaded { term, cycle, .. }) = self.loaded else { return false };
        let due = release.cycle.saturating_add(u64::from(was_asked));
        let lost = due.saturating_sub(cycle).saturating_sub(1);
        let silent = u64::from(self.rules.silent());
        let unmet = release.cycle.saturating_sub(cycle).saturating_sub(silent);
        self.twin.take_over(term, was_asked, lost, unmet)
    }

    /// Goes on as the holder with this cycle, from the state that came last; returns how many cycles were missed before.
    fn activate(
        &mut self,
        cyclic: &mut Cyclic<Monotonic>,
        task: &mut FollowingTask<'_, S>,
        cycle: u64,
    ) -> u64 {
        let Some(term) = self.twin.term() else { return 0 };
        (self.active, self.first) = (Some(term), Some(cycle));
        let (passed, loaded) = match self.loaded {
            Some(loaded) => (cycle.saturating_sub(loaded.cycle).saturating_sub(1), loaded),
            None => (0, Loaded { term, cycle, next_sequence: 0, missed: 0 }),
        };
        let missed = loaded.missed.saturating_add(passed);
        cyclic.take_over(missed);
        task.outputs.go_on(term, loaded.next_sequence.saturating_add(passed));
        self.states.go_on(term, self.states.next_sequence());
        missed
    }
}

impl<S: Service> Pairing<S> for Paired<S> {
    fn begin(&self, outputs: &mut OutputPorts<S>) {
        // A port has a later one of its own, which a takeover need not exceed where the clock is set back.
        self.active.iter().for_each(|term| outputs.go_on(*term, 0));
    }

    #[inline]
    fn stand_by(
        &mut self,
        cyclic: &mut Cyclic<Monotonic>,
        following: FollowingTask<'_, S>,
    ) -> Standing {
        if self.active.is_some() && self.active == self.twin.term() {
            return Standing::Holds;
        }
        if self.active.take().is_some() {
            // What it computed since is nobody's.
            (self.loaded, self.rules) = (None, Rules::new(self.twin.after));
        }
        self.follow(cyclic, following)
    }

    #[inline]
    fn holds(&self) -> bool {
        self.active.is_some() && self.active == self.twin.term()
    }

    #[inline]
    fn left_out(&mut self, cycle: u64) -> u64 {
        self.first.take().map_or(0, |first| cycle.saturating_sub(first))
    }

    #[inline]
    fn claim(&self, cycle: u64) -> bool {
        self.holds() && self.twin.claim(self.task, cycle)
    }

    fn publish(&mut self, engine: &TaskEngine, release: &Release, next_sequence: u64) {
        if !self.twin.is_wanted() || !self.holds() {
            return;
        }
        let Some(values) = self.states.values_mut() else {
            self.states.prepare();
            return;
        };
        if let Some((before, words)) = values.split_first_chunk_mut::<WORDS_BEFORE>() {
            *before = [next_sequence, release.start_ns].map(f64::from_bits);
            engine.copy_words(words.get_mut(..engine.state_words()).unwrap_or_default());
        }
        self.states.renumber(self.twin.configuration());
        self.states.send(Stamp::from(*release), || Monotonic.now_ns());
        self.states.prepare();
    }

    fn maintain(&mut self) {
        self.states.maintain();
        self.received.maintain();
    }

    fn is_followed(&self) -> bool {
        self.twin.is_followed()
    }
}
