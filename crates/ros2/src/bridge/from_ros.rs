//! The thread that publishes messages as frames.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{
    Domain, FrameLayout, FramePublisher, LayoutAnnouncer, Participant, Stamp, ipc,
};
use isochrone_model::Flags;
use isochrone_processes::Stop;
use rustdds::GUID;
use rustdds::mio1::{Events, Poll, Token};

use super::clocks::{monotonic_ns, read_clocks};
use super::counts::{Count, Hearing, LinkCounts};
use super::gap::Gap;
use crate::config::FromRos;
use crate::dds::{Body, Dds, Reader, Received, Sender};
use crate::failure::Failure;
use crate::mapping::{Incoming, Misfit};
use crate::names::dds_topic;

/// Between two looks for readers of the frames, and for a stop.
const TEND_INTERVAL: Duration = Duration::from_millis(20);
/// Most publishers of a topic whose messages are counted.
const MOST_PUBLISHERS: usize = 1024;

/// A topic and the service that its messages go to.
struct Link {
    reader: Reader,
    incoming: Incoming,
    publisher: FramePublisher<ipc::Service>,
    announcer: LayoutAnnouncer<ipc::Service>,
    gap: Gap,
    /// The last values, and when they were so.
    last: Option<(Vec<f64>, u64)>,
    frames: u64,
    /// The number of each publisher's last message.
    numbers: HashMap<GUID, i64>,
    counts: Arc<LinkCounts>,
}

/// Publishes messages as frames until it is to stop.
pub(crate) fn from_ros(
    domain: &Domain,
    takes_over: bool,
    dds: &Dds,
    links: &[(FromRos, Arc<LinkCounts>)],
    stop: &Stop,
) -> Result<(), Failure> {
    let participant =
        Participant::join("isochrone-ros2/from_ros", domain).map_err(Failure::found)?;
    let participant = participant.taking_over(takes_over);
    let services: Vec<&str> = links.iter().map(|(link, _)| &*link.service).collect();
    participant.refuse_far_writers(&services).map_err(Failure::found)?;
    let open = |(link, counts): &(FromRos, Arc<LinkCounts>)| {
        Link::open(&participant, dds, link, counts.clone())
    };
    let mut links: Vec<Link> = links.iter().map(open).collect::<Result<_, _>>()?;
    let cannot = |cause| Failure::found(format!("cannot wait for messages: {cause}"));
    let mut poll = Poll::new().map_err(cannot)?;
    for (index, link) in links.iter_mut().enumerate() {
        link.reader.register(poll.registry(), Token(index)).map_err(cannot)?;
    }
    let mut events = Events::with_capacity(links.len().max(1));
    let mut tend_ns = 0;
    while !stop.is_due() {
        for link in &mut links {
            link.publish_all();
        }
        let now_ns = Monotonic.now_ns();
        if now_ns >= tend_ns {
            participant.tend();
            for link in &mut links {
                link.announcer.tend(&participant);
                link.publisher.maintain();
            }
            tend_ns = now_ns + TEND_INTERVAL.as_nanos() as u64;
        }
        let gaps = links.iter().filter_map(|link| link.gap.due_ns());
        let until_ns = gaps.min().unwrap_or(tend_ns).min(tend_ns);
        let wait = Duration::from_nanos(until_ns.saturating_sub(now_ns));
        if let Err(cause) = poll.poll(&mut events, Some(wait))
            && cause.kind() != std::io::ErrorKind::Interrupted
        {
            return Err(cannot(cause));
        }
    }
    for link in &mut links {
        link.end();
    }
    Ok(())
}

impl Link {
    fn open(
        participant: &Participant<ipc::Service>,
        dds: &Dds,
        link: &FromRos,
        counts: Arc<LinkCounts>,
    ) -> Result<Self, Failure> {
        let layout = FrameLayout { signals: link.message.signals.clone(), period_ns: None };
        let (service, incoming) = (&*link.service, link.message.clone());
        let publisher =
            FramePublisher::open(participant, service, &layout).map_err(Failure::found)?;
        let announcer = LayoutAnnouncer::open(participant, service, "isochrone-ros2", &layout);
        let announcer = announcer.map_err(Failure::found)?;
        let type_name = incoming.message.dds_name();
        let reader = dds.reader(&dds_topic(&link.topic), &type_name, link.quality_of_service)?;
        let gap = Gap::new(link.max_gap.map(|longest| longest.as_nanos() as u64));
        let (last, frames, numbers) = (None, 0, HashMap::new());
        Ok(Self { reader, incoming, publisher, announcer, gap, last, frames, numbers, counts })
    }

    /// Publishes the messages that came, or that none came.
    fn publish_all(&mut self) {
        while let Some(received) = self.reader.next() {
            match received {
                Received::Message(body, sender) => self.publish(&body, &sender),
                Received::Unreadable(why) => {
                    let what = || format!("a message is dropped: {why}");
                    self.counts.dropped(Count::Misfit, 1, what);
                }
                Received::OtherType(other) => {
                    self.counts.add(Count::Misfit, 1);
                    let expected = self.incoming.message.dds_name();
                    tracing::warn!(
                        "{}: messages of a publisher of {other} are dropped, as {expected} is expected",
                        self.counts.name
                    );
                }
                Received::OtherTypeAgain => drop(self.counts.add(Count::Misfit, 1)),
            }
        }
        if self.gap.begins(Monotonic.now_ns()) {
            if self.counts.add(Count::Gaps, 1) {
                tracing::warn!("{}: no message for longer than max_gap", self.counts.name);
            }
            self.counts.hears(Hearing::Silence);
            self.send_last(Flags::STALE);
        }
    }

    /// Counts the messages that are missing before this one.
    fn count_lost(&mut self, sender: &Sender) {
        if self.numbers.len() >= MOST_PUBLISHERS {
            self.numbers.clear();
        }
        let number = i64::from(sender.sequence);
        if let Some(before) = self.numbers.insert(sender.writer, number) {
            let lost = u64::try_from(number.saturating_sub(before).saturating_sub(1));
            let lost = lost.unwrap_or_default();
            self.counts.dropped(Count::Lost, lost, || {
                format!("messages were lost before the bridge received them, {lost} at first")
            });
        }
    }

    fn publish(&mut self, body: &Body, sender: &Sender) {
        self.count_lost(sender);
        let read = match self.incoming.read(&body.bytes, body.order) {
            Ok(read) => read,
            Err(misfit) => {
                let count = match misfit {
                    Misfit::NotANumber(_) => Count::NotANumber,
                    _ => Count::Misfit,
                };
                return self.counts.dropped(count, 1, || format!("a message is dropped: {misfit}"));
            }
        };
        let now = read_clocks();
        self.gap.message(now.monotonic_ns);
        self.counts.hears(Hearing::Well);
        let stamped_ns = read.stamp_unix_ns.and_then(|unix_ns| monotonic_ns(now, unix_ns));
        if read.stamp_unix_ns.is_some() && stamped_ns.is_none() && self.counts.add(Count::Stamps, 1)
        {
            tracing::warn!(
                "{}: time stamps in messages are not used: they lie in the future, or before this machine started",
                self.counts.name
            );
        }
        let sent_ns = sender.sent_unix_ns.and_then(|unix_ns| monotonic_ns(now, unix_ns));
        let source_ns = stamped_ns.or(sent_ns).unwrap_or(now.monotonic_ns);
        self.last = Some((read.values, source_ns));
        self.send_last(Flags::NONE);
    }

    /// Publishes the last values with these flags, if there are any.
    fn send_last(&mut self, flags: Flags) {
        let Some((values, source_ns)) = &self.last else { return };
        self.publisher.prepare();
        if let Some(channels) = self.publisher.values_mut() {
            channels.copy_from_slice(values);
        }
        let stamp = Stamp { cycle: self.frames, source_ns: *source_ns, flags, ..Stamp::default() };
        let is_sent = self.publisher.send(stamp, || Monotonic.now_ns());
        self.frames += 1;
        self.publisher.prepare();
        let counted = flags.contains(Flags::STALE) || flags.contains(Flags::STOPPED);
        if !is_sent {
            let what = || "a frame is not sent: the service takes none now".to_owned();
            self.counts.dropped(Count::Unsent, 1, what);
        } else if !counted {
            self.counts.add(Count::Sent, 1);
        }
    }

    /// Says that nothing more comes.
    fn end(&mut self) {
        self.send_last(Flags::STOPPED);
    }
}
