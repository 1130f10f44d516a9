//! Kills or stops a publisher, a node and a subscriber at every system call of their start and end, and
//! sees whether the others get on.
//!
//! ```text
//! cargo run --release -p isochrone-benches --bin crash-points -- --sample 50
//! ```

use std::collections::VecDeque;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use clap::Parser;
use isochrone_benches::crash_points::{
    Blow, Call, Circumstance, Outcome, Phase, Pile, Point, Role, Selection, Stage, Verdict, name,
    spread,
};
use isochrone_benches::{Failure, Profile, build};
use isochrone_processes::Stop;
use serde_json::json;

/// Kill or stop a publisher, a node and a subscriber at system calls of their start and end, and see
/// whether the others get on
///
/// After each blow a publisher, a node and a subscriber are started anew, as far as they do not run
/// anyway. Frames must flow through them within --within, all must end with exit status 0, and no more
/// may be left than they leave undisturbed. Exit status: 0 all points passed, 1 some did not, 2 usage.
#[derive(Parser)]
#[command(name = "crash-points")]
struct Args {
    /// Strike these only
    #[arg(long, value_delimiter = ',')]
    role: Vec<Role>,
    /// Strike in this company only
    #[arg(long, value_delimiter = ',')]
    circumstance: Vec<Circumstance>,
    /// Strike in this part of life only
    #[arg(long, value_delimiter = ',')]
    phase: Vec<Phase>,
    /// Strike at these system calls only
    #[arg(long, value_delimiter = ',')]
    call: Vec<Call>,
    /// What happens at a point
    #[arg(long, value_enum, default_value = "kill")]
    signal: Blow,
    /// Strike at so many points only, evenly spread over all that there are
    #[arg(long, value_name = "N")]
    sample: Option<usize>,
    /// Strike so many instructions after each call, not in its place
    #[arg(long, default_value_t = 0, value_name = "INSTRUCTIONS")]
    steps: u32,
    /// Strike at this point only, such as node:cold:end:unlink:4, or …:4@2 in thread 2, or …:4+500, 500
    /// instructions after the call
    #[arg(long, value_name = "ROLE:CIRCUMSTANCE:PHASE:CALL:K")]
    point: Vec<Point>,
    /// Say which points there are, and strike nowhere
    #[arg(long)]
    list: bool,
    /// Kill at the points in one domain, one after the other, and say what is left after the first and
    /// after the last
    #[arg(long, conflicts_with_all = ["list", "jobs", "json"])]
    pile: bool,
    /// Points at the same time, each in a domain of its own
    #[arg(long, default_value_t = 1)]
    jobs: usize,
    /// How soon frames must flow again
    #[arg(long, default_value_t = 2.0, value_name = "SECONDS")]
    within: f64,
    /// The program to use instead of building it
    #[arg(long)]
    program: Option<std::path::PathBuf>,
    /// Print the outcomes as JSON
    #[arg(long)]
    json: bool,
}

fn main() -> Result<ExitCode, Failure> {
    let args = Args::parse();
    let program = match &args.program {
        Some(program) => std::path::absolute(program)?,
        None => build(Profile::own())?,
    };
    // What was started has process groups of its own: Ctrl-C does not reach it, dropping ends it.
    let stop = Stop::on_signal(|| eprintln!("ended at once by another signal; files may be left"))?;
    let stage = Stage::new(program, Duration::from_secs_f64(args.within))?;
    let points = points(&args, &stage)?;
    if args.list {
        points.iter().for_each(|point| println!("{point}"));
        return Ok(ExitCode::SUCCESS);
    }
    if args.pile {
        return pile(&stage, &points);
    }
    let outcomes = scan(&args, &stage, &points, &stop)?;
    if outcomes.len() < points.len() {
        eprintln!("interrupted: {} points were not tried", points.len() - outcomes.len());
    }
    conclude(&args, &outcomes);
    let is_well = outcomes.len() == points.len() && failures(&outcomes).count() == 0;
    Ok(if is_well { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn points(args: &Args, stage: &Stage) -> Result<Vec<Point>, Failure> {
    if !args.point.is_empty() {
        return Ok(args.point.clone());
    }
    let mut all = stage.points(&Selection {
        roles: args.role.clone(),
        circumstances: args.circumstance.clone(),
        phases: args.phase.clone(),
        calls: args.call.clone(),
    })?;
    all.iter_mut().for_each(|point| point.steps = args.steps);
    eprintln!("{} points", all.len());
    Ok(args.sample.map_or_else(|| all.clone(), |sample| spread(&all, sample)))
}

fn scan(
    args: &Args,
    stage: &Stage,
    points: &[Point],
    stop: &Stop,
) -> Result<Vec<Outcome>, Failure> {
    let left = Mutex::new(points.iter().copied().collect::<VecDeque<Point>>());
    let next = || left.lock().unwrap_or_else(PoisonError::into_inner).pop_front();
    let (since, done) = (Instant::now(), AtomicUsize::new(0));
    let work = || {
        let mut outcomes = Vec::new();
        while let Some(point) = next().filter(|_| !stop.is_due()) {
            let outcome = stage.strike(point, args.signal);
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            let (all, seconds) = (points.len(), since.elapsed().as_secs());
            eprintln!("{done} of {all}, {seconds} s: {}", line(&outcome));
            outcomes.push(outcome);
        }
        Ok::<_, Failure>(outcomes)
    };
    thread::scope(|scope| {
        let workers: Vec<_> = (0..args.jobs.max(1)).map(|_| scope.spawn(work)).collect();
        let mut outcomes = Vec::new();
        for worker in workers {
            outcomes.extend(worker.join().map_err(|_| "a worker panicked")??);
        }
        Ok(outcomes)
    })
}

fn pile(stage: &Stage, points: &[Point]) -> Result<ExitCode, Failure> {
    let Pile { first, last, wrong } = stage.pile_up(points)?;
    println!("after 1 kill {} files or folders are left: {}", first.len(), first.join(", "));
    println!("after {} kills {}: {}", points.len(), last.len(), last.join(", "));
    wrong.iter().for_each(|wrong| println!("{wrong}"));
    let is_well = wrong.is_empty() && first == last;
    Ok(if is_well { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn failures(outcomes: &[Outcome]) -> impl Iterator<Item = &Outcome> {
    outcomes.iter().filter(|outcome| matches!(outcome.verdict, Verdict::Fail(_)))
}

fn line(outcome: &Outcome) -> String {
    let Outcome { point, verdict, .. } = outcome;
    match verdict {
        Verdict::Pass => {
            let recovered = outcome.recovered.unwrap_or_default().as_millis();
            format!("PASS {point}: frames after {recovered} ms")
        }
        Verdict::NotReached => format!("---- {point}: not reached"),
        Verdict::Fail(wrong) => format!("FAIL {point}: {}", wrong.join("; ")),
    }
}

fn conclude(args: &Args, outcomes: &[Outcome]) {
    let failed = failures(outcomes).count();
    let unreached =
        outcomes.iter().filter(|outcome| outcome.verdict == Verdict::NotReached).count();
    let slowest = outcomes.iter().filter_map(|outcome| outcome.recovered).max().unwrap_or_default();
    let command = |point: &Point| {
        let signal = name(args.signal);
        format!(
            "cargo run --release -p isochrone-benches --bin crash-points -- --signal {signal} --point {point}"
        )
    };
    if args.json {
        let outcome = |outcome: &Outcome| {
            let (verdict, wrong) = match &outcome.verdict {
                Verdict::Pass => ("pass", &[][..]),
                Verdict::NotReached => ("not_reached", &[][..]),
                Verdict::Fail(wrong) => ("fail", &wrong[..]),
            };
            json!({
                "point": outcome.point.to_string(),
                "signal": name(outcome.blow),
                "verdict": verdict,
                "wrong": wrong,
                "recovered_ms": outcome.recovered.map(|recovered| recovered.as_millis() as u64),
                "command": command(&outcome.point),
            })
        };
        let all: Vec<_> = outcomes.iter().map(outcome).collect();
        let struck = outcomes.len() - unreached;
        println!(
            "{}",
            json!({"failed": failed, "struck": struck, "not_reached": unreached, "outcomes": all})
        );
        return;
    }
    for outcome in failures(outcomes) {
        println!("{}\n  {}", line(outcome), command(&outcome.point));
    }
    println!(
        "{failed} of {} points failed, {unreached} more were not reached; frames flowed after {} ms at most",
        outcomes.len() - unreached,
        slowest.as_millis()
    );
}
