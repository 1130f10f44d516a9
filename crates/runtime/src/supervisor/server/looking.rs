//! The methods that look at the node and answer at once, or with the next cycles.

use isochrone_control::desk::{Selection, Signal};
use isochrone_control::{
    AlarmsParams, AlarmsResult, Begun, Caller, ConfigurationOrigin, DescribeParams, DescribeResult,
    Entry, ForcesParams, ForcesResult, GetParams, GetResult, Handle, JournalParams, JournalResult,
    Refusal, Room, SignalDescription, SignalsParams, SignalsResult, TaskDescription,
};
use isochrone_cyclic::{Clock, Monotonic};

use super::ControlServer;
use super::requests::{MAX_VALUES, unsent};
use super::under_way::{Read, Work};

/// Signals of a page, if the request does not say how many.
const SIGNALS: u64 = 1000;
/// The most signals of a page: each takes more than 64 bytes of the answer.
const MOST_SIGNALS: usize = isochrone_ipc::MAX_MESSAGE_BYTES / 64;

/// `describe`: the node, its tasks and configuration.
impl Handle<DescribeParams> for ControlServer {
    fn handle(&mut self, _: DescribeParams, _: Caller) -> Result<Begun<DescribeResult>, Refusal> {
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
        Ok(Begun::Ended(DescribeResult {
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
            announced_units: operating.operator.announced_units(),
            tasks: next.into_iter().enumerate().filter_map(task).collect(),
            redundancy: operating.redundancy().map(Box::new),
        }))
    }
}

/// `signals`: the signals of the node.
impl Handle<SignalsParams> for ControlServer {
    fn handle(
        &mut self,
        params: SignalsParams,
        _: Caller,
    ) -> Result<Begun<SignalsResult>, Refusal> {
        let (offset, limit) = page(params.offset, params.limit.or(Some(SIGNALS)));
        let limit = limit.min(MOST_SIGNALS);
        let (operating, selection) = self.shared.search(|signals| match &params.pattern {
            Some(pattern) => Selection::of(signals, [pattern.as_str()], offset, limit),
            None => Ok(Selection::of_all(signals, offset, limit)),
        })?;
        let signals = operating.operator.signals();
        let some = |text: &str| Some(text.to_owned()).filter(|text| !text.is_empty());
        let describe = |signal: Signal<'_>| SignalDescription {
            forced: operating.operator.is_forced(&signal),
            protected: Some(operating.operator.is_protected(&signal)),
            limits: operating.operator.limits(&signal),
            can_be_unset: signal.can_be_unset,
            value_type: signal.value_type.to_string(),
            unit: some(operating.operator.unit(&signal)),
            comment: some(signal.comment),
            role: signal.role,
            task: signals.task_name(signal.task).to_owned(),
            doc: signal.doc.to_owned(),
            name: signal.name,
        };
        let page = fitting(selection.signals().map(describe));
        Ok(Begun::Ended(SignalsResult { total: selection.total() as u64, signals: page }))
    }
}

/// `get`: values of signals.
impl Handle<GetParams> for ControlServer {
    fn handle(&mut self, params: GetParams, _: Caller) -> Result<Begun<GetResult>, Refusal> {
        self.check_names("names", &params.names)?;
        let offset = params.offset.unwrap_or_default().try_into().unwrap_or(usize::MAX);
        let limit = params.limit.unwrap_or(MAX_VALUES as u64).min(MAX_VALUES as u64) as usize;
        let names = || params.names.iter().map(String::as_str);
        let (mut operating, selection) = self
            .shared
            .search(|signals| Ok(Selection::of(signals, names(), offset, limit)?.with_quality()))?;
        let total = selection.total();
        let is_asked = params.types.unwrap_or_default();
        let types = is_asked.then(|| selection.signals().map(|signal| signal.value_type).collect());
        let mut prepared = operating.operator.read(selection);
        let order = std::mem::take(&mut prepared.read_from);
        let missing = prepared.tasks().count();
        let number = operating.send(prepared).map_err(unsent)?.number;
        let read = Read {
            names: operating.lanes.iter().map(|lane| lane.name.clone()).collect(),
            grids: operating.grids(),
            total: total as u64,
            order,
            types,
            readings: Vec::new(),
        };
        drop(operating);
        Ok(self.begun(number, missing, Work::Read(read)))
    }
}

/// `forces`: the forces in place.
impl Handle<ForcesParams> for ControlServer {
    fn handle(&mut self, params: ForcesParams, _: Caller) -> Result<Begun<ForcesResult>, Refusal> {
        let operating = self.shared.lock();
        let (offset, limit) = page(params.offset, params.limit);
        let in_place = || operating.operator.forces();
        let forces = fitting(in_place().skip(offset).take(limit));
        Ok(Begun::Ended(ForcesResult { total: in_place().count() as u64, forces }))
    }
}

/// `journal`: what operators did.
impl Handle<JournalParams> for ControlServer {
    fn handle(
        &mut self,
        params: JournalParams,
        _: Caller,
    ) -> Result<Begun<JournalResult>, Refusal> {
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
        Ok(Begun::Ended(JournalResult { total, entries: page, pending }))
    }
}

/// Leaves out the changes of an entry that do not fit into one answer.
fn shorten(entry: &mut Entry) {
    let mut room = Room::of_answer();
    let changes = std::mem::take(&mut entry.changes);
    let all = changes.len();
    room.takes(entry);
    entry.changes = changes.into_iter().take_while(|change| room.takes(change)).collect();
    entry.left_out = (all - entry.changes.len()) as u64;
}

/// `alarms`: the active alarms, and the process alarms with their events.
impl Handle<AlarmsParams> for ControlServer {
    fn handle(&mut self, params: AlarmsParams, _: Caller) -> Result<Begun<AlarmsResult>, Refusal> {
        let operating = self.shared.lock();
        let (process, total) = (&operating.process_alarms, operating.count_alarms());
        let (offset, limit) = page(params.offset, params.limit);
        let mut room = Room::of_answer();
        let alarms = operating.active_alarms().skip(offset).take(limit);
        let alarms: Vec<_> = alarms.take_while(|alarm| room.takes(alarm)).collect();
        let mut answer = AlarmsResult {
            total: total as u64,
            process_total: process.count_standing() as u64,
            newest_event: process.newest_event(),
            lost_events: process.lost(),
            ..AlarmsResult::default()
        };
        // Process alarms go on where these end.
        if offset.saturating_add(alarms.len()) >= total {
            let standing = process.standing(offset.saturating_sub(total));
            let standing = standing.take(limit - alarms.len());
            answer.process = standing.take_while(|alarm| room.takes(alarm)).collect();
        }
        if let Some(since) = params.since {
            let events = process.events_since(since).take(limit);
            answer.events = events.take_while(|event| room.takes(*event)).cloned().collect();
        }
        Ok(Begun::Ended(AlarmsResult { alarms, ..answer }))
    }
}

/// How many items to skip, and how many to return at most.
fn page(offset: Option<u64>, limit: Option<u64>) -> (usize, usize) {
    let count = |count: u64| usize::try_from(count).unwrap_or(usize::MAX);
    (count(offset.unwrap_or_default()), count(limit.unwrap_or(u64::MAX)))
}

/// The first items, as many as fit into an answer.
fn fitting<T: serde::Serialize>(items: impl Iterator<Item = T>) -> Vec<T> {
    let mut room = Room::of_answer();
    items.take_while(|item| room.takes(item)).collect()
}
