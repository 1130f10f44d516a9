//! Release jitter of the node beside that of cyclictest, and what each measure brings.
//!
//! The arms take turns, forth and back, so that what the machine does meanwhile meets them all.
//! Each runs at the same period, priority, CPU and phase; the node has an input, blocks and an
//! output. An arm's distribution is that of all its turns together.
//!
//! ```text
//! cargo bench -p isochrone-benches --bench cyclictest -- --rounds 10 --seconds 60 --svg jitter
//! ```

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use clap::Parser;
use isochrone_benches::{Bench, Failure, Profile, take_turns, us};
use isochrone_processes::Child;
use isochrone_report::{Report, Series, histogram_svg, percentiles_svg, ratio_in_words};
use isochrone_timing::Distribution;

#[derive(Parser)]
struct Args {
    /// Turns of each arm
    #[arg(long, default_value_t = 10)]
    rounds: usize,
    /// Length of a turn
    #[arg(long, default_value_t = 6.0)]
    seconds: f64,
    /// Period in microseconds
    #[arg(long, default_value_t = 1000)]
    period_us: u64,
    /// CPU of all arms
    #[arg(long, default_value_t = 1)]
    cpu: u32,
    /// Arms, by name
    #[arg(long, value_delimiter = ',', default_value = "cyclictest,hybrid,economical")]
    arms: Vec<String>,
    /// Run `stress-ng` with these arguments meanwhile
    #[arg(long, allow_hyphen_values = true)]
    stress: Option<String>,
    /// Write FOLDER/percentiles.svg and FOLDER/histogram.svg
    #[arg(long)]
    svg: Option<PathBuf>,
    /// Title of the pictures
    #[arg(long, default_value = "Release jitter")]
    title: String,
    /// Only see whether every arm runs
    #[arg(long)]
    test: bool,
    /// Given by `cargo bench`
    #[arg(long, hide = true)]
    bench: bool,
}

/// Longest turn that `isochrone bench jitter` takes at once.
const LONGEST_TURN_S: f64 = 60.0;

/// Name, keys of the task, and a command that runs the node with other rights.
const ARMS: [(&str, &str, &[&str]); 14] = [
    ("hybrid", "priority = 80\ncpu = CPU", &[]),
    ("economical", "priority = 80\ncpu = CPU\ncpu_budget = 0.10", &[]),
    ("phase auto", "priority = 80\ncpu = CPU\ncpu_budget = 0.5\nphase = \"auto\"", &[]),
    ("generous", "priority = 80\ncpu = CPU\ncpu_budget = 0.5", &[]),
    ("sleep", "priority = 80\ncpu = CPU\nwake = \"sleep\"", &[]),
    ("margin 50 us", "priority = 80\ncpu = CPU\nmargin = \"50us\"", &[]),
    ("margin 100 us", "priority = 80\ncpu = CPU\nmargin = \"100us\"", &[]),
    ("margin 200 us", "priority = 80\ncpu = CPU\nmargin = \"200us\"", &[]),
    ("on the tick", "priority = 80\ncpu = CPU\nphase = \"500us\"", &[]),
    ("sleep on the tick", "priority = 80\ncpu = CPU\nwake = \"sleep\"\nphase = \"500us\"", &[]),
    ("any CPU", "priority = 80\ncpu = \"any\"", &[]),
    ("no priority", "cpu = CPU\nwake = \"hybrid\"", &[]),
    (
        "memory not locked",
        "priority = 80\ncpu = CPU",
        &["prlimit", "--memlock=0", "setpriv", "--bounding-set", "-ipc_lock"],
    ),
    ("sleep, no priority", "cpu = CPU\nwake = \"sleep\"", &[]),
];

const NODE: &str = r#"
[node]
name = "bench"
[[task]]
name = "bench"
period = "PERIODus"
TASK
[[input]]
name = "raw"
service = "bench/in"
[[block]]
name = "scaled"
type = "ScaleLinear"
[block.in]
x = "raw"
x1 = 0.0
y1 = 0.0
x2 = 27648.0
y2 = 100.0
yMin = 0.0
yMax = 100.0
[[block]]
name = "saw"
type = "SawTooth"
[block.in]
incrementRange = 1
numberSteps = 1000
[[output]]
service = "bench/out"
signals = ["scaled.y", "saw.value"]
"#;

/// What an arm showed so far.
struct Arm {
    name: String,
    jitter: Distribution,
    cpu_s: f64,
    elapsed_s: f64,
    missed: u64,
}

fn main() -> Result<(), Failure> {
    let mut args = Args::parse();
    if args.test {
        (args.rounds, args.seconds) = (1, 0.3);
    }
    let bench = Bench::new(Profile::of_bench(args.test))?;
    let mut arms = Vec::new();
    for name in &args.arms {
        if name == "cyclictest" && Command::new("cyclictest").arg("--help").output().is_err() {
            eprintln!("cyclictest is not installed (Debian: rt-tests); its arm is left out");
            continue;
        }
        let jitter = Distribution::new();
        arms.push(Arm { name: name.clone(), jitter, cpu_s: 0.0, elapsed_s: 0.0, missed: 0 });
    }
    let stress = args.stress.as_deref().map(stress).transpose()?;
    take_turns(args.rounds, &mut arms, |arm| match arm.name.as_str() {
        "cyclictest" => cyclictest(&bench, &args, arm),
        _ => node(&bench, &args, arm),
    })?;
    drop(stress);
    print(&args, &arms);
    if let Some(folder) = &args.svg {
        draw(folder, &args.title, &arms)?;
    }
    Ok(())
}

fn node(bench: &Bench, args: &Args, arm: &mut Arm) -> Result<(), Failure> {
    let Some((_, task, wrapper)) = ARMS.iter().find(|(name, ..)| *name == arm.name) else {
        let known: Vec<_> = ARMS.iter().map(|(name, ..)| *name).collect();
        return Err(format!(
            "no arm \"{}\"; there are: cyclictest, {}",
            arm.name,
            known.join(", ")
        )
        .into());
    };
    let node = NODE.replace("TASK", task).replace("CPU", &args.cpu.to_string());
    let node = node.replace("PERIOD", &args.period_us.to_string());
    arm.take(args, bench.start(wrapper, &node, args.seconds)?.report()?)
}

/// The program itself, as `isochrone bench jitter` runs and reads it.
fn cyclictest(bench: &Bench, args: &Args, arm: &mut Arm) -> Result<(), Failure> {
    let arguments = format!(
        "bench jitter --arms cyclictest --seconds {} --turn {} --period {}us --cpu {}",
        args.seconds,
        args.seconds.min(LONGEST_TURN_S),
        args.period_us,
        args.cpu
    );
    arm.take(args, bench.measure(&[], &arguments)?.report()?)
}

impl Arm {
    fn take(&mut self, args: &Args, report: Report) -> Result<(), Failure> {
        let task = report.tasks.first().ok_or("the report has no task")?;
        if let Some(histogram) = task.task.histograms.get("release_jitter_ns") {
            self.jitter.merge(&Distribution::decode(histogram)?);
        }
        let cpu_fraction = task.task.cpu_fraction.ok_or("the report has no CPU time")?;
        self.cpu_s += cpu_fraction * args.seconds;
        self.elapsed_s += args.seconds;
        self.missed += task.task.missed;
        Ok(())
    }
}

/// Load that ends with the bench.
fn stress(arguments: &str) -> Result<Child, Failure> {
    let mut command = Command::new("stress-ng");
    command.args(arguments.split_whitespace()).stdout(Stdio::null()).stderr(Stdio::null());
    Ok(Child::start("stress-ng", &mut command)?)
}

fn print(args: &Args, arms: &[Arm]) {
    println!(
        "release jitter in us, period {} us, {} turns of {} s each, alternating",
        args.period_us, args.rounds, args.seconds
    );
    println!(
        "{:<20}{:>9}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}{:>7}{:>8}",
        "", "samples", "p50", "p90", "p99", "p99.9", "p99.99", "max", "CPU %", "missed"
    );
    for arm in arms {
        let quantile = |quantile: f64, needed: u64| {
            if arm.jitter.count() >= needed {
                us(arm.jitter.quantile(quantile))
            } else {
                "-".into()
            }
        };
        println!(
            "{:<20}{:>9}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}{:>7.1}{:>8}",
            arm.name,
            arm.jitter.count(),
            quantile(0.5, 2),
            quantile(0.9, 10),
            quantile(0.99, 100),
            quantile(0.999, 1_000),
            quantile(0.9999, 10_000),
            quantile(1.0, 1),
            100.0 * arm.cpu_s / arm.elapsed_s,
            arm.missed
        );
    }
    let Some((reference, others)) = arms.split_first() else { return };
    println!(
        "{:<20}{:>20}{:>20}{:>20}{:>20}",
        format!("than {}", reference.name),
        "p50",
        "p90",
        "p99",
        "p99.9"
    );
    for arm in others {
        let ratio = |quantile: f64| {
            let ns = arm.jitter.quantile(quantile).max(1);
            ratio_in_words(reference.jitter.quantile(quantile) as f64 / ns as f64)
        };
        println!(
            "{:<20}{:>20}{:>20}{:>20}{:>20}",
            arm.name,
            ratio(0.5),
            ratio(0.9),
            ratio(0.99),
            ratio(0.999)
        );
    }
}

fn draw(folder: &Path, title: &str, arms: &[Arm]) -> Result<(), Failure> {
    fs::create_dir_all(folder)?;
    let series: Vec<Series<'_>> =
        arms.iter().map(|arm| Series { name: &arm.name, distribution: &arm.jitter }).collect();
    fs::write(folder.join("percentiles.svg"), percentiles_svg(title, &series))?;
    fs::write(folder.join("histogram.svg"), histogram_svg(title, &series))?;
    Ok(())
}
