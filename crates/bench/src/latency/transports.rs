//! All transports there are.

use super::arms::Arm;
use super::end::{EndError, Opening, Place};
use super::{cache_line, node_path, pipe, ports, raw, tcp, unix_datagram};

/// Opens an end. The measuring one comes first, then its peer, then both are connected.
pub(super) fn open(arm: Arm, place: &Place<'_>) -> Result<Opening, EndError> {
    match arm {
        Arm::Raw => raw::open(place),
        Arm::Ports => ports::open(place),
        Arm::Unix => unix_datagram::open(place),
        Arm::Pipe => pipe::open(place),
        Arm::Tcp => tcp::open(place),
        Arm::CacheLine => cache_line::open(place),
        Arm::Node => node_path::open_publisher(place),
    }
}
