//! One of two redundant processes is stopped for a while, as by a debugger, and goes on.

use std::thread;
use std::time::Duration;

use rustix::process::Signal;

use super::moments::Moments;
use super::pair::{Pair, Role};
use super::scene::PATIENCE;
use super::turn::{Stage, Turn};
use crate::Failure;

/// As many frames as a process would send that went on wrongly.
const SETTLED: Duration = Duration::from_millis(100);

pub(super) fn play(stage: &Stage, moments: &mut Moments, turn: &mut Turn) -> Result<(), Failure> {
    let Some(mut pair) = turn.take(Pair::start(stage)?) else { return Ok(()) };
    for _ in 0..stage.faults {
        let Some(()) = turn.take(pair.until_complete()) else { break };
        moments.sleep_up_to_ms(200);
        let Some(newest) = pair.newest() else { break };
        let holder = Pair::seat_of(&newest);
        let is_standby = moments.once_in(3);
        let stopped = if is_standby { 1 - holder } else { holder };
        pair.process(stopped).signal(Signal::STOP);
        turn.done += 1;
        let taken = if is_standby {
            Ok(())
        } else {
            pair.until_taken_over(1 - holder, newest.term).map(drop)
        };
        moments.sleep_up_to_ms(400);
        pair.process(stopped).signal(Signal::CONT);
        // On a busy machine they had changed places just before, or the holder had not heard the standby for 100 ms, so
        // that there was none.
        if taken.is_err() && pair.role(1 - holder) == Role::Joining {
            continue;
        }
        if turn.take(taken).is_none() {
            break;
        }
        thread::sleep(SETTLED);
        let stands_by = pair.scene.wait(PATIENCE, || {
            // On a busy machine it may have taken over again.
            matches!(pair.role(stopped), Role::Standby | Role::Holder).then_some(())
        });
        if stands_by.is_none() {
            turn.keep([format!("who was stopped does not stand by: {}", pair.said())]);
            break;
        }
    }
    pair.conclude(turn, u64::MAX);
    Ok(())
}
