//! Bindings of inputs to channels of frames: resolved by name in the ordinary thread, used by index in the
//! cycle. Bindings reach the cycle through a wait-free ring, and return through another when they are replaced, so
//! that the cycle frees nothing.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use isochrone_engine::config::Binding;
use isochrone_ipc::{FrameLayout, LayoutConflict, SenderClock};
use rtrb::{Consumer, Producer, RingBuffer};

use super::freshness::Missing;

/// More than are ever under way, as the ordinary thread sends one at a time.
const ROOM: usize = 4;

/// What an input reads.
#[derive(Debug, Clone)]
pub(crate) struct WantedSignal {
    /// Where the value is.
    pub(crate) binding: Binding,
    /// Its type.
    pub(crate) value_type: String,
    /// Its unit, if the configuration gives one; else empty.
    pub(crate) unit: String,
}

/// Why an input takes no sample of the frames of a layout.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Unfit {
    /// They have no such signal, or one of another type.
    Layout(LayoutConflict),
    /// They have it in another unit than the input.
    Unit {
        /// The input's.
        wanted: String,
        /// The announced one.
        announced: String,
    },
}

impl Unfit {
    /// The same, for the cycle.
    pub(crate) fn missing(&self) -> Missing {
        match self {
            Self::Layout(_) => Missing::Signal,
            Self::Unit { .. } => Missing::Unit,
        }
    }
}

impl std::fmt::Display for Unfit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Layout(conflict) => conflict.fmt(f),
            Self::Unit { wanted, announced } => {
                let (announced, wanted) = (quoted_unit(announced), quoted_unit(wanted));
                write!(f, "its unit is {announced}, {wanted} is needed")
            }
        }
    }
}

/// A unit in quotes; where it has characters that look like others, such as the two of µ, with their codes.
pub(crate) fn quoted_unit(unit: &str) -> String {
    let odd = unit.chars().filter(|c| !c.is_ascii());
    let codes: Vec<String> = odd.map(|c| format!("U+{:04X}", u32::from(c))).collect();
    if codes.is_empty() {
        format!("\"{unit}\"")
    } else {
        format!("\"{unit}\" ({})", codes.join(" "))
    }
}

impl WantedSignal {
    /// The index of the channel in frames of a layout.
    pub(crate) fn place(&self, layout: &FrameLayout) -> Result<usize, Unfit> {
        let channel = match &self.binding {
            Binding::Channel(channel) => *channel,
            Binding::Signal(name) => layout.find(name).map_err(Unfit::Layout)?,
        };
        layout.check_channel(channel, &self.value_type).map_err(Unfit::Layout)?;
        match layout.unit(channel) {
            announced if self.unit.is_empty() || announced.is_empty() || announced == self.unit => {
                Ok(channel)
            }
            announced => {
                Err(Unfit::Unit { wanted: self.unit.clone(), announced: announced.to_owned() })
            }
        }
    }
}

/// Where the inputs are in frames of one layout.
#[derive(Debug)]
pub(crate) struct Bindings {
    pub(crate) layout: u64,
    pub(crate) clock: SenderClock,
    pub(crate) period_ns: Option<u64>,
    /// For each input its index in the frame, or why the frame does not have what it wants.
    pub(crate) places: Box<[Result<usize, Missing>]>,
}

impl Bindings {
    /// For frames that do not say which layout they have: by channel only.
    fn plain(wanted: &[WantedSignal]) -> Self {
        let place = |wanted: &WantedSignal| match wanted.binding {
            Binding::Channel(channel) => Ok(channel),
            Binding::Signal(_) => Err(Missing::Signal),
        };
        let places = wanted.iter().map(place).collect();
        Self { layout: 0, clock: SenderClock::Shared, period_ns: None, places }
    }
}

/// What the cycle reports about a service to the ordinary thread. Only the cycle writes it.
#[derive(Debug, Default)]
pub(crate) struct ServiceObservations {
    /// The layout of the newest frame if that is not resolved yet; 0 otherwise.
    pub(crate) unknown_layout: AtomicU64,
    /// Whether the newest frame does not say which layout it has.
    pub(crate) is_plain: AtomicBool,
    pub(crate) other_writers: AtomicU64,
    /// How far in the future the newest such stamp was, in ns, since the ordinary thread last looked; 0: there was
    /// none.
    pub(crate) ahead_ns: AtomicU64,
    /// How old the newest stamp from the past was, likewise.
    pub(crate) behind_ns: AtomicU64,
    /// How far behind its frame the oldest sample of a fresh one lay, in ns, since the ordinary thread took it;
    /// 0: not far. And the flags of that frame.
    pub(crate) old_source_ns: AtomicU64,
    pub(crate) old_source_flags: AtomicU64,
}

/// The cycle's end.
pub(crate) struct Resolved {
    plain: Bindings,
    current: Option<Box<Bindings>>,
    new: Consumer<Box<Bindings>>,
    used: Producer<Box<Bindings>>,
    pub(crate) observed: Arc<ServiceObservations>,
}

/// The ordinary thread's end.
pub(crate) struct Desk {
    pub(crate) service: String,
    /// Names of the inputs, for people.
    pub(crate) inputs: Vec<String>,
    pub(crate) wanted: Vec<WantedSignal>,
    /// The task that follows the service.
    pub(crate) follower: Option<String>,
    new: Producer<Box<Bindings>>,
    used: Consumer<Box<Bindings>>,
    pub(crate) observed: Arc<ServiceObservations>,
}

/// Makes both ends for the inputs of a service.
pub(crate) fn ends(
    service: &str,
    inputs: Vec<String>,
    wanted: Vec<WantedSignal>,
) -> (Resolved, Desk) {
    let (send_new, new) = RingBuffer::new(ROOM);
    let (used, receive_used) = RingBuffer::new(2 * ROOM);
    let observed = Arc::new(ServiceObservations::default());
    let plain = Bindings::plain(&wanted);
    let resolved = Resolved { plain, current: None, new, used, observed: observed.clone() };
    let service = service.to_owned();
    let (new, used) = (send_new, receive_used);
    let desk = Desk { service, inputs, wanted, follower: None, new, used, observed };
    (resolved, desk)
}

impl Resolved {
    /// Takes over what the ordinary thread has resolved since; returns the announced period if that
    /// is news. Wait-free, and frees nothing.
    pub(crate) fn update(&mut self) -> Option<u64> {
        let new = self.new.pop().ok()?;
        let period_ns = new.period_ns;
        if let Some(used) = self.current.replace(new) {
            // There is always room: the other end sends only when it has emptied this ring.
            let _ = self.used.push(used);
        }
        period_ns
    }

    /// The bindings for frames of a layout; `None` as long as that is not resolved.
    pub(crate) fn of(&self, layout: u64) -> Option<&Bindings> {
        if layout == 0 {
            return Some(&self.plain);
        }
        self.current.as_deref().filter(|current| current.layout == layout)
    }
}

impl Desk {
    /// Sends bindings to the cycle; `false` if the previous ones are still under way.
    pub(crate) fn send(&mut self, bindings: Bindings) -> bool {
        while self.used.pop().is_ok() {}
        self.new.push(Box::new(bindings)).is_ok()
    }

    /// The inputs that want a signal by its name, by their places.
    pub(crate) fn by_signals(&self) -> impl Iterator<Item = usize> {
        let wanted = self.wanted.iter().enumerate();
        let by_name =
            |(_, wanted): &(usize, &WantedSignal)| matches!(wanted.binding, Binding::Signal(_));
        wanted.filter(by_name).map(|(index, _)| index)
    }

    /// Whether an input wants a signal by its name.
    pub(crate) fn by_signal(&self) -> Option<&str> {
        let mut inputs = self.inputs.iter().zip(&self.wanted);
        let found = inputs.find(|(_, wanted)| matches!(wanted.binding, Binding::Signal(_)));
        found.map(|(input, _)| input.as_str())
    }
}

impl ServiceObservations {
    /// A store for the cycle, which waits for nothing.
    pub(crate) fn store(counter: &AtomicU64, value: u64) {
        counter.store(value, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use isochrone_ipc::SignalSpec;

    use super::*;

    fn wanted(binding: Binding) -> WantedSignal {
        WantedSignal { binding, value_type: "LREAL".into(), unit: String::new() }
    }

    fn bindings(layout: u64) -> Bindings {
        let (clock, period_ns) = (SenderClock::Shared, Some(layout * 10));
        Bindings { layout, clock, period_ns, places: [Ok(7)].into() }
    }

    #[test]
    fn only_the_layout_that_is_resolved_is_read() {
        let (mut cycle, mut desk) = ends("s", vec!["x".into()], vec![wanted(Binding::Channel(3))]);
        assert_eq!(cycle.of(0).unwrap().places[0], Ok(3));
        assert!(cycle.of(5).is_none());
        assert!(desk.send(bindings(5)));
        assert_eq!(cycle.update(), Some(50));
        assert_eq!(cycle.update(), None);
        assert_eq!(cycle.of(5).unwrap().places[0], Ok(7));
        assert!(cycle.of(6).is_none());
        assert_eq!(cycle.of(0).unwrap().places[0], Ok(3));
    }

    #[test]
    fn a_declared_unit_is_compared_byte_for_byte_with_the_announced_one() {
        let of = |unit: &str| SignalSpec::new("a", "LREAL").in_unit(unit);
        let layout = |unit| FrameLayout { signals: vec![of(unit)], period_ns: None };
        let place = |declared: &str, announced| {
            let unit = declared.to_owned();
            let wanted = WantedSignal { unit, ..wanted(Binding::Signal("a".into())) };
            wanted.place(&layout(announced)).map_err(|why| why.to_string())
        };
        for (declared, announced) in [("", ""), ("", "m"), ("m", "m"), ("m", ""), ("µm", "µm")] {
            assert_eq!(place(declared, announced), Ok(0), "{declared} {announced}");
        }
        for (declared, announced) in [("m", "cm"), ("m", "M"), ("m", "m ")] {
            let why = place(declared, announced).unwrap_err();
            assert_eq!(why, format!("its unit is \"{announced}\", \"{declared}\" is needed"));
        }
        // The micro sign and the Greek letter look alike.
        let why = place("\u{b5}m", "\u{3bc}m").unwrap_err();
        assert_eq!(why, "its unit is \"μm\" (U+03BC), \"µm\" (U+00B5) is needed");
    }

    #[test]
    fn a_signal_is_in_no_plain_frame() {
        let signal = wanted(Binding::Signal("a".into()));
        let (cycle, desk) = ends("s", vec!["x".into()], vec![signal]);
        assert_eq!(cycle.of(0).unwrap().places[0], Err(Missing::Signal));
        assert_eq!(desk.by_signal(), Some("x"));
    }

    #[test]
    fn the_cycle_frees_no_bindings_however_often_they_change() {
        let (mut cycle, mut desk) = ends("s", Vec::new(), Vec::new());
        for layout in 1..100 {
            assert!(desk.send(bindings(layout)));
            cycle.update();
            assert!(cycle.used.slots() > 0, "there is room for what is given back");
            assert!(cycle.of(layout).is_some());
        }
        // A cycle that stands still gets no more than there is room for.
        let sent = (100..120).take_while(|layout| desk.send(bindings(*layout))).count();
        assert_eq!(sent, ROOM);
    }
}
