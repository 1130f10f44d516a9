//! The thread that publishes `/diagnostics`: nodes, and the bridge's own links.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use isochrone_control::{AlarmSeverity, Client, ClientError, DescribeParams, running_nodes};
use isochrone_ipc::{Domain, Participant, ipc};
use isochrone_processes::Stop;
use isochrone_recording::message::{Definitions, RosValue, encode};
use rustdds::policy::Durability;

use crate::bridge::{Count, Hearing, Level, LinkCounts, read_clocks, status};
use crate::config::{Diagnostics, Profile, QualityOfService};
use crate::dds::Dds;
use crate::failure::Failure;
use crate::mapping::time;
use crate::names::dds_topic;

const TOPIC: &str = "/diagnostics";
/// How long a node may take to answer.
const PATIENCE: Duration = Duration::from_millis(500);
/// Between two looks whether the bridge is to stop.
const LOOK_INTERVAL: Duration = Duration::from_millis(50);

/// Publishes diagnostics until it is to stop.
pub(crate) fn diagnostics(
    domain: &Domain,
    dds: &Dds,
    wanted: &Diagnostics,
    links: &[Arc<LinkCounts>],
    definitions: &Definitions,
    stop: &Stop,
) -> Result<(), Failure> {
    let participant =
        Participant::join("isochrone-ros2/diagnostics", domain).map_err(Failure::found)?;
    let message = definitions.find("diagnostic_msgs/DiagnosticArray").map_err(Failure::found)?;
    let quality = QualityOfService::of(Profile::Default);
    let writer =
        dds.writer(&dds_topic(TOPIC), &message.dds_name(), quality, Durability::Volatile)?;
    let hardware = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let hardware = hardware.trim();
    let mut clients = HashMap::new();
    let mut due = Instant::now();
    while !stop.is_due() {
        if Instant::now() < due {
            std::thread::sleep(LOOK_INTERVAL.min(wanted.interval));
            continue;
        }
        due = Instant::now() + wanted.interval;
        let nodes = match &wanted.nodes[..] {
            [] => running_nodes(&participant)
                .map(|nodes| nodes.into_iter().map(|node| node.name).collect())
                .unwrap_or_default(),
            nodes => nodes.to_vec(),
        };
        clients.retain(|node, _| nodes.contains(node));
        let mut all: Vec<RosValue> = links.iter().map(|link| of_link(link, hardware)).collect();
        for node in &nodes {
            all.push(of_node(&participant, &mut clients, node, hardware));
        }
        let header =
            RosValue::Message(vec![time(read_clocks().unix_ns), RosValue::Text(String::new())]);
        let array = RosValue::Message(vec![header, RosValue::Several(all)]);
        match encode(&message, &array) {
            Ok(body) => drop(writer.send(body)),
            Err(error) => tracing::error!("cannot send {TOPIC}: {error}"),
        }
    }
    dds.forget_writer(writer.guid());
    Ok(())
}

/// The status of a link: a warning once something was dropped, and as long as nothing comes.
fn of_link(link: &LinkCounts, hardware: &str) -> RosValue {
    let dropped = [Count::NotANumber, Count::Misfit, Count::Unsent, Count::Lost];
    let is_warned = dropped.iter().any(|count| link.get(*count) > 0);
    let silent = match link.hearing() {
        Hearing::Well => None,
        Hearing::Nobody => Some(format!("silent: nobody publishes {}", link.from)),
        Hearing::Silence => Some(format!("silent: nothing comes from {}", link.from)),
    };
    let level = if is_warned || silent.is_some() { Level::Warning } else { Level::Ok };
    let text = silent.map_or_else(|| link.text(), |silent| format!("{silent}; {}", link.text()));
    let values: Vec<_> =
        Count::ALL.iter().map(|count| (count.name(), link.get(*count).to_string())).collect();
    status(level, &format!("isochrone-ros2: {}", link.name), &text, hardware, &values)
}

/// The status of a node, by the client that it has had or a new one.
fn of_node(
    participant: &Participant<ipc::Service>,
    clients: &mut HashMap<String, Client>,
    node: &str,
    hardware: &str,
) -> RosValue {
    let name = format!("isochrone: {node}");
    let client =
        clients.remove(node).map_or_else(|| Client::connect(participant, node, PATIENCE), Ok);
    let asked = client.and_then(|mut client| {
        let of_node = ask(&mut client, &name, hardware)?;
        Ok((client, of_node))
    });
    match asked {
        Ok((client, of_node)) => {
            clients.insert(node.to_owned(), client);
            of_node
        }
        Err(error) => status(Level::Stale, &name, &error.to_string(), hardware, &[]),
    }
}

fn ask(client: &mut Client, name: &str, hardware: &str) -> Result<RosValue, ClientError> {
    let described = client.call(&DescribeParams {})?;
    let (of_node, of_process) = client.alarms()?;
    let mut values = vec![
        ("version".to_owned(), described.version),
        ("configuration".to_owned(), described.configuration.file),
    ];
    let mut level = Level::Ok;
    let mut messages = Vec::new();
    for task in &described.tasks {
        let mut add =
            |what: &str, value: String| values.push((format!("{}.{what}", task.name), value));
        add("cycle", task.last_cycle.map_or_else(String::new, |cycle| cycle.to_string()));
        add("missed", task.missed.to_string());
        add("overruns", task.overruns.to_string());
        add("alarms", task.alarms.to_string());
        add("forces", task.forces.to_string());
        if let Some(last_second) = &task.last_second {
            let jitter = &last_second.release_jitter_ns;
            for (what, ns) in [("p50", jitter.p50), ("p99", jitter.p99), ("max", jitter.max)] {
                let us = ns.map_or_else(String::new, |ns| format!("{:.3}", ns as f64 / 1e3));
                add(&format!("release_jitter_{what}_us"), us);
            }
            add("execution_us", format!("{:.3}", last_second.execution_ns / 1e3));
        }
        if task.stands_ns.is_some() {
            level = level.max(Level::Error);
            messages.push(format!("task {} stands", task.name));
        }
    }
    for alarm in &of_node {
        level = level.max(Level::Warning);
        messages.push(format!("{}: {}", alarm.name, alarm.meaning));
    }
    for alarm in &of_process {
        level = level.max(match alarm.severity {
            AlarmSeverity::Info => Level::Ok,
            AlarmSeverity::Warning => Level::Warning,
            AlarmSeverity::Critical => Level::Error,
        });
        messages.push(format!("{}: {}", alarm.name, alarm.text));
    }
    let message = if messages.is_empty() { "OK".into() } else { messages.join("; ") };
    let values: Vec<_> = values.iter().map(|(key, value)| (&**key, value.clone())).collect();
    Ok(status(level, name, &message, hardware, &values))
}
