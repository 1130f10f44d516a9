//! Named pipes, whose other end may not be there yet.

use std::io;
use std::path::Path;
use std::thread;
use std::time::Duration;

use isochrone_processes::is_asked_to_end;

use crate::terminal;

/// Between two looks for the other end.
const LOOK: Duration = Duration::from_millis(20);

/// Polls `look` until another process "reads" or "writes" the pipe. Reports the wait after `looks_until_said` polls,
/// and ends on a signal.
pub(super) fn await_other_end<T>(
    path: &Path,
    does: &str,
    looks_until_said: usize,
    mut look: impl FnMut() -> io::Result<Option<T>>,
) -> io::Result<T> {
    for looks in 1.. {
        if let Some(found) = look()? {
            return Ok(found);
        }
        if is_asked_to_end() {
            break;
        }
        if looks == looks_until_said {
            terminal::note(&format!("waiting until somebody {does} the pipe {}", path.display()));
        }
        thread::sleep(LOOK);
    }
    Err(io::Error::other(format!("nobody {does} this pipe")))
}
