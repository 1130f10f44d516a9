use std::ops::Range;

use super::*;

const US: u64 = 1_000;
const MS: u64 = 1_000_000;
/// When the writers below begin; any time will do.
const BEGIN_NS: u64 = 7_000_000_000;
/// How long after the instant that it asked for a reader looks.
const WAKE_UP_NS: u64 = 8 * US;

/// A frame that is sent, and what its writer stamps on it.
#[derive(Clone, Copy)]
struct Sent {
    at_ns: u64,
    header: FrameHeader,
}

fn plain(at_ns: u64) -> Sent {
    Sent { at_ns, header: FrameHeader { publish_ns: at_ns, ..FrameHeader::default() } }
}

fn on_grid(release_ns: u64, at_ns: u64) -> Sent {
    Sent { at_ns, header: FrameHeader { release_ns, publish_ns: at_ns, ..FrameHeader::default() } }
}

/// Frames of a plain writer with a period, the first one `begin_ns` after the beginning.
fn periodic(begin_ns: u64, period_ns: u64, count: u64) -> Vec<Sent> {
    (0..count).map(|k| plain(BEGIN_NS + begin_ns + k * period_ns)).collect()
}

/// A number below `limit` that looks like chance.
fn chance(k: u64, limit: u64) -> u64 {
    (k.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(23).wrapping_mul(0xbf58_476d_1ce4_e5b9)
        >> 33)
        % limit
}

/// What a reader saw that sleeps between its looks.
#[derive(Debug, Default)]
struct Seen {
    /// How long each frame lay there.
    latencies_ns: Vec<u64>,
    looks: u64,
    /// Most frames that one look found.
    at_once: usize,
    longest_nap_ns: u64,
}

impl Seen {
    fn quantile_ns(&self, percent: usize) -> u64 {
        let mut sorted = self.latencies_ns.clone();
        sorted.sort_unstable();
        sorted[(sorted.len() - 1) * percent / 100]
    }

    /// Without the first few, from which the rhythm was learned.
    fn settled(mut self) -> Self {
        self.latencies_ns.drain(..8);
        self
    }
}

fn reader() -> Expectation {
    Expectation::new(256)
}

/// Reads the frames until `end_ns`, sleeping as told.
fn read(expectation: &mut Expectation, frames: &[Sent], from_ns: u64, end_ns: u64) -> Seen {
    read_woken(expectation, frames, from_ns..end_ns, |_| WAKE_UP_NS)
}

/// As `read`, woken so late after each nap.
fn read_woken(
    expectation: &mut Expectation,
    frames: &[Sent],
    time_ns: Range<u64>,
    late_ns: impl Fn(u64) -> u64,
) -> Seen {
    let Range { start: from_ns, end: end_ns } = time_ns;
    let mut seen = Seen::default();
    let mut now_ns = from_ns;
    let mut left = frames.iter().filter(|frame| frame.at_ns >= from_ns).peekable();
    while now_ns < end_ns {
        seen.looks += 1;
        expectation.woke(now_ns);
        let mut at_once = 0;
        while let Some(frame) = left.next_if(|frame| frame.at_ns <= now_ns) {
            expectation.note(&frame.header);
            seen.latencies_ns.push(now_ns - frame.at_ns);
            at_once += 1;
        }
        seen.at_once = seen.at_once.max(at_once);
        let look_ns = expectation.next_look_ns(now_ns);
        assert!(look_ns > now_ns, "{look_ns} {now_ns}");
        seen.longest_nap_ns = seen.longest_nap_ns.max(look_ns - now_ns);
        now_ns = look_ns + late_ns(look_ns - now_ns);
    }
    seen
}

/// Reads all of the frames.
fn read_all(frames: &[Sent]) -> Seen {
    let end_ns = frames.last().unwrap().at_ns + 10 * MS;
    let seen = read(&mut reader(), frames, BEGIN_NS, end_ns);
    assert_eq!(seen.latencies_ns.len(), frames.len());
    seen
}

#[test]
fn a_periodic_writer_is_read_in_one_look_a_frame_though_it_announces_nothing() {
    for period_ns in [250 * US, MS, 3 * MS] {
        let frames = periodic(50 * US, period_ns, 400);
        let seen = read_all(&frames);
        assert!(seen.looks < 400 + 100, "{period_ns}: {}", seen.looks);
        assert!(seen.settled().quantile_ns(100) <= 10 * US, "{period_ns}");
    }
}

#[test]
fn a_slow_writer_is_seen_at_once_between_naps_of_some_milliseconds() {
    let seen = read_all(&periodic(0, 100 * MS, 40));
    assert!(seen.looks < 40 * 21 + 200, "{}", seen.looks);
    assert!(seen.longest_nap_ns <= 5 * MS);
    assert!(seen.settled().quantile_ns(100) <= 10 * US);
}

#[test]
fn a_reader_that_is_woken_late_asks_earlier_and_hardly_looks_more_often() {
    // Long sleeps end 40 to 90 us late, short ones 5 us.
    let late_ns =
        |nap_ns: u64| if nap_ns < 100 * US { 5 * US } else { 40 * US + chance(nap_ns, 50 * US) };
    for period_ns in [2 * MS, 4 * MS] {
        let frames: Vec<_> =
            (0..400).map(|k| plain(BEGIN_NS + k * period_ns + chance(k, 3 * US))).collect();
        let end_ns = BEGIN_NS + 400 * period_ns;
        let seen = read_woken(&mut reader(), &frames, BEGIN_NS..end_ns, late_ns);
        assert!(seen.looks < 400 * 3 / 2 + 50, "{period_ns}: {}", seen.looks);
        let seen = seen.settled();
        assert!(seen.quantile_ns(50) < 30 * US, "{period_ns}: {}", seen.quantile_ns(50));
        assert!(seen.quantile_ns(90) < 60 * US, "{period_ns}: {}", seen.quantile_ns(90));
    }
}

#[test]
fn a_machine_that_wakes_nobody_in_time_is_not_asked_much_earlier() {
    let frames = periodic(0, 4 * MS, 200);
    let late_ns = |nap_ns: u64| chance(nap_ns, 2 * MS);
    let end_ns = BEGIN_NS + 800 * MS;
    let seen = read_woken(&mut reader(), &frames, BEGIN_NS..end_ns, late_ns);
    assert!(seen.looks < 200 * 2, "{}", seen.looks);
}

#[test]
fn an_announced_period_helps_from_the_first_frame_on() {
    let mut expectation = reader();
    expectation.set_period(MS);
    let frames = periodic(300 * US, MS, 5);
    let seen = read(&mut expectation, &frames, BEGIN_NS, BEGIN_NS + 5 * MS);
    assert!(seen.latencies_ns[1..].iter().all(|ns| *ns <= 10 * US), "{seen:?}");
}

#[test]
fn what_was_announced_is_not_believed_where_frames_come_otherwise() {
    for announced_ns in [10 * US, 700 * US, 30 * MS, u64::MAX] {
        let mut expectation = reader();
        expectation.set_period(announced_ns);
        let frames = periodic(0, MS, 400);
        let seen = read(&mut expectation, &frames, BEGIN_NS, BEGIN_NS + 400 * MS);
        assert_eq!(seen.latencies_ns.len(), 400);
        assert!(seen.settled().quantile_ns(90) <= 10 * US, "{announced_ns}");
    }
}

#[test]
fn a_jittering_writer_is_seen_soon_in_a_few_looks_a_frame() {
    let frames: Vec<Sent> =
        (0..1000).map(|k| plain(BEGIN_NS + k * MS + chance(k, 100 * US))).collect();
    let seen = read_all(&frames);
    assert!(seen.looks < 1000 * 4, "{}", seen.looks);
    assert!(seen.quantile_ns(50) <= 40 * US, "{seen:?}");
    let seen = seen.settled();
    assert!(seen.quantile_ns(99) <= 120 * US, "{}", seen.quantile_ns(99));
    assert!(seen.quantile_ns(100) <= 200 * US, "{}", seen.quantile_ns(100));
}

#[test]
fn one_frame_that_is_late_or_left_out_does_not_disturb_the_rhythm() {
    let late = |k: u64| if k % 20 == 13 { 400 * US } else { 0 };
    let frames: Vec<Sent> = (0..400)
        .filter(|k| k % 50 != 21)
        .map(|k| on_grid(BEGIN_NS + k * MS, BEGIN_NS + k * MS + 30 * US + late(k)))
        .collect();
    let seen = read_all(&frames);
    assert!(seen.looks < 400 * 3, "{}", seen.looks);
    let seen = seen.settled();
    assert!(seen.quantile_ns(90) <= 10 * US, "{seen:?}");
    assert!(seen.quantile_ns(100) <= 400 * US / LATE_PART + WAKE_UP_NS, "{seen:?}");
}

#[test]
fn bursts_are_slept_over_and_cost_no_frame() {
    let frames: Vec<Sent> =
        (0..1000).map(|k| plain(BEGIN_NS + k / 10 * 10 * MS + k % 10 * 2 * US)).collect();
    let seen = read_all(&frames);
    assert!(seen.looks < 100 * 6 + 100, "{}", seen.looks);
    let seen = seen.settled();
    assert!(seen.quantile_ns(80) <= 50 * US, "{seen:?}");
}

#[test]
fn frames_without_a_rhythm_wait_an_eighth_of_their_interval_or_100_us() {
    let mut at_ns = BEGIN_NS;
    let frames: Vec<Sent> = (0..1000)
        .map(|k| {
            at_ns += 50 * US + chance(k, 6) * chance(k + 7_777, MS);
            plain(at_ns)
        })
        .collect();
    let seen = read_all(&frames);
    assert!(seen.quantile_ns(50) <= 200 * US, "{seen:?}");
    assert!(seen.looks < 1000 * 20, "{}", seen.looks);
}

#[test]
fn a_writer_that_has_stopped_costs_naps_of_some_milliseconds_and_is_seen_again_after_one() {
    let mut expectation = reader();
    let frames = periodic(0, MS, 100);
    read(&mut expectation, &frames, BEGIN_NS, BEGIN_NS + 100 * MS);
    let idle = read(&mut expectation, &[], BEGIN_NS + 100 * MS, BEGIN_NS + 10_000 * MS);
    assert!(idle.looks < 2_100, "{}", idle.looks);
    assert_eq!(idle.longest_nap_ns, 5 * MS);
    // Back on another phase, and then with another period.
    for (begin_ns, period_ns) in [(10_000 * MS + 370 * US, MS), (12_000 * MS, 2 * MS)] {
        let frames = periodic(begin_ns, period_ns, 200);
        let end_ns = frames[199].at_ns + MS;
        let seen = read(&mut expectation, &frames, BEGIN_NS + begin_ns - 5 * MS, end_ns);
        assert_eq!(seen.latencies_ns.len(), 200);
        assert!(seen.latencies_ns[0] <= 5 * MS + WAKE_UP_NS, "{seen:?}");
        assert!(seen.settled().quantile_ns(98) <= 10 * US, "{begin_ns}");
    }
}

#[test]
fn a_phase_that_changes_in_between_is_learned_again() {
    let frames: Vec<Sent> =
        (0..400).map(|k| plain(BEGIN_NS + k * MS + if k < 200 { 0 } else { 600 * US })).collect();
    let seen = read_all(&frames);
    assert!(seen.looks < 600, "{}", seen.looks);
    let worst = seen.latencies_ns[200..216].iter().max();
    assert!(worst.is_some_and(|ns| *ns <= 400 * US + WAKE_UP_NS), "{seen:?}");
    assert!(seen.latencies_ns[216..].iter().all(|ns| *ns <= 10 * US), "{seen:?}");
}

#[test]
fn a_writer_that_is_faster_than_the_reader_is_read_in_batches_without_spinning() {
    let frames = periodic(0, 2 * US, 20_000);
    let seen = read_all(&frames);
    assert!(seen.looks < 40_000 / 20 + 100, "{}", seen.looks);
    assert!(seen.at_once < 64, "{}", seen.at_once);
}

#[test]
fn two_services_are_read_by_the_earliest_of_their_looks() {
    let writers = [periodic(100 * US, MS, 300), periodic(450 * US, 3 * MS, 100)];
    let mut expectations = [reader(), reader()];
    let mut latencies_ns = [Vec::new(), Vec::new()];
    let mut left = writers.each_ref().map(|frames| frames.iter().peekable());
    let (mut now_ns, mut looks) = (BEGIN_NS, 0);
    while now_ns < BEGIN_NS + 310 * MS {
        looks += 1;
        let mut look_ns = u64::MAX;
        for (service, expectation) in expectations.iter_mut().enumerate() {
            while let Some(frame) = left[service].next_if(|frame| frame.at_ns <= now_ns) {
                expectation.note(&frame.header);
                latencies_ns[service].push(now_ns - frame.at_ns);
            }
            look_ns = look_ns.min(expectation.next_look_ns(now_ns));
        }
        now_ns = look_ns + WAKE_UP_NS;
    }
    assert_eq!(latencies_ns.each_ref().map(Vec::len), [300, 100]);
    assert!(looks < 300 + 100 + 200, "{looks}");
    for latencies_ns in latencies_ns {
        assert!(latencies_ns[8..].iter().all(|ns| *ns <= 20 * US), "{latencies_ns:?}");
    }
}

#[test]
fn stamps_of_another_clock_do_not_mislead_it() {
    for shift in [i64::MIN / 2, -1_000_370_000, -370_000, 370_000, 1_000_370_000] {
        let frames: Vec<Sent> = periodic(0, MS, 400)
            .into_iter()
            .map(|frame| Sent {
                at_ns: frame.at_ns,
                ..plain(frame.at_ns.saturating_add_signed(shift))
            })
            .collect();
        let seen = read_all(&frames);
        assert!(seen.looks < 400 * 12, "{shift}: {}", seen.looks);
        assert!(seen.quantile_ns(50) <= 150 * US, "{shift}: {seen:?}");
    }
}

#[test]
fn wild_stamps_cost_neither_a_panic_nor_a_busy_loop() {
    let wild = [0, 1, u64::MAX, u64::MAX - 1, BEGIN_NS, u64::MAX / 2];
    let frames: Vec<Sent> = (0..400)
        .map(|k| {
            let header = FrameHeader {
                release_ns: wild[chance(k, 6) as usize],
                publish_ns: wild[chance(k + 99, 6) as usize],
                ..FrameHeader::default()
            };
            Sent { at_ns: BEGIN_NS + k * MS, header }
        })
        .collect();
    let seen = read_all(&frames);
    assert!(seen.looks < 400 * 25, "{}", seen.looks);
    assert!(seen.longest_nap_ns <= 5 * MS);
    let mut late = reader();
    late.set_period(u64::MAX);
    late.note(&FrameHeader::default());
    assert!(late.next_look_ns(u64::MAX - 5) > u64::MAX - 5);
}

#[test]
fn a_small_buffer_is_looked_after_more_often_the_faster_its_writer_may_fill_it() {
    let longest_nap_ns = |buffer, announced_ns| {
        let mut expectation = Expectation::new(buffer);
        expectation.set_period(announced_ns);
        expectation.longest_nap_ns()
    };
    assert_eq!(
        [2, 256, u64::MAX].map(|buffer| longest_nap_ns(buffer, 0)),
        [500 * US, 1_280 * US, 5 * MS]
    );
    assert_eq!(
        [2, 25, 256].map(|buffer| longest_nap_ns(buffer, 100 * US)),
        [500 * US, 1_200 * US, 5 * MS]
    );
    assert_eq!([2, 256].map(|buffer| longest_nap_ns(buffer, u64::MAX)), [5 * MS; 2]);
}
