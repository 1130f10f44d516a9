//! A process that is struck at a given system call.
//!
//! It is traced as `strace -f -e inject=CALL:signal=KILL:when=K` would, with one difference: strace
//! counts for all threads at once and strikes whichever is first, so the early calls of a thread that
//! starts late are out of its reach. A node opens its ports in such a thread.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{Read, Write};
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;

use nix::errno::Errno;
use nix::sys::ptrace::{self, Options};
use nix::sys::signal::{Signal, kill};
use nix::sys::wait::{WaitPidFlag, WaitStatus, waitpid};
use nix::unistd::Pid;

use super::call::Call;
use super::output::Output;
use super::point::{Blow, Phase};
use crate::Failure;

/// After so many sleeps with none of the calls in between, a thread has started: it waits for nothing
/// but the next cycle.
const QUIET_SLEEPS: u32 = 8;
/// After so many it does the same over and over.
const MANY_SLEEPS: u32 = 24;
/// What a traced thread that the kernel has just made, or stops with the others, reports.
const EVENT_STOP: i32 = 128;

/// A call of a thread, in a part of its life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Site {
    pub(super) phase: Phase,
    pub(super) thread: usize,
    pub(super) call: Call,
}

/// How often each call was made.
pub(super) type Counts = BTreeMap<Site, u32>;

/// Where the process is struck, and how.
#[derive(Debug, Clone, Copy)]
pub(super) struct Aim {
    pub(super) site: Site,
    /// At which of these calls, from 1.
    pub(super) k: u32,
    /// So many instructions of the program after the call; 0: instead of making it.
    pub(super) steps: u32,
    pub(super) blow: Blow,
}

/// A thread that runs instruction by instruction to where it is struck.
#[derive(Debug, Clone, Copy)]
struct Walk {
    pid: Pid,
    steps_left: u32,
    blow: Blow,
}

/// What became of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Event {
    /// The blow was dealt.
    Struck,
    /// It ended with this exit code, or by a signal.
    Ended(Option<i32>),
}

#[derive(Debug, Default)]
struct Thread {
    index: usize,
    sleeps: u32,
    quiet_sleeps: u32,
    is_settled: bool,
}

impl Thread {
    fn sleeps(&mut self) {
        self.sleeps += 1;
        self.quiet_sleeps += 1;
        self.is_settled |= self.quiet_sleeps >= QUIET_SLEEPS || self.sleeps >= MANY_SLEEPS;
    }
}

pub(super) struct Tracer {
    pub(super) leader: Pid,
    aim: Option<Aim>,
    report: Sender<Event>,
    settled: Arc<AtomicBool>,
    threads: BTreeMap<Pid, Thread>,
    detached: BTreeSet<Pid>,
    phase: Phase,
    /// Whether the program runs, not the shell before it.
    is_program: bool,
    is_struck: bool,
    walk: Option<Walk>,
    counts: Counts,
}

impl Tracer {
    /// Starts a program behind a shell that says a line and waits for one, and attaches to it.
    pub(super) fn attach(
        mut gated: Command,
        aim: Option<Aim>,
        report: Sender<Event>,
        settled: Arc<AtomicBool>,
    ) -> Result<(Self, Output), Failure> {
        let mut shell = gated.spawn()?;
        let leader = Pid::from_raw(shell.id().cast_signed());
        // Before that the shell itself may still be about to become one, and would be taken for the
        // program.
        if let Some(stdout) = &mut shell.stdout {
            stdout.read_exact(&mut [0])?;
        }
        let options = Options::PTRACE_O_TRACESYSGOOD
            | Options::PTRACE_O_TRACECLONE
            | Options::PTRACE_O_TRACEEXEC
            | Options::PTRACE_O_EXITKILL;
        if let Err(error) = ptrace::seize(leader, options) {
            let _ = shell.kill();
            let _ = shell.wait();
            return Err(format!("this process may not trace others: {error}").into());
        }
        let output = Output::of(shell.stdout.take(), shell.stderr.take());
        if let Some(mut gate) = shell.stdin.take() {
            gate.write_all(b"go\n")?;
        }
        let tracer = Self {
            leader,
            aim,
            report,
            settled,
            threads: BTreeMap::new(),
            detached: BTreeSet::new(),
            phase: Phase::Start,
            is_program: false,
            is_struck: false,
            walk: None,
            counts: Counts::new(),
        };
        Ok((tracer, output))
    }

    /// Traces it to its end.
    pub(super) fn trace(mut self) -> Result<Counts, Failure> {
        // Its process group holds all its threads, and nobody else's processes.
        let group = Pid::from_raw(-self.leader.as_raw());
        loop {
            let status = match waitpid(group, Some(WaitPidFlag::__WALL)) {
                Ok(status) => status,
                Err(Errno::EINTR) => continue,
                Err(error) => return Err(format!("lost the traced process: {error}").into()),
            };
            match status {
                WaitStatus::Exited(pid, code) if pid == self.leader => {
                    let _ = self.report.send(Event::Ended(Some(code)));
                    return Ok(self.counts);
                }
                WaitStatus::Signaled(pid, ..) if pid == self.leader => {
                    let _ = self.report.send(Event::Ended(None));
                    return Ok(self.counts);
                }
                stopped => self.stopped(stopped),
            }
        }
    }

    fn stopped(&mut self, status: WaitStatus) {
        let Some(pid) = status.pid() else { return };
        let signal = match status {
            WaitStatus::Stopped(_, signal) => Some(signal),
            _ => None,
        };
        if self.is_struck && self.aim.is_some_and(|aim| aim.blow == Blow::Stop) {
            // From here on the kernel alone holds it, as it does any process that was stopped.
            self.detach(pid, signal);
            return;
        }
        if self.walk.is_some_and(|walk| walk.pid == pid) && !self.is_struck {
            self.walks(status, signal);
            return;
        }
        match status {
            WaitStatus::PtraceEvent(_, _, libc::PTRACE_EVENT_EXEC) => {
                self.is_program = true;
                self.know(pid);
            }
            WaitStatus::PtraceEvent(_, _, EVENT_STOP) => self.know(pid),
            WaitStatus::PtraceSyscall(_) if self.is_program && self.is_struck_by(pid) => return,
            WaitStatus::Stopped(_, Signal::SIGINT) => self.phase = Phase::End,
            _ => {}
        }
        // Where the process is gone by now, waiting tells.
        let _ = ptrace::syscall(pid, signal);
    }

    /// Gives a thread its number.
    fn know(&mut self, pid: Pid) {
        let index = self.threads.len();
        if self.is_program {
            self.threads.entry(pid).or_insert(Thread { index, ..Thread::default() });
        }
    }

    /// Counts a call; deals the blow if it is the one.
    fn is_struck_by(&mut self, pid: Pid) -> bool {
        let Some((number, second, fourth)) = entered(pid) else { return false };
        self.know(pid);
        let Some(thread) = self.threads.get_mut(&pid) else { return false };
        if Call::is_sleep(number, second, fourth) {
            thread.sleeps();
            if thread.index == 0 && thread.is_settled {
                self.settled.store(true, Ordering::Relaxed);
            }
        }
        let Some(call) = Call::numbered(number) else { return false };
        thread.quiet_sleeps = 0;
        // Without an aim this is a dry run, which tells what is worth aiming at.
        if self.aim.is_none() && self.phase == Phase::Start && thread.is_settled {
            return false;
        }
        let site = Site { phase: self.phase, thread: thread.index, call };
        let count = self.counts.entry(site).or_default();
        *count += 1;
        let count = *count;
        let is_here = |aim: &Aim| aim.site == site && aim.k == count;
        let Some(aim) = self.aim.filter(is_here) else { return false };
        if aim.steps > 0 {
            self.walk = Some(Walk { pid, steps_left: aim.steps, blow: aim.blow });
            return false;
        }
        self.strike(pid, aim.blow);
        true
    }

    /// Lets a thread make its next step, or strikes it after the last.
    fn walks(&mut self, status: WaitStatus, signal: Option<Signal>) {
        let Some(walk) = &mut self.walk else { return };
        let has_stepped = signal == Some(Signal::SIGTRAP);
        walk.steps_left -= u32::from(has_stepped);
        let Walk { pid, steps_left, blow } = *walk;
        if steps_left == 0 {
            return self.strike(pid, blow);
        }
        if let WaitStatus::Stopped(_, Signal::SIGINT) = status {
            self.phase = Phase::End;
        }
        let _ = ptrace::step(pid, signal.filter(|_| !has_stepped));
    }

    fn strike(&mut self, pid: Pid, blow: Blow) {
        self.is_struck = true;
        match blow {
            // A call that is due is not made: the thread finds itself dead before.
            Blow::Kill => drop(kill(self.leader, Signal::SIGKILL)),
            // A call that is due is made, and the thread stops on its way out.
            Blow::Stop => self.detach(pid, Some(Signal::SIGSTOP)),
        }
        let _ = self.report.send(Event::Struck);
    }

    fn detach(&mut self, pid: Pid, signal: Option<Signal>) {
        if self.detached.insert(pid) {
            let _ = ptrace::detach(pid, signal);
        }
    }
}

/// The call that a stopped thread is about to make: its number, and its second and fourth argument; none if it has
/// just made it.
fn entered(pid: Pid) -> Option<(i64, u64, u64)> {
    let is_entry = ptrace::syscall_info(pid).ok()?.op == libc::PTRACE_SYSCALL_INFO_ENTRY;
    if !is_entry {
        return None;
    }
    let registers = ptrace::getregs(pid).ok()?;
    #[cfg(target_arch = "x86_64")]
    return Some((registers.orig_rax.cast_signed(), registers.rsi, registers.r10));
    #[cfg(target_arch = "aarch64")]
    return Some((registers.regs[8].cast_signed(), registers.regs[1], registers.regs[3]));
}
