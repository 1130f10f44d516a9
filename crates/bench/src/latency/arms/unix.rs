//! Unix datagram sockets: a message is a datagram.

use std::io::{self, ErrorKind};
use std::os::unix::net::UnixDatagram;

use isochrone_ipc::ForRealTime;

use crate::latency::arm::Transport;
use crate::latency::end::{
    BLOCKED, End, EndError, Opening, Rendezvous, Side, insist, is_nothing_yet, without_ports,
};
use crate::latency::message::{self, Header, Message};
use crate::latency::pace::Wait;

pub(super) struct Unix;

impl Transport for Unix {
    fn name(&self) -> &'static str {
        "unix"
    }

    fn help(&self) -> &'static str {
        "Unix datagram socket"
    }

    fn can_block(&self) -> bool {
        true
    }

    fn open(&self, place: &Rendezvous<'_>) -> Result<ForRealTime<Opening>, EndError> {
        let failed = EndError::system("open a Unix datagram socket");
        let [measuring, peer] = ["unix-measuring", "unix-peer"].map(|name| place.folder.join(name));
        let (own, other) = match place.side {
            Side::Measuring => (measuring, peer),
            Side::Peer => (peer, measuring),
        };
        let socket = UnixDatagram::bind(own).map_err(&failed)?;
        let (wait, values) = (place.wait, place.values);
        Ok(without_ports(Box::new(move || {
            let set_up = socket.connect(other).and_then(|()| {
                socket.set_nonblocking(wait == Wait::Poll)?;
                socket.set_read_timeout(Some(BLOCKED))?;
                socket.set_write_timeout(Some(BLOCKED))
            });
            set_up.map_err(failed)?;
            let buffer = vec![0; message::bytes(values)];
            Ok(Box::new(Datagrams { socket, incoming: buffer.clone(), outgoing: buffer })
                as Box<dyn End>)
        })))
    }
}

struct Datagrams {
    socket: UnixDatagram,
    incoming: Vec<u8>,
    outgoing: Vec<u8>,
}

impl End for Datagrams {
    fn send(&mut self, header: Header) -> Result<(), EndError> {
        message::encode(header, &mut self.outgoing);
        insist("send a datagram", || {
            self.socket.send(&self.outgoing).map_err(|error| too_large(error, self.outgoing.len()))
        })
        .map(drop)
    }

    fn receive(&mut self) -> Result<Option<Message>, EndError> {
        match self.socket.recv(&mut self.incoming) {
            Ok(length) => Ok(self.incoming.get(..length).and_then(message::decode)),
            Err(error) if is_nothing_yet(&error) => Ok(None),
            Err(error) => Err(EndError::system("receive a datagram")(error)),
        }
    }
}

/// Says what to do about a datagram that the socket's buffer cannot hold.
fn too_large(error: io::Error, bytes: usize) -> io::Error {
    const EMSGSIZE: i32 = rustix::io::Errno::MSGSIZE.raw_os_error();
    match error.raw_os_error() {
        Some(EMSGSIZE) => io::Error::new(
            ErrorKind::InvalidInput,
            format!(
                "{bytes} bytes do not fit the socket's buffer; raise it with sysctl -w \
                 net.core.wmem_default=212992, or give fewer --values"
            ),
        ),
        _ => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_datagram_that_cannot_fit_is_refused_with_the_way_out() {
        let (one, _other) = UnixDatagram::pair().unwrap();
        let buffer = vec![0; 64 << 20];
        let mut end = Datagrams { socket: one, incoming: Vec::new(), outgoing: buffer };
        let error = end.send(Header { sequence: 0, sent_ns: 0 }).unwrap_err().to_string();
        assert!(error.contains("wmem_default") && error.contains("--values"), "{error}");
    }

    #[test]
    fn a_datagram_cut_short_is_damaged() {
        let (one, other) = UnixDatagram::pair().unwrap();
        let mut receiver =
            Datagrams { socket: other, incoming: vec![0; message::bytes(8)], outgoing: Vec::new() };
        let mut sent = vec![0; message::bytes(8)];
        message::encode(Header { sequence: 9, sent_ns: 0 }, &mut sent);
        one.send(&sent[..message::bytes(7)]).unwrap();
        assert!(!receiver.receive().unwrap().unwrap().is_whole(8));
    }
}
