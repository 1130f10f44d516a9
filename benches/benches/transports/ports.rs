//! This product's ports: what the others are compared with.

use std::fs;
use std::path::{Path, PathBuf};

use isochrone_benches::Failure;
use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{
    Depth, FrameLayout, FramePublisher, FrameSubscriber, Participant, SignalSpec, Stamp, ipc,
    load_config, remove_leftovers,
};

use crate::Listening;
use crate::message::{Wire, room};

/// A folder with an iceoryx2 domain of the bench's own. Drop it after all arms.
pub(crate) struct Home {
    folder: tempfile::TempDir,
}

impl Home {
    pub(crate) fn new() -> Result<Self, Failure> {
        let home = Self { folder: tempfile::tempdir()? };
        let (root, id) = (home.folder.path().join("iceoryx2"), std::process::id());
        let text = format!("[global]\nroot-path = {root:?}\nprefix = \"transports{id}_\"\n");
        fs::write(home.domain_file(), text)?;
        Ok(home)
    }

    pub(crate) fn domain_file(&self) -> PathBuf {
        self.folder.path().join("domain.toml")
    }
}

impl Drop for Home {
    fn drop(&mut self) {
        if let Ok(config) = load_config(Some(&self.domain_file())) {
            // Joining removes what a peer left that was killed.
            drop(Participant::<ipc::Service>::join("isochrone/cleaner", &config));
            remove_leftovers::<ipc::Service>(&config);
        }
    }
}

pub(crate) fn listen(place: &str, values: usize) -> Result<Listening, Failure> {
    let mut ports = Ports::open(place, values, "forth", "back")?;
    Ok(Box::new(move || {
        ports.publisher.prepare();
        ports.subscriber.maintain();
        Ok(Box::new(ports) as Box<dyn Wire>)
    }))
}

pub(crate) fn connect(place: &str, values: usize) -> Result<Box<dyn Wire>, Failure> {
    Ok(Box::new(Ports::open(place, values, "back", "forth")?))
}

struct Ports {
    publisher: FramePublisher<ipc::Service>,
    subscriber: FrameSubscriber<ipc::Service>,
}

impl Ports {
    fn open(place: &str, values: usize, out: &str, back: &str) -> Result<Self, Failure> {
        let config = load_config(Some(Path::new(place)))?;
        let participant = Participant::<ipc::Service>::join("isochrone/transports", &config)?;
        let signal = |i| SignalSpec::new(format!("v{i}"), "");
        let words = room(values).len();
        let layout = FrameLayout { signals: (0..words).map(signal).collect(), period_ns: None };
        let name = |way| format!("transports/{values}/{way}");
        let publisher = FramePublisher::open(&participant, &name(out), &layout)?.plain();
        let subscriber = FrameSubscriber::open(&participant, &name(back), words, Depth::All)?;
        Ok(Self { publisher, subscriber })
    }
}

impl Wire for Ports {
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
