//! `demo`: publisher, control node and subscriber as three processes.

mod messages;
mod redundant;

use std::fs;
use std::io::{self, IsTerminal};
use std::process::Stdio;
use std::thread;
use std::time::Duration;

use isochrone_engine::parse_seconds;
use isochrone_processes::{Child, Company};
use isochrone_report::Report;

use self::messages::Messages;
use crate::base::failure::Failure;
use crate::base::numbers;
use crate::base::stop;
use crate::base::terminal;

/// Run publisher, control node and subscriber as three processes and show live values
///
/// Simulates a 4-20 mA transmitter, scales its level and limits its rate of change. Ends with a
/// summary of jitter and latency.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Args {
    /// Stop after this time: 10, 500ms, 5min
    #[arg(long, value_name = "TIME", default_value = "10", value_parser = parse_seconds, allow_negative_numbers = true)]
    seconds: f64,
    /// Print the summary as JSON; live values go to stderr
    #[arg(long)]
    json: bool,
    /// Run one node in two processes instead, kill the one that holds it each second, and draw the ramp that goes on
    #[arg(long, conflicts_with = "json")]
    redundant: bool,
}

impl Default for Args {
    fn default() -> Self {
        Self { seconds: 10.0, json: false, redundant: false }
    }
}

const CONFIGURATION: &str = include_str!("level.toml");
const INPUT: &str = "plant/analog";
const OUTPUT: &str = "plant/level";
/// The subscriber prints every 500th frame, two lines a second, or draws its table ten times a second.
const PRINTED: &str = "500";
const DRAWN: &str = "100";
/// Where the subscriber writes its report.
const LINK_REPORT: &str = "link.json";
/// How long the children outlive a parent that was killed.
const GRACE_S: f64 = 5.0;
const LOOK_INTERVAL: Duration = Duration::from_millis(20);

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let stop = stop::on_signal(Some(args.seconds))?;
    if args.redundant {
        return redundant::run(&stop);
    }
    let company = Company::gather("isodemo")?;
    company.write("level.toml", CONFIGURATION)?;
    let limit = numbers::format(args.seconds + GRACE_S);
    let is_live = !args.json && io::stdout().is_terminal();
    // Their messages would disturb the table that the subscriber draws.
    let start = |arguments: &[&str]| {
        company.start_with(arguments, |command| {
            let stderr = if is_live { Stdio::piped() } else { Stdio::inherit() };
            command.args(company.in_domain()).stdin(Stdio::null()).stderr(stderr)
        })
    };
    let mut node = start(&["run", "level.toml", "--json", "--seconds", &limit])?;
    let mut publisher = start(&[
        "publish",
        INPUT,
        "--wave",
        "sine",
        "--amplitude",
        "13824",
        "--offset",
        "13824",
        "--frequency",
        "0.2",
        "--seconds",
        &limit,
    ])?;
    let words = Messages::of([&mut node, &mut publisher]);
    let mut run = Ok(());
    while is_live && !words.are_ready() && !stop.is_due() && run.is_ok() {
        thread::sleep(LOOK_INTERVAL);
        run = [&mut node, &mut publisher].into_iter().try_for_each(Child::check);
    }
    words.say();
    run?;
    let every = if is_live { DRAWN } else { PRINTED };
    let mut subscriber = company.start_with(
        &[
            "subscribe",
            OUTPUT,
            "--report",
            LINK_REPORT,
            "--every",
            every,
            "--spin",
            "--wait-silently",
            // On a busy machine the others may need all the time for their start, which is not a failure.
            "--patience",
            &limit,
            "--seconds",
            &limit,
        ],
        // It draws on the terminal itself.
        |command| {
            let stdout = if is_live { Stdio::inherit() } else { Stdio::piped() };
            command.args(company.in_domain()).stdin(Stdio::null()).stdout(stdout)
        },
    )?;
    let node_report = node.document(|_| ());
    let _ = publisher.document(|_| ());
    let json = args.json;
    let _ = subscriber.document(move |line| {
        if json {
            terminal::note(line);
        } else {
            // The pipe's reader may be gone; the summary will tell.
            drop(terminal::print(&format!("{line}\n")));
        }
    });

    let mut all_run = Ok(());
    while all_run.is_ok() && !stop.is_due() {
        thread::sleep(LOOK_INTERVAL);
        all_run =
            [&mut node, &mut publisher, &mut subscriber].into_iter().try_for_each(Child::check);
    }
    // From the reader to the writer, so that the reader sees no end of its frames.
    let ends = [subscriber.finish(), node.finish(), publisher.finish()];
    words.say();
    all_run?;
    ends.into_iter().collect::<Result<(), _>>()?;
    let link_report = fs::read_to_string(company.folder().join(LINK_REPORT)).unwrap_or_default();
    let reports = [node_report.recv().unwrap_or_default(), link_report];
    if reports.iter().any(String::is_empty) {
        terminal::note(
            "stopped before anything was measured; give the demo longer, as in `isochrone demo --seconds 60`",
        );
        return Ok(());
    }
    let [node, link] = reports.map(|report| parse(&report));
    let (node, link) = (node?, link?);
    if link.links.iter().all(|link| link.link.frames == 0) {
        terminal::note(
            "no frame arrived in time: the machine is busy; give the demo longer, as in `isochrone demo --seconds 60`",
        );
    }
    let report = Report {
        command: vec!["demo".into(), "--seconds".into(), numbers::six_digits(args.seconds)],
        links: link.links,
        ..node
    };
    if args.json {
        return terminal::print_json(&report);
    }
    terminal::print(&format!("\n{report}"))
}

fn parse(document: &str) -> Result<Report, Failure> {
    let unreadable = |error| Failure::found(format!("a process's report cannot be read: {error}"));
    serde_json::from_str(document).map_err(unreadable)
}
