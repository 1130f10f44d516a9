//! Messages as frames of isochrone's ports.

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{FrameLayout, FramePublisher, SignalSpec, Stamp, ipc};

use super::end::EndError;
use super::message::Header;

/// Frames of so many values.
pub(super) fn layout(values: usize) -> FrameLayout {
    let signal = |channel| SignalSpec::new(format!("v{channel}"), "");
    FrameLayout { signals: (0..values).map(signal).collect(), period_ns: None }
}

/// Writes a value everywhere into the prepared frame, and sends it. Its own sequence goes on over all turns, so the message's
/// stands in place of the cycle; and as `publish_ns` is read after the values were written, the
/// message's time stands in place of the release.
pub(super) fn publish(
    publisher: &mut FramePublisher<ipc::Service>,
    header: Header,
    value: f64,
) -> Result<(), EndError> {
    if let Some(values) = publisher.values_mut() {
        values.fill(value);
    }
    let stamp = Stamp { cycle: header.sequence, release_ns: header.sent_ns, ..Stamp::default() };
    if publisher.send(stamp, || Monotonic.now_ns()) { Ok(()) } else { Err(EndError::Refused) }
}
