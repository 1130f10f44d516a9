//! A stack of sufficient size, whatever the limit.

use std::io;
use std::panic::resume_unwind;
use std::thread;

use rustix::process::{Resource, getrlimit};

/// The default size of the main thread's stack.
const USUAL_BYTES: usize = 8 << 20;
/// What parsing a command line takes in a debug build, several times over.
const ENOUGH_BYTES: u64 = 4 << 20;

/// Does the program's work: in this thread, or in one with a stack of the usual size where a limit
/// (`ulimit -s`) leaves this one so little that it might overflow, which would kill the program without a word.
///
/// # Errors
/// The thread cannot be started.
pub fn with_usual_stack<T: Send>(work: impl FnOnce() -> T + Send) -> io::Result<T> {
    let limit = getrlimit(Resource::Stack).current;
    if limit.is_none_or(|limit| limit >= ENOUGH_BYTES) {
        return Ok(work());
    }
    thread::scope(|scope| {
        let thread = thread::Builder::new().name("main".to_owned()).stack_size(USUAL_BYTES);
        let thread = thread.spawn_scoped(scope, work)?;
        Ok(thread.join().unwrap_or_else(|panic| resume_unwind(panic)))
    })
}
