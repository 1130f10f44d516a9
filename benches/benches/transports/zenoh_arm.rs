//! zenoh: two peers over TCP that find each other by address, publisher and subscriber each way.

use std::thread;
use std::time::{Duration, Instant};

use isochrone_benches::Failure;
use zenoh::handlers::FifoChannelHandler;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::CongestionControl;
use zenoh::sample::Sample;
use zenoh::{Config, Session, Wait};

use crate::Listening;
use crate::message::{Wire, from_bytes, to_bytes};

/// How long two peers may take to know of each other.
const PATIENCE: Duration = Duration::from_secs(10);
const LOOK_INTERVAL: Duration = Duration::from_millis(5);

pub(crate) fn listen(place: &str) -> Result<Listening, Failure> {
    let peer = Peer::open("listen", place, "isochrone/forth", "isochrone/back")?;
    Ok(Box::new(move || {
        peer.await_reader()?;
        Ok(Box::new(peer) as Box<dyn Wire>)
    }))
}

pub(crate) fn connect(place: &str) -> Result<Box<dyn Wire>, Failure> {
    let peer = Peer::open("connect", place, "isochrone/back", "isochrone/forth")?;
    peer.await_reader()?;
    Ok(Box::new(peer))
}

struct Peer {
    publisher: Publisher<'static>,
    subscriber: Subscriber<FifoChannelHandler<Sample>>,
    // Closed when dropped.
    _session: Session,
}

impl Peer {
    fn open(
        role: &str,
        place: &str,
        out: &'static str,
        back: &'static str,
    ) -> Result<Self, Failure> {
        let mut config = Config::default();
        config.insert_json5("mode", "\"peer\"")?;
        // Nobody else on the network shall take part.
        config.insert_json5("scouting/multicast/enabled", "false")?;
        config.insert_json5("scouting/gossip/enabled", "false")?;
        if role == "connect" {
            config.insert_json5("listen/endpoints", "[]")?;
        }
        config.insert_json5(&format!("{role}/endpoints"), &format!("[\"tcp/{place}\"]"))?;
        let session = zenoh::open(config).wait()?;
        let subscriber = session.declare_subscriber(back).wait()?;
        let publisher = session
            .declare_publisher(out)
            .congestion_control(CongestionControl::Block)
            // Sent at once instead of in a batch.
            .express(true)
            .wait()?;
        Ok(Self { publisher, subscriber, _session: session })
    }

    /// What is sent before the other end is known is lost.
    fn await_reader(&self) -> Result<(), Failure> {
        let since = Instant::now();
        while !self.publisher.matching_status().wait()?.matching() {
            if since.elapsed() > PATIENCE {
                return Err("the two zenoh peers do not find each other".into());
            }
            thread::sleep(LOOK_INTERVAL);
        }
        Ok(())
    }
}

impl Wire for Peer {
    fn send(&mut self, words: &[u64]) -> Result<(), Failure> {
        self.publisher.put(to_bytes(words)).wait()
    }

    fn receive(&mut self, words: &mut [u64]) -> Result<(), Failure> {
        let sample = self.subscriber.recv()?;
        from_bytes(&sample.payload().to_bytes(), words)
    }
}
