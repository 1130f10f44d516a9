//! Values that were sent and have not come back.

use super::message::Header;

/// What a value is that has come back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Returned {
    /// That of this message; so many before it did not come back and will not.
    Message { sent: Header, overtaken: u64 },
    /// The last one once more: the node had no new one.
    Again,
    /// None that was sent.
    Stranger,
}

/// Messages on their way through nodes, oldest first.
#[derive(Debug)]
pub(super) struct InFlight {
    sent: Vec<Header>,
    /// Of the turn.
    last: Option<f64>,
    /// What was sent before this does not count.
    from_ns: u64,
}

impl InFlight {
    /// Has room for so many.
    pub(super) fn with_room(messages: usize) -> Self {
        Self { sent: Vec::with_capacity(messages), last: None, from_ns: 0 }
    }

    pub(super) fn begin(&mut self, from_ns: u64) {
        self.sent.clear();
        (self.last, self.from_ns) = (None, from_ns);
    }

    pub(super) fn push(&mut self, sent: Header) {
        self.sent.push(sent);
    }

    pub(super) fn is_empty(&self) -> bool {
        self.sent.is_empty()
    }

    /// When the oldest one was sent, in ns.
    pub(super) fn oldest_ns(&self) -> Option<u64> {
        self.sent.first().map(|sent| sent.sent_ns)
    }

    /// The value that the node has until a new one comes.
    pub(super) fn expected(&self) -> f64 {
        self.last.unwrap_or_default()
    }

    /// How many count.
    pub(super) fn counted(&self) -> u64 {
        self.sent.iter().filter(|sent| sent.sent_ns >= self.from_ns).count() as u64
    }

    /// Takes in a value that has come back.
    pub(super) fn take(&mut self, value: f64) -> Returned {
        let found = self.sent.iter().position(|sent| sent.value() == value);
        let Some((index, sent)) = found.and_then(|index| Some((index, *self.sent.get(index)?)))
        else {
            // What came before the first one of the turn is of nobody's business.
            let is_known = self.last.is_none_or(|last| last == value);
            return if is_known { Returned::Again } else { Returned::Stranger };
        };
        let counts = |before: &Header| before.sent_ns >= self.from_ns;
        let overtaken = self.sent.drain(..=index).take(index).filter(counts).count() as u64;
        self.last = Some(value);
        Returned::Message { sent, overtaken }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(number: u64) -> Header {
        Header { sequence: (7 << 32) + number, sent_ns: number }
    }

    fn of(messages: std::ops::Range<u64>) -> InFlight {
        let mut flight = InFlight::with_room(8);
        flight.begin(2);
        messages.for_each(|number| flight.push(header(number)));
        flight
    }

    #[test]
    fn a_value_is_that_of_the_message_that_it_was_sent_with() {
        let mut flight = of(0..3);
        assert_eq!(flight.take(0.0), Returned::Message { sent: header(0), overtaken: 0 });
        assert_eq!(flight.oldest_ns(), Some(1));
        assert_eq!(flight.take(1.0), Returned::Message { sent: header(1), overtaken: 0 });
        assert_eq!(flight.counted(), 1);
        assert!(!flight.is_empty());
    }

    #[test]
    fn messages_that_a_newer_one_overtook_are_counted_without_those_of_the_warm_up() {
        let mut flight = of(0..6);
        assert_eq!(flight.take(4.0), Returned::Message { sent: header(4), overtaken: 2 });
        assert_eq!(flight.counted(), 1);
    }

    #[test]
    fn a_node_without_a_new_value_repeats_the_last_and_none_that_was_not_sent() {
        let mut flight = of(0..2);
        assert_eq!(flight.take(1_048_577.0), Returned::Again, "of before the turn");
        flight.take(1.0);
        assert_eq!(flight.take(1.0), Returned::Again);
        assert_eq!(flight.take(0.0), Returned::Stranger, "nothing goes backwards");
        assert!(flight.is_empty());
    }
}
