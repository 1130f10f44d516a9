//! ZeroMQ: two DEALER sockets over TCP, in the implementation that is all Rust.

use isochrone_benches::Failure;
use tokio::runtime::{Builder, Runtime};
use zeromq::{DealerSocket, Socket, SocketRecv, SocketSend, ZmqMessage};

use crate::Listening;
use crate::message::{Wire, from_bytes, to_bytes};

pub(crate) fn listen(place: &str) -> Result<Listening, Failure> {
    let mut dealer = Dealer::new()?;
    dealer.runtime.block_on(dealer.socket.bind(&endpoint(place)))?;
    Ok(Box::new(move || Ok(Box::new(dealer) as Box<dyn Wire>)))
}

pub(crate) fn connect(place: &str) -> Result<Box<dyn Wire>, Failure> {
    let mut dealer = Dealer::new()?;
    dealer.runtime.block_on(dealer.socket.connect(&endpoint(place)))?;
    Ok(Box::new(dealer))
}

fn endpoint(place: &str) -> String {
    format!("tcp://{place}")
}

struct Dealer {
    socket: DealerSocket,
    // Its own thread lets the socket read and write meanwhile.
    runtime: Runtime,
}

impl Dealer {
    fn new() -> Result<Self, Failure> {
        let runtime = Builder::new_multi_thread().worker_threads(1).enable_all().build()?;
        let socket = {
            let _inside = runtime.enter();
            DealerSocket::new()
        };
        Ok(Self { socket, runtime })
    }
}

impl Wire for Dealer {
    fn send(&mut self, words: &[u64]) -> Result<(), Failure> {
        let message = ZmqMessage::from(to_bytes(words));
        Ok(self.runtime.block_on(self.socket.send(message))?)
    }

    fn receive(&mut self, words: &mut [u64]) -> Result<(), Failure> {
        let message = self.runtime.block_on(self.socket.recv())?;
        from_bytes(message.get(0).ok_or("an empty message came")?, words)
    }
}
