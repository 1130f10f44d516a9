//! A measured chain as text and as JSON.

use std::collections::BTreeMap;
use std::time::Duration;

use isochrone_report::Table;
use isochrone_timing::units::{counted, duration};
use isochrone_timing::{ChainReport, HopReport, Summary};
use serde::Serialize;

use super::service::{End, MeasuredService};

/// The measurement.
pub(super) struct Measured {
    pub(super) chain: ChainReport,
    pub(super) elapsed: Duration,
    pub(super) end: Option<End>,
}

/// The table.
pub(super) fn text(measured: &Measured, nodes: &[String]) -> String {
    let chain = &measured.chain;
    let mut table = Table::default();
    table.row([
        "hop", "node", "p50", "p90", "p99", "p99.9", "max", "wait p50", "frames", "lost",
        "repeated", "unknown",
    ]);
    for hop in HopRow::all(chain, nodes) {
        table.row(hop.cells());
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
pub(super) fn notes(measured: &Measured, measured_services: &[MeasuredService<'_>]) -> Vec<String> {
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
    for measured_service in measured_services {
        let service = measured_service.service();
        if measured_service.gaps() > 0 {
            notes.push(format!(
                "note: {} of \"{service}\" did not reach this program in time and are missing from the \
                 numbers",
                counted(measured_service.gaps(), "frame")
            ));
        }
        if measured_service.restarts() > 0 {
            notes.push(format!(
                "note: \"{service}\" began anew {} during the measurement",
                counted(measured_service.restarts(), "time")
            ));
        }
        if measured_service.future_stamps() > 0 {
            notes.push(format!(
                "note: {} of \"{service}\" have time stamps in the future, from another clock, and are left \
                 out",
                counted(measured_service.future_stamps(), "frame")
            ));
        }
    }
    notes
}

/// The document of `--json`.
#[derive(Serialize)]
pub(super) struct Document<'a> {
    elapsed_ns: u64,
    latency_ns: &'a Summary,
    lost: u64,
    hops: Vec<HopRow<'a>>,
    services: Vec<ServiceRow<'a>>,
    ended: Option<String>,
    histograms: &'a BTreeMap<String, String>,
}

impl<'a> Document<'a> {
    pub(super) fn of(
        measured: &'a Measured,
        measured_services: &'a [MeasuredService<'_>],
        nodes: &'a [String],
    ) -> Self {
        let chain = &measured.chain;
        Self {
            elapsed_ns: measured.elapsed.as_nanos() as u64,
            latency_ns: &chain.latency_ns,
            lost: chain.lost,
            hops: HopRow::all(chain, nodes).collect(),
            services: measured_services.iter().map(ServiceRow::of).collect(),
            ended: measured.end.as_ref().map(ToString::to_string),
            histograms: &chain.histograms,
        }
    }
}

/// A hop, and the node that makes it.
#[derive(Serialize)]
struct HopRow<'a> {
    from: &'a str,
    to: &'a str,
    node: &'a str,
    latency_ns: &'a Summary,
    wait_ns: &'a Summary,
    lost: u64,
    repeated: u64,
    unknown: u64,
    histograms: &'a BTreeMap<String, String>,
}

impl<'a> HopRow<'a> {
    fn all(chain: &'a ChainReport, nodes: &'a [String]) -> impl Iterator<Item = Self> {
        chain.hops.iter().zip(nodes).map(|(hop, node)| {
            let HopReport { from, to, latency_ns, wait_ns, histograms, .. } = hop;
            let (lost, repeated, unknown) = (hop.lost, hop.repeated, hop.unknown);
            Self { from, to, node, latency_ns, wait_ns, lost, repeated, unknown, histograms }
        })
    }

    fn cells(&self) -> Vec<String> {
        let mut cells = vec![format!("{} -> {}", self.from, self.to), self.node.to_owned()];
        cells.extend(latency(self.latency_ns));
        cells.push(time(self.wait_ns.p50));
        let counts = [self.latency_ns.count, self.lost, self.repeated, self.unknown];
        cells.extend(counts.map(|count| count.to_string()));
        cells
    }
}

/// A service of the chain, as it was read.
#[derive(Serialize)]
struct ServiceRow<'a> {
    service: &'a str,
    publisher: Option<&'a str>,
    period_ns: Option<u64>,
    frames: u64,
    gaps: u64,
    restarts: u64,
    future_stamps: u64,
}

impl<'a> ServiceRow<'a> {
    fn of(service: &'a MeasuredService<'_>) -> Self {
        let announced = service.announced();
        Self {
            service: service.service(),
            publisher: announced.map(|announced| announced.publisher.as_str()),
            period_ns: announced.and_then(|announced| announced.layout.period_ns),
            frames: service.frames(),
            gaps: service.gaps(),
            restarts: service.restarts(),
            future_stamps: service.future_stamps(),
        }
    }
}

fn time(ns: Option<u64>) -> String {
    ns.map_or_else(|| "-".to_owned(), |ns| duration(ns as f64))
}

fn latency(latency: &Summary) -> [String; 5] {
    let Summary { p50, p90, p99, p99_9, max, .. } = *latency;
    [p50, p90, p99, p99_9, max].map(time)
}
