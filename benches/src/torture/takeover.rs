//! The holder of a redundant node is killed at any moment.

use rustix::process::Signal;

use super::moments::Moments;
use super::pair::Pair;
use super::turn::{Stage, Turn};
use crate::Failure;

pub(super) fn play(stage: &Stage, moments: &mut Moments, turn: &mut Turn) -> Result<(), Failure> {
    let Some(mut pair) = turn.take(Pair::start(stage)?) else { return Ok(()) };
    let mut until_ns = u64::MAX;
    for _ in 0..stage.faults {
        if turn.take(pair.until_complete()).is_none() {
            break;
        }
        let complete = pair.newest();
        // A third of them in the first 50 ms of the standby.
        let most_ms = if moments.once_in(3) { 50 } else { 400 };
        moments.sleep_up_to_ms(most_ms);
        let Some(newest) = pair.newest() else { break };
        let holder = Pair::seat_of(&newest);
        if moments.once_in(8) {
            // In the last moments of a holder that ends in order.
            pair.process(holder).signal(Signal::TERM);
            moments.sleep_up_to_ms(50);
        }
        pair.kill(holder);
        turn.done += 1;
        match pair.until_taken_over(1 - holder, newest.term) {
            Ok(pairs) => {
                let found = pair.silence(1 - holder, &pairs);
                let passed = turn.take(found);
                turn.measured
                    .extend(passed.map(|passed| ("cycles of 10 ms without a frame", passed)));
            }
            // They changed places just before, and the new standby had nothing yet; or this machine is so busy that the
            // holder had not heard it for 100 ms, so that it was none.
            Err(wrong)
                if complete.is_none_or(|complete| complete.term != newest.term)
                    || wrong.contains("had not heard this one") =>
            {
                turn.measured.push(("restarts without a standby", 1));
                until_ns = newest.publish_ns;
                break;
            }
            Err(wrong) => {
                turn.keep([wrong]);
                until_ns = newest.publish_ns;
                break;
            }
        }
        pair.replace(holder);
    }
    pair.conclude(turn, until_ns);
    Ok(())
}
