//! A measured chain for people and for programs.

use isochrone_report::Table;
use isochrone_timing::units::{counted, duration};
use isochrone_timing::{HopReport, Summary};
use serde_json::{Value, json};

use super::Measured;
use super::link::Link;

/// The table.
pub(super) fn text(measured: &Measured, nodes: &[String]) -> String {
    let chain = &measured.chain;
    let time = |ns: Option<u64>| ns.map_or_else(|| "-".to_owned(), |ns| duration(ns as f64));
    let latency = |latency: &Summary| {
        let Summary { p50, p90, p99, p99_9, max, .. } = *latency;
        [p50, p90, p99, p99_9, max].map(time)
    };
    let mut table = Table::default();
    table.row([
        "hop", "node", "p50", "p90", "p99", "p99.9", "max", "wait p50", "frames", "lost",
        "repeated", "unknown",
    ]);
    for (hop, node) in chain.hops.iter().zip(nodes) {
        let HopReport { from, to, latency_ns, wait_ns, lost, repeated, unknown, .. } = hop;
        let mut row = vec![format!("{from} -> {to}"), node.clone()];
        row.extend(latency(latency_ns));
        row.push(time(wait_ns.p50));
        row.extend([latency_ns.count, *lost, *repeated, *unknown].map(|count| count.to_string()));
        table.row(row);
    }
    let mut row = vec!["whole way".to_owned(), String::new()];
    row.extend(latency(&chain.latency_ns));
    row.push(String::new());
    row.extend([chain.latency_ns.count, chain.lost].map(|count| count.to_string()));
    table.row(row);
    let time = duration(measured.elapsed.as_nanos() as f64);
    format!("{} measured for {time}\n{}", counted(chain.hops.len(), "hop"), table.draw(0))
}

/// What cannot be known, and why.
pub(super) fn notes(measured: &Measured, links: &[Link<'_>]) -> Vec<String> {
    let mut notes = Vec::new();
    for hop in measured.chain.hops.iter().filter(|hop| hop.unknown > 0) {
        notes.push(format!(
            "note: {} of \"{}\" go back to no frame of \"{}\": the oldest sample behind them came from \
             elsewhere, there is none, or that frame did not reach this program; how long it took cannot be \
             known",
            counted(hop.unknown, "frame"),
            hop.to,
            hop.from
        ));
    }
    for link in links {
        let service = link.service();
        if link.gaps() > 0 {
            notes.push(format!(
                "note: {} of \"{service}\" did not reach this program in time and are missing from the \
                 numbers",
                counted(link.gaps(), "frame")
            ));
        }
        if link.restarts() > 0 {
            notes.push(format!(
                "note: \"{service}\" began anew {} during the measurement",
                counted(link.restarts(), "time")
            ));
        }
        if link.future_stamps() > 0 {
            notes.push(format!(
                "note: {} of \"{service}\" have time stamps in the future, from another clock, and are left \
                 out",
                counted(link.future_stamps(), "frame")
            ));
        }
    }
    notes
}

/// The document of `--json`.
pub(super) fn document(measured: &Measured, links: &[Link<'_>], nodes: &[String]) -> Value {
    let service = |link: &Link<'_>| {
        let announced = link.announced();
        json!({
            "service": link.service(),
            "publisher": announced.map(|announced| &announced.publisher),
            "period_ns": announced.and_then(|announced| announced.layout.period_ns),
            "frames": link.frames(),
            "gaps": link.gaps(),
            "restarts": link.restarts(),
            "future_stamps": link.future_stamps(),
        })
    };
    let hop = |(hop, node): (&HopReport, &String)| {
        let HopReport { from, to, latency_ns, wait_ns, lost, repeated, unknown, histograms } = hop;
        json!({
            "from": from,
            "to": to,
            "node": node,
            "latency_ns": latency_ns,
            "wait_ns": wait_ns,
            "lost": lost,
            "repeated": repeated,
            "unknown": unknown,
            "histograms": histograms,
        })
    };
    json!({
        "elapsed_ns": measured.elapsed.as_nanos() as u64,
        "latency_ns": measured.chain.latency_ns,
        "lost": measured.chain.lost,
        "hops": measured.chain.hops.iter().zip(nodes).map(hop).collect::<Vec<_>>(),
        "services": links.iter().map(service).collect::<Vec<_>>(),
        "ended": measured.end.as_ref().map(ToString::to_string),
        "histograms": measured.chain.histograms,
    })
}
