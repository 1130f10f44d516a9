//! The end of a node: it waits until every task has ended the cycle that it is in.

use std::time::Duration;

use isochrone_runtime::Running;

use crate::terminal;

/// A task whose cycle lasts longer than this after the end was asked for is named. Tasks that wait
/// for a release end within 200 ms.
const IN_SILENCE: Duration = Duration::from_secs(1);

/// Ends a node, and waits until none of its tasks runs and everything is reported. Names tasks that do not end.
pub(super) fn await_end(name: &str, node: &Running) {
    node.stop();
    if !node.wait_within(IN_SILENCE) {
        terminal::note(&sentence(name, node));
        node.wait();
    }
}

fn sentence(name: &str, node: &Running) -> String {
    let tasks: Vec<String> = node.unfinished_tasks().map(|task| format!("\"{task}\"")).collect();
    if tasks.is_empty() {
        return format!(
            "node \"{name}\" waits until the journal has what was done last: the disk takes long."
        );
    }
    let (tasks, cycles) = match tasks.as_slice() {
        [task] => (format!("task {task}"), "its cycle"),
        tasks => (format!("tasks {}", tasks.join(", ")), "their cycles"),
    };
    format!(
        "node \"{name}\" waits for {tasks} to end {cycles}: a block takes long, or hangs. Another \
         signal (Ctrl-C) ends the program at once, without a report."
    )
}
