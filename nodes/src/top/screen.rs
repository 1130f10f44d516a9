//! The terminal while the screen has it, and giving it back however the program ends.

use std::io::{self, IsTerminal, Stdout, stdout};
use std::panic;
use std::time::Duration;

use ratatui::Terminal;
use ratatui::backend::CrosstermBackend;
use ratatui::crossterm::cursor::Show;
use ratatui::crossterm::execute;
use ratatui::crossterm::terminal::{
    EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode,
};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;

use crate::failure::Failure;
use crate::terminal;

/// The terminal. It is given back when this is dropped, and before the message of a panic in any thread.
pub(crate) struct Screen {
    pub(crate) terminal: Terminal<CrosstermBackend<Stdout>>,
}

impl Screen {
    /// Whether stdout is a terminal that can show a screen.
    pub(crate) fn is_possible() -> bool {
        stdout().is_terminal() && !is_dumb()
    }

    /// Names alternatives if stdout is not a terminal that can show a screen.
    pub(crate) fn check() -> Result<(), Failure> {
        if Self::is_possible() {
            return Ok(());
        }
        let is_dumb = is_dumb();
        let what = if is_dumb { "the terminal is \"dumb\"" } else { "stdout is no terminal" };
        Err(Failure::usage(format!(
            "top needs a terminal, and {what}; `isochrone show NODE` prints the signals once, and `isochrone watch NODE NAME…` prints them as they change"
        )))
    }

    /// Takes the terminal.
    pub(crate) fn open() -> Result<Self, Failure> {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            restore();
            before(panic);
        }));
        Self::enter().map_err(|error| {
            restore();
            Failure::found(format!("cannot use the terminal: {error}"))
        })
    }

    fn enter() -> io::Result<Self> {
        enable_raw_mode()?;
        terminal::hold_notes();
        execute!(stdout(), EnterAlternateScreen)?;
        Ok(Self { terminal: Terminal::new(CrosstermBackend::new(stdout()))? })
    }
}

fn is_dumb() -> bool {
    std::env::var_os("TERM").is_some_and(|term| term == "dumb")
}

impl Drop for Screen {
    fn drop(&mut self) {
        restore();
        // The hook of the screen has nothing left to do.
        if !std::thread::panicking() {
            drop(panic::take_hook());
        }
    }
}

/// The result of waiting for the terminal.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Wait {
    /// A key, or the time is over.
    Over,
    /// The terminal is gone: its window was closed.
    HungUp,
}

/// Waits for a key. Of a terminal that is gone crossterm would read the end for ever.
pub(crate) fn wait(time: Duration) -> io::Result<Wait> {
    let stdout = stdout();
    let mut terminal = [PollFd::new(&stdout, PollFlags::IN)];
    let time = Timespec::try_from(time).map_err(io::Error::other)?;
    match poll(&mut terminal, Some(&time)) {
        Ok(_) | Err(Errno::INTR) => {}
        Err(error) => return Err(error.into()),
    }
    let [terminal] = terminal;
    let gone = PollFlags::HUP | PollFlags::ERR | PollFlags::NVAL;
    Ok(if terminal.revents().intersects(gone) { Wait::HungUp } else { Wait::Over })
}

/// Restores the terminal; a second call does no harm. A failure cannot be reported.
pub(crate) fn restore() {
    let _ = disable_raw_mode();
    let _ = execute!(stdout(), LeaveAlternateScreen, Show);
    terminal::release_notes();
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use super::*;

    /// Run by the next test, on a terminal of its own.
    #[test]
    #[ignore = "takes the terminal and panics"]
    fn a_panic_on_the_screen() {
        let _screen = Screen::open().map_err(|_| "no terminal").unwrap();
        crate::terminal::note("noted while the screen was shown");
        panic!("in the middle of it");
    }

    #[test]
    fn a_panic_gives_the_terminal_back_before_its_message() {
        let folder = tempfile::tempdir().unwrap();
        let this = std::env::current_exe().unwrap();
        let command = format!(
            "cd '{}'; stty -a > before; '{}' --ignored --nocapture a_panic_on_the_screen; stty -a > after",
            folder.path().display(),
            this.display()
        );
        let script = Command::new("script").args(["-qec", &command, "/dev/null"]).output();
        let Ok(written) = script else {
            assert!(std::env::var_os("CI").is_none(), "`script` is not installed");
            return isochrone_testing::not_tested("a panic on the screen", "no `script`");
        };
        let written = String::from_utf8(written.stdout).unwrap();
        let place = |text: &str| {
            written.find(text).unwrap_or_else(|| panic!("{text:?} is not in {written:?}"))
        };
        let (taken, given_back) = (place("\u{1b}[?1049h"), place("\u{1b}[?1049l"));
        assert!(taken < given_back && given_back < place("in the middle of it"), "{written:?}");
        assert!(given_back < place("noted while the screen was shown"), "{written:?}");
        let read = |name| std::fs::read_to_string(folder.path().join(name)).unwrap();
        assert_eq!(read("after"), read("before"));
    }
}
