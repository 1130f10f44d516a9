//! Requests to a node, one a line: read, and carried out by the desk of a node that steps.

use std::sync::LazyLock;

use isochrone_control::desk::{
    Draft, Feeds, Operator, OrderOutcome, PreparedRequest, RequestTerms, Selection,
};
use isochrone_control::{At, Call, Parsed, Refusal, Reply, Unparsed, answer, parse};
use isochrone_engine::orders::{Inbox, Replacement};
use isochrone_engine::{Plan, Rules, Source, TaskEngine};

use crate::{Target, assert_sentence};

pub(crate) const TARGET: Target = Target { name: "requests", max_bytes: 2048, max_mib: 64, read };

const NODE: &str = include_str!("node.toml");
const MOST_REQUESTS: usize = 12;

static PLAN: LazyLock<Plan> =
    LazyLock::new(|| plan(NODE.to_owned()).unwrap_or_else(|refused| panic!("{refused}")));

fn plan(text: String) -> Result<Plan, isochrone_engine::Diagnostics> {
    Plan::new(Source::new("node.toml", text), &Rules::default())
}

fn read(bytes: &[u8]) {
    let mut node = OperatedNode::new();
    for line in bytes.split(|byte| *byte == b'\n').take(MOST_REQUESTS) {
        match parse(line) {
            Ok(Parsed { id, call }) => {
                assert_eq!(
                    parse(&written(&id, &call)),
                    Ok(Parsed { id: id.clone(), call: call.clone() })
                );
                if let Err(refusal) = node.carry_out(call) {
                    check_refusal(Some(&id), &refusal);
                }
            }
            Err(Unparsed { id, failure }) => check_refusal(id.as_deref(), &failure),
        }
        node.step();
    }
    node.save();
}

/// The text of a request, with names that it has twice.
fn written(id: &str, call: &Call) -> Vec<u8> {
    let id = serde_json::to_string(id).expect("a text has a JSON");
    let params = serde_json::to_string(call).expect("what was read can be written");
    let method = call.method().as_str();
    format!(r#"{{"jsonrpc":"2.0","id":{id},"method":"{method}","params":{params}}}"#).into_bytes()
}

/// A refusal says why, in an answer that is JSON.
fn check_refusal(id: Option<&str>, refusal: &Refusal) {
    assert_sentence(&isochrone_engine::escaped(&refusal.message));
    for finding in &refusal.findings {
        assert_sentence(&isochrone_engine::escaped(&finding.message));
    }
    let text = answer::<Reply>(id, Err(refusal));
    let text: serde_json::Value = serde_json::from_slice(&text).expect("an answer is JSON");
    assert_eq!(text["id"].as_str(), id);
}

struct OperatedNode {
    text: String,
    operator: Operator,
    engines: Vec<TaskEngine>,
    inboxes: Vec<Inbox>,
    replacements: Vec<Option<Replacement>>,
    /// The next cycle of each task.
    next: Vec<u64>,
}

impl OperatedNode {
    fn new() -> Self {
        let engines = TaskEngine::build(&PLAN).expect("it can be stepped");
        let tasks = engines.len();
        Self {
            text: NODE.to_owned(),
            operator: Operator::new(&PLAN, Feeds::Services),
            engines,
            inboxes: (0..tasks).map(|_| Inbox::new(99)).collect(),
            replacements: (0..tasks).map(|_| None).collect(),
            next: vec![0; tasks],
        }
    }

    fn carry_out(&mut self, call: Call) -> Result<(), Refusal> {
        let (operator, next) = (&self.operator, &self.next);
        let at = |at: Option<At>| RequestTerms { at, is_remote: true, ..RequestTerms::default() };
        let prepared = match &call {
            Call::Set(set) => operator.set(values(&set.values), at(set.at), next)?,
            Call::Force(force) => {
                operator.force(values(&force.values), force.seconds, at(force.at), next)?
            }
            Call::Release(release) => {
                let names = release.names.iter().map(String::as_str);
                let unmatched = operator.signals().unmatched(names.clone());
                operator.release(names, unmatched, at(None), next)?
            }
            Call::Undo(undo) => operator.undo(undo.transaction, at(None), next)?,
            Call::Get(get) => {
                let names = get.names.iter().map(String::as_str);
                let offset = usize::try_from(get.offset.unwrap_or(0)).unwrap_or(usize::MAX);
                let limit = usize::try_from(get.limit.unwrap_or(100)).unwrap_or(usize::MAX);
                let selected = Selection::of(operator.signals(), names, offset, limit)?;
                operator.read(selected.with_quality())
            }
            Call::Apply(apply) => {
                self.apply(&apply.configuration);
                return Ok(());
            }
            _ => return Ok(()),
        };
        self.send(prepared);
        Ok(())
    }

    fn send(&mut self, prepared: PreparedRequest) {
        let (_, orders) = self.operator.send(prepared);
        for (task, order) in orders {
            self.inboxes[task].take(order).expect("there is room");
        }
    }

    fn apply(&mut self, text: &str) {
        if text.contains("count") {
            return;
        }
        let Ok(plan) = plan(text.to_owned()) else { return };
        let draft = Draft::new(&plan).expect("it can be stepped");
        let Ok(prepared) = self.operator.change(draft, RequestTerms::default()) else { return };
        let at: Vec<u64> = self.next.iter().map(|next| next + 1).collect();
        let (_, replacements) =
            self.operator.send_change(prepared, &at).expect("nothing was sent meanwhile");
        self.replacements = replacements.into_iter().map(Some).collect();
        self.text = text.to_owned();
    }

    /// A cycle of each task.
    fn step(&mut self) {
        for (task, engine) in self.engines.iter_mut().enumerate() {
            let (cycle, operator) = (self.next[task], &mut self.operator);
            if let Some(mut due) = self.replacements[task].take_if(|it| cycle >= it.at()) {
                engine.replace(&mut due, cycle);
                operator.replaced(task, due, 0);
            }
            engine.expire(cycle, |ended| drop(operator.expired(task, ended, cycle, 0)));
            let inbox = &mut self.inboxes[task];
            inbox.apply(engine, cycle, 0, |order| drop(operator.done(task, order, 0)));
            engine.step(cycle);
            inbox.read(engine, cycle, |order| {
                if let OrderOutcome::Read(reading) = operator.done(task, order, 0) {
                    let qualities = reading.quality.map(|quality| quality.len());
                    assert!(qualities.is_none_or(|of| of == reading.values.len()));
                }
            });
            if let Some(next) = self.replacements[task].as_mut().filter(|it| cycle + 1 >= it.at()) {
                engine.hand_over(next);
            }
            self.next[task] += 1;
        }
    }

    /// What was set stands in what is saved, which is a configuration.
    fn save(&mut self) {
        // What is on its way comes first.
        self.step();
        self.step();
        assert_eq!(self.operator.changing(), None, "a change has not ended");
        let saved = self.operator.save(&self.text).expect("what runs can be saved");
        let plan = plan(saved.clone()).unwrap_or_else(|refused| panic!("{refused}\n{saved}"));
        let again = Operator::new(&plan, Feeds::Services);
        let engines = TaskEngine::build(&plan).expect("it can be stepped");
        for retained in self.operator.retained_values() {
            let signal = again.signals().find(&retained.name).expect("it is there");
            let value = engines[signal.task].image()[signal.slot];
            assert_eq!(value.to_bits(), retained.value, "{}\n{saved}", retained.name);
        }
        for entry in self.operator.journal(0) {
            let text = serde_json::to_string(&entry).expect("an entry can be written");
            let again: isochrone_control::Entry = serde_json::from_str(&text).expect("and read");
            assert_eq!(serde_json::to_string(&again).expect("and written"), text);
        }
    }
}

fn values(
    values: &isochrone_control::Values<isochrone_control::Written>,
) -> impl Iterator<Item = (&str, isochrone_control::Written)> {
    values.0.iter().map(|(name, value)| (name.as_str(), value.clone()))
}
