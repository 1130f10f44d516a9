//! Work that takes too long for the thread that serves requests. A thread of its own does one job after the other.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread;

use crate::panics;
use isochrone_control::{Code, Refusal};

type Work = Box<dyn FnOnce() + Send>;

/// The thread, which is started with the first job. Dropping this ends it after the jobs that it has.
#[derive(Default)]
pub(super) struct Jobs {
    work: Option<Sender<Work>>,
}

/// Work that has been given to the thread.
pub(super) struct Job<T> {
    done: Receiver<thread::Result<T>>,
}

impl Jobs {
    /// Has work done when all that was given before is done.
    pub(super) fn begin<T: Send + 'static>(
        &mut self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<Job<T>, Refusal> {
        let (tell, done) = channel();
        let work = move || {
            // Without a receiver, no one waits for the result any more.
            let _ = tell.send(catch_unwind(AssertUnwindSafe(work)));
        };
        let sender = match self.work.take() {
            Some(sender) => sender,
            None => start()?,
        };
        let sender = self.work.insert(sender);
        // If the thread is gone, the work is dropped, and the job reports that.
        let _ = sender.send(Box::new(work));
        Ok(Job { done })
    }
}

fn start() -> Result<Sender<Work>, Refusal> {
    let (sender, given) = channel::<Work>();
    let work = move || given.into_iter().for_each(|work| work());
    let started = thread::Builder::new().name("control jobs".into()).spawn(work);
    started.map(|_| sender).map_err(|error| {
        Refusal::new(Code::Internal, format!("cannot start a thread to do this in: {error}"))
    })
}

impl<T> Job<T> {
    /// Its result; `None` while it is not done.
    pub(super) fn result(&self) -> Option<Result<T, Refusal>> {
        let internal = |why: String| Some(Err(Refusal::new(Code::Internal, why)));
        match self.done.try_recv() {
            Ok(Ok(made)) => Some(Ok(made)),
            Ok(Err(panic)) => internal(format!("panicked: {}", panics::message(&*panic))),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => internal("the thread that does this is gone".into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use isochrone_testing::wait_for_some;

    use super::*;

    fn result<T>(job: &Job<T>) -> Result<T, Refusal> {
        wait_for_some("the job is done", || job.result())
    }

    #[test]
    fn jobs_are_done_in_the_order_in_which_they_were_given_and_one_that_panics_alone_fails() {
        let mut jobs = Jobs::default();
        let (go, gone) = channel();
        let first = jobs.begin(move || gone.recv().unwrap()).unwrap();
        let second = jobs.begin(|| -> i32 { panic!("out of ink") }).unwrap();
        let third = jobs.begin(|| thread::current().name().map(str::to_owned)).unwrap();
        assert!(first.result().is_none() && second.result().is_none() && third.result().is_none());
        go.send(1).unwrap();
        assert_eq!(result(&first).unwrap(), 1);
        assert_eq!(result(&second).unwrap_err().message, "panicked: out of ink");
        assert_eq!(result(&third).unwrap().as_deref(), Some("control jobs"));
    }
}
