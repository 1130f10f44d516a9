//! Services that are written on both machines.

use std::time::{Duration, Instant};

use isochrone_ipc::{LayoutWatcher, Participant, SenderClock, ipc};

use crate::failure::Failure;
use crate::terminal;

/// Layouts are announced every 500 ms; a writer without an announcement for this long has ended.
const HEARD: Duration = Duration::from_secs(2);

/// Who announces the layout of one service.
///
/// Nobody refuses a writer here whose service is written over there, if the link was not there or not
/// connected when it started.
pub(super) struct Writers {
    service: String,
    layouts: LayoutWatcher<ipc::Service>,
    near: Option<Writer>,
    far: Option<Writer>,
    is_told: bool,
}

struct Writer {
    name: String,
    heard: Instant,
}

impl Writers {
    pub(super) fn open(
        participant: &Participant<ipc::Service>,
        service: &str,
    ) -> Result<Self, Failure> {
        let layouts = LayoutWatcher::open(participant, service).map_err(Failure::found)?;
        let service = service.to_owned();
        Ok(Self { service, layouts, near: None, far: None, is_told: false })
    }

    /// Says when both machines write the service, and when that is over.
    pub(super) fn look(&mut self, participant: &Participant<ipc::Service>) {
        let (near, far) = (&mut self.near, &mut self.far);
        self.layouts.hear(participant, |announced| {
            let writer = Writer { name: announced.publisher.clone(), heard: Instant::now() };
            match announced.clock() {
                SenderClock::Shared => *near = Some(writer),
                SenderClock::Foreign => *far = Some(writer),
            }
        });
        let service = &self.service;
        let heard = |writer: &&Writer| writer.heard.elapsed() < HEARD;
        match (self.near.as_ref().filter(heard), self.far.as_ref().filter(heard)) {
            (Some(near), Some(far)) if !self.is_told => {
                self.is_told = true;
                terminal::note(&format!(
                    "warning: service \"{service}\" is written on both machines, by \"{}\" here and by \"{}\" \
                     there; the readers of each keep to their own. End one, or have it write another service",
                    near.name, far.name
                ));
            }
            (None, _) | (_, None) if self.is_told => {
                self.is_told = false;
                terminal::note(&format!("service \"{service}\" has one writer again"));
            }
            _ => {}
        }
    }
}
