//! This product's ports: what the others are compared with.

use std::path::Path;

use isochrone_benches::Failure;
use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{
    Depth, Domain, ForRealTime, FrameLayout, FramePublisher, FrameSubscriber, InRealTime,
    Participant, SignalSpec, Stamp, ipc,
};

use crate::Listening;
use crate::message::{Wire, room};

pub(crate) fn listen(place: &str, values: usize) -> Result<Listening, Failure> {
    let mut ports = Ports::open(place, values, "forth", "back")?.enter();
    Ok(Box::new(move || {
        ports.publisher.prepare();
        ports.subscriber.maintain();
        Ok(Box::new(ports) as Box<dyn Wire>)
    }))
}

pub(crate) fn connect(place: &str, values: usize) -> Result<Box<dyn Wire>, Failure> {
    Ok(Box::new(Ports::open(place, values, "back", "forth")?.enter()))
}

struct Ports {
    publisher: FramePublisher<ipc::Service>,
    subscriber: FrameSubscriber<ipc::Service>,
}

impl Ports {
    fn open(
        place: &str,
        values: usize,
        out: &str,
        back: &str,
    ) -> Result<ForRealTime<Self>, Failure> {
        let domain = Domain::from_file(Path::new(place))?;
        let participant = Participant::join("isochrone/transports", domain)?.for_real_time()?;
        let signal = |i| SignalSpec::new(format!("v{i}"), "");
        let words = room(values).len();
        let layout = FrameLayout { signals: (0..words).map(signal).collect(), period_ns: None };
        let name = |way| format!("transports/{values}/{way}");
        let publisher = participant.publisher(&name(out), &layout)?;
        let subscriber = participant.subscriber(&name(back), words, Depth::All)?;
        let ports = publisher.and(subscriber);
        Ok(ports.map(|(publisher, subscriber)| Self { publisher: publisher.plain(), subscriber }))
    }
}

impl Wire for InRealTime<Ports> {
    fn send(&mut self, words: &[u64]) -> Result<(), Failure> {
        if let Some(values) = self.publisher.values_mut() {
            values.iter_mut().zip(words).for_each(|(value, word)| *value = f64::from_bits(*word));
        }
        let sent = self.publisher.send(Stamp::default(), || Monotonic.now_ns());
        self.publisher.prepare();
        if sent { Ok(()) } else { Err("a frame was not sent".into()) }
    }

    fn receive(&mut self, words: &mut [u64]) -> Result<(), Failure> {
        let now_ns = Monotonic.now_ns();
        loop {
            if let Some(frame) = self.subscriber.next(now_ns) {
                let values = frame.values().iter();
                words.iter_mut().zip(values).for_each(|(word, value)| *word = value.to_bits());
                return Ok(());
            }
        }
    }
}
