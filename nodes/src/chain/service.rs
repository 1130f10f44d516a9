//! One measured service of a chain.

use std::collections::VecDeque;
use std::fmt;
use std::time::Duration;

use isochrone_ipc::{
    Announcement, Flags, Participant, SenderClock, SignalReader, Stamps, ipc, longest_silence_ns,
};
use isochrone_timing::ChainFrame;
use isochrone_timing::units::duration;

use crate::failure::Failure;

/// A service that sent nothing for so long at the end of a measurement has stopped, unless its period allows a
/// [longer silence](longest_silence_ns).
const SILENCE_NS: u64 = 2_000_000_000;

/// A service that is measured.
pub(super) struct MeasuredService<'p> {
    reader: SignalReader<'p, ipc::Service>,
    taken: VecDeque<ChainFrame>,
    frames: u64,
    /// Frames that were sent and did not come here.
    gaps: u64,
    /// How often another publisher took over, or the same one began anew.
    restarts: u64,
    /// Frames with stamps of another clock, which are left out.
    future_stamps: u64,
    /// When the newest frame came.
    heard_ns: Option<u64>,
    has_ended: bool,
}

/// Why a service sends no more.
pub(super) enum End {
    /// Its publisher said so, or has left.
    Left { service: String },
    /// Nothing came for this time, in ns.
    Silent { service: String, for_ns: u64 },
    /// Nothing came at all.
    Never { service: String },
}

impl fmt::Display for End {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Left { service } => write!(
                f,
                "the publisher of \"{service}\" ended during the measurement; the numbers are those until \
                 then"
            ),
            Self::Silent { service, for_ns } => write!(
                f,
                "\"{service}\" has sent nothing for {}: its publisher hangs, is stopped or was killed; \
                 the numbers are those until then",
                duration(*for_ns as f64)
            ),
            Self::Never { service } => write!(
                f,
                "\"{service}\" has sent nothing during the measurement: its publisher hangs, is stopped or \
                 was killed, or its period is longer (--seconds)"
            ),
        }
    }
}

impl<'p> MeasuredService<'p> {
    /// Opens all services of a chain.
    pub(super) fn open_all(
        participant: &'p Participant<ipc::Service>,
        services: &[String],
    ) -> Result<Vec<Self>, Failure> {
        services.iter().map(|service| Self::open(participant, service)).collect()
    }

    fn open(participant: &'p Participant<ipc::Service>, service: &str) -> Result<Self, Failure> {
        let reader = SignalReader::open_existing(participant, service, &[]);
        let Some(reader) = reader.map_err(Failure::found)? else {
            return Err(Failure::nobody(format!("service \"{service}\" has just ended")));
        };
        Ok(Self {
            // Only stamps are measured, so no frame waits for its layout.
            reader: reader.with_patience(Duration::ZERO),
            taken: VecDeque::new(),
            frames: 0,
            gaps: 0,
            restarts: 0,
            future_stamps: 0,
            heard_ns: None,
            has_ended: false,
        })
    }

    pub(super) fn service(&self) -> &str {
        self.reader.service()
    }

    pub(super) fn announced(&self) -> Option<&Announcement> {
        self.reader.announced()
    }

    pub(super) fn is_announced(&self) -> bool {
        self.announced().is_some()
    }

    /// Whether another machine sends it.
    pub(super) fn is_foreign(&self) -> bool {
        self.announced().is_some_and(|announced| announced.clock() == SenderClock::Foreign)
    }

    /// Drops what waits: the measurement begins.
    pub(super) fn discard(&mut self) {
        self.receive();
        self.taken.clear();
        (self.frames, self.gaps, self.restarts) = (0, 0, 0);
        (self.future_stamps, self.heard_ns) = (0, None);
    }

    /// How long frames may lie there, in ns.
    pub(super) fn longest_nap_ns(&self) -> u64 {
        self.reader.subscriber().longest_nap_ns()
    }

    /// Takes the frames that wait.
    pub(super) fn receive(&mut self) {
        while let Some(frame) = self.reader.next_frame() {
            let (header, receipt) = (frame.header(), frame.receipt());
            self.heard_ns = Some(receipt.received_ns);
            self.has_ended = frame.flags().contains(Flags::STOPPED);
            self.frames += 1;
            self.gaps += receipt.lost;
            self.restarts += receipt.restarts;
            if receipt.stamps != Stamps::Believed {
                self.future_stamps += 1;
                continue;
            }
            self.taken.push_back(ChainFrame {
                release_ns: header.release_ns,
                publish_ns: header.publish_ns,
                source_ns: header.source_ns,
            });
        }
    }

    /// The frames that were taken since the last time and sent until an instant.
    pub(super) fn taken(&mut self, until_ns: u64) -> impl Iterator<Item = ChainFrame> {
        let later = self.taken.iter().position(|frame| frame.publish_ns > until_ns);
        self.taken.drain(..later.unwrap_or(self.taken.len()))
    }

    /// Whether its publisher has ended.
    pub(super) fn ended(&self) -> Option<End> {
        let has_left = self.has_ended || self.reader.subscriber().publishers() == 0;
        has_left.then(|| End::Left { service: self.service().to_owned() })
    }

    /// Whether it has sent nothing for long, in a measurement that began at an instant.
    pub(super) fn silence(&self, begin_ns: u64, now_ns: u64) -> Option<End> {
        let service = self.service().to_owned();
        let period_ns = self.announced().and_then(|announced| announced.layout.period_ns);
        let longest_ns = longest_silence_ns(period_ns.unwrap_or_default()).max(SILENCE_NS);
        let for_ns = now_ns.saturating_sub(self.heard_ns.unwrap_or(begin_ns));
        if for_ns < longest_ns {
            return None;
        }
        Some(match self.heard_ns {
            Some(_) => End::Silent { service, for_ns },
            None => End::Never { service },
        })
    }

    pub(super) fn frames(&self) -> u64 {
        self.frames
    }

    pub(super) fn future_stamps(&self) -> u64 {
        self.future_stamps
    }

    /// Frames that were sent and did not come here.
    pub(super) fn gaps(&self) -> u64 {
        self.gaps
    }

    /// How often another publisher took over, or the same one began anew.
    pub(super) fn restarts(&self) -> u64 {
        self.restarts
    }
}
