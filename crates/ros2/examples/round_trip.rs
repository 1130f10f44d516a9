//! How long a frame takes to a message and back to a frame: two bridges in a domain of their own, the first from a service
//! to a topic, the second from that topic to another service, and this program on both sides. At the end it prints what
//! came back, and what each bridge counted.
//!
//! `cargo run --release --example round_trip -- [FRAMES_A_SECOND [SECONDS [default|sensor_data]]]`

use std::process::Command;
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic, PromptWakeUps};
use isochrone_ipc::{
    FrameLayout, FramePublisher, LayoutAnnouncer, Participant, SignalReader, SignalSpec, Stamp, ipc,
};
use isochrone_testing::{Domain, Process};

const WARM_UP: Duration = Duration::from_secs(5);

fn main() {
    let mut arguments = std::env::args().skip(1);
    let mut next = |default: &str| arguments.next().unwrap_or(default.into());
    let (rate, seconds, qos) = (next("1000"), next("20"), next("default"));
    let period_ns = (1e9 / rate.parse::<f64>().expect("frames a second")) as u64;
    let seconds: u64 = seconds.parse().expect("whole seconds");
    let domain = Domain::new();
    let link = |table, service, field, signal| {
        format!(
            "[[{table}]]\ntopic = \"/round_trip\"\nservice = \"{service}\"\ntype = \"std_msgs/msg/Float64\"\n\
             fields = {{ {field} = \"{signal}\" }}\nqos = \"{qos}\"\ndepth = 100\n"
        )
    };
    let bridges = [
        ("out.toml", link("to_ros", "there", "data", "sent")),
        ("back.toml", link("from_ros", "back", "data", "sent")),
    ]
    .map(|(file, text)| {
        let own = std::env::current_exe().expect("this program");
        let program = own.ancestors().nth(2).expect("its folder").join("isochrone-ros2");
        let mut command = Command::new(program);
        command.arg(domain.write(file, text)).args(["--local", "--domain", "98"]);
        command.env("ICEORYX2_CONFIG", domain.config_file());
        Process::start(command)
    });
    let participant = domain.join("round_trip");
    let frames = seconds * 1_000_000_000 / period_ns;
    let counted_from_ns = Monotonic.now_ns() + WARM_UP.as_nanos() as u64;
    let mut latencies_ns = std::thread::scope(|scope| {
        let config = isochrone_ipc::Domain::from_file(&domain.config_file()).expect("a domain");
        scope.spawn(move || send(config, counted_from_ns, frames, period_ns));
        read(&participant, counted_from_ns, frames)
    });
    latencies_ns.sort_unstable();
    let at = |share: f64| {
        let index = (share * latencies_ns.len() as f64) as usize;
        latencies_ns.get(index).map_or(f64::NAN, |ns| *ns as f64 / 1e3)
    };
    println!(
        "{} of {frames} frames came back; p50 {:.0} us, p99 {:.0} us, p99.9 {:.0} us",
        latencies_ns.len(),
        at(0.5),
        at(0.99),
        at(0.999)
    );
    // With those of the warm-up.
    for bridge in bridges {
        print!("{}", bridge.stop().expect_code(0).stderr);
    }
}

/// Sends frames whose value is the time at which they were sent: until a time those that warm up, and then so many.
fn send(domain: isochrone_ipc::Domain, counted_from_ns: u64, frames: u64, period_ns: u64) {
    let participant = Participant::<ipc::Service>::join("sender", domain).expect("a participant");
    let layout =
        FrameLayout { signals: vec![SignalSpec::new("sent", "LREAL")], period_ns: Some(period_ns) };
    let mut publisher = FramePublisher::open(&participant, "there", &layout).expect("a publisher");
    let mut announcer =
        LayoutAnnouncer::open(&participant, "there", "sender", &layout).expect("an announcer");
    let _prompt = PromptWakeUps::in_this_thread();
    let warm_up = counted_from_ns.saturating_sub(Monotonic.now_ns()) / period_ns;
    let first_ns = counted_from_ns - warm_up * period_ns;
    for frame in 0..warm_up + frames {
        Monotonic.sleep_until_ns(first_ns + frame * period_ns);
        if frame % 20 == 0 {
            announcer.tend(&participant);
        }
        publisher.prepare();
        if let Some(values) = publisher.values_mut() {
            values[0] = Monotonic.now_ns() as f64;
        }
        publisher.send(Stamp { cycle: frame, ..Stamp::default() }, || Monotonic.now_ns());
    }
}

/// How long frames took that were sent from a time on, until so many have come or none comes any more.
fn read(participant: &Participant<ipc::Service>, counted_from_ns: u64, frames: u64) -> Vec<u64> {
    let mut reader = SignalReader::open(participant, "back", &["sent"]).expect("a reader");
    let mut latencies_ns = Vec::new();
    while (latencies_ns.len() as u64) < frames {
        let Some(frame) = reader.wait(2 * WARM_UP) else { break };
        let sent_ns = frame.channels()[0] as u64;
        if sent_ns >= counted_from_ns {
            latencies_ns.push(frame.receipt().received_ns.saturating_sub(sent_ns));
        }
    }
    latencies_ns
}
