//! Two processes and messages of one size: all turns of all arms.

use std::fs;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic, Pinning, ThreadRequest};
use isochrone_ipc::{RealTime, ipc};
use isochrone_machine::Disturbance;
use isochrone_processes::{Company, Stop};
use isochrone_report::{LinkArm, turn_order};
use isochrone_runtime::warning;
use isochrone_timing::Warning;

use super::arm::Arm;
use super::bench_node::BenchNode;
use super::end::{Rendezvous, Side};
use super::measurer::{self, Answer, Job, TurnResult};
use super::pace::SendPace;
use super::peer::{Setup, Turn};
use super::processes::{Node, Peer};
use super::series::{Disturbed, KeptPace, Series};
use super::settings::{Circumstance, LatencySettings};
use super::tending::Tending;
use super::turn::Span;
use crate::watch::Watch;
use crate::{BenchError, Onlooker};

/// From the order to begin a turn until it begins.
const LEAD_NS: u64 = 5_000_000;
/// How long before the warm-up is over the kernel's counts are read: that takes time on a CPU that
/// is needed then.
const AHEAD_NS: u64 = 3_000_000;
/// Part of a turn that is warm-up.
const WARM_UP: u64 = 10;
/// How long a node outlives us, should we be killed, in seconds.
const GRACE_S: f64 = 15.0;

/// What all sessions of a bench share.
pub(super) struct Bench<'a> {
    pub(super) settings: &'a LatencySettings,
    pub(super) company: &'a Company,
    pub(super) participant: &'a RealTime<ipc::Service>,
    pub(super) tending: Tending,
    pub(super) stop: &'a Stop,
    pub(super) onlooker: &'a dyn Onlooker,
    pub(super) origin_ns: u64,
    /// Turns so far.
    pub(super) turns: u64,
    pub(super) paces: Vec<KeptPace>,
    pub(super) warnings: Vec<Warning>,
}

impl Bench<'_> {
    /// Measures messages of one size.
    pub(super) fn measure(
        &mut self,
        values: usize,
        circumstances: &[Circumstance],
    ) -> Result<Vec<LinkArm>, BenchError> {
        let mut arms: Vec<Arm> = Vec::new();
        for arm in circumstances.iter().flat_map(|some| &some.arms) {
            if !arms.contains(arm) {
                arms.push(*arm);
            }
        }
        let folder = self.company.path(&values.to_string());
        fs::create_dir(&folder).map_err(|error| BenchError::no_file(folder.display(), error))?;
        let prefix = self.company.domain().prefix();
        let place = Rendezvous {
            side: Side::Measuring,
            folder: &folder,
            participant: self.participant,
            prefix: &prefix,
            values,
            wait: self.settings.wait,
        };
        let setup = Setup {
            domain_file: self.company.domain().file(),
            folder: folder.clone(),
            prefix: prefix.clone(),
            arms: arms.clone(),
            values,
            wait: self.settings.wait,
            cpu: self.settings.cpus.sender,
            priority: self.settings.priority,
        };
        let request = ThreadRequest {
            priority: self.settings.priority,
            cpu: Pinning::Named(self.settings.cpus.receiver),
        };
        let flag = self.stop.flag();
        thread::scope(|scope| {
            let (jobs, to_do) = channel();
            let (answer, answers) = channel();
            let (place, known) = (&place, &arms);
            scope.spawn(move || measurer::run(place, known, request, &flag, &to_do, &answer));
            let mut session = Session::open(self, jobs, answers, arms.clone(), &setup)?;
            let mut reports = Vec::new();
            for circumstance in circumstances {
                let series = session.circumstance(values, circumstance)?;
                reports.extend(series.iter().filter_map(Series::report));
                session.bench.paces.extend(series.iter().map(Series::pace));
            }
            Ok(reports)
        })
    }

    fn warn(&mut self, warnings: impl IntoIterator<Item = Warning>) {
        for warning in warnings {
            if !self.warnings.contains(&warning) {
                self.warnings.push(warning);
            }
        }
    }
}

struct Session<'a, 'b> {
    bench: &'a mut Bench<'b>,
    // Leaves before the thread that measures ends, so that no message is without a reader.
    peer: Peer,
    jobs: Sender<Job>,
    answers: Receiver<Result<Answer, String>>,
    arms: Vec<Arm>,
    thread: u32,
}

impl<'a, 'b> Session<'a, 'b> {
    fn open(
        bench: &'a mut Bench<'b>,
        jobs: Sender<Job>,
        answers: Receiver<Result<Answer, String>>,
        arms: Vec<Arm>,
        setup: &Setup,
    ) -> Result<Self, BenchError> {
        let Answer::Open { thread, refusals } = answer(&answers)? else {
            return Err(unexpected());
        };
        bench.warn(refusals.iter().map(warning));
        let (peer, warnings) = Peer::start(bench.company, setup)?;
        bench.warn(warnings);
        let session = Self { bench, peer, jobs, answers, arms, thread };
        session.order(Job::Connect)?;
        answer(&session.answers)?;
        Ok(session)
    }

    /// Lets the arms of a circumstance take turns.
    fn circumstance(
        &mut self,
        values: usize,
        circumstance: &Circumstance,
    ) -> Result<Vec<Series>, BenchError> {
        let new = |arm: &Arm| Series::new(*arm, circumstance.pace, values);
        let mut series: Vec<Series> = circumstance.arms.iter().map(new).collect();
        let labels: Vec<String> = series.iter().map(Series::label).collect();
        let labels: Vec<&str> = labels.iter().map(String::as_str).collect();
        let view = self.bench.onlooker.begin(self.bench.settings.total(), &labels);
        for (round, index) in turn_order(self.bench.settings.rounds, series.len()) {
            let Some(series) = series.get_mut(index) else { continue };
            view.pass(self.bench.settings.turn() * self.bench.turns as u32);
            if !self.turn(circumstance.pace, round, series)? {
                break;
            }
            view.show(index, series.samples());
        }
        Ok(series)
    }

    /// One turn; `false` if it was stopped, and does not count.
    fn turn(
        &mut self,
        pace: SendPace,
        round: usize,
        series: &mut Series,
    ) -> Result<bool, BenchError> {
        if self.bench.stop.is_due() {
            return Ok(false);
        }
        self.bench.turns += 1;
        let Some(arm) = self.arms.iter().position(|arm| *arm == series.arm()) else {
            return Err(unexpected());
        };
        let period_ns = pace.hz().map(|hz| (1e9 / hz).round() as u64);
        let nodes = self.start_nodes(arm, series.arm(), period_ns)?;
        let span = self.span(round, series.arm(), period_ns);
        let mut watches = self.watches(series.arm());
        self.bench.tending.keep_quiet(&span);
        if series.arm().has_peer() {
            self.peer.begin(&Turn { arm, span, period_ns })?;
        }
        self.order(Job::Turn { arm, span, period_ns })?;
        let ahead_ns = span.from_ns.saturating_sub(AHEAD_NS);
        thread::sleep(Duration::from_nanos(ahead_ns.saturating_sub(Monotonic.now_ns())));
        watches.iter_mut().for_each(Watch::look);
        let result = self.result();
        watches.iter_mut().for_each(Watch::look);
        for node in nodes {
            let refused = node.end()?;
            self.bench.warn(refused);
        }
        if self.bench.stop.is_due() && result.is_ok() {
            return Ok(false);
        }
        // Where both sides fail, the peer's reason is the cause more often than not.
        let sent = match result.as_ref().map(|result| result.sent) {
            Ok(Some(sent)) => sent,
            Ok(None) => self.peer.finish()?,
            Err(_) => match self.peer.last_words() {
                Some(why) => return Err(why),
                None => return result.map(|_| false),
            },
        };
        let result = result?;
        let mut seen = watches.iter().map(|watch| watch.since(span.from_ns));
        let receiver = seen.next().unwrap_or_default();
        let sender = seen.reduce(Disturbance::and).unwrap_or_default();
        let turn = Disturbed {
            at_s: span.from_ns.saturating_sub(self.bench.origin_ns) as f64 / 1e9,
            elapsed_ns: span.end_ns - span.from_ns,
            sender,
            receiver,
        };
        series.push(&turn, &result, &sent);
        Ok(true)
    }

    fn span(&self, round: usize, arm: Arm, period_ns: Option<u64>) -> Span {
        let plan = self.bench.settings;
        let earliest_ns = Monotonic.now_ns() + LEAD_NS;
        let start_ns = arm.transport().start_ns(earliest_ns, period_ns, round, plan.rounds);
        Span {
            start_ns,
            from_ns: start_ns + plan.turn_ns / WARM_UP,
            end_ns: start_ns + plan.turn_ns,
            first: self.bench.turns << 32,
        }
    }

    /// Watches over the thread that measures, and over the CPUs of the others: of the peer, or of the nodes
    /// where that thread has sent itself.
    fn watches(&self, arm: Arm) -> Vec<Watch> {
        let plan = self.bench.settings;
        let mut others = vec![plan.cpus.sender];
        if !arm.has_peer() {
            others.extend(plan.node_places(arm).iter().map(|place| place.cpu));
        }
        others.sort_unstable();
        others.dedup();
        let measuring = Watch::begin(Some(plan.cpus.receiver), Some(self.thread));
        let others = others.into_iter().map(|cpu| Watch::begin(Some(cpu), None));
        [measuring].into_iter().chain(others).collect()
    }

    /// Starts the nodes of an arm, if it has any, and waits until they send.
    fn start_nodes(
        &mut self,
        index: usize,
        arm: Arm,
        period_ns: Option<u64>,
    ) -> Result<Vec<Node<'b>>, BenchError> {
        let plan = self.bench.settings;
        let configurations = arm.transport().nodes(period_ns, &plan.node_places(arm));
        if configurations.is_empty() {
            return Ok(Vec::new());
        }
        let seconds = plan.turn().as_secs_f64() + GRACE_S;
        let start = |node: &BenchNode| Node::start(self.bench.company, node, seconds);
        let nodes = configurations.iter().map(start).collect::<Result<Vec<_>, _>>()?;
        self.order(Job::AwaitNodes(index))?;
        match self.answers.recv() {
            Ok(Ok(_)) => Ok(nodes),
            Ok(Err(why)) => {
                let logs: String = nodes.iter().map(Node::log).collect();
                Err(BenchError::Failed(format!("{why}\n{logs}")))
            }
            Err(_) => Err(unexpected()),
        }
    }

    fn result(&self) -> Result<Box<TurnResult>, BenchError> {
        match answer(&self.answers)? {
            Answer::TurnResult(result) => Ok(result),
            _ => Err(unexpected()),
        }
    }

    fn order(&self, job: Job) -> Result<(), BenchError> {
        self.jobs.send(job).map_err(|_| unexpected())
    }
}

fn answer(answers: &Receiver<Result<Answer, String>>) -> Result<Answer, BenchError> {
    answers.recv().map_err(|_| unexpected())?.map_err(BenchError::Failed)
}

fn unexpected() -> BenchError {
    let why = "the thread that measures has ended; this is a bug, and stderr says where";
    BenchError::Failed(why.into())
}
