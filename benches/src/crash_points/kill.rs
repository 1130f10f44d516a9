//! A process that is killed at a point.

use std::time::{Duration, Instant};

use nix::sys::signal::Signal;

use super::peer::END_WITHIN;
use super::point::{Blow, Circumstance, Phase, Point, Role};
use super::roles::{
    FRESH, INPUT, LIVING, NODE, OUTPUT, SECOND_NODE, SECOND_OUTPUT, VICTIM, command,
};
use super::scene::{Company, let_connections_settle};
use super::stage::{Findings, SET_WITHIN, Stage, wait};
use super::tracer::{Aim, Event, Site};
use super::victim::Victim;
use super::watch::Watch;
use crate::Failure;

/// How long after its start was over a process may still come to a point of its start.
const LATE: Duration = Duration::from_millis(200);

/// Exit status of a subscriber that found nobody.
pub(super) const NOBODY: i32 = 3;

/// Returns what was found, or nothing if the process never came to the point.
pub(super) fn strike(stage: &Stage, point: Point) -> Result<Option<Findings>, Failure> {
    let mut company = Company::gather(stage, point.role, point.circumstance)?;
    let victim = start(stage, &company, point, Blow::Kill)?;
    if !reaches(&company, point, &victim)? {
        return Ok(None);
    }
    match victim.event(END_WITHIN) {
        Some(Event::Ended(None)) => {}
        other => return Err(format!("SIGKILL did not end the process: {other:?}").into()),
    }
    drop(victim);

    let mut findings = Findings::default();
    if !company.expect_pulse(&mut findings) {
        return Ok(Some(findings));
    }
    replace(&mut company, point)?;
    if !company.expect_frames(stage.within(), &mut findings) || !company.expect_pulse(&mut findings)
    {
        return Ok(Some(findings));
    }
    let domain = company.end(&mut findings);
    findings.take(stage.check_litter(&domain));
    Ok(Some(findings))
}

/// Starts the process that is struck at the point.
pub(super) fn start(
    stage: &Stage,
    company: &Company<'_>,
    point: Point,
    blow: Blow,
) -> Result<Victim, Failure> {
    let Point { phase, thread, call, k, steps, .. } = point;
    let aim = Aim { site: Site { phase, thread, call }, k, steps, blow };
    Victim::start(&stage.command(&company.domain, &command(point.role, VICTIM)), Some(aim))
}

/// Lets the process come to the point; asks it to end if that is where the point lies.
pub(super) fn reaches(
    company: &Company<'_>,
    point: Point,
    victim: &Victim,
) -> Result<bool, Failure> {
    if point.phase == Phase::End {
        runs(company, point.role, point.circumstance, victim)?;
        victim.signal(Signal::SIGINT);
        return match victim.event(END_WITHIN) {
            Some(Event::Struck) => Ok(true),
            Some(Event::Ended(Some(0 | NOBODY))) => Ok(false),
            other => Err(astray(point, victim, other)),
        };
    }
    let since = Instant::now();
    let mut settled = None;
    loop {
        match victim.event(Duration::from_millis(5)) {
            Some(Event::Struck) => return Ok(true),
            None if since.elapsed() < SET_WITHIN => {}
            other => return Err(astray(point, victim, other)),
        }
        if settled.is_none() && victim.is_settled() {
            settled = Some(Instant::now());
        }
        if settled.is_some_and(|settled: Instant| settled.elapsed() > LATE) {
            return Ok(false);
        }
    }
}

/// A process that goes wrong before it is struck.
fn astray(point: Point, victim: &Victim, event: Option<Event>) -> Failure {
    let did = match event {
        Some(Event::Ended(code)) => format!("ended with {code:?}"),
        _ => "went on and on".to_owned(),
    };
    let said = victim.output.last_words();
    format!("before the blow, the {:?} {did}: {said}", point.role).into()
}

/// Waits until the process that will be struck works.
pub(super) fn runs(
    company: &Company<'_>,
    role: Role,
    circumstance: Circumstance,
    victim: &Victim,
) -> Result<(), Failure> {
    let speaks = || role == Role::Subscriber || !victim.output.errors().is_empty();
    let heard =
        if circumstance.has_company() { company.hears(role, VICTIM, &victim.output) } else { None };
    let runs = || victim.is_settled() && speaks() && heard.as_ref().is_none_or(Watch::is_met);
    if wait(SET_WITHIN, runs).is_none() {
        let said = victim.output.errors();
        return Err(format!("the {role:?} does not start: {said}").into());
    }
    let_connections_settle();
    Ok(())
}

/// Starts a process of each role of which there can be another.
pub(super) fn replace(company: &mut Company<'_>, point: Point) -> Result<(), Failure> {
    if !point.circumstance.has_company() {
        return company.all_fresh();
    }
    let living = company.living_subscriber();
    let expect = |company: &mut Company<'_>, value| {
        let watch =
            living.as_ref().map(|output| Watch::new("living subscriber", output, Some(value)));
        company.watches.extend(watch);
    };
    match point.role {
        Role::Publisher => {
            company.publisher(FRESH)?;
            company.node(SECOND_NODE)?;
            company.subscriber_of(SECOND_OUTPUT, Some(FRESH))?;
            expect(company, FRESH);
        }
        Role::Node => {
            company.node(NODE)?;
            company.subscriber_of(OUTPUT, Some(LIVING))?;
            company.subscriber_of(INPUT, Some(LIVING))?;
            expect(company, LIVING);
        }
        Role::Subscriber => {
            company.node(SECOND_NODE)?;
            company.subscriber_of(SECOND_OUTPUT, Some(LIVING))?;
            company.subscriber_of(OUTPUT, Some(LIVING))?;
        }
    }
    Ok(())
}
