//! The server: on this machine's own addresses alone, a thread for each connection, and no more of them than
//! a fixed number.

use std::io::ErrorKind;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::SyncSender;
use std::thread;
use std::time::{Duration, Instant};

use super::response::Response;
use super::routes::{Answer, answer};
use super::shared::View;
use super::threads::start_thread;
use super::{http, refusals, stream};
use crate::failure::Failure;

/// Most connections at a time. An open page takes one, and others for moments: there are fewer pages than connections.
const MAX_CONNECTIONS: usize = 64;
/// How long a request may take to come.
const PATIENCE: Duration = Duration::from_secs(5);
/// How often a free port is looked for that both addresses have.
const ATTEMPTS: usize = 16;

/// The sockets that listen.
pub(super) struct Listeners {
    listeners: Vec<TcpListener>,
    pub(super) port: u16,
}

impl Listeners {
    /// Listens on 127.0.0.1 and, where there is IPv6, on ::1; on a free port for 0.
    pub(super) fn bind(port: u16) -> Result<Self, Failure> {
        let mut attempts = if port == 0 { ATTEMPTS } else { 1 };
        loop {
            attempts -= 1;
            match Self::bind_both(port) {
                Err(error) if error.kind() == ErrorKind::AddrInUse && attempts > 0 => {}
                Err(error) if error.kind() == ErrorKind::AddrInUse => {
                    return Err(Failure::found(format!(
                        "port {port} is in use; give another one with --port, or --port 0 for any free one"
                    )));
                }
                Err(error) if error.kind() == ErrorKind::PermissionDenied => {
                    return Err(Failure::found(format!(
                        "port {port} is reserved for privileged programs; give one from 1024 on with --port"
                    )));
                }
                Err(error) => {
                    return Err(Failure::found(format!("cannot listen on port {port}: {error}")));
                }
                Ok(listeners) => return Ok(listeners),
            }
        }
    }

    fn bind_both(port: u16) -> std::io::Result<Self> {
        let first = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        let port = first.local_addr()?.port();
        let second = match TcpListener::bind(SocketAddr::from((Ipv6Addr::LOCALHOST, port))) {
            Err(error) if error.kind() == ErrorKind::AddrInUse => return Err(error),
            // A machine without IPv6 has no ::1.
            second => second.ok(),
        };
        Ok(Self { listeners: [Some(first), second].into_iter().flatten().collect(), port })
    }

    /// Serves pages from threads of their own, until the program ends.
    pub(super) fn serve(self, view: &Arc<View>) -> Result<(), Failure> {
        let connections = Arc::new(AtomicUsize::new(0));
        let refused = refusals::start(&Response::sentence(
            503,
            format!(
                "{MAX_CONNECTIONS} connections are open, which is as many as there can be; close a page"
            ),
        ))?;
        for listener in self.listeners {
            let (view, connections, refused) = (view.clone(), connections.clone(), refused.clone());
            let accept = move || accept(&listener, &view, &connections, &refused);
            start_thread("view-listen", accept)?;
        }
        Ok(())
    }
}

fn accept(
    listener: &TcpListener,
    view: &Arc<View>,
    connections: &Arc<AtomicUsize>,
    refused: &SyncSender<TcpStream>,
) {
    /// If no more files can be opened, some may be closed soon.
    const PAUSE: Duration = Duration::from_millis(100);
    for stream in listener.incoming() {
        let Ok(stream) = stream else {
            thread::sleep(PAUSE);
            continue;
        };
        let place = ConnectionSlot::take(connections);
        if place.number >= MAX_CONNECTIONS {
            // Where too many are refused already, the browser sees the connection closed.
            let _ = refused.try_send(stream);
            continue;
        }
        let view = view.clone();
        let serve = move || {
            serve(&view, &stream);
            drop(place);
        };
        // Where no thread can be started, the browser sees the connection closed.
        let _ = thread::Builder::new().name("view-page".into()).spawn(serve);
    }
}

/// One of the connections, until this is dropped.
struct ConnectionSlot {
    connections: Arc<AtomicUsize>,
    number: usize,
}

impl ConnectionSlot {
    fn take(connections: &Arc<AtomicUsize>) -> Self {
        let number = connections.fetch_add(1, Ordering::Relaxed);
        Self { connections: connections.clone(), number }
    }
}

impl Drop for ConnectionSlot {
    fn drop(&mut self) {
        self.connections.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Answers the one request of a connection.
fn serve(view: &View, connection: &TcpStream) {
    let _ = connection.set_nodelay(true);
    let mut is_head = false;
    let response = match http::read(connection, Instant::now() + PATIENCE) {
        Ok(None) => return,
        Err(refusal) => refusal,
        Ok(Some(request)) => {
            is_head = request.method == "HEAD";
            match answer(view, &request) {
                Answer::Whole(response) => response,
                Answer::Events => {
                    // A browser that has gone cannot be answered.
                    let _ = stream::serve(view, connection);
                    return;
                }
            }
        }
    };
    if stream::send(connection, response.bytes(is_head)).is_ok() {
        http::close(connection);
    }
}
