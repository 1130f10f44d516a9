//! All transports there are.

use isochrone_ipc::ForRealTime;

use super::arms::Arm;
use super::end::{EndError, Opening, Place};
use super::{cache_line, follow_path, node_path, pipe, ports, raw, tcp, unix_datagram};

/// Opens an end. The measuring one comes first, then its peer, then both are connected.
pub(super) fn open(arm: Arm, place: &Place<'_>) -> Result<ForRealTime<Opening>, EndError> {
    let without_ports = |opening: Opening| ForRealTime::nothing().map(|()| opening);
    match arm {
        Arm::Ports => ports::open(place),
        Arm::Node => node_path::open_publisher(place),
        Arm::Follow | Arm::Chain => Ok(follow_path::open_peer()),
        Arm::Raw => raw::open(place).map(without_ports),
        Arm::Unix => unix_datagram::open(place).map(without_ports),
        Arm::Pipe => pipe::open(place).map(without_ports),
        Arm::Tcp => tcp::open(place).map(without_ports),
        Arm::CacheLine => cache_line::open(place).map(without_ports),
    }
}
