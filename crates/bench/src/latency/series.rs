//! The series that an arm measured under one circumstance.

use isochrone_machine::Disturbance;
use isochrone_report::{LinkArm, Turns};
use isochrone_timing::{Distribution, LinkReport, Metric, Warning, WarningCode, encoded};

use super::arm::Arm;
use super::measurer::TurnResult;
use super::measuring::Stages;
use super::pace::SendPace;
use super::turn::SenderCounts;

/// What an arm has measured under one circumstance.
pub(super) struct Series {
    arm: Arm,
    pace: SendPace,
    values: usize,
    turns: Turns,
    stages: Stages,
    timed_out: Option<u64>,
    received: u64,
    sent: u64,
    /// Instants at which the sender could not send.
    missed: u64,
    /// Of the turns without their warm-up.
    elapsed_ns: u64,
}

/// When a turn was, and what disturbed it.
pub(super) struct Disturbed {
    pub(super) at_s: f64,
    pub(super) elapsed_ns: u64,
    pub(super) sender: Disturbance,
    pub(super) receiver: Disturbance,
}

/// How well a sender kept its pace.
pub(super) struct KeptPace {
    label: String,
    /// Instants at which it was to send, ...
    asked: u64,
    /// ... and at which it could not.
    missed: u64,
}

impl KeptPace {
    fn missed_part(&self) -> f64 {
        self.missed as f64 / self.asked.max(1) as f64
    }

    /// Says so if there are senders that could not keep their pace.
    pub(super) fn warning(all: &[Self]) -> Option<Warning> {
        /// Part of the instants that may be missed in silence.
        const TOLERATED: f64 = 0.01;
        let late = || all.iter().filter(|pace| pace.missed_part() > TOLERATED);
        let worst = late().max_by(|a, b| a.missed_part().total_cmp(&b.missed_part()))?;
        Some(Warning::new(
            WarningCode::PaceNotKept,
            format!(
                "in {} of {} rows the sender could not keep its pace and sent fewer messages; worst: {}, \
                 {} of {} instants missed",
                late().count(),
                all.len(),
                worst.label,
                worst.missed,
                worst.asked
            ),
        ))
    }
}

impl Series {
    pub(super) fn new(arm: Arm, pace: SendPace, values: usize) -> Self {
        Self {
            arm,
            pace,
            values,
            turns: Turns::default(),
            stages: Stages::default(),
            timed_out: None,
            received: 0,
            sent: 0,
            missed: 0,
            elapsed_ns: 0,
        }
    }

    pub(super) fn arm(&self) -> Arm {
        self.arm
    }

    /// What people see while it is measured.
    pub(super) fn label(&self) -> String {
        let unit = if self.values == 1 { "value" } else { "values" };
        format!("{} ({}, {} {unit})", self.arm, self.pace, self.values)
    }

    /// All samples so far.
    pub(super) fn samples(&self) -> &Distribution {
        self.turns.all()
    }

    /// Takes in a turn.
    pub(super) fn push(&mut self, turn: &Disturbed, result: &TurnResult, sent: &SenderCounts) {
        let disturbance = match result.sent {
            // One thread sends and receives.
            Some(_) => alone(turn.sender, turn.receiver),
            None => both(turn.sender, turn.receiver, sent),
        };
        let lost = result.received.lost;
        self.turns.push(turn.at_s, turn.elapsed_ns, &result.samples, lost, disturbance);
        self.received += result.received.messages;
        self.sent += sent.messages;
        self.missed += sent.missed;
        self.elapsed_ns += turn.elapsed_ns;
        self.stages.merge(&result.stages);
        if let Some(timed_out) = result.timed_out {
            *self.timed_out.get_or_insert_default() += timed_out;
        }
    }

    /// What became of the pace.
    pub(super) fn pace(&self) -> KeptPace {
        KeptPace { label: self.label(), asked: self.sent + self.missed, missed: self.missed }
    }

    /// The report, if there is anything to report.
    pub(super) fn report(&self) -> Option<LinkArm> {
        if self.turns.reports().is_empty() {
            return None;
        }
        let stages = &self.stages;
        let link = LinkReport {
            service: self.arm.as_str().to_owned(),
            frames: self.received,
            lost: self.turns.missed(),
            rate_hz: Some(self.received as f64 * 1e9 / self.elapsed_ns.max(1) as f64),
            one_way_ns: self.turns.all().summary(),
            end_to_end_ns: stages.end_to_end.summary(),
            age_at_publish_ns: stages.age_at_publish.summary(),
            histograms: encoded([
                (Metric::ONE_WAY.key, self.turns.all()),
                ("end_to_end_ns", &stages.end_to_end),
                ("age_at_publish_ns", &stages.age_at_publish),
                ("age_at_release_ns", &stages.age_at_release),
            ]),
            ..LinkReport::default()
        };
        Some(LinkArm {
            link,
            values: self.values as u64,
            paced_hz: self.pace.hz(),
            timed_out: self.timed_out,
            age_at_release_ns: stages.age_at_release.summary(),
            turns: self.turns.reports().to_vec(),
        })
    }
}

/// What disturbed either of the two. Both are in one control group, so it was throttled once.
fn both(sender: Disturbance, receiver: Disturbance, sent: &SenderCounts) -> Disturbance {
    // The other process counts its thread itself.
    let sender = Disturbance { faults: sent.faults, preemptions: sent.preemptions, ..sender };
    Disturbance { throttled_ns: receiver.throttled_ns, ..sender.and(receiver) }
}

/// What disturbed the one thread that sends and receives, and the CPUs of the nodes.
fn alone(nodes: Disturbance, thread: Disturbance) -> Disturbance {
    let Disturbance { throttled_ns, faults, preemptions, .. } = thread;
    Disturbance { throttled_ns, faults, preemptions, ..nodes.and(thread) }
}

#[cfg(test)]
mod tests {
    use isochrone_timing::Distribution;

    use super::*;
    use crate::latency::arms::arm;
    use crate::latency::turn::Received;

    const PACES: [SendPace; 2] = [SendPace::Hz(1_000.0), SendPace::BackToBack];

    #[test]
    fn the_age_of_a_value_at_every_stage_is_in_the_report() {
        let mut series = Series::new(arm("node"), PACES[0], 1);
        let mut stages = Stages::default();
        stages.age_at_release.record(600_000);
        stages.age_at_publish.record(650_000);
        stages.end_to_end.record(651_000);
        let result = TurnResult {
            samples: Distribution::new(),
            received: Received { messages: 1, lost: 0 },
            stages,
            sent: None,
            timed_out: None,
        };
        let none = Disturbance::default();
        let turn = Disturbed { at_s: 0.0, elapsed_ns: 1_000_000, sender: none, receiver: none };
        series.push(&turn, &result, &SenderCounts::default());
        let report = series.report().unwrap();
        let ages =
            [report.age_at_release_ns, report.link.age_at_publish_ns, report.link.end_to_end_ns];
        assert_eq!(ages.map(|age| age.max), [600_000, 650_000, 651_000].map(Some));
    }

    #[test]
    fn where_one_thread_sends_and_receives_its_faults_count_and_so_do_the_nodes_cpus() {
        let mut series = Series::new(arm("follow"), PACES[0], 1);
        let cpu = |steal_ns| Disturbance { steal_ns: Some(steal_ns), ..Disturbance::default() };
        for (at_s, steal_ns, faults) in [(0.0, 0, 0), (1.0, 9_000_000, 0), (2.0, 0, 1)] {
            let sent = SenderCounts { messages: 50, ..SenderCounts::default() };
            let result = TurnResult {
                samples: Distribution::new(),
                received: Received { messages: 50, lost: 0 },
                stages: Stages::default(),
                sent: Some(sent),
                timed_out: Some(3),
            };
            let receiver = Disturbance { faults: Some(faults), ..cpu(0) };
            let elapsed_ns = 500_000_000;
            let turn = Disturbed { at_s, elapsed_ns, sender: cpu(steal_ns), receiver };
            series.push(&turn, &result, &sent);
        }
        let report = series.report().unwrap();
        assert_eq!(report.timed_out, Some(9));
        let invalid: Vec<bool> = report.turns.iter().map(|turn| turn.invalid.is_some()).collect();
        assert_eq!(invalid, [false, true, true]);
    }

    #[test]
    fn a_message_of_one_value_is_called_so() {
        let label = |values| Series::new(arm("raw"), SendPace::BackToBack, values).label();
        assert_eq!(label(1), format!("raw ({}, 1 value)", SendPace::BackToBack));
        assert_eq!(label(64), format!("raw ({}, 64 values)", SendPace::BackToBack));
    }

    #[test]
    fn a_series_reports_all_its_turns_and_what_was_lost_in_them() {
        let mut series = Series::new(arm("tcp"), SendPace::Hz(100.0), 64);
        assert!(series.report().is_none());
        let mut samples = Distribution::new();
        samples.record_many(900, 50);
        let received = Received { messages: 50, lost: 2 };
        let result = TurnResult {
            samples,
            received,
            stages: Stages::default(),
            sent: None,
            timed_out: None,
        };
        let of = |steal_ns| Disturbance { steal_ns: Some(steal_ns), ..Disturbance::default() };
        for (at_s, sender) in [(0.0, of(0)), (1.0, of(9_000_000))] {
            let receiver = of(0);
            let turn = Disturbed { at_s, elapsed_ns: 500_000_000, sender, receiver };
            series.push(
                &turn,
                &result,
                &SenderCounts { messages: 50, missed: 1, ..SenderCounts::default() },
            );
        }
        let report = series.report().unwrap();
        assert_eq!((report.link.frames, report.link.lost), (100, 4));
        assert_eq!(report.link.rate_hz, Some(100.0));
        assert_eq!(report.link.one_way_ns.count, 100);
        let invalid: Vec<bool> = report.turns.iter().map(|turn| turn.invalid.is_some()).collect();
        assert_eq!(invalid, [false, true], "the sender's steal counts as the receiver's");
        assert_eq!(report.link.histograms.keys().collect::<Vec<_>>(), ["one_way_ns"]);
        let pace = [series.pace(), KeptPace { label: "raw".into(), asked: 100, missed: 1 }];
        let warning = KeptPace::warning(&pace).unwrap().message;
        for says in ["in 1 of 2 rows", "tcp (100 Hz, 64 values), 2 of 102 instants"] {
            assert!(warning.contains(says), "{warning}");
        }
        assert_eq!(KeptPace::warning(&pace[1..]), None, "one in a hundred is life");
    }
}
