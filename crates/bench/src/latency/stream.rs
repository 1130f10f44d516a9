//! Messages over a stream of bytes: all have one size, so they need no mark between them.

use std::io::{Read, Write};

use super::end::{End, EndError, insist, is_nothing_yet};
use super::message::{self, Header, Message};

/// An end that reads one stream and writes another.
pub(super) struct Stream<R, W> {
    reader: R,
    writer: W,
    incoming: Vec<u8>,
    /// Bytes of `incoming` that have come.
    arrived: usize,
    outgoing: Vec<u8>,
}

impl<R: Read, W: Write> Stream<R, W> {
    pub(super) fn new(reader: R, writer: W, values: usize) -> Self {
        let buffer = vec![0; message::bytes(values)];
        Self { reader, writer, incoming: buffer.clone(), arrived: 0, outgoing: buffer }
    }
}

impl<R: Read, W: Write> End for Stream<R, W> {
    fn send(&mut self, header: Header) -> Result<(), EndError> {
        message::encode(header, &mut self.outgoing);
        let mut rest = self.outgoing.as_slice();
        while !rest.is_empty() {
            let written = insist("write to the stream", || self.writer.write(rest))?;
            if written == 0 {
                return Err(EndError::Gone);
            }
            rest = rest.get(written..).unwrap_or_default();
        }
        Ok(())
    }

    fn receive(&mut self) -> Result<Option<Message>, EndError> {
        while let Some(missing @ [_, ..]) = self.incoming.get_mut(self.arrived..) {
            match self.reader.read(missing) {
                Ok(0) => return Err(EndError::Gone),
                Ok(read) => self.arrived += read,
                Err(error) if is_nothing_yet(&error) => return Ok(None),
                Err(error) => return Err(EndError::system("read from the stream")(error)),
            }
        }
        self.arrived = 0;
        Ok(message::decode(&self.incoming))
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::collections::VecDeque;
    use std::io::{self, ErrorKind};

    use super::*;

    /// A stream that takes and gives a few bytes at a time, with interruptions.
    #[derive(Default)]
    struct Trickle {
        bytes: RefCell<VecDeque<u8>>,
        calls: RefCell<usize>,
    }

    impl Trickle {
        fn portion(&self, most: usize) -> io::Result<usize> {
            let calls = &mut *self.calls.borrow_mut();
            *calls += 1;
            match *calls % 5 {
                0 => Err(ErrorKind::WouldBlock.into()),
                3 => Err(ErrorKind::Interrupted.into()),
                portion => Ok(most.min(portion * 3)),
            }
        }
    }

    impl Read for &Trickle {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            let portion = self.portion(into.len())?;
            let mut bytes = self.bytes.borrow_mut();
            if bytes.is_empty() {
                return Err(ErrorKind::WouldBlock.into());
            }
            let portion = portion.min(bytes.len());
            into[..portion].iter_mut().for_each(|byte| *byte = bytes.pop_front().unwrap());
            Ok(portion)
        }
    }

    impl Write for &Trickle {
        fn write(&mut self, from: &[u8]) -> io::Result<usize> {
            let portion = self.portion(from.len())?;
            self.bytes.borrow_mut().extend(&from[..portion]);
            Ok(portion)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn messages_that_come_in_bits_are_put_together_in_order() {
        let wire = Trickle::default();
        let mut end = Stream::new(&wire, &wire, 64);
        for sequence in 0..20 {
            end.send(Header { sequence, sent_ns: 7 }).unwrap();
        }
        let mut received = Vec::new();
        for _ in 0..20_000 {
            if let Some(message) = end.receive().unwrap() {
                assert!(message.is_whole(64), "{message:?}");
                received.push(message.header.sequence);
            }
        }
        assert_eq!(received, (0..20).collect::<Vec<_>>());
    }

    #[test]
    fn a_message_is_not_there_before_its_last_byte() {
        let wire = Trickle::default();
        let mut sender = Stream::new(io::empty(), &wire, 1);
        sender.send(Header { sequence: 3, sent_ns: 7 }).unwrap();
        let last = wire.bytes.borrow_mut().pop_back().unwrap();
        let mut receiver = Stream::new(&wire, io::sink(), 1);
        assert!((0..100).all(|_| receiver.receive().unwrap().is_none()));
        wire.bytes.borrow_mut().push_back(last);
        assert!((0..100).any(|_| receiver.receive().unwrap().is_some()));
    }

    #[test]
    fn the_end_of_a_stream_is_the_end_of_its_writer() {
        let mut end = Stream::new(io::empty(), io::sink(), 1);
        assert!(matches!(end.receive(), Err(EndError::Gone)));
        let mut space = [0; 20];
        let mut end = Stream::new(io::empty(), space.as_mut_slice(), 1);
        assert!(matches!(end.send(Header { sequence: 3, sent_ns: 7 }), Err(EndError::Gone)));
    }
}
