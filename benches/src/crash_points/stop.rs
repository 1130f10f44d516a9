//! A process that is stopped at a point, and goes on later.

use std::fs;
use std::time::Instant;

use nix::sys::signal::Signal;
use nix::unistd::Pid;

use super::kill::{NOBODY, reaches, start};
use super::output::Output;
use super::peer::END_WITHIN;
use super::point::{Blow, Phase, Point, Role};
use super::roles::{FRESH, INPUT, LIVING, NODE, OUTPUT, SECOND_NODE, SECOND_OUTPUT, VICTIM};
use super::scene::Company;
use super::stage::{Findings, SET_WITHIN, Stage, wait};
use super::tracer::Event;
use super::victim::Victim;
use super::watch::Watch;
use crate::Failure;

/// Returns what was found, or nothing if the process never came to the point.
pub(super) fn strike(stage: &Stage, point: Point) -> Result<Option<Findings>, Failure> {
    let mut company = Company::gather(stage, point.role, point.circumstance)?;
    let victim = start(stage, &company, point, Blow::Stop)?;
    if !reaches(&company, point, &victim)? {
        return Ok(None);
    }
    if wait(SET_WITHIN, || matches!(state(victim.pid), Some('T') | None)).is_none() {
        return Err("SIGSTOP did not stop the process".into());
    }
    if state(victim.pid).is_none() {
        // The call was its last.
        return Ok(None);
    }

    let mut findings = Findings::default();
    let readers = join_meanwhile(&mut company, point)?;
    findings.take(work_or_wait(stage, &company, victim.pid));
    company.expect_pulse(&mut findings);

    victim.signal(Signal::SIGCONT);
    company.watch_anew();
    match point.phase {
        Phase::Start => expect_of_victim(&mut company, point, &victim, &readers),
        Phase::End => {
            findings.take(ended(point, &victim));
            replace(&mut company, point, &readers)?;
        }
    }
    company.expect_frames(stage.within(), &mut findings);
    company.expect_pulse(&mut findings);
    if point.phase == Phase::Start {
        victim.signal(Signal::SIGINT);
        findings.take(ended(point, &victim));
    }
    if findings.wrong.is_empty() {
        let domain = company.end(&mut findings);
        findings.take(stage.check_litter(&domain));
    }
    Ok(Some(findings))
}

/// Starts processes of the other roles while one is stopped. Returns subscribers that depend on the
/// one that is stopped.
fn join_meanwhile(company: &mut Company<'_>, point: Point) -> Result<Vec<Output>, Failure> {
    let is_beside = point.circumstance.has_company();
    let (node, output) = if is_beside { (SECOND_NODE, SECOND_OUTPUT) } else { (NODE, OUTPUT) };
    let mut readers = Vec::from_iter(company.living_subscriber());
    match point.role {
        Role::Publisher => {
            company.node(node)?;
            readers.push(company.subscriber_of(output, None)?);
        }
        Role::Node => {
            if !is_beside {
                company.publisher(FRESH)?;
            }
            company.subscriber_of(INPUT, Some(source(point)))?;
            readers.push(company.subscriber(OUTPUT)?);
        }
        Role::Subscriber => {
            if !is_beside {
                company.publisher(FRESH)?;
            }
            company.node(node)?;
            company.subscriber_of(output, Some(source(point)))?;
        }
    }
    Ok(readers)
}

/// What the publisher sends that is not the one that is stopped.
fn source(point: Point) -> f64 {
    if point.circumstance.has_company() { LIVING } else { FRESH }
}

/// Either frames flow, or everybody said something and somebody named the one who holds them up.
fn work_or_wait(stage: &Stage, company: &Company<'_>, pid: Pid) -> Result<(), String> {
    let names_it = |errors: &str| {
        errors.split(|c: char| !c.is_ascii_digit()).any(|number| number == pid.to_string())
    };
    let is_well = || {
        let waits = company.fresh().iter().any(|peer| names_it(&peer.output.errors()));
        let spoke = company.fresh().iter().all(|peer| peer.has_spoken());
        company.watches.iter().all(Watch::is_met) || (waits && spoke)
    };
    if stage.wait_for(is_well).is_some() {
        return Ok(());
    }
    Err(format!("while it was stopped, nobody named its pid {pid}: {}", company.unmet().join("; ")))
}

/// After SIGCONT what is stopped works, and the others see it.
fn expect_of_victim(company: &mut Company<'_>, point: Point, victim: &Victim, readers: &[Output]) {
    let value = match point.role {
        Role::Publisher => VICTIM,
        Role::Node | Role::Subscriber => source(point),
    };
    expect(company, readers, value);
    if point.role == Role::Subscriber {
        company.watches.push(Watch::new("process that was stopped", &victim.output, Some(value)));
    }
}

/// Starts a process of the role of the one that was stopped, and has ended.
fn replace(company: &mut Company<'_>, point: Point, readers: &[Output]) -> Result<(), Failure> {
    match point.role {
        Role::Publisher => {
            company.publisher(FRESH)?;
            expect(company, readers, FRESH);
        }
        Role::Node => {
            company.node(NODE)?;
            expect(company, readers, source(point));
        }
        Role::Subscriber => drop(company.subscriber_of(OUTPUT, Some(source(point)))?),
    }
    Ok(())
}

fn expect(company: &mut Company<'_>, readers: &[Output], value: f64) {
    let watch = |reader| Watch::new("subscriber", reader, Some(value));
    company.watches.extend(readers.iter().map(watch));
}

/// Waits for the end of what was stopped.
fn ended(point: Point, victim: &Victim) -> Result<(), String> {
    let since = Instant::now();
    while let Some(left) = END_WITHIN.checked_sub(since.elapsed()) {
        let Some(Event::Ended(code)) = victim.event(left) else { continue };
        let alone = point.role == Role::Subscriber && !point.circumstance.has_company();
        return match code {
            Some(0) => Ok(()),
            Some(NOBODY) if alone && point.phase == Phase::End => Ok(()),
            other => Err(format!(
                "what was stopped ended with {other:?}: {}",
                victim.output.last_words()
            )),
        };
    }
    Err(format!("what was stopped does not end: {}", victim.output.errors()))
}

/// The state of a process as the kernel shows it, `T` where it is stopped; none if it is gone.
fn state(pid: Pid) -> Option<char> {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    stat.rsplit_once(") ")?.1.chars().next()
}
