//! What a frame costs by the C interface and by the ports in Rust, in turns that alternate.
//!
//! Each turn is a process of its own that writes frames, sends them and reads them in one thread, so that nothing but
//! the calls is measured: `exchange.c`, compiled here and linked to the shared library, and this program by itself. The
//! cycle is from before the values are written until all of them are read; the slack is the next loan and the
//! maintenance of the reader.
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

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{
    Depth, Domain, FrameLayout, IsolatedDomain, Participant, SignalSpec, Stamp, ipc,
};

const TURNS: usize = 15;
const EXCHANGES: usize = 50_000;
/// The first of each turn, which warm up.
const LEFT_OUT: usize = EXCHANGES / 10;
const SIZES: [usize; 3] = [1, 100, 1_000];
/// Says to this program that it is a turn of the ports, with so many values.
const TURN: &str = "ISOCHRONE_BENCH_VALUES";

fn main() {
    if let Some(values) = std::env::var_os(TURN) {
        return turn_of_ports(values.to_str().unwrap().parse().unwrap());
    }
    let domain = IsolatedDomain::new("capibench").unwrap();
    let own = std::env::current_exe().unwrap();
    let in_c = compile(&own);
    println!("ns for each exchange, median of {TURNS} turns of {} exchanges", EXCHANGES - LEFT_OUT);
    println!("values  part    percentile   ports    capi  capi / ports (lowest to highest turn)");
    for values in SIZES {
        let mut ports = Vec::new();
        let mut capi = Vec::new();
        for turn in 0..TURNS {
            let mut by_ports = Command::new(&own);
            by_ports.env(TURN, values.to_string());
            let mut by_c = Command::new(&in_c);
            by_c.args([values, EXCHANGES].map(|number| number.to_string()));
            // Whoever is first finds the caches as the other left them.
            let mut run_ports = || ports.push(measured(&mut by_ports, &domain));
            if turn % 2 == 0 {
                run_ports();
                capi.push(measured(&mut by_c, &domain));
            } else {
                capi.push(measured(&mut by_c, &domain));
                run_ports();
            }
        }
        for (part, name) in ["cycle", "slack"].into_iter().enumerate() {
            for (percentile, label) in ["p50", "p99"].into_iter().enumerate() {
                let of = |turns: &[[[u32; 2]; 2]]| -> Vec<f64> {
                    turns.iter().map(|turn| f64::from(turn[part][percentile])).collect()
                };
                let [ports, capi] = [of(&ports), of(&capi)];
                let mut ratios: Vec<_> = ports.iter().zip(&capi).map(|(p, c)| c / p).collect();
                let (ratio, ports, capi) =
                    (median(&mut ratios), median(&mut ports.clone()), median(&mut capi.clone()));
                println!(
                    "{values:>6}  {name}   {label}        {ports:>6.0}  {capi:>6.0}  {ratio:.2} ({:.2} to {:.2})",
                    ratios[0],
                    ratios[TURNS - 1]
                );
            }
        }
    }
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The C program, linked to the library of this build.
fn compile(own: &Path) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("exchange");
    let sources = Path::new(env!("CARGO_MANIFEST_DIR"));
    std::fs::create_dir_all(&folder).unwrap();
    // target/<profile>/deps/exchange-<hash>
    let library = own.ancestors().nth(1).unwrap().join("libisochrone.so");
    assert!(library.exists(), "{library:?} is not there");
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

/// The exchange by the ports, as a node's task has them.
fn turn_of_ports(count: usize) {
    let participant = Participant::<ipc::Service>::join("bench/ports", Domain::find().unwrap());
    let participant = participant.unwrap().for_real_time().unwrap();
    let signals = (0..count).map(|index| SignalSpec::new(format!("s{index}"), "LREAL")).collect();
    let layout = FrameLayout { signals, period_ns: None };
    let subscriber = participant.subscriber("bench/ports", count, Depth::All).unwrap();
    let ports = participant.publisher("bench/ports", &layout).unwrap().and(subscriber);
    let mut ports = ports.enter();
    let (publisher, subscriber) = &mut *ports;
    subscriber.maintain();
    let mut ns = Vec::with_capacity(8 * EXCHANGES);
    for n in 0..EXCHANGES {
        let begin_ns = Monotonic.now_ns();
        let values = publisher.values_mut().unwrap();
        for (index, value) in values.iter_mut().enumerate() {
            *value = (n + index) as f64;
        }
        assert!(publisher.send(Stamp::default(), || Monotonic.now_ns()));
        let frame = subscriber.newest(Monotonic.now_ns()).unwrap();
        let sum: f64 = black_box(frame.values().iter().sum());
        let end_ns = Monotonic.now_ns();
        assert!(publisher.prepare());
        subscriber.maintain();
        let slack_ns = Monotonic.now_ns() - end_ns;
        assert_eq!(sum, (count * n + count * (count - 1) / 2) as f64);
        for part in [end_ns - begin_ns, slack_ns] {
            ns.extend(u32::try_from(part).unwrap().to_ne_bytes());
        }
    }
    std::io::stdout().write_all(&ns).unwrap();
}
