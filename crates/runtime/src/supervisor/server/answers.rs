//! What a node tells of itself at once.

use isochrone_control::desk::{Selection, Signal};
use isochrone_cyclic::{Clock, Monotonic};

use isochrone_control::{
    AlarmsParams, AlarmsResult, ConfigurationOrigin, DescribeResult, Entry, ForcesParams,
    ForcesResult, JournalParams, JournalResult, Refusal, Reply, Room, SignalDescription,
    SignalsParams, SignalsResult, TaskDescription,
};

use super::ControlServer;
use super::requests::select;

/// Signals of a page, if the request does not say how many.
const SIGNALS: u64 = 1000;
/// Most signals of a page: each takes more than 64 bytes of its answer.
const MOST_SIGNALS: usize = isochrone_ipc::MAX_MESSAGE_BYTES / 64;

impl ControlServer {
    pub(super) fn describe(&self) -> Reply {
        let operating = self.shared.lock();
        let now_ns = Monotonic.now_ns();
        let next = operating.next_cycles(now_ns);
        let task = |(index, next): (usize, u64)| {
            let lane = operating.lanes.get(index)?;
            Some(TaskDescription {
                name: lane.name.clone(),
                ob: lane.ob,
                period_ns: lane.schedule.period_ns,
                phase_ns: lane.schedule.phase_ns,
                cycle: next.saturating_sub(1),
                last_cycle: lane.last.map(|last| last.cycle),
                stands_ns: operating.stands_ns(index, now_ns),
                missed: lane.last.map_or(0, |last| last.missed),
                overruns: lane.last.map_or(0, |last| last.overruns),
                parameters: operating.operator.parameters(index) as u64,
                forces: operating.operator.forced(index) as u64,
                alarms: lane.faults.total() as u64,
                last_second: lane.seconds.last(now_ns, lane.schedule.period_ns),
                placement: operating.placement(index),
            })
        };
        Reply::Describe(DescribeResult {
            node: self.node.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            control: self.control,
            configuration: ConfigurationOrigin {
                file: operating.configuration.source.name.clone(),
                sha256: operating.configuration.sha256.clone(),
                started_sha256: Some(operating.configuration.started_sha256.clone()),
                changed: operating.configuration.is_changed || operating.operator.has_changed(),
            },
            started_unix_ns: self.started_unix_ns,
            tasks: next.into_iter().enumerate().filter_map(task).collect(),
        })
    }

    pub(super) fn signals(&self, params: &SignalsParams) -> Result<Reply, Refusal> {
        let (offset, limit) = page(params.offset, params.limit.or(Some(SIGNALS)));
        let limit = limit.min(MOST_SIGNALS);
        let (operating, selection) = select(&self.shared, |signals| match &params.pattern {
            Some(pattern) => Selection::of(signals, [pattern.as_str()], offset, limit),
            None => Ok(Selection::of_all(signals, offset, limit)),
        })?;
        let signals = operating.operator.signals();
        let describe = |signal: Signal<'_>| SignalDescription {
            forced: operating.operator.is_forced(&signal),
            protected: Some(operating.operator.is_protected(&signal)),
            limits: operating.operator.limits(&signal),
            can_be_unset: signal.can_be_unset,
            value_type: signal.value_type.to_string(),
            unit: Some(signal.unit.to_owned()).filter(|unit| !unit.is_empty()),
            role: signal.role,
            task: signals.task_name(signal.task).to_owned(),
            doc: signal.doc.to_owned(),
            name: signal.name,
        };
        let page = fitting(selection.signals().map(describe));
        Ok(Reply::Signals(SignalsResult { total: selection.total() as u64, signals: page }))
    }

    pub(super) fn forces(&self, params: &ForcesParams) -> Reply {
        let operating = self.shared.lock();
        let (offset, limit) = page(params.offset, params.limit);
        let in_place = || operating.operator.forces();
        let forces = fitting(in_place().skip(offset).take(limit));
        Reply::Forces(ForcesResult { total: in_place().count() as u64, forces })
    }

    pub(super) fn journal(&self, params: &JournalParams) -> Reply {
        let operating = self.shared.lock();
        let entries = operating.operator.journal(params.since.unwrap_or_default());
        let total = entries.len() as u64;
        let (_, limit) = page(None, params.limit);
        let mut room = Room::of_answer();
        let mut page = Vec::new();
        for mut entry in entries.take(limit) {
            entry.configuration = None;
            if page.is_empty() {
                shorten(&mut entry);
            }
            if !room.takes(&entry) {
                break;
            }
            page.push(entry);
        }
        let pending = operating.operator.pending();
        let pending = pending.take_while(|pending| room.takes(pending)).collect();
        Reply::Journal(JournalResult { total, entries: page, pending })
    }

    pub(super) fn alarms(&self, params: &AlarmsParams) -> Reply {
        let operating = self.shared.lock();
        let (offset, limit) = page(params.offset, params.limit);
        let alarms = fitting(operating.active_alarms().skip(offset).take(limit));
        Reply::Alarms(AlarmsResult { total: operating.count_alarms() as u64, alarms })
    }
}

/// How many to leave out, and most that are wanted.
fn page(offset: Option<u64>, limit: Option<u64>) -> (usize, usize) {
    let count = |count: u64| usize::try_from(count).unwrap_or(usize::MAX);
    (count(offset.unwrap_or_default()), count(limit.unwrap_or(u64::MAX)))
}

/// The first items, as many as an answer holds.
fn fitting<T: serde::Serialize>(items: impl Iterator<Item = T>) -> Vec<T> {
    let mut room = Room::of_answer();
    items.take_while(|item| room.takes(item)).collect()
}

/// Takes out as many changes as do not fit into an answer of its own.
fn shorten(entry: &mut Entry) {
    let mut room = Room::of_answer();
    let changes = std::mem::take(&mut entry.changes);
    let all = changes.len();
    room.takes(entry);
    entry.changes = changes.into_iter().take_while(|change| room.takes(change)).collect();
    entry.left_out = (all - entry.changes.len()) as u64;
}
