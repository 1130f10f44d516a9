//! Services that another machine writes through a link.

use std::thread;
use std::time::{Duration, Instant};

use iceoryx2::identifiers::UniqueNodeId;

use crate::frames::service::{self, holders};
use crate::frames::writers::each;
use crate::{
    Depth, Flags, FrameSubscriber, LayoutWatcher, OpenError, Participant, SenderClock, Service,
};

/// For how long the frames of another machine are looked for: its writer announces their layout every 500 ms.
const LOOK: Duration = Duration::from_millis(750);
const INTERVAL: Duration = Duration::from_millis(2);

impl<S: Service> Participant<S> {
    /// Makes sure that no other machine writes one of the services, as far as a link brings its frames here.
    ///
    /// Where no link has one of them, this takes some milliseconds; where one has, it listens for 750 ms. Call it
    /// before a publisher is opened, which itself only looks at this machine.
    ///
    /// # Errors
    /// Another machine writes one of them, or one cannot be opened.
    pub fn refuse_far_writers(&self, services: &[&str]) -> Result<(), OpenError> {
        let mut watched = Vec::new();
        for service in services {
            watched.extend(Watched::open(self, service)?);
        }
        let began = Instant::now();
        let is_open = |watched: &[Watched<S>]| watched.iter().any(|service| !service.is_clear());
        while is_open(&watched) && began.elapsed() < LOOK {
            thread::sleep(INTERVAL);
            watched.iter_mut().for_each(|service| service.look(self));
        }
        watched.into_iter().find_map(Watched::refusal).map_or(Ok(()), Err)
    }
}

/// A service that a link has.
struct Watched<S: Service> {
    service: String,
    frames: FrameSubscriber<S>,
    layouts: LayoutWatcher<S>,
    /// The link whose last frame was not that of a writer that ends.
    through: Option<UniqueNodeId>,
}

impl<S: Service> Watched<S> {
    fn open(participant: &Participant<S>, service: &str) -> Result<Option<Self>, OpenError> {
        let Some(opened) = service::open_existing(participant, service)? else { return Ok(None) };
        let mut has_link = false;
        each(&opened, |writer| has_link |= writer.link.is_some());
        let frames = has_link
            .then(|| FrameSubscriber::open_existing(participant, service, Depth::Newest))
            .transpose()?
            .flatten();
        let Some(frames) = frames else { return Ok(None) };
        let layouts = LayoutWatcher::open(participant, service)?;
        Ok(Some(Self { service: service.to_owned(), frames, layouts, through: None }))
    }

    fn look(&mut self, participant: &Participant<S>) {
        self.layouts.look(participant);
        while let Some((writer, header)) = self.frames.next_of_any() {
            let mut link = None;
            each(self.frames.service(), |found| {
                link = link.or(found.link.filter(|_| found.id == writer));
            });
            if link.is_some() {
                self.through = link.filter(|_| !header.flags().contains(Flags::STOPPED));
            }
        }
    }

    /// Whether all is known that the refusal says.
    fn is_clear(&self) -> bool {
        self.through.is_some() && self.layouts.newest().is_some()
    }

    fn refusal(self) -> Option<OpenError> {
        let announced = self.layouts.newest();
        let is_foreign = announced.is_some_and(|known| known.clock() == SenderClock::Foreign);
        if self.through.is_none() && !is_foreign {
            return None;
        }
        let opened = self.frames.service();
        let mut link = self.through;
        each(opened, |writer| link = link.or(writer.link));
        Some(OpenError::FarWriter {
            service: self.service,
            publisher: announced.map(|known| known.publisher.clone()).unwrap_or_default(),
            through: link.map(|node| holders::node(&**opened, node)).unwrap_or_default(),
        })
    }
}
