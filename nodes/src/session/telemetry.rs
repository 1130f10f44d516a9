//! The timing of cycles, as a node's telemetry shows it.

use std::collections::HashMap;

use isochrone_ipc::{FrameLayout, LayoutKey, OpenError, Participant, SignalReader, ipc};
use isochrone_timing::CycleStartCounts;

use super::news::{FollowSample, Sample};

type Service = ipc::Service;

/// Reads the telemetry of one node.
pub(crate) struct Telemetry<'p> {
    reader: SignalReader<'p, Service>,
    /// Of the frames of this layout.
    channels: Option<(LayoutKey, Vec<TaskChannels>)>,
}

/// Where the timing of a task stands in a frame.
#[derive(Debug, PartialEq)]
struct TaskChannels {
    task: String,
    cycle: usize,
    release_jitter_ns: usize,
    /// Of a task that follows its data.
    follow: Option<FollowChannels>,
}

#[derive(Debug, PartialEq)]
struct FollowChannels {
    followed: usize,
    found_ready: usize,
    timed_out: usize,
    wait_ns: usize,
    latency_ns: usize,
}

impl<'p> Telemetry<'p> {
    /// Opens the telemetry of a node; `None` if it has none.
    pub(crate) fn open(
        participant: &'p Participant<Service>,
        node: &str,
    ) -> Result<Option<Self>, OpenError> {
        let service = format!("isochrone/{node}/telemetry");
        let reader = SignalReader::open_existing(participant, &service, &[])?;
        Ok(reader.map(|reader| Self { reader, channels: None }))
    }

    /// The cycles that came since the last call.
    pub(crate) fn take(&mut self) -> Vec<Sample> {
        let mut samples = Vec::new();
        while let Some(frame) = self.reader.next_frame() {
            let layout = frame.layout();
            if self.channels.as_ref().is_none_or(|(known, _)| *known != layout) {
                self.channels = frame.announced().map(|it| (layout, channels(&it.layout)));
            }
            let Some((_, channels)) = &self.channels else { continue };
            let (values, at_ns) = (frame.channels(), frame.receipt().received_ns);
            samples.extend(channels.iter().filter_map(|it| it.sample(values, at_ns)));
        }
        samples
    }
}

impl TaskChannels {
    /// The sample of a task in a frame; `None` while it has not run.
    fn sample(&self, values: &[f64], at_ns: u64) -> Option<Sample> {
        let value = |place: usize| {
            let value = values.get(place).filter(|value| value.is_finite() && **value >= 0.0);
            value.map(|value| *value as u64)
        };
        Some(Sample {
            task: self.task.clone(),
            cycle: value(self.cycle)?,
            at_ns,
            release_jitter_ns: value(self.release_jitter_ns)?,
            follow: self.follow.as_ref().and_then(|follow| {
                Some(FollowSample {
                    begun: CycleStartCounts {
                        followed: value(follow.followed)?,
                        found_ready: value(follow.found_ready)?,
                        timed_out: value(follow.timed_out)?,
                    },
                    wait_ns: value(follow.wait_ns)?,
                    latency_ns: value(follow.latency_ns),
                })
            }),
        })
    }
}

/// Finds `task.NAME.cycle` and its like.
fn channels(layout: &FrameLayout) -> Vec<TaskChannels> {
    let names = layout.signals.iter().enumerate();
    let places: HashMap<&str, usize> =
        names.map(|(place, signal)| (signal.name.as_str(), place)).collect();
    let tasks = layout.signals.iter().filter_map(|signal| {
        let task = signal.name.strip_prefix("task.")?.strip_suffix(".cycle")?;
        let place = |what: &str| places.get(format!("task.{task}.{what}").as_str()).copied();
        let follow = || {
            Some(FollowChannels {
                followed: place("followed")?,
                found_ready: place("found_ready")?,
                timed_out: place("timed_out")?,
                wait_ns: place("follow_wait_ns")?,
                latency_ns: place("follow_latency_ns")?,
            })
        };
        Some(TaskChannels {
            task: task.to_owned(),
            cycle: place("cycle")?,
            release_jitter_ns: place("release_jitter_ns")?,
            follow: follow(),
        })
    });
    tasks.collect()
}

#[cfg(test)]
mod tests {
    use isochrone_ipc::SignalSpec;

    use super::*;

    #[test]
    fn a_task_that_has_not_run_has_no_timing_and_no_signal_is_taken_for_one() {
        let names = [
            "task.fast.cycle",
            "task.fast.release_jitter_ns",
            "task.fast.execution_ns",
            "level",
            "task.slow.cycle",
            "task.slow.release_jitter_ns",
            "task.slow.execution_ns",
            "task.cycle",
            "task.late.cycle",
            "task.late.release_jitter_ns",
            "task.late.execution_ns",
            "task.late.follow_wait_ns",
            "task.late.followed",
            "task.late.found_ready",
            "task.late.timed_out",
            "task.late.follow_latency_ns",
        ];
        let signals = names.map(|name| SignalSpec::new(name, "LREAL")).to_vec();
        let layout = FrameLayout { signals, period_ns: None };
        let nan = f64::NAN;
        let values = [
            7.0, 1500.0, 250.0, 1.0, nan, nan, nan, 3.0, 8.0, 20.0, 300.0, 90.0, 4.0, 3.0, 2.0, nan,
        ];
        let channels = channels(&layout);
        let samples: Vec<_> = channels.iter().filter_map(|it| it.sample(&values, 9)).collect();
        let sample = |task: &str, cycle, release_jitter_ns, follow| {
            let task = task.to_owned();
            Sample { task, cycle, at_ns: 9, release_jitter_ns, follow }
        };
        let follow = FollowSample {
            begun: CycleStartCounts { followed: 4, found_ready: 3, timed_out: 2 },
            wait_ns: 90,
            latency_ns: None,
        };
        let expected = [sample("fast", 7, 1500, None), sample("late", 8, 20, Some(follow))];
        assert_eq!(samples, expected);
        assert!(channels.iter().all(|it| it.sample(&[], 9).is_none()), "a shorter frame");
    }
}
