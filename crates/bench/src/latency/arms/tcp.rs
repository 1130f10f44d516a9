//! TCP over the loopback interface, with every message sent at once (TCP_NODELAY).

use std::fs;
use std::io;
use std::net::{Ipv4Addr, TcpListener, TcpStream};

use isochrone_ipc::ForRealTime;

use crate::latency::arm::Transport;
use crate::latency::end::{BLOCKED, End, EndError, Opening, Rendezvous, Side, without_ports};
use crate::latency::pace::Wait;
use crate::latency::stream::Stream;

/// Tells the peer where to connect.
const PORT_FILE: &str = "tcp-port";

pub(super) struct Tcp;

impl Transport for Tcp {
    fn name(&self) -> &'static str {
        "tcp"
    }

    fn help(&self) -> &'static str {
        "TCP over the loopback interface, TCP_NODELAY"
    }

    fn can_block(&self) -> bool {
        true
    }

    fn open(&self, place: &Rendezvous<'_>) -> Result<ForRealTime<Opening>, EndError> {
        let failed = EndError::system("connect over TCP");
        let (wait, values) = (place.wait, place.values);
        let file = place.folder.join(PORT_FILE);
        let connect: Box<dyn FnOnce() -> io::Result<TcpStream>> = match place.side {
            Side::Measuring => {
                let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).map_err(&failed)?;
                let port = listener.local_addr().map_err(&failed)?.port();
                fs::write(file, port.to_string()).map_err(&failed)?;
                Box::new(move || listener.accept().map(|(stream, _)| stream))
            }
            Side::Peer => {
                let port = fs::read_to_string(file).map_err(&failed)?;
                let port = port.parse().map_err(io::Error::other).map_err(&failed)?;
                let stream = TcpStream::connect((Ipv4Addr::LOCALHOST, port)).map_err(&failed)?;
                Box::new(|| Ok(stream))
            }
        };
        Ok(without_ports(Box::new(move || {
            let both = connect().and_then(|stream| {
                stream.set_nodelay(true)?;
                stream.set_nonblocking(wait == Wait::Poll)?;
                stream.set_read_timeout(Some(BLOCKED))?;
                stream.set_write_timeout(Some(BLOCKED))?;
                Ok((stream.try_clone()?, stream))
            });
            let (reader, writer) = both.map_err(failed)?;
            Ok(Box::new(Stream::new(reader, writer, values)) as Box<dyn End>)
        })))
    }
}
