//! HdrHistogram's interval log (`.hlog`, version 1.3).

use std::time::{Duration, SystemTime};

use hdrhistogram::serialization::V2DeflateSerializer;
use hdrhistogram::serialization::interval_log::{
    IntervalLogWriter, IntervalLogWriterBuilder, IntervalLogWriterError, Tag,
};
use isochrone_timing::Distribution;
use jiff::Timestamp;

use crate::bench::Reported;
use crate::report::{Report, TurnReport};

type Writer<'a> = IntervalLogWriter<'a, 'a, Vec<u8>, V2DeflateSerializer>;
type Failure = IntervalLogWriterError<hdrhistogram::serialization::V2DeflateSerializeError>;

/// Writes the turns of a bench as HdrHistogram's interval log, in the order in which they ran:
/// start and duration in s, maximum in ms (us for costs), and all samples in ns (ps for costs). The
/// tag is the arm with its conditions. A comment before an invalid turn states the reason. The
/// report of a run has no turns, so its log has no intervals.
pub fn hlog(report: &Report) -> String {
    let mut bytes = Vec::new();
    match written(report, &mut bytes) {
        Ok(()) => String::from_utf8_lossy(&bytes).into_owned(),
        Err(_) => unreachable!("writing to memory does not fail, and the counts fit"),
    }
}

fn written(report: &Report, bytes: &mut Vec<u8>) -> Result<(), Failure> {
    let mut head = IntervalLogWriterBuilder::new();
    head.add_comment("[Histogram log format version 1.3]");
    let command = report.command.join(" ").replace(char::is_control, " ");
    head.add_comment(&format!("[isochrone {} {command}]", report.isochrone));
    if let Ok(started) = report.started.parse::<Timestamp>() {
        let started = SystemTime::from(started);
        // With the start alone, Java's reader has to guess that the intervals count from there.
        head.with_start_time(started).with_base_time(started);
    }
    head.with_max_value_divisor(1e6);
    let mut serializer = V2DeflateSerializer::new();
    let mut log = head.begin_log_with(bytes, &mut serializer)?;
    let tasks = report.tasks.iter().flat_map(tagged);
    let links = report.links.iter().flat_map(tagged);
    let costs = report.costs.iter().flat_map(tagged);
    let mut turns: Vec<(String, &TurnReport)> = tasks.chain(links).chain(costs).collect();
    turns.sort_by(|(_, one), (_, other)| one.at_s.total_cmp(&other.at_s));
    turns.iter().try_for_each(|(tag, turn)| interval(&mut log, tag, turn))
}

fn interval(log: &mut Writer<'_>, tag: &str, turn: &TurnReport) -> Result<(), Failure> {
    let Ok(samples) = Distribution::decode(&turn.histogram) else {
        return Ok(log.write_comment(&format!("{tag}: a turn whose histogram cannot be read"))?);
    };
    if let Some(why) = &turn.invalid {
        log.write_comment(&format!("the next interval is invalid: {why}"))?;
    }
    let at = Duration::try_from_secs_f64(turn.at_s).unwrap_or_default();
    let elapsed = Duration::from_nanos(turn.elapsed_ns);
    log.write_histogram(samples.histogram(), at, elapsed, Tag::new(tag))
}

/// The turns of an arm, each with the arm's tag.
fn tagged<R: Reported>(part: &R) -> impl Iterator<Item = (String, &TurnReport)> {
    // A tag has neither commas nor blanks.
    let tag = match part.circumstances() {
        none if none.is_empty() => part.arm().to_owned(),
        circumstances => format!("{}/{}", part.arm(), circumstances.replace(", ", "/")),
    };
    let tag = tag.replace(|c: char| c == ',' || c.is_whitespace() || c.is_control(), "_");
    part.turns().iter().map(move |turn| (tag.clone(), turn))
}

#[cfg(test)]
mod tests {
    use hdrhistogram::serialization::interval_log::{IntervalLogIterator, LogEntry};
    use isochrone_machine::Disturbance;
    use isochrone_timing::TaskReport;

    use super::*;
    use crate::bench::Turns;
    use crate::report::{CostReport, TaskArm};

    fn turns(ns: u64, at_s: &[f64], disturbance: Disturbance) -> Vec<TurnReport> {
        let mut samples = Distribution::new();
        samples.record_many(ns, 1_000);
        let mut turns = Turns::default();
        at_s.iter().for_each(|at_s| turns.push(*at_s, 1_500_000_000, &samples, 0, disturbance));
        turns.reports().to_vec()
    }

    fn task(name: &str, turns: Vec<TurnReport>) -> TaskArm {
        TaskArm {
            task: TaskReport {
                name: name.to_owned(),
                period_ns: 1_000_000,
                ..TaskReport::default()
            },
            load: "idle".to_owned(),
            turns,
            ..TaskArm::default()
        }
    }

    fn report() -> Report {
        let fault = Disturbance { faults: Some(2), ..Disturbance::default() };
        Report {
            isochrone: "0.1.0".to_owned(),
            command: vec!["bench".to_owned()],
            started: "2026-11-20T12:00:00Z".to_owned(),
            tasks: vec![
                task("sleep", turns(50_000, &[0.5, 4.0], Disturbance::default())),
                task("a, b", turns(2_000_000, &[2.0], fault)),
            ],
            ..Report::default()
        }
    }

    #[test]
    fn a_log_reads_back_with_each_turn_in_the_order_of_time() {
        let text = hlog(&report());
        let entries: Vec<LogEntry<'_>> =
            IntervalLogIterator::new(text.as_bytes()).map(|entry| entry.unwrap()).collect();
        let intervals: Vec<_> = entries
            .iter()
            .filter_map(|entry| match entry {
                LogEntry::Interval(interval) => Some(interval),
                _ => None,
            })
            .collect();
        let tags: Vec<&str> = intervals.iter().map(|i| i.tag().unwrap().as_str()).collect();
        assert_eq!(tags, ["sleep/1_ms/idle", "a__b/1_ms/idle", "sleep/1_ms/idle"]);
        let starts: Vec<f64> =
            intervals.iter().map(|i| i.start_timestamp().as_secs_f64()).collect();
        assert_eq!(starts, [0.5, 2.0, 4.0]);
        assert!(intervals.iter().all(|i| i.duration().as_millis() == 1_500), "{text}");
        assert!((intervals[1].max() - 2.0).abs() < 0.002, "in ms: {}", intervals[1].max());
        let read = Distribution::decode(intervals[0].encoded_histogram()).unwrap().summary();
        assert_eq!((read.count, read.p50.map(|ns| ns / 100)), (1_000, Some(500)));
        let noon = Duration::from_secs(1_795_176_000);
        assert!(entries.contains(&LogEntry::StartTime(noon)), "{text}");
        assert!(entries.contains(&LogEntry::BaseTime(noon)), "{text}");
    }

    #[test]
    fn a_log_begins_with_its_format_and_says_which_turn_is_invalid() {
        let text = hlog(&report());
        assert!(text.starts_with("#[Histogram log format version 1.3]\n"), "{text}");
        let (_, after) = text.split_once("#the next interval is invalid: 2 page faults\n").unwrap();
        assert!(after.starts_with("Tag=a__b/1_ms/idle,2.000,"), "{after}");
    }

    #[test]
    fn a_turn_that_cannot_be_read_is_said_and_a_report_without_a_date_has_no_start() {
        let mut broken = report();
        broken.started = "yesterday".to_owned();
        broken.tasks.truncate(1);
        broken.tasks[0].turns[0].histogram = "no".to_owned();
        broken.costs = vec![CostReport::default()];
        let text = hlog(&broken);
        assert!(!text.contains("StartTime"), "{text}");
        assert!(text.contains("#sleep/1_ms/idle: a turn whose histogram cannot be read\n"));
        assert_eq!(text.lines().filter(|line| line.starts_with("Tag=")).count(), 1);
    }
}
