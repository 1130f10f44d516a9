//! Room for the states that a process hands over to its twin.

use std::time::Instant;

use isochrone_control::{Code, Refusal};
use isochrone_engine::{Plan, TaskEngine};

use super::twin::Twin;
use crate::error::PrepareError;

/// The most bytes of a node's state that are handed over in every cycle.
const MOST_BYTES: usize = 1 << 20;
/// Words that each task may have more of after an `apply`, and as many as it had at the start.
const SPARE_WORDS: usize = 1024;
/// A copy takes at most this part of a period.
const PART_OF_PERIOD: u64 = 4;

/// Makes sure that the states of a node are small enough to be sent in every cycle, and plans room for them.
///
/// # Errors
/// They are not.
pub(crate) fn make_room(
    twin: &Twin,
    plan: &Plan,
    engines: &[TaskEngine],
) -> Result<(), PrepareError> {
    check_states(plan, &engines.iter().collect::<Vec<_>>())?;
    let most = |engine: &TaskEngine| 2 * engine.state_words() + SPARE_WORDS;
    twin.set_most_words(engines.iter().map(most).collect());
    Ok(())
}

fn check_states(plan: &Plan, engines: &[&TaskEngine]) -> Result<(), PrepareError> {
    let bytes: usize = engines.iter().map(|engine| engine.state_words() * size_of::<f64>()).sum();
    if bytes > MOST_BYTES {
        return Err(PrepareError::StateTooLarge { node: plan.node.clone(), bytes });
    }
    for (task, engine) in plan.tasks.iter().zip(engines) {
        let mut room = vec![0.0; engine.state_words()];
        let copy = |_| {
            let began = Instant::now();
            engine.copy_words(&mut room);
            began.elapsed().as_nanos() as u64
        };
        // The first one also has the memory put in place.
        let took_ns = (0..5).map(copy).min().unwrap_or(0);
        let period_ns = task.settings.period_ns;
        if took_ns.saturating_mul(PART_OF_PERIOD) > period_ns {
            let task = task.name.clone();
            return Err(PrepareError::StateTooSlow { task, took_ns, period_ns });
        }
    }
    Ok(())
}

/// Makes sure that this process can hand over the states of a node that is to have another configuration.
///
/// # Errors
/// It cannot.
pub(crate) fn check_change(
    twin: &Twin,
    plan: &Plan,
    engines: &[&TaskEngine],
) -> Result<(), Refusal> {
    check_states(plan, engines)
        .map_err(|error| Refusal::new(Code::CannotChange, error.to_string()))?;
    let mut tasks = plan.tasks.iter().zip(engines).zip(twin.most_words());
    let large = tasks.find(|((_, engine), most)| engine.state_words() > **most);
    let Some(((task, engine), most)) = large else { return Ok(()) };
    let [bytes, most] = [engine.state_words(), *most].map(|words| words * size_of::<f64>());
    let message = format!(
        "task \"{}\" would have {bytes} bytes of state, and this process has room for {most} to hand over",
        task.name
    );
    let help = "end both processes of the node, and start them with the new file";
    Err(Refusal::one(Code::CannotChange, &task.name, message, help))
}
