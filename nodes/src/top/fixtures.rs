//! Descriptions of things that tests of the screen show.

use isochrone_control::{
    Access, Action, ActiveAlarm, AskedBy, Change, ConfigurationOrigin, DescribeResult, Entry,
    Force, LastSecond, Role, SignalDescription, TaskDescription, Value,
};
use isochrone_timing::Summary;

use crate::base::session::{ReadValues, Sample};

pub(super) fn signal(name: &str, role: Role, value_type: &str) -> SignalDescription {
    SignalDescription {
        name: name.into(),
        value_type: value_type.into(),
        comment: None,
        unit: (value_type == "LREAL").then(|| "m/s".into()),
        role,
        task: "fast".into(),
        forced: false,
        protected: Some(false),
        limits: None,
        can_be_unset: false,
        doc: format!("what {name} is for"),
    }
}

/// Values without flags.
pub(super) fn read<const N: usize>(values: [(&str, impl Into<Value>); N]) -> ReadValues {
    ReadValues { values: values.into_iter().collect(), ..ReadValues::default() }
}

pub(super) fn force(name: &str, value: impl Into<Value>) -> Force {
    let (name, value) = (name.to_owned(), value.into());
    Force {
        name,
        value,
        value_type: None,
        since_cycle: 100,
        until_cycle: Some(5100),
        client: Some("ann".into()),
    }
}

pub(super) fn alarm(name: &str, status: Option<u16>) -> ActiveAlarm {
    let meaning = format!("what is wrong with {name}");
    ActiveAlarm {
        name: name.into(),
        code: None,
        status,
        meaning,
        task: "fast".into(),
        since_cycle: 42,
        since_unix_ns: Some(1_700_000_000_000_000_000),
        count: 3,
    }
}

/// The entry of a transaction of its own that bert asked for.
pub(super) fn entry(transaction: u64, action: Action, after: f64) -> Entry {
    let (before, after) = (Value::Number(0.0), Some(Value::Number(after)));
    Entry {
        sequence: transaction,
        transaction,
        action,
        task: "fast".into(),
        cycle: 777,
        unix_ns: 1_700_000_000_000_000_000,
        until_cycle: None,
        undone: None,
        changes: vec![Change {
            name: "ramp.setChangeRate".into(),
            before,
            after,
            value_type: None,
        }],
        left_out: 0,
        by: AskedBy { client: Some("bert".into()), ..AskedBy::default() },
        configuration: None,
        applied: None,
    }
}

pub(super) fn node(started_unix_ns: u64) -> DescribeResult {
    let task = |name: &str, period_ns| TaskDescription {
        name: name.into(),
        ob: None,
        period_ns,
        phase_ns: 0,
        cycle: 123_456,
        last_cycle: Some(123_456),
        stands_ns: None,
        missed: 2,
        overruns: 1,
        placement: None,
        parameters: 7,
        forces: 1,
        alarms: 0,
        last_second: (name == "fast").then(a_second),
    };
    DescribeResult {
        node: "tank".into(),
        version: "0.1.0".into(),
        control: Access::Force,
        configuration: ConfigurationOrigin {
            file: "tank.toml".into(),
            sha256: "00".into(),
            started_sha256: None,
            changed: false,
        },
        announced_units: 0,
        started_unix_ns,
        tasks: vec![task("fast", 1_000_000), task("slow", 100_000_000)],
        redundancy: None,
    }
}

/// All thousand cycles of a second.
fn a_second() -> LastSecond {
    let release_jitter_ns = Summary {
        count: 1000,
        p50: Some(1_500),
        p99: Some(9_500),
        max: Some(12_000),
        ..Summary::default()
    };
    LastSecond { cycles: 1000, release_jitter_ns, execution_ns: 250_000.0 }
}

/// Every twentieth cycle of "fast" within the last minute before `now_ns`.
pub(super) fn a_minute_of_samples(now_ns: u64) -> Vec<Sample> {
    let sample = |number: u64| Sample {
        task: "fast".into(),
        cycle: number * 20,
        at_ns: now_ns - 60_000_000_000 + number * 20_000_000,
        release_jitter_ns: 1_000 + number,
        follow: None,
    };
    (0..3000).map(sample).collect()
}
