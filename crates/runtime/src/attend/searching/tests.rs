//! The order of searches, with the test in the place of the thread.

use isochrone_engine::operate::Pattern;
use isochrone_engine::{Plan, Rules, Source};

use super::*;

/// The names of a node with so many instances of a block, `late`.
pub(super) fn signals(count: usize) -> Arc<Signals> {
    let text = format!(
        "[node]\nname = \"n\"\n[[task]]\nname = \"fast\"\nperiod = \"10ms\"\n[[block]]\n\
         name = \"late\"\ncount = {count}\ntype = \"LimRateOfChangeCI\"\n\
         in = {{ value = 1.0, setChangeRate = 10.0 }}\n"
    );
    Arc::new(Signals::of(&Plan::new(Source::new("n.toml", text), &Rules::default()).unwrap()))
}

pub(super) fn search(name: &str, offset: usize, limit: usize) -> Search {
    Search { names: Some(vec![name.to_owned()]), offset, limit, purpose: Purpose::Read }
}

/// What the thread would see and say.
struct Played {
    jobs: Receiver<Job>,
    tell: Sender<Found>,
}

impl Played {
    /// Does the one job that is there.
    fn search(&self) -> String {
        let Job { signals, search } = self.jobs.try_recv().unwrap();
        assert!(self.jobs.try_recv().is_err(), "there are two at once");
        let name = search.names.iter().flatten().next().unwrap().clone();
        let selection = search.page(&signals);
        self.tell.send(Found { search, selection }).unwrap();
        name
    }
}

fn searching(names: &[&str]) -> (Searching, Played) {
    let (jobs, taken) = channel();
    let (tell, found) = channel();
    let waiting = names.iter().zip(1..).map(|(name, n)| (Ticket(n), search(name, 0, 1))).collect();
    let searching = Searching { thread: Some(Searcher::of(jobs, found, None)), waiting };
    (searching, Played { jobs: taken, tell })
}

fn found(searching: &mut Searching) -> Option<u64> {
    searching.found().map(|(ticket, found)| {
        assert!(found.unwrap().selection.is_ok());
        ticket.0
    })
}

#[test]
fn the_thread_has_one_search_at_a_time_in_the_order_of_the_requests() {
    let signals = signals(3);
    let (mut searching, thread) = searching(&["late.0.*", "late.1.*", "late.2.*"]);
    for index in 0..3 {
        for _ in 0..2 {
            assert!(searching.begin_next(|| Arc::clone(&signals)).is_none());
        }
        assert_eq!(found(&mut searching), None);
        assert_eq!(thread.search(), format!("late.{index}.*"));
        assert_eq!(found(&mut searching), Some(index + 1));
    }
    assert!(searching.begin_next(|| unreachable!("nothing waits")).is_none());
}

#[test]
fn what_nobody_waits_for_any_more_is_not_looked_for_and_not_answered() {
    let signals = signals(3);
    let (mut searching, thread) = searching(&["late.0.*", "late.1.*", "late.2.*"]);
    searching.begin_next(|| Arc::clone(&signals));
    searching.forget(Ticket(1));
    searching.forget(Ticket(2));
    assert!(searching.begin_next(|| Arc::clone(&signals)).is_none());
    assert_eq!(thread.search(), "late.0.*", "it had begun");
    assert_eq!(found(&mut searching), None);
    searching.begin_next(|| Arc::clone(&signals));
    assert_eq!(thread.search(), "late.2.*");
    assert_eq!(found(&mut searching), Some(3));
}

#[test]
fn at_the_end_the_thread_is_left_with_no_more_than_the_search_it_has() {
    let signals = signals(3);
    let (mut searching, thread) = searching(&["late.0.*", "late.1.*", "late.2.*"]);
    searching.begin_next(|| Arc::clone(&signals));
    drop(searching);
    assert_eq!(thread.jobs.into_iter().count(), 1);
}

#[test]
fn a_thread_that_panicked_is_told_to_the_one_who_waits_and_the_next_gets_another() {
    let signals = signals(3);
    let (mut searching, thread) = searching(&["late.0.*", "late.1.*"]);
    searching.begin_next(|| Arc::clone(&signals));
    drop(thread);
    let (ticket, outcome) = searching.found().unwrap();
    assert_eq!((ticket, outcome.err().unwrap().code), (Ticket(1), Code::Internal));
    assert!(searching.begin_next(|| Arc::clone(&signals)).is_none());
    let thread = searching.thread.as_ref().unwrap();
    let Found { search, selection } = thread.found.recv().unwrap();
    assert_eq!(search.names, Some(vec!["late.1.*".to_owned()]));
    assert_eq!(selection.unwrap().total(), signals.matching(&Pattern::new("late.1.*")).total());
}
