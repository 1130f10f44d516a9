//! What a frame costs by the C interface and in Rust, in turns that alternate.
//!
//! Each turn is a process of its own that writes frames, sends them and reads them in one thread, so that nothing but
//! the calls is measured: `exchange.c`, compiled here and linked to the shared library (`capi`), and this program by
//! itself, with the ports of a node's task (`ports`) and with a reader that knows names and checks stamps, as the C
//! interface has it (`reader`). The cycle is from before the values are written until all of them are read; the slack
//! is the next loan and the maintenance of the reader.
//!
//! ```text
//! cargo bench --manifest-path crates/capi/Cargo.toml --target-dir target/reach
//! ```
#![allow(clippy::print_stdout, reason = "figures are what this program is for")]

use std::hint::black_box;
use std::io::Write;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{
    Depth, Domain, FrameLayout, FramePublisher, IsolatedDomain, LayoutAnnouncer, LayoutWatcher,
    Participant, SignalReader, SignalSpec, Stamp, ToldLayouts, ipc,
};

const TURNS: usize = 15;
const EXCHANGES: usize = 50_000;
/// The first of each turn, which warm up.
const LEFT_OUT: usize = EXCHANGES / 10;
const SIZES: [usize; 3] = [1, 100, 1_000];
/// Says to this program that it is a turn of one of the arms in Rust, with so many values.
const TURN: &str = "ISOCHRONE_BENCH_VALUES";
const READER: &str = "ISOCHRONE_BENCH_READER";

fn main() {
    if let Some(values) = std::env::var_os(TURN) {
        return turn_in_rust(values.to_str().unwrap().parse().unwrap());
    }
    let domain = IsolatedDomain::new("capibench").unwrap();
    let own = std::env::current_exe().unwrap();
    let in_c = compile(&own);
    println!("ns for each exchange, median of {TURNS} turns of {} exchanges", EXCHANGES - LEFT_OUT);
    println!("values  part   percentile   ports  reader    capi  capi / ports  capi / reader");
    for values in SIZES {
        let mut by_ports = Command::new(&own);
        by_ports.env(TURN, values.to_string());
        let mut by_reader = Command::new(&own);
        by_reader.env(TURN, values.to_string()).env(READER, "");
        let mut by_c = Command::new(&in_c);
        by_c.args([values, EXCHANGES].map(|number| number.to_string()));
        let mut arms = [by_ports, by_reader, by_c];
        let mut turns = [const { Vec::new() }; 3];
        for turn in 0..TURNS {
            // Whoever is first finds the caches as the one before left them.
            for arm in (0..3).map(|arm| (arm + turn) % 3) {
                turns[arm].push(measured(&mut arms[arm], &domain));
            }
        }
        for (part, name) in ["cycle", "slack"].into_iter().enumerate() {
            for (percentile, label) in ["p50", "p99"].into_iter().enumerate() {
                let of =
                    |arm: usize| turns[arm].iter().map(|turn| f64::from(turn[part][percentile]));
                let ratio = |to: usize| {
                    let mut ratios: Vec<_> =
                        of(to).zip(of(2)).map(|(to, capi)| capi / to).collect();
                    let median = median(&mut ratios);
                    format!("{median:.2} ({:.2} to {:.2})", ratios[0], ratios[TURNS - 1])
                };
                let [ports, reader, capi] =
                    [0, 1, 2].map(|arm| median(&mut of(arm).collect::<Vec<_>>()));
                println!(
                    "{values:>6}  {name}  {label}         {ports:>6.0}  {reader:>6.0}  {capi:>6.0}  {}  {}",
                    ratio(0),
                    ratio(1)
                );
            }
        }
    }
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The C program, linked to the library as this program is built: target/<profile>/deps/exchange-<hash>.
fn compile(own: &Path) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("exchange");
    let sources = Path::new(env!("CARGO_MANIFEST_DIR"));
    std::fs::create_dir_all(&folder).unwrap();
    // For a bench, cargo builds no library that other languages link to.
    let target = own.ancestors().nth(3).unwrap();
    let mut build = Command::new(env!("CARGO"));
    build.args(["build", "--lib", "--profile", "bench", "--locked", "--manifest-path"]);
    build.arg(sources.join("Cargo.toml")).arg("--target-dir").arg(target);
    assert!(build.status().unwrap().success(), "{build:?}");
    let library = target.join("release/libisochrone.so");
    let version = [env!("CARGO_PKG_VERSION_MAJOR"), env!("CARGO_PKG_VERSION_MINOR")].join(".");
    for name in ["libisochrone.so".to_owned(), format!("libisochrone.so.{version}")] {
        let _ = std::fs::remove_file(folder.join(&name));
        symlink(&library, folder.join(name)).unwrap();
    }
    let program = folder.join("exchange");
    let mut command = Command::new("cc");
    command.args(["-std=gnu99", "-O2", "-Wall", "-Werror"]).arg(sources.join("benches/exchange.c"));
    command.arg("-I").arg(sources.join("include")).arg("-L").arg(&folder).arg("-lisochrone");
    command.arg(format!("-Wl,-rpath,{}", folder.display())).arg("-o").arg(&program);
    assert!(command.status().unwrap().success(), "{command:?}");
    program
}

/// Median and 99th percentile of cycle and slack in one turn.
fn measured(command: &mut Command, domain: &IsolatedDomain) -> [[u32; 2]; 2] {
    let output = command.env("ICEORYX2_CONFIG", domain.file()).stderr(Stdio::inherit()).output();
    let output = output.unwrap();
    assert!(output.status.success(), "{command:?}: {}", output.status);
    let (numbers, _) = output.stdout.as_chunks::<4>();
    let numbers: Vec<u32> = numbers.iter().map(|bytes| u32::from_ne_bytes(*bytes)).collect();
    assert_eq!(numbers.len(), 2 * EXCHANGES);
    [0, 1].map(|part| {
        let of_part = numbers.iter().skip(2 * LEFT_OUT + part).step_by(2);
        let mut sorted: Vec<u32> = of_part.copied().collect();
        sorted.sort_unstable();
        [sorted[sorted.len() / 2], sorted[sorted.len() * 99 / 100]]
    })
}

/// The exchange by the ports as a node's task has them, and with [`READER`] by names, as the C interface has it.
fn turn_in_rust(count: usize) {
    let participant = Participant::<ipc::Service>::join("bench/rust", Domain::find().unwrap());
    let participant = Arc::new(participant.unwrap().for_real_time().unwrap());
    // As in a node and in a program in C: with a second thread, each allocation takes a lock.
    let tended = Arc::clone(&participant);
    thread::spawn(move || {
        loop {
            tended.tend();
            thread::sleep(Duration::from_millis(20));
        }
    });
    let signals = (0..count).map(|index| SignalSpec::new(format!("s{index}"), "LREAL")).collect();
    let layout = FrameLayout { signals, period_ns: None };
    let subscriber = participant.subscriber("bench/rust", count, Depth::All).unwrap();
    let publisher = participant.publisher("bench/rust", &layout).unwrap();
    let mut ns = Vec::with_capacity(8 * EXCHANGES);
    if std::env::var_os(READER).is_none() {
        let mut ports = publisher.and(subscriber).enter();
        let (publisher, subscriber) = &mut *ports;
        exchange(publisher, &mut ns, count, subscriber, |subscriber, is_slack| {
            if is_slack {
                subscriber.maintain();
                return None;
            }
            let frame = subscriber.newest(Monotonic.now_ns())?;
            Some(frame.values().iter().sum())
        });
    } else {
        let told = heard(participant.ordinary(), &layout);
        let mut ports = publisher
            .and(subscriber.map(|port| SignalReader::told(port, "bench/rust", &[], told)))
            .enter();
        let (publisher, reader) = &mut *ports;
        reader.maintain();
        exchange(publisher, &mut ns, count, reader, |reader, is_slack| {
            if is_slack {
                reader.maintain();
                return None;
            }
            let frame = reader.newest_frame()?;
            Some(frame.channels().iter().sum())
        });
    }
    std::io::stdout().write_all(&ns).unwrap();
}

/// The layout, as a thread that listens tells it.
fn heard(participant: &Participant<ipc::Service>, layout: &FrameLayout) -> ToldLayouts {
    let told = ToldLayouts::default();
    let mut watcher = LayoutWatcher::open(participant, "bench/rust").unwrap();
    let mut announcer = LayoutAnnouncer::open(participant, "bench/rust", "bench", layout).unwrap();
    while !watcher.look(participant) {
        announcer.tend(participant);
    }
    told.tell(&watcher);
    told
}

/// `read` gives the sum of the newest frame or, in the slack, maintains what it reads with.
fn exchange<R>(
    publisher: &mut FramePublisher<ipc::Service>,
    ns: &mut Vec<u8>,
    count: usize,
    reader: &mut R,
    read: impl Fn(&mut R, bool) -> Option<f64>,
) {
    read(reader, true);
    for n in 0..EXCHANGES {
        let begin_ns = Monotonic.now_ns();
        let values = publisher.values_mut().unwrap();
        for (index, value) in values.iter_mut().enumerate() {
            *value = (n + index) as f64;
        }
        assert!(publisher.send(Stamp::default(), || Monotonic.now_ns()));
        let sum = black_box(read(reader, false).unwrap());
        let end_ns = Monotonic.now_ns();
        assert!(publisher.prepare());
        read(reader, true);
        let slack_ns = Monotonic.now_ns() - end_ns;
        assert_eq!(sum, (count * n + count * (count - 1) / 2) as f64);
        for part in [end_ns - begin_ns, slack_ns] {
            ns.extend(u32::try_from(part).unwrap().to_ne_bytes());
        }
    }
}
