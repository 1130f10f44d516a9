//! A node of nothing but parameters, and the process that it runs in.

use std::collections::HashMap;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use isochrone_control::{
    Access, At, Begun, Call, CallResult, Caller, Code, ConfigurationOrigin, ControlService,
    DescribeParams, DescribeResult, Finding, ForceParams, ForceResult, GetParams, GetResult,
    Handle, Hold, Operated, Part, ReadAt, Refusal, Reply, Role, Room, SaveParams, SaveResult,
    SetParams, SetResult, SignalDescription, SignalsParams, SignalsResult, Ticket, Types, Value,
    Values, Written,
};
use isochrone_ipc::{
    Domain, FrameLayout, FramePublisher, IsolatedDomain, Participant, SignalSpec, ipc,
};

pub(crate) type Node = Participant<ipc::Service>;

/// Parameters of the node that is operated here.
pub(crate) const PARAMETERS: usize = 5000;

/// A node of nothing but parameters: what the engine will be.
pub(crate) struct Parameters {
    values: HashMap<String, f64>,
    transactions: u64,
    under_way: Vec<(Instant, Ticket, CallResult)>,
    processes: Vec<Option<u32>>,
}

impl Parameters {
    pub(crate) fn new() -> Self {
        let values = (0..PARAMETERS).map(|n| (name(n), n as f64)).collect();
        Self { values, transactions: 0, under_way: Vec::new(), processes: Vec::new() }
    }

    fn set(&mut self, set: SetParams, caller: Caller) -> Result<Begun<Reply>, Refusal> {
        let unknown = set.values.iter().filter(|(name, _)| !self.values.contains_key(*name));
        let unknown: Vec<_> = unknown
            .map(|(name, _)| Finding::new(name, format!("there is no signal \"{name}\"")))
            .collect();
        if !unknown.is_empty() {
            return Err(Refusal::of(Code::UnknownName, unknown));
        }
        self.transactions += 1;
        self.processes.push(caller.process);
        let mut before = Values::default();
        for (name, value) in set.values.iter() {
            let Written::Value(Value::Number(value)) = value else { panic!("{value:?}") };
            let old = self.values.insert(name.to_owned(), value).unwrap();
            before.0.push((name.to_owned(), Value::Number(old)));
        }
        let cycle = cycle(set.at);
        let reply = Reply::Set(SetResult {
            transaction: self.transactions,
            tasks: [("fast".to_owned(), Part { cycle, pending: false })].into(),
            before,
            after: Values::default(),
            types: Types::default(),
            warnings: Vec::new(),
        });
        let (due, ticket) =
            (Instant::now() + Duration::from_millis(cycle), Ticket(self.transactions));
        self.under_way.push((due, ticket, Ok(reply)));
        Ok(Begun::Later(ticket))
    }
}

pub(crate) fn name(n: usize) -> String {
    format!("block.{n}.setChangeRate")
}

impl Handle<DescribeParams> for Parameters {
    fn handle(&mut self, _: DescribeParams, _: Caller) -> Result<Begun<DescribeResult>, Refusal> {
        Ok(Begun::Ended(DescribeResult {
            node: "level".to_owned(),
            version: "0".to_owned(),
            control: Access::Set,
            configuration: ConfigurationOrigin {
                file: "level.toml".to_owned(),
                sha256: String::new(),
                started_sha256: None,
                changed: self.transactions > 0,
            },
            announced_units: 0,
            started_unix_ns: u64::MAX,
            tasks: Vec::new(),
            redundancy: None,
        }))
    }
}

impl Handle<SignalsParams> for Parameters {
    fn handle(
        &mut self,
        signals: SignalsParams,
        _: Caller,
    ) -> Result<Begun<SignalsResult>, Refusal> {
        let mut room = Room::of_answer();
        let (offset, limit) = (signals.offset.unwrap_or(0), signals.limit.unwrap_or(1000));
        let matches = |name: &String| signals.pattern.as_ref().is_none_or(|wanted| wanted == name);
        let names: Vec<_> = (0..PARAMETERS).map(name).filter(matches).collect();
        let total = names.len() as u64;
        let description = |name| SignalDescription {
            name,
            value_type: "LREAL".to_owned(),
            unit: None,
            comment: None,
            role: Role::Parameter,
            task: "fast".to_owned(),
            forced: false,
            protected: None,
            limits: None,
            can_be_unset: false,
            doc: "x".repeat(500),
        };
        let page = names.into_iter().skip(offset as usize).take(limit as usize).map(description);
        let signals = page.take_while(|signal| room.takes(signal)).collect();
        Ok(Begun::Ended(SignalsResult { total, signals }))
    }
}

impl Handle<GetParams> for Parameters {
    fn handle(&mut self, get: GetParams, _: Caller) -> Result<Begun<GetResult>, Refusal> {
        if let Some(name) = get.names.iter().find(|name| !self.values.contains_key(*name)) {
            let finding = Finding::new(name, format!("there is no signal \"{name}\""));
            return Err(Refusal::of(Code::UnknownName, vec![finding]));
        }
        let values = get.names.iter().map(|name| (name.as_str(), self.values[name]));
        Ok(Begun::Ended(GetResult {
            total: get.names.len() as u64,
            tasks: [("fast".to_owned(), ReadAt { cycle: 1, release_ns: 2 })].into(),
            values: values.collect(),
            quality: None,
            types: None,
        }))
    }
}

impl Handle<SaveParams> for Parameters {
    fn handle(&mut self, save: SaveParams, _: Caller) -> Result<Begun<SaveResult>, Refusal> {
        let text = "# né\n".repeat(100_000);
        let rest = &text[save.offset.unwrap_or(0) as usize..];
        let configuration = rest.chars().take(100_000).collect();
        Ok(Begun::Ended(SaveResult { total: text.len() as u64, configuration }))
    }
}

impl Handle<ForceParams> for Parameters {
    fn handle(&mut self, force: ForceParams, _: Caller) -> Result<Begun<ForceResult>, Refusal> {
        assert!(force.values.iter().all(|(name, _)| self.values.contains_key(name)));
        let Hold::Seconds(seconds) = force.seconds else { panic!("{:?}", force.seconds) };
        let until = Some(cycle(force.at) + (seconds * 1000.0) as u64);
        let value = |(name, _)| (name, self.values[name]);
        Ok(Begun::Ended(ForceResult {
            transaction: self.transactions + 1,
            tasks: [("fast".to_owned(), Part { cycle: 0, pending: false })].into(),
            before: force.values.iter().map(value).collect(),
            after: Values::default(),
            types: Types::default(),
            warnings: Vec::new(),
            until: [("fast".to_owned(), until)].into(),
        }))
    }
}

fn cycle(at: Option<At>) -> u64 {
    match at {
        Some(At::Cycle(cycle)) => cycle,
        None | Some(At::In(_)) => 0,
    }
}

impl Operated for Parameters {
    fn begin(&mut self, call: Call, caller: Caller) -> Result<Begun<Reply>, Refusal> {
        match call {
            Call::Set(set) => self.set(set, caller),
            Call::Describe(params) => Ok(self.handle(params, caller)?.map(Reply::Describe)),
            Call::Signals(params) => Ok(self.handle(params, caller)?.map(Reply::Signals)),
            Call::Get(params) => Ok(self.handle(params, caller)?.map(Reply::Get)),
            Call::Save(params) => Ok(self.handle(params, caller)?.map(Reply::Save)),
            Call::Force(params) => Ok(self.handle(params, caller)?.map(Reply::Force)),
            other => {
                let message = format!("{} is forbidden", other.method().as_str());
                Err(Refusal::new(Code::Forbidden, message))
            }
        }
    }

    fn ended(&mut self) -> Option<(Ticket, CallResult)> {
        let now = Instant::now();
        let index = self.under_way.iter().position(|(due, ..)| *due <= now)?;
        let (_, ticket, outcome) = self.under_way.remove(index);
        Some((ticket, outcome))
    }
}

pub(crate) fn join(domain: &Domain) -> Node {
    Participant::join("tester", domain).unwrap()
}

/// The process of a node that takes requests (or none), which is killed at the end.
pub(crate) struct Running(Child);

impl Running {
    pub(crate) fn start(domain: &IsolatedDomain, role: &str, node: &str) -> Self {
        let mut child = isochrone_testing::role(role, &domain.file())
            .env("ISOCHRONE_TEST_NODE", node)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        lines.find(|line| line.as_ref().is_ok_and(|line| line == "running")).unwrap().unwrap();
        Self(child)
    }

    pub(crate) fn process(&self) -> u32 {
        self.0.id()
    }

    pub(crate) fn signal(&self, signal: &str) {
        let pid = self.0.id().to_string();
        assert!(Command::new("kill").args([signal, &pid]).status().unwrap().success());
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }
}

/// Has telemetry, by which others know that the node runs.
pub(crate) fn telemetry(participant: &Node, node: &str) -> FramePublisher<ipc::Service> {
    let layout = FrameLayout { signals: vec![SignalSpec::new("cycle", "LREAL")], period_ns: None };
    FramePublisher::open(participant, &format!("isochrone/{node}/telemetry"), &layout).unwrap()
}

/// A node that takes requests until it is killed; nothing in a process that no test started.
pub(crate) fn take_requests() {
    let Some(domain) = isochrone_testing::role_domain() else { return };
    let node = std::env::var("ISOCHRONE_TEST_NODE").unwrap();
    let participant = Arc::new(join(&domain));
    let _telemetry = telemetry(&participant, &node);
    let mut desk = ControlService::open(&participant, &node).unwrap();
    let mut upkeep = desk.upkeep();
    let other = Arc::clone(&participant);
    thread::spawn(move || {
        loop {
            upkeep.tend(&other);
            thread::sleep(Duration::from_millis(50));
        }
    });
    let mut parameters = Parameters::new();
    println!("\nrunning");
    loop {
        desk.serve(&mut parameters, &participant);
        thread::sleep(Duration::from_millis(2));
    }
}
