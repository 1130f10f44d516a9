//! The table, letter by letter.

use isochrone_machine::Environment;
use isochrone_model::AlarmTotals;
use isochrone_report::{
    Comparison, CostReport, LeftOut, LinkArm, Report, TaskArm, TurnReport, Verdict,
};
use isochrone_timing::{Direction, LinkReport, Summary, TaskReport, Warning, WarningCode};

fn jitter() -> Summary {
    Summary {
        count: 59_900,
        min: Some(41),
        mean: Some(105.2),
        p50: Some(98),
        p90: Some(150),
        p99: Some(260),
        p99_9: Some(2_100),
        p99_99: Some(52_000),
        max: Some(231_000),
    }
}

fn few() -> Summary {
    Summary {
        count: 12,
        min: Some(1_204),
        p50: Some(1_250),
        p90: Some(10_004),
        max: Some(1_300_000),
        ..Summary::default()
    }
}

fn report() -> Report {
    let some = |text: &str| Some(text.to_owned());
    Report {
        isochrone: "0.1.0".to_owned(),
        command: ["run", "level.toml", "--cycles", "60000"].map(str::to_owned).to_vec(),
        started: "2026-11-20T12:00:00Z".to_owned(),
        environment: Environment {
            kernel: some("6.18.44"),
            preempt: None,
            cpus: 2,
            hypervisor: some("kvm"),
            clocksource: some("tsc"),
            clock_read_ns: Some(42),
            ..Environment::default()
        },
        warnings: vec![
            Warning {
                code: WarningCode::RtDenied,
                message: "no real-time priority".to_owned(),
                remedy: "run as root".to_owned(),
            },
            Warning {
                code: "steal".into(),
                message: "CPU was stolen".to_owned(),
                remedy: String::new(),
            },
        ],
        tasks: vec![TaskArm {
            task: TaskReport {
                name: "fast".to_owned(),
                period_ns: 1_000_000,
                wake: "hybrid".to_owned(),
                scheduler: "fifo:80".to_owned(),
                cpu: Some(1),
                cycles: 60_000,
                warm_up_cycles: 100,
                overruns: Some(0),
                release_jitter_ns: jitter(),
                execution_ns: few(),
                cpu_fraction: Some(0.0625),
                allocations: Some(0),
                minor_faults: Some(3),
                major_faults: Some(0),
                ipc_allocations: Some(60_000),
                voluntary_switches: Some(60_000),
                involuntary_switches: Some(1),
                block_errors: Some(0),
                input_rejects: Some(0),
                connects: Some(2),
                connect_errors: Some(0),
                ..TaskReport::default()
            },
            ..TaskArm::default()
        }],
        links: vec![LinkArm {
            link: LinkReport {
                service: "plant/level".to_owned(),
                direction: Some(Direction::Received),
                frames: 60_000,
                lost: 1,
                restarts: Some(0),
                rate_hz: Some(999.98),
                one_way_ns: few(),
                ..LinkReport::default()
            },
            ..LinkArm::default()
        }],
        ..Report::default()
    }
}

#[test]
fn a_report_prints_as_an_aligned_table_with_human_units() {
    let expected = "\
isochrone 0.1.0 run level.toml --cycles 60000
started 2026-11-20T12:00:00Z
kernel 6.18.44, preempt -, 2 CPUs, hypervisor kvm, clock tsc (42 ns per reading)

task fast: period 1 ms, wake hybrid, scheduler fifo:80, CPU 1
  60000 cycles, 0 missed, 0 overruns, 100 warm-up cycles excluded
                       min      p50      p90      p99    p99.9   p99.99      max
  release jitter     41 ns    98 ns   150 ns   260 ns  2.10 us  52.0 us   231 us
  execution        1.20 us  1.25 us  10.0 us        -        -        -  1.30 ms
  response               -        -        -        -        -        -        -
  period error           -        -        -        -        -        -        -
  CPU 6.2 %, 0 allocations (60000 more by the IPC library), 3 minor and 0 major faults, 60000 voluntary and 1 involuntary switches
  0 block errors, 0 input rejects, 2 connects (0 failed at first)

link plant/level (received): 1000 Hz
  60000 frames, 1 lost, 0 restarts
                       min      p50      p90      p99    p99.9   p99.99      max
  last hop         1.20 us  1.25 us  10.0 us        -        -        -  1.30 ms
  end to end             -        -        -        -        -        -        -

warning [rt_denied]: no real-time priority
  remedy: run as root
warning [steal]: CPU was stolen
";
    assert_eq!(report().to_string(), expected);
}

#[test]
fn a_task_that_may_move_and_lost_records_and_snapshots_says_so() {
    let mut report = report();
    report.tasks[0].task.cpu = None;
    report.tasks[0].task.lost_records = Some(7);
    report.tasks[0].task.lost_snapshots = Some(3);
    let table = report.to_string();
    assert!(table.contains("scheduler fifo:80, any CPU\n"));
    assert!(table.contains("100 warm-up cycles excluded, 7 records lost, 3 snapshots lost\n"));
}

#[test]
fn process_alarms_are_counted_and_those_that_stand_are_named() {
    let mut report = report();
    let mut totals = AlarmTotals::default();
    report.process_alarms = Some(totals.clone());
    let none = "\nprocess alarms: 0 occurrences, 0 standing, 0 unacknowledged\n\nwarning";
    assert!(report.to_string().contains(none), "{report}");
    (totals.came, totals.standing, totals.unacknowledged, totals.lost) = (1, 10, 2, 1);
    totals.names = (1..=10).map(|alarm| format!("high_{alarm}")).collect();
    report.process_alarms = Some(totals);
    let some = "process alarms: 1 occurrence, 10 standing, 2 unacknowledged, 1 change lost\n  \
        standing: high_1, high_2, high_3, high_4, high_5, high_6, high_7, high_8 and 2 more\n";
    assert!(report.to_string().contains(some), "{report}");
}

fn comparison(percentile: &str, ratio: f64, verdict: Verdict) -> Comparison {
    Comparison {
        metric: "release_jitter_corrected_ns".to_owned(),
        percentile: percentile.to_owned(),
        reference: "sleep (1 ms, idle)".to_owned(),
        candidate: "hybrid (1 ms, idle)".to_owned(),
        ratio,
        low: ratio * 0.9,
        high: ratio * 1.1,
        verdict,
        ..Comparison::default()
    }
}

fn bench() -> Report {
    let turn = TurnReport::default();
    let invalid = TurnReport { invalid: Some("2 page faults".to_owned()), ..turn.clone() };
    let arm = |name: &str, release_jitter_ns: Summary| TaskArm {
        task: TaskReport {
            name: name.to_owned(),
            period_ns: 1_000_000,
            release_jitter_ns,
            ..TaskReport::default()
        },
        load: "idle".to_owned(),
        turns: vec![turn.clone(), turn.clone()],
        ..TaskArm::default()
    };
    let link = |service: &str| LinkArm {
        link: LinkReport {
            service: service.to_owned(),
            frames: 12,
            one_way_ns: few(),
            ..LinkReport::default()
        },
        values: 10,
        paced_hz: Some(1_000.0),
        turns: vec![turn.clone()],
        ..LinkArm::default()
    };
    let cost = |instances: u64| CostReport {
        name: "mixed".to_owned(),
        instances,
        step_ps: Summary { count: 400, p50: Some(6_412), p99: Some(51_300), ..Summary::default() },
        ..CostReport::default()
    };
    Report {
        command: vec!["bench".to_owned()],
        warnings: Vec::new(),
        ended_early: true,
        tasks: vec![
            TaskArm {
                task: TaskReport {
                    missed: 3,
                    cpu_fraction: Some(0.0125),
                    ..arm("sleep", few()).task
                },
                release_jitter_corrected_ns: Some(Summary { count: 15, ..few() }),
                release_jitter_valid_ns: Some(few()),
                ..arm("sleep", few())
            },
            TaskArm {
                task: TaskReport { cpu_fraction: Some(0.5), ..arm("hybrid", jitter()).task },
                release_jitter_corrected_ns: Some(jitter()),
                release_jitter_valid_ns: Some(Summary {
                    count: 900,
                    p99_9: None,
                    p99_99: None,
                    ..jitter()
                }),
                turns: vec![turn.clone(), invalid],
                ..arm("hybrid", jitter())
            },
            TaskArm {
                task: TaskReport { period_ns: 250_000, ..arm("hybrid", few()).task },
                ..arm("hybrid", few())
            },
        ],
        links: vec![
            link("iceoryx2"),
            LinkArm {
                link: LinkReport {
                    lost: 2,
                    age_at_publish_ns: few(),
                    end_to_end_ns: jitter(),
                    ..link("through the node").link
                },
                age_at_release_ns: few(),
                ..link("through the node")
            },
        ],
        costs: vec![cost(1), cost(1_000)],
        comparisons: vec![
            comparison("p50", 12.5, Verdict::Better),
            comparison("p90", 0.26, Verdict::Worse),
            comparison("p99_9", 1.01, Verdict::Same),
        ],
        ..report()
    }
}

#[test]
fn a_bench_prints_a_table_for_each_circumstance_and_how_the_arms_compare() {
    let expected = "\
isochrone 0.1.0 bench
started 2026-11-20T12:00:00Z
ended early: stopped before its time
kernel 6.18.44, preempt -, 2 CPUs, hypervisor kvm, clock tsc (42 ns per reading)

release jitter, 1 ms, idle
  arm          samples      p50      p90     p99    p99.9   p99.99      max  CPU %  missed  invalid turns
  sleep             12  1.25 us  10.0 us       -        -        -  1.30 ms    1.2       3         0 of 2
    corrected       15  1.25 us  10.0 us       -        -        -  1.30 ms
  hybrid         59900    98 ns   150 ns  260 ns  2.10 us  52.0 us   231 us   50.0       0         1 of 2
    valid          900    98 ns   150 ns  260 ns        -        -   231 us
  compared with sleep, valid turns                     ratio              99 % interval  verdict
    hybrid                            p50   12.5 times lower               11.2 to 13.8   better
                                      p90  3.85 times higher               3.50 to 4.27    worse
                                    p99.9   1.01 times lower  1.10 higher to 1.11 lower     same

release jitter, 250 us, idle
  arm     samples      p50      p90  p99  p99.9  p99.99      max  CPU %  missed  invalid turns
  hybrid       12  1.25 us  10.0 us    -      -       -  1.30 ms      -       0         0 of 2

one-way latency, 1000 Hz, 10 values
  arm               frames    mean      p50      p90     p99    p99.9   p99.99      max  lost  invalid turns
  iceoryx2              12       -  1.25 us  10.0 us       -        -        -  1.30 ms     0         0 of 1
  through the node      12       -  1.25 us  10.0 us       -        -        -  1.30 ms     2         0 of 1
    age at release      12       -  1.25 us  10.0 us       -        -        -  1.30 ms
    age at publish      12       -  1.25 us  10.0 us       -        -        -  1.30 ms
    end to end       59900  105 ns    98 ns   150 ns  260 ns  2.10 us  52.0 us   231 us

time of one instance in a cycle
  block  instances  samples      p50      p99
  mixed          1      400  6.41 ns  51.3 ns
  mixed       1000      400  6.41 ns  51.3 ns
";
    assert_eq!(bench().to_string(), expected);
}

#[test]
fn cycles_that_had_no_new_value_are_shown_beside_arms_that_count_them() {
    let link = |service: &str, timed_out| LinkArm {
        timed_out,
        link: LinkReport { service: service.into(), lost: 2, ..LinkReport::default() },
        turns: vec![TurnReport::default()],
        ..LinkArm::default()
    };
    let links = vec![link("ports", None), link("follow", Some(7))];
    let table = Report { links, ..Report::default() }.to_string();
    let rows: Vec<&str> = table.lines().filter(|line| line.ends_with("0 of 1")).collect();
    assert!(table.contains("  lost  timed out  invalid turns\n"), "{table}");
    assert!(rows[1].starts_with("  follow (there and back) "), "{table}");
    assert!(rows[0].ends_with("2          -         0 of 1"), "{table}");
    assert!(rows[1].ends_with("2          7         0 of 1"), "{table}");
}

#[test]
fn what_was_not_measured_is_a_dash_and_not_nothing() {
    let mut report = report();
    let task = &mut report.tasks[0].task;
    (task.cpu_fraction, task.allocations, task.minor_faults) = (None, None, None);
    let table = report.to_string();
    assert!(table.contains("CPU - %, - allocations"), "{table}");
    assert!(table.contains("- minor and 0 major faults"), "{table}");
}

#[test]
fn a_comparison_that_is_left_out_says_why_and_how_much_longer_to_run() {
    let left_out = LeftOut {
        percentile: "p99_9".to_owned(),
        reference: "sleep (1 ms, idle)".to_owned(),
        candidate: "hybrid (1 ms, idle)".to_owned(),
        why: "900 of 10000 samples; run it 12 times as long".to_owned(),
        ..LeftOut::default()
    };
    let report = Report { left_out: vec![left_out], ..bench() };
    let says = "\nnot compared\n  hybrid (1 ms, idle) with sleep (1 ms, idle) at p99.9: 900 of 10000 \
        samples; run it 12 times as long\n";
    assert!(report.to_string().contains(says), "{report}");
}

#[test]
fn a_link_that_was_sent_says_so_and_nothing_of_what_only_a_receiver_counts() {
    let link = LinkReport {
        service: "plant/out".to_owned(),
        direction: Some(Direction::Sent),
        frames: 7,
        ..LinkReport::default()
    };
    let links = vec![LinkArm { link, ..LinkArm::default() }];
    let report = Report { tasks: Vec::new(), links, warnings: Vec::new(), ..report() };
    let shown = report.to_string();
    assert!(shown.contains("\nlink plant/out (sent)\n  7 frames, 0 lost\n"), "{shown}");
    let json = serde_json::to_value(&report).unwrap();
    assert_eq!(json["links"][0]["direction"], "sent");
    assert!(json["links"][0]["restarts"].is_null() && json["links"][0]["other_writers"].is_null());
}
