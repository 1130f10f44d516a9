//! The process at the other end: it sends at its own pace, or sends back what it gets.

use std::io::{self, BufRead, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::Receiver;
use std::thread;

use isochrone_cyclic::{Pinning, ThreadRequest, prepare_process};
use isochrone_ipc::{Domain, ForRealTime, Participant};
use isochrone_runtime::{RealTimeThread, warning};
use isochrone_timing::Warning;
use serde::{Deserialize, Serialize};

use super::arm::Arm;
use super::end::{Rendezvous, Side};
use super::pace::Wait;
use super::tending::Tending;
use super::turn::{self, SenderCounts, Span, Terms};
use crate::BenchError;
use crate::peer_process::read_orders;

/// The first line that the peer reads.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Setup {
    pub(super) domain_file: PathBuf,
    pub(super) folder: PathBuf,
    pub(super) prefix: String,
    pub(super) arms: Vec<Arm>,
    pub(super) values: usize,
    pub(super) wait: Wait,
    pub(super) cpu: usize,
    pub(super) priority: Option<u8>,
}

/// Every further line: a turn.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Turn {
    /// Which of the arms.
    pub(super) arm: usize,
    pub(super) span: Span,
    /// Between two messages; `None`: send back what comes.
    pub(super) period_ns: Option<u64>,
}

/// What the peer writes: first that it is ready, then a line for each turn.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Reply {
    Ready(Vec<Warning>),
    Done(SenderCounts),
    Failed(String),
}

/// Does what a bench asks for in `orders`, line by line, and answers in `replies`. Does not return before
/// there are no more orders.
///
/// # Errors
/// No bench gives orders.
pub fn serve(
    orders: impl BufRead + Send + 'static,
    replies: &mut dyn Write,
) -> Result<(), BenchError> {
    let stop = Arc::new(AtomicBool::new(false));
    let lines = read_orders(orders, stop.clone());
    let Ok(setup) = lines.recv() else {
        return Err(BenchError::Usage(
            "latency-peer is started by `isochrone bench latency`".into(),
        ));
    };
    if let Err(error) = take_turns(&setup, &lines, &stop, replies) {
        // Whoever started us tells it; should nobody be there any more, it matters to nobody.
        let _ = reply(replies, &Reply::Failed(error));
    }
    Ok(())
}

fn take_turns(
    setup: &str,
    lines: &Receiver<String>,
    stop: &Arc<AtomicBool>,
    replies: &mut dyn Write,
) -> Result<(), String> {
    let setup: Setup = read(setup)?;
    let mut refusals = prepare_process().refusals;
    let domain = Domain::from_file(&setup.domain_file).map_err(|error| error.to_string())?;
    let participant = Participant::join("isochrone/latency-peer", domain)
        .and_then(Participant::for_real_time)
        .map_err(|error| error.to_string())?;
    thread::scope(|scope| {
        let tending = Tending::start(scope, &participant);
        let place = Rendezvous {
            side: Side::Peer,
            folder: &setup.folder,
            participant: &participant,
            prefix: &setup.prefix,
            values: setup.values,
            wait: setup.wait,
        };
        let open = |arm: &Arm| {
            let opened = arm.transport().open(&place);
            let end = opened.and_then(|opening| opening.try_map(|opening| opening()));
            end.map_err(|error| format!("arm \"{arm}\": {error}"))
        };
        let ends = setup.arms.iter().map(open).collect::<Result<ForRealTime<Vec<_>>, String>>()?;
        let request = ThreadRequest { priority: setup.priority, cpu: Pinning::Named(setup.cpu) };
        let (mut ends, grant) = RealTimeThread::prepare(request, ends);
        refusals.extend(grant.refusals);
        let ready = Reply::Ready(refusals.iter().map(warning).collect());
        reply(replies, &ready).map_err(|_| "nobody listens")?;

        let terms = Terms { values: setup.values, wait: setup.wait };
        while let Ok(line) = lines.recv() {
            let turn: Turn = read(&line)?;
            let (Some(end), Some(arm)) = (ends.get_mut(turn.arm), setup.arms.get(turn.arm)) else {
                return Err(format!("there is no arm {}", turn.arm));
            };
            tending.keep_quiet(&turn.span);
            let sent = match turn.period_ns {
                Some(period_ns) => turn::send_paced(end.as_mut(), &turn.span, period_ns, stop),
                None => turn::echo(end.as_mut(), &turn.span, terms, stop),
            };
            let sent = sent.map_err(|error| format!("arm \"{arm}\", the peer: {error}"))?;
            reply(replies, &Reply::Done(sent)).map_err(|_| "nobody listens")?;
        }
        Ok(())
    })
}

fn read<T: serde::de::DeserializeOwned>(line: &str) -> Result<T, String> {
    serde_json::from_str(line).map_err(|error| format!("a line cannot be read: {error}"))
}

fn reply(replies: &mut dyn Write, reply: &Reply) -> io::Result<()> {
    writeln!(replies, "{}", serde_json::to_string(reply)?)?;
    replies.flush()
}
