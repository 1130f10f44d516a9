//! Turns over an end that is no transport: a queue that can lose and damage messages.

use std::collections::VecDeque;

use super::*;

const VALUES: usize = 4;
const TERMS: Terms = Terms { values: VALUES, wait: Wait::Poll };
const SPAN: Span = Span { start_ns: 0, from_ns: 0, end_ns: u64::MAX, first: 1 << 32 };

/// Gives what was put in; what is sent stays with it, or comes back at once.
#[derive(Default)]
struct Queue {
    incoming: VecDeque<Message>,
    sent: Vec<Header>,
    echoes: bool,
}

impl Queue {
    fn of(headers: impl IntoIterator<Item = (u64, u64)>) -> Self {
        let header = |(sequence, sent_ns)| Header { sequence, sent_ns };
        Self { incoming: headers.into_iter().map(header).map(whole).collect(), ..Self::default() }
    }
}

fn whole(header: Header) -> Message {
    Message { header, sum: header.value() * VALUES as f64 }
}

impl End for Queue {
    fn send(&mut self, header: Header) -> Result<(), EndError> {
        self.sent.push(header);
        if self.echoes {
            self.incoming.push_back(whole(header));
        }
        Ok(())
    }

    fn receive(&mut self) -> Result<Option<Message>, EndError> {
        Ok(self.incoming.pop_front())
    }
}

fn receive(queue: &mut Queue, span: &Span) -> (Result<Received, EndError>, Distribution) {
    let mut samples = Distribution::new();
    let stop = AtomicBool::new(false);
    let received = receive_paced(queue, span, TERMS, &stop, &mut samples);
    (received, samples)
}

fn sequences(sequences: &[u64], sent: u64) -> Queue {
    let messages = sequences.iter().map(|sequence| (SPAN.first + sequence, 10));
    Queue::of(messages.chain([(END, sent)]))
}

#[test]
fn a_gap_in_the_sequence_is_a_loss_of_exactly_that_many() {
    let (received, samples) = receive(&mut sequences(&[0, 1, 4, 5], 6), &SPAN);
    assert_eq!(received.unwrap(), Received { messages: 4, lost: 2 });
    assert_eq!(samples.count(), 4);
}

#[test]
fn a_message_lost_at_the_very_end_is_missed() {
    let (received, _) = receive(&mut sequences(&[0, 1], 5), &SPAN);
    assert_eq!(received.unwrap().lost, 3);
}

#[test]
fn what_a_turn_before_left_over_does_not_count() {
    let left_over = (SPAN.first - 7, 10);
    let mut queue = Queue::of([left_over, (SPAN.first, 10), (END, 1)]);
    let (received, _) = receive(&mut queue, &SPAN);
    assert_eq!(received.unwrap(), Received { messages: 1, lost: 0 });
}

#[test]
fn what_was_sent_in_the_warm_up_is_in_no_sample_and_no_loss() {
    let messages = [(0, 10), (3, 20), (4, 30), (6, 40)].map(|(s, ns)| (SPAN.first + s, ns));
    let mut queue = Queue::of(messages.into_iter().chain([(END, 7)]));
    let (received, samples) = receive(&mut queue, &Span { from_ns: 30, ..SPAN });
    assert_eq!(received.unwrap(), Received { messages: 2, lost: 1 });
    assert_eq!(samples.count(), 2);
}

#[test]
fn a_damaged_message_ends_the_turn_with_its_number() {
    let mut queue = sequences(&[0, 1], 2);
    queue.incoming[1].sum += 1.0;
    let (received, _) = receive(&mut queue, &SPAN);
    let error = received.unwrap_err().to_string();
    assert!(error.contains(&format!("message {} is damaged", SPAN.first + 1)), "{error}");
}

#[test]
fn an_end_that_stays_silent_is_given_up() {
    let (received, _) = receive(&mut Queue::default(), &Span { end_ns: 0, ..SPAN });
    assert!(matches!(received, Err(EndError::Silent)), "{received:?}");
}

#[test]
fn a_ping_counts_every_answer_and_says_when_it_is_over() {
    let mut queue = Queue { echoes: true, ..Queue::default() };
    let mut samples = Distribution::new();
    let span = Span { end_ns: Monotonic.now_ns() + 2_000_000, ..SPAN };
    let received = ping(&mut queue, &span, TERMS, &AtomicBool::new(false), &mut samples).unwrap();
    assert_eq!(received.lost, 0);
    assert_eq!(received.messages, samples.count());
    let (last, messages) = queue.sent.split_last().unwrap();
    assert_eq!(*last, Header { sequence: END, sent_ns: received.messages });
    assert!(
        messages.iter().zip(SPAN.first..).all(|(header, expected)| header.sequence == expected)
    );
}

#[test]
fn an_echo_sends_back_what_it_got_and_ends_with_the_turn() {
    let mut queue = sequences(&[0, 1, 2], 3);
    let sent = echo(&mut queue, &SPAN, TERMS, &AtomicBool::new(false)).unwrap();
    assert_eq!(sent.messages, 3);
    assert_eq!(queue.sent.iter().map(|header| header.sequence - SPAN.first).max(), Some(2));
}

#[test]
fn a_paced_sender_numbers_what_it_sends_and_says_how_many_there_were() {
    let mut queue = Queue::default();
    let start_ns = Monotonic.now_ns();
    let span = Span { start_ns, end_ns: start_ns + 5_000_000, ..SPAN };
    let stop = Arc::new(AtomicBool::new(false));
    let sent = send_paced(&mut queue, &span, 1_000_000, &stop).unwrap();
    assert_eq!(sent.messages + sent.missed, 5, "{sent:?}");
    let last = queue.sent.pop().unwrap();
    assert_eq!(last, Header { sequence: END, sent_ns: sent.messages });
    assert_eq!(queue.sent.len() as u64, sent.messages);
    assert!(queue.sent.iter().all(|header| header.sent_ns >= start_ns));
}
