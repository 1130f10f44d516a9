//! A report as a bench writes it, of made-up times: two loops under two loads with every kind of
//! disturbance, three transports, and costs.

use isochrone_machine::{CheckResult, Disturbance, Environment, Severity};
use isochrone_report::{CostReport, LinkArm, LoopArm, Report, TaskArm, Turns};
use isochrone_timing::{CycleRecord, Distribution, LinkReport, TaskReport, Warning, WarningCode};

const PERIOD_NS: u64 = 1_000_000;
const ORIGIN_NS: u64 = 70_000_000_000;
const CYCLES: u64 = 1_000;
const TURNS: u64 = 12;

/// The same numbers for everybody, from 0 to 1.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A time with a long tail, `typical_ns` in the middle.
    fn time(&mut self, typical_ns: f64) -> u64 {
        let body = typical_ns * (0.8 + 0.4 * self.next());
        (body + typical_ns * 0.02 * (1.0 / (1.0 - self.next()) - 1.0).min(3_000.0)) as u64
    }
}

/// One arm among two, turn by turn: `turn_of_arm` is 0 or 1.
fn arm(name: &str, load: &str, typical_ns: f64, turn_of_arm: u64) -> TaskArm {
    let mut chance = Chance(0x9e37_79b9 + typical_ns as u64);
    let mut arm = LoopArm::new(PERIOD_NS, ORIGIN_NS);
    let mut missed = 0;
    for turn in 0..TURNS {
        let from_ns = ORIGIN_NS + (turn * 2 + turn_of_arm) * 1_200_000_000;
        let mut cycle = 0;
        let mut records = Vec::new();
        while cycle < CYCLES {
            let late_ns = chance.time(typical_ns);
            // A wake-up after the next release leaves that one out.
            let periods = late_ns / PERIOD_NS;
            missed += periods;
            cycle += periods;
            let release_ns = from_ns + cycle * PERIOD_NS;
            let start_ns = release_ns + late_ns % PERIOD_NS;
            let end_ns = start_ns + 9_000;
            records.push(CycleRecord { cycle, release_ns, start_ns, end_ns, missed, overruns: 0 });
            cycle += 1;
        }
        let disturbance = match turn {
            3 => Disturbance { steal_ns: Some(4_000_000), ..Disturbance::default() },
            8 => Disturbance { faults: Some(2), ..Disturbance::default() },
            _ => Disturbance::default(),
        };
        arm.turn(&records, &[], from_ns..u64::MAX, disturbance, |at_ns| cause(at_ns / 1_000 % 9));
    }
    TaskArm {
        task: TaskReport {
            wake: name.to_owned(),
            margin_ns: (name == "hybrid").then_some(60_000),
            scheduler: "fifo:80".to_owned(),
            cpu: Some(1),
            cpu_fraction: Some(0.0125),
            ..arm.report(name).task
        },
        load: load.to_owned(),
        ..arm.report(name)
    }
}

fn cause(kind: u64) -> Disturbance {
    let none = Disturbance::default();
    match kind {
        0 => Disturbance { steal_ns: Some(1), ..none },
        1 => Disturbance { throttled_ns: Some(1), ..none },
        2 => Disturbance { faults: Some(1), ..none },
        3 | 4 => Disturbance { preemptions: Some(1), ..none },
        5 | 6 => Disturbance { interrupts: Some(1), ..none },
        _ => none,
    }
}

fn turns(typical: f64, offset_s: f64) -> Turns {
    let mut chance = Chance(0x51ed_2701 + typical as u64);
    let mut turns = Turns::default();
    for turn in 0..TURNS {
        let mut samples = Distribution::new();
        (0..CYCLES).for_each(|_| samples.record(chance.time(typical)));
        let at_s = offset_s + turn as f64 * 3.0;
        let faults = u64::from(turn == 5 && offset_s == 0.0);
        let disturbance = Disturbance { faults: Some(faults), ..Disturbance::default() };
        turns.push(at_s, 1_000_000_000, &samples, 0, disturbance);
    }
    turns
}

fn link(service: &str, typical_ns: f64, offset_s: f64) -> LinkArm {
    let turns = turns(typical_ns, offset_s);
    let one_way_ns = turns.all().summary();
    LinkArm {
        link: LinkReport {
            service: service.to_owned(),
            frames: one_way_ns.count,
            rate_hz: Some(999.98),
            one_way_ns,
            histograms: [("one_way_ns".to_owned(), turns.all().encode())].into(),
            ..LinkReport::default()
        },
        values: 10,
        paced_hz: Some(1_000.0),
        turns: turns.reports().to_vec(),
        ..LinkArm::default()
    }
}

fn cost(name: &str, instances: u64, typical_ps: f64) -> CostReport {
    let turns = turns(typical_ps, 0.0);
    CostReport {
        name: name.to_owned(),
        instances,
        step_ps: turns.all().summary(),
        histograms: [("step_ps".to_owned(), turns.all().encode())].into(),
        turns: turns.reports().to_vec(),
        ..CostReport::default()
    }
}

fn finding(code: &str, severity: Severity, value: &str, fix: Option<&str>) -> CheckResult {
    CheckResult {
        code: code.to_owned(),
        severity,
        value: value.to_owned(),
        details: vec!["of a made-up machine".to_owned()],
        source: "/proc/cmdline".to_owned(),
        effect: "Something else may run first.".to_owned(),
        fix: fix.map(str::to_owned),
        inert: false,
        inert_why: None,
    }
}

/// The report.
pub(crate) fn report() -> Report {
    let some = |text: &str| Some(text.to_owned());
    let through = link("iceoryx2 through the node", 31_000.0, 2.0);
    let mut report = Report {
        isochrone: "0.1.0".to_owned(),
        command: ["bench", "jitter", "--seconds", "60"].map(str::to_owned).to_vec(),
        started: "2026-11-20T12:00:00Z".to_owned(),
        environment: Environment {
            kernel: some("6.18.44"),
            preempt: some("lazy"),
            cpus: 2,
            hypervisor: some("kvm"),
            clocksource: some("tsc"),
            clock_read_ns: Some(42),
            rt_throttling: "950000/1000000".parse().ok(),
            ..Environment::default()
        },
        warnings: vec![Warning {
            code: WarningCode::RtDenied,
            message: "no real-time priority".to_owned(),
            remedy: "run as root, or set rtprio 80 in limits.conf".to_owned(),
        }],
        tasks: vec![
            arm("sleep", "idle", 52_000.0, 0),
            arm("hybrid", "idle", 900.0, 1),
            arm("sleep", "cpu", 71_000.0, 0),
            arm("hybrid", "cpu", 2_400.0, 1),
        ],
        links: vec![
            link("iceoryx2", 8_000.0, 0.0),
            LinkArm {
                link: LinkReport {
                    age_at_publish_ns: turns(21_000.0, 0.0).all().summary(),
                    end_to_end_ns: turns(52_000.0, 0.0).all().summary(),
                    ..through.link
                },
                age_at_release_ns: turns(19_000.0, 0.0).all().summary(),
                ..through
            },
            link("udp", 24_000.0, 1.0),
        ],
        costs: [1, 10, 100, 1_000, 10_000]
            .into_iter()
            .flat_map(|instances| {
                let shared = 40_000.0 / instances as f64;
                [("ramp", 2_100.0), ("mixed", 6_400.0), ("pid", 11_000.0)]
                    .map(|(name, ps)| cost(name, instances, ps + shared))
            })
            .collect(),
        findings: vec![
            finding("isolated_cpus", Severity::Warning, "none", Some("isolcpus=1")),
            finding("clock_source", Severity::Ok, "tsc", None),
            finding("memory_lock", Severity::Problem, "64 kB", Some("ulimit -l unlimited")),
        ],
        ended_early: true,
        ..Report::default()
    };
    report.compare_arms();
    report.comparisons.retain(|comparison| comparison.metric != "step_ps");
    report
}
