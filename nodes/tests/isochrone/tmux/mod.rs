//! A terminal for a program that draws on all of it: tmux.

use std::path::PathBuf;
use std::process::{Command, Stdio};

use isochrone_testing::{Domain, afresh, not_tested, wait_for_ok};

/// A terminal of 80 columns and 24 lines, which ends with the test.
pub(crate) struct Tmux {
    socket: PathBuf,
}

impl Tmux {
    /// Has a shell run the program with these arguments, and then say how it ended. `None` where there is
    /// no tmux.
    pub(crate) fn start(domain: &Domain, environment: &str, arguments: &str) -> Option<Self> {
        if Command::new("tmux").arg("-V").stdout(Stdio::null()).status().is_err() {
            assert!(std::env::var_os("CI").is_none(), "tmux is not installed");
            not_tested("the screen of a running node", "tmux is not installed");
            return None;
        }
        let tmux = Self { socket: domain.path("tmux") };
        let program = env!("CARGO_BIN_EXE_isochrone");
        let (config, folder) = (domain.config_file(), domain.folder().display());
        let script = format!(
            "cd '{folder}'; stty -a > before\n\
             env {environment} '{program}' {arguments} --iceoryx2-config '{}'\n\
             echo \"ended with $?\"; stty -a > after; echo compared; sleep 600\n",
            config.display()
        );
        let script = domain.write("on_the_terminal.sh", &script);
        let new = ["new-session", "-d", "-x", "80", "-y", "24", "sh"];
        let started = tmux.command().args(new).arg(script).output().unwrap();
        assert!(started.status.success(), "{}", String::from_utf8_lossy(&started.stderr));
        Some(tmux)
    }

    fn command(&self) -> Command {
        let mut command = Command::new("tmux");
        command.args(["-u", "-f", "/dev/null", "-S"]).arg(&self.socket);
        command.env("LC_ALL", "C.UTF-8").env("SHELL", "/bin/sh").env_remove("TMUX");
        afresh(command.stdin(Stdio::null()));
        command
    }

    pub(crate) fn run(&self, arguments: &[&str]) -> String {
        let output = self.command().args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    }

    pub(crate) fn shown(&self) -> String {
        self.run(&["capture-pane", "-p"])
    }

    /// Presses keys by the names that tmux has for them.
    pub(crate) fn press(&self, keys: &[&str]) {
        self.run(&[&["send-keys"], keys].concat());
    }

    /// Waits until the screen shows a text.
    #[track_caller]
    pub(crate) fn wait_for(&self, text: &str) {
        self.wait_until(text, |shown| shown.contains(text));
    }

    #[track_caller]
    pub(crate) fn wait_until(&self, what: &str, met: impl Fn(&str) -> bool) {
        wait_for_ok(&format!("the screen shows {what}"), || {
            let shown = self.shown();
            if met(&shown) { Ok(()) } else { Err(shown) }
        });
    }

    /// The process of the program.
    pub(crate) fn program(&self) -> String {
        let shell = self.run(&["display-message", "-p", "#{pane_pid}"]);
        let shell = shell.trim();
        let children = format!("/proc/{shell}/task/{shell}/children");
        std::fs::read_to_string(children).unwrap().trim().to_owned()
    }

    /// The terminal is as it was before the program: its settings, and what stood on it, without `gone`.
    #[track_caller]
    pub(crate) fn expect_given_back(&self, domain: &Domain, code: i32, gone: &str) {
        self.wait_for("compared");
        assert!(self.shown().contains(&format!("ended with {code}")), "{}", self.shown());
        assert!(!self.shown().contains(gone), "{}", self.shown());
        assert_eq!(self.run(&["display-message", "-p", "#{cursor_flag}"]).trim(), "1");
        assert_eq!(domain.read("after"), domain.read("before"));
    }
}

impl Drop for Tmux {
    fn drop(&mut self) {
        let _ = self.command().arg("kill-server").output();
    }
}
