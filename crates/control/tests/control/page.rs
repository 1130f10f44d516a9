//! What the page on the control protocol says is what there is.

use std::collections::BTreeSet;

use isochrone_control::{
    Access, Action, ActiveAlarm, AlarmsResult, AppliedChange, ApplyResult, AskedBy, ByTask, Change,
    ChangedValue, Code, ConfigurationOrigin, DescribeResult, Entry, Finding, Followed, Force,
    ForceResult, ForcesResult, GetResult, Given, JournalResult, LastSecond, Method, Part,
    PendingEntry, Placement, ReadAt, Reply, Role, SaveResult, SetResult, SignalDescription,
    SignalsResult, TaskDescription, TraceResult, TracedSignal, Tuned, Value, Values,
};
use isochrone_timing::Summary;

fn page() -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/control.md");
    std::fs::read_to_string(path).unwrap()
}

/// What the page says of a method.
fn section(page: &str, method: &str) -> String {
    let (_, methods) = page.split_once("## Methods").unwrap();
    let start = format!("\n### {method}\n");
    let (_, section) = methods.split_once(&start).unwrap_or_else(|| panic!("no {method}"));
    section.split("\n### ").next().unwrap().to_owned()
}

fn described() -> DescribeResult {
    let placement = Placement {
        cpu: None,
        scheduler: "other".into(),
        wake: "sleep".into(),
        first_release_ns: 0,
        longest_watch_ns: 0,
        phase_reason: None,
        cpu_reason: None,
        response_ns: None,
        follow: Some(Followed { service: String::new(), within_ns: 0 }),
        sends: vec![String::new()],
    };
    let task = TaskDescription {
        name: String::new(),
        ob: Some(0),
        period_ns: 0,
        phase_ns: 0,
        cycle: 0,
        last_cycle: Some(0),
        stands_ns: Some(0),
        missed: 0,
        overruns: 0,
        parameters: 0,
        forces: 0,
        alarms: 0,
        last_second: Some(LastSecond {
            cycles: 0,
            release_jitter_ns: Summary::default(),
            execution_ns: 0.0,
        }),
        placement: Some(placement),
    };
    DescribeResult {
        node: String::new(),
        version: String::new(),
        control: Access::Set,
        configuration: ConfigurationOrigin {
            file: String::new(),
            sha256: String::new(),
            started_sha256: None,
            changed: false,
        },
        started_unix_ns: 0,
        tasks: vec![task],
    }
}

fn signal() -> SignalDescription {
    SignalDescription {
        name: String::new(),
        value_type: String::new(),
        unit: None,
        role: Role::Input,
        task: String::new(),
        forced: false,
        protected: Some(false),
        limits: Some([0.0, 1.0]),
        can_be_unset: true,
        doc: String::new(),
    }
}

fn entry() -> Entry {
    Entry {
        sequence: 1,
        transaction: 1,
        action: Action::Set,
        task: String::new(),
        cycle: 0,
        unix_ns: 0,
        until_cycle: Some(0),
        undone: Some(0),
        changes: vec![Change { name: String::new(), before: Value::Bool(true), after: None }],
        left_out: 1,
        by: by(),
        configuration: Some("".into()),
        applied: Some(AppliedChange {
            file: Some(String::new()),
            sha256: String::new(),
            added: 0,
            removed: 0,
            changed: 0,
            limits: vec![String::new()],
        }),
    }
}

fn by() -> AskedBy {
    AskedBy { client: Some(String::new()), process: Some(0), comment: Some(String::new()) }
}

fn pending() -> PendingEntry {
    PendingEntry {
        transaction: 1,
        action: Action::Set,
        task: String::new(),
        cycle: 0,
        names: vec![String::new()],
        values: Values::default(),
        by: by(),
    }
}

fn set() -> SetResult {
    let warning = Finding::new("", "").with_help("");
    SetResult {
        transaction: 1,
        tasks: parts(),
        before: Values::default(),
        after: Values::default(),
        warnings: vec![warning],
    }
}

fn parts() -> ByTask<Part> {
    [("TASK".to_owned(), Part { cycle: 0, pending: true })].into()
}

/// An answer to each method, with every member that it can have.
fn answer(method: Method) -> Reply {
    let none = Values::default;
    match method {
        Method::Describe => Reply::Describe(described()),
        Method::Signals => Reply::Signals(SignalsResult { total: 1, signals: vec![signal()] }),
        Method::Get => {
            let tasks = [("TASK".to_owned(), ReadAt { cycle: 0, release_ns: 0 })].into();
            let quality = Some(Default::default());
            Reply::Get(GetResult { total: 0, tasks, values: none(), quality })
        }
        Method::Set => Reply::Set(set()),
        Method::Release => Reply::Release(set()),
        Method::Undo => Reply::Undo(set()),
        Method::Force => {
            let SetResult { transaction, tasks, before, warnings, .. } = set();
            let until = ByTask::new();
            Reply::Force(ForceResult { transaction, tasks, before, warnings, until })
        }
        Method::Forces => {
            let force = Force {
                name: String::new(),
                value: Value::Bool(true),
                since_cycle: 0,
                until_cycle: None,
                client: None,
            };
            Reply::Forces(ForcesResult { total: 1, forces: vec![force] })
        }
        Method::Journal => Reply::Journal(JournalResult {
            total: 1,
            entries: vec![entry()],
            pending: vec![pending()],
        }),
        Method::Alarms => {
            let alarm = ActiveAlarm {
                name: String::new(),
                code: Some(String::new()),
                status: None,
                meaning: String::new(),
                task: String::new(),
                since_cycle: 0,
                since_unix_ns: Some(0),
                count: 1,
            };
            Reply::Alarms(AlarmsResult { total: 1, alarms: vec![alarm] })
        }
        Method::Save => Reply::Save(SaveResult { total: 0, configuration: String::new() }),
        Method::Trace => Reply::Trace(TraceResult {
            id: String::new(),
            service: String::new(),
            task: String::new(),
            period_ns: 0,
            timing: vec![String::new()],
            signals: vec![TracedSignal {
                name: String::new(),
                value_type: String::new(),
                unit: Some(String::new()),
            }],
        }),
        Method::Apply => {
            let names = Vec::new;
            Reply::Apply(ApplyResult {
                transaction: Some(1),
                tasks: parts(),
                warnings: vec![Finding::new("", "").with_help("")],
                added: names(),
                removed: names(),
                kept: names(),
                changed: names(),
                values: vec![ChangedValue {
                    name: String::new(),
                    before: Given::Value(Value::Bool(true)),
                    after: Given::Wire { wire: String::new() },
                }],
                values_left_out: 0,
                tuned: vec![Tuned {
                    name: String::new(),
                    value: Value::Bool(true),
                    configured: Value::Bool(true),
                }],
                limits: names(),
                cost_ns: 0,
                refused: Some(String::new()),
            })
        }
    }
}

fn members(value: &serde_json::Value, found: &mut BTreeSet<String>) {
    match value {
        serde_json::Value::Object(object) => {
            found.extend(object.keys().filter(|key| *key != "TASK").cloned());
            object.values().for_each(|value| members(value, found));
        }
        serde_json::Value::Array(items) => items.iter().for_each(|item| members(item, found)),
        _ => {}
    }
}

#[test]
fn every_method_is_described_with_all_of_its_parameters_and_results() {
    let page = page();
    for method in Method::ALL {
        let mut text = section(&page, method.as_str());
        for parameter in method.params() {
            assert!(text.contains(&format!("`{parameter}`")), "{method:?} lacks {parameter}");
        }
        if text.contains("as for `set`") {
            text += &section(&page, "set");
        }
        // What every finding has stands under the errors.
        text += page.split_once("### Errors").unwrap().1.split("\n## ").next().unwrap();
        let mut found = BTreeSet::new();
        members(&serde_json::to_value(answer(method)).unwrap(), &mut found);
        for member in found {
            assert!(text.contains(&format!("`{member}`")), "{method:?} lacks {member}");
        }
    }
}

#[test]
fn every_code_is_described() {
    let page = page();
    for code in Code::ALL {
        assert!(page.contains(&format!("\n| {} |", code.number())), "{code:?}");
    }
}
