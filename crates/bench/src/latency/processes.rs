//! The processes that a bench starts, as it sees them.

use std::fs;
use std::fs::File;
use std::io::ErrorKind;
use std::process::Stdio;

use isochrone_processes::{Child, Company};
use isochrone_timing::{Warning, WarningCode};
use serde::Deserialize;

use super::bench_node::BenchNode;
use super::peer::{Reply, Setup, Turn};
use super::turn::SenderCounts;
use crate::BenchError;
use crate::peer_process::{PeerProcess, gone};

/// The peer. It leaves when this is dropped.
pub(super) struct Peer(PeerProcess);

impl Peer {
    /// Starts it; returns when its ends are open, with what it was refused.
    pub(super) fn start(
        company: &Company,
        setup: &Setup,
    ) -> Result<(Self, Vec<Warning>), BenchError> {
        let mut peer = Self(PeerProcess::start(company, "latency-peer", setup)?);
        match peer.reply()? {
            Reply::Ready(warnings) => Ok((peer, warnings)),
            other => Err(unexpected(&other)),
        }
    }

    /// Lets it have a turn.
    pub(super) fn begin(&mut self, turn: &Turn) -> Result<(), BenchError> {
        self.0.order(turn)
    }

    /// Waits for the end of its turn.
    pub(super) fn finish(&mut self) -> Result<SenderCounts, BenchError> {
        match self.reply()? {
            Reply::Done(sent) => Ok(sent),
            other => Err(unexpected(&other)),
        }
    }

    /// Why it ended, if it did and has said so.
    pub(super) fn last_words(&mut self) -> Option<BenchError> {
        self.0.dismiss();
        loop {
            let line = self.0.reply().unwrap_or_default();
            match serde_json::from_str(&line) {
                Ok(Reply::Failed(why)) => return Some(BenchError::Failed(why)),
                _ if line.is_empty() => return None,
                _ => {}
            }
        }
    }

    fn reply(&mut self) -> Result<Reply, BenchError> {
        match serde_json::from_str(&self.0.reply()?) {
            Ok(Reply::Failed(why)) => Err(BenchError::Failed(why)),
            Ok(reply) => Ok(reply),
            Err(_) => Err(gone("without a word")),
        }
    }
}

fn unexpected(reply: &Reply) -> BenchError {
    BenchError::Failed(format!("the peer said {reply:?}, which was not its turn to say"))
}

/// A control node that runs for one turn.
pub(super) struct Node<'a> {
    company: &'a Company,
    name: &'static str,
    process: Child,
}

impl<'a> Node<'a> {
    /// Starts it. It ends by itself after `seconds`, should we be killed.
    pub(super) fn start(
        company: &'a Company,
        node: &BenchNode,
        seconds: f64,
    ) -> Result<Self, BenchError> {
        let name = node.name;
        let file = format!("{name}.toml");
        company.write(&file, &node.to_string())?;
        let log = File::create(company.path(&log_file(name)))
            .map_err(|cause| BenchError::no_file(log_file(name), cause))?;
        let seconds = seconds.to_string();
        let report = report_file(name);
        let arguments = ["run", &file, "--seconds", &seconds, "--report", &report];
        let process = company.start_with(&arguments, |command| {
            command.args(company.in_domain());
            command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(log)
        })?;
        Ok(Self { company, name, process })
    }

    /// What it has said.
    pub(super) fn log(&self) -> String {
        fs::read_to_string(self.company.path(&log_file(self.name))).unwrap_or_default()
    }

    /// Ends it, waits, and returns what the machine refused it.
    pub(super) fn end(mut self) -> Result<Vec<Warning>, BenchError> {
        self.process.finish()?;
        let file = report_file(self.name);
        let refused = match fs::read_to_string(self.company.path(&file)) {
            // It was ended before it ran.
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
            read => read.and_then(|report| Ok(refusals(&report)?)),
        };
        refused.map_err(|error| BenchError::Failed(format!("cannot read {file}: {error}")))
    }
}

/// What a node's report says that the machine refused.
fn refusals(report: &str) -> serde_json::Result<Vec<Warning>> {
    #[derive(Deserialize)]
    struct Warned {
        warnings: Vec<Warning>,
    }
    let Warned { mut warnings } = serde_json::from_str(report)?;
    let is_refusal = |code: &WarningCode| {
        matches!(code, WarningCode::RtDenied | WarningCode::CpuDenied | WarningCode::LockDenied)
    };
    warnings.retain(|warning| is_refusal(&warning.code));
    Ok(warnings)
}

fn report_file(node: &str) -> String {
    format!("{node}.json")
}

fn log_file(node: &str) -> String {
    format!("{node}.log")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_machine_refused_a_node_is_taken_from_its_report() {
        let report = r#"{"warnings": [
            {"code": "debug_build", "message": "a debug build", "remedy": ""},
            {"code": "rt_denied", "message": "no real-time priority 2", "remedy": "setcap"}
        ]}"#;
        let refused = refusals(report).unwrap();
        let codes: Vec<_> = refused.iter().map(|warning| &warning.code).collect();
        assert_eq!(codes, [&WarningCode::RtDenied]);
        assert!(refusals("{}").is_err());
    }
}
