//! Turns of loops in this process.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::ops::Range;
use std::sync::mpsc::{Sender, channel};
use std::thread;
use std::time::Duration;

use isochrone_cyclic::{
    Clock, Cyclic, Monotonic, ThreadGrant, ThreadRequest, prepare_thread, thread_usage,
};
use isochrone_machine::Environment;
use isochrone_timing::CycleRecord;

use super::turn::{Terms, Turn, TurnResult, Used, WARM_UP, cycles};
use crate::BenchError;
use crate::watch::{LOOK_INTERVAL, Watching};
use isochrone_runtime::next_epoch_ns;

/// Between two turns of a spinning loop: what the kernel grants counts anew after a second.
const SPIN_REST: Duration = Duration::from_millis(300);

/// What a loop needs around its turns.
#[derive(Clone, Copy)]
pub(super) struct Setting {
    /// Hold the machine out of its idle states meanwhile.
    pub(super) awake: bool,
    /// Rest before.
    pub(super) rest: bool,
}

/// Runs the loop in a thread of its own; what it learns stays in `cyclic`.
pub(super) fn turn(
    terms: &Terms,
    cyclic: &mut Cyclic<Monotonic>,
    turn: &Turn<'_>,
    setting: Setting,
) -> Result<TurnResult, BenchError> {
    if setting.rest {
        thread::sleep(SPIN_REST);
    }
    let _awake = setting.awake.then(stay_awake).flatten();
    let (tell, thread_id) = channel();
    let mut records = Vec::with_capacity(cycles(terms.period_ns, turn.counted));
    // Touched, so that no cycle meets a page for the first time.
    records.resize(records.capacity(), CycleRecord::default());
    records.clear();
    let job = Job { request: terms.request, phase_ns: terms.phase_ns, counted: turn.counted, tell };
    let (done, watch) = thread::scope(|scope| {
        let spawned = thread::Builder::new()
            .name("bench".into())
            .spawn_scoped(scope, || job.run(cyclic, &mut records));
        let running = spawned.map_err(BenchError::no_thread)?;
        let watching = Watching::begin(terms.cpu, thread_id.recv().ok());
        while !running.is_finished() {
            thread::sleep(LOOK_INTERVAL);
            (turn.pass)();
        }
        let watch = watching.end();
        let done = running.join().map_err(|_| BenchError::panicked("the loop's thread"))?;
        Ok::<_, BenchError>((done, watch))
    })?;
    Ok(TurnResult {
        records,
        follows: Vec::new(),
        counted: Some(done.counted),
        watch,
        thread_usage: None,
        grant: Some(done.grant),
        margin_ns: cyclic.margin_ns(),
        used: done.used,
        warnings: Vec::new(),
    })
}

/// What the loop's thread is given.
struct Job {
    request: ThreadRequest,
    phase_ns: u64,
    counted: Duration,
    /// Tells the thread's id when its set-up is done.
    tell: Sender<u32>,
}

struct LoopRun {
    grant: ThreadGrant,
    /// What was counted: from when to when.
    counted: Range<u64>,
    used: Option<Used>,
}

impl Job {
    fn run(self, cyclic: &mut Cyclic<Monotonic>, records: &mut Vec<CycleRecord>) -> LoopRun {
        let grant = prepare_thread(self.request);
        let _ = self.tell.send(rustix::thread::gettid().as_raw_nonzero().get() as u32);
        let epoch_ns = next_epoch_ns() + self.phase_ns;
        let from_ns = epoch_ns + WARM_UP.as_nanos() as u64;
        let end_ns = from_ns + self.counted.as_nanos() as u64;
        cyclic.resume(epoch_ns);
        let mut counting = None;
        while let Some(release) = cyclic.wait() {
            let is_over = release.release_ns >= end_ns;
            if counting.is_none() && release.release_ns >= from_ns {
                counting = Some((thread_usage(), release.start_ns));
            }
            let finished_ns = Monotonic.now_ns();
            cyclic.finished(finished_ns);
            // A pause that skipped cycles leaves room; nothing ever makes more of them.
            if records.len() < records.capacity() {
                records.push(CycleRecord {
                    cycle: release.cycle,
                    release_ns: release.release_ns,
                    start_ns: release.start_ns,
                    end_ns: finished_ns,
                    missed: release.missed,
                    overruns: cyclic.overruns(),
                });
            }
            if is_over {
                break;
            }
        }
        let used = counting.map(|(before, began_ns)| {
            let usage = thread_usage().since(before);
            let elapsed_ns = Monotonic.now_ns().saturating_sub(began_ns);
            Used { cpu_ns: usage.cpu_ns, elapsed_ns, usage: Some(usage) }
        });
        LoopRun { grant, counted: from_ns..end_ns, used }
    }
}

/// Holds the machine out of its idle states, as cyclictest does, for as long as the file is open.
fn stay_awake() -> Option<File> {
    let mut file = OpenOptions::new().write(true).open("/dev/cpu_dma_latency").ok()?;
    file.write_all(&0_i32.to_ne_bytes()).ok()?;
    Some(file)
}

/// How long a turn of a spinning loop may be counted, if the kernel limits real-time threads: four
/// fifths of what it grants a CPU at a time, less the warm-up.
pub(super) fn longest_spin(environment: &Environment, priority: Option<u8>) -> Option<Duration> {
    priority?;
    let granted = environment.fifo_throttling()?.granted()?;
    Some((granted * 4 / 5).saturating_sub(WARM_UP).max(Duration::from_millis(1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn throttled(text: &str) -> Environment {
        Environment { rt_throttling: text.parse().ok(), ..Environment::default() }
    }

    #[test]
    fn a_real_time_spinner_stays_below_what_the_kernel_grants() {
        let longest = longest_spin(&throttled("950000/1000000"), Some(80));
        assert_eq!(longest, Some(Duration::from_millis(560)));
    }

    #[test]
    fn a_spinner_that_nothing_limits_has_whole_turns() {
        assert_eq!(longest_spin(&throttled("-1/1000000"), Some(80)), None);
        assert_eq!(longest_spin(&throttled("950000/1000000"), None), None);
        assert_eq!(longest_spin(&Environment::default(), Some(80)), None);
    }
}
