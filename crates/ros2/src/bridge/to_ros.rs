//! The thread that sends frames as messages.

use std::sync::Arc;

use isochrone_cyclic::{Clock, Monotonic, PromptWakeUps};
use isochrone_ipc::{Domain, Participant, Service, SignalFrame, SignalReader, Stamps, ipc};
use isochrone_processes::Stop;
use isochrone_recording::message::{Definitions, MessageType};

use super::clocks::read_clocks;
use super::counts::{Count, LinkCounts};
use super::each_signal::EachSignal;
use super::one_message::OneMessage;
use super::outlet::Outlet;
use super::quality::Worth;
use super::rate_limit::RateLimit;
use super::silence::Listener;
use crate::config::ToRos;
use crate::dds::Dds;
use crate::failure::Failure;

/// How late a stop is noticed at most, in ns.
const LOOK_NS: u64 = 20_000_000;

/// What a service's frames become.
enum Sending<'d> {
    One(Box<OneMessage<'d>>),
    Each(Box<EachSignal<'d>>),
}

/// A service and where its frames go.
struct Link<'p, 'd> {
    reader: SignalReader<'p, ipc::Service>,
    listener: Listener,
    limit: RateLimit,
    sending: Sending<'d>,
    quality: Option<Outlet<'d>>,
    status: Arc<MessageType>,
    counts: Arc<LinkCounts>,
}

/// Sends frames as messages until it is to stop.
pub(crate) fn to_ros(
    domain: &Domain,
    dds: &Dds,
    links: &[(ToRos, Arc<LinkCounts>)],
    definitions: &Definitions,
    stop: &Stop,
) -> Result<(), Failure> {
    let participant = Participant::join("isochrone-ros2/to_ros", domain).map_err(Failure::found)?;
    let open = |(link, counts)| open(&participant, dds, link, counts, definitions);
    let mut links: Vec<_> =
        links.iter().map(|(link, counts)| open((link, counts))).collect::<Result<_, _>>()?;
    let _prompt = PromptWakeUps::in_this_thread();
    while !stop.is_due() {
        let mut look_ns = Monotonic.now_ns() + LOOK_NS;
        for link in &mut links {
            link.send_all();
            look_ns = look_ns.min(link.reader.next_look_ns());
        }
        Monotonic.sleep_until_ns(look_ns);
    }
    Ok(())
}

fn open<'p, 'd>(
    participant: &'p Participant<ipc::Service>,
    dds: &'d Dds,
    link: &ToRos,
    counts: &Arc<LinkCounts>,
    definitions: &Definitions,
) -> Result<Link<'p, 'd>, Failure> {
    let signals = link.message.as_ref().map(|outgoing| &outgoing.signals[..]).unwrap_or_default();
    let names: Vec<&str> = signals.iter().map(String::as_str).collect();
    let reader = SignalReader::open(participant, &link.service, &names).map_err(Failure::found)?;
    let find = |name| definitions.find(name).map_err(Failure::found);
    let sending = match &link.message {
        Some(outgoing) => Sending::One(Box::new(OneMessage::open(dds, link, outgoing)?)),
        None => Sending::Each(Box::new(EachSignal::new(dds, link, find("std_msgs/Float64")?))),
    };
    let status = find("diagnostic_msgs/DiagnosticStatus")?;
    let outlet =
        |topic: &String| Outlet::open(dds, topic, status.dds_name(), link.quality_of_service);
    let quality = link.quality.as_ref().map(outlet).transpose()?;
    let (limit, counts) = (RateLimit::new(link.interval_ns()), counts.clone());
    let listener = Listener::new(Monotonic.now_ns());
    Ok(Link { reader, listener, limit, sending, quality, status, counts })
}

impl Link<'_, '_> {
    /// Sends the frames that came.
    fn send_all(&mut self) {
        let Self { reader, listener, limit, sending, quality, status, counts } = self;
        let service = reader.service().to_owned();
        while let Some(frame) = reader.next_frame() {
            listener.hear(frame.receipt().received_ns);
            let lost = frame.lost();
            counts.dropped(Count::Lost, lost, || {
                format!("frames were lost before the bridge received them, {lost} at first")
            });
            if !limit.takes(frame.receipt().due_ns()) {
                continue;
            }
            let source_ns = source_ns(&frame);
            match sending {
                Sending::One(one) => one.take(&frame, read_clocks().unix_ns(source_ns), counts),
                Sending::Each(each) => each.take(&frame, counts),
            }
            if let Some(quality) = quality {
                let age_ns = Monotonic.now_ns().checked_sub(source_ns);
                let worth = Worth {
                    service: &service,
                    flags: frame.flags(),
                    age_s: age_ns.map(|age_ns| age_ns as f64 / 1e9),
                    sequence: frame.sequence(),
                    lost: frame.lost(),
                };
                let body = worth.encode(status).map_err(|error| error.to_string());
                if let Err(why) = body.and_then(|body| quality.send(body)) {
                    let what = || format!("a message is not sent on {}: {why}", quality.topic());
                    counts.dropped(Count::Unsent, 1, what);
                }
            }
        }
        let period_ns = reader.announced().and_then(|announced| announced.layout.period_ns);
        let publishers = || reader.subscriber().publishers();
        if let Some(hearing) = listener.look(Monotonic.now_ns(), period_ns, publishers) {
            counts.hears(hearing);
        }
    }
}

/// When what the frame says was so: on this machine's clock.
fn source_ns<S: Service>(frame: &SignalFrame<'_, S>) -> u64 {
    let receipt = frame.receipt();
    match (receipt.stamps, frame.header().source_ns) {
        (Stamps::Believed, 0) => frame.header().publish_ns,
        (Stamps::Believed, source_ns) => source_ns.min(receipt.received_ns),
        _ => receipt.received_ns,
    }
}
