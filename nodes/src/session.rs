//! A running node as a screen or a page shows it: the threads that ask it, so that whoever shows it waits
//! for nobody. One reads, one changes.

mod asker;
mod asking;
mod changes;
mod connection;
mod news;
mod readings;
mod target;
mod telemetry;
mod timing;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

pub(crate) use self::asker::Asker;
use self::asking::Asking;
use self::changes::Changes;
pub(crate) use self::changes::{Outcome, change};
use self::connection::Connection;
pub(crate) use self::news::{Absence, CompletedOrder, News, Order, ReadValues, Wish};
#[cfg(test)]
pub(crate) use self::news::{FollowSample, Sample};
pub(crate) use self::readings::{Marks, Readings};
pub(crate) use self::target::Target;
pub(crate) use self::timing::{FollowWindow, Timings, Window, Windows};
use crate::failure::Failure;
use crate::operate::{NodeArgs, Purpose, failure};

/// The threads, and the ways to them. They end when this is dropped.
pub(crate) struct Session {
    wishes: Sender<Wish>,
    orders: Sender<Order>,
    news: Receiver<News>,
    is_over: Arc<AtomicBool>,
    /// The process of the node; 0: not known.
    process: Arc<AtomicU32>,
    threads: Vec<JoinHandle<()>>,
}

impl Session {
    /// Starts asking a node; returns when it has answered for the first time.
    pub(crate) fn start(args: NodeArgs, asker: Asker) -> Result<Self, Failure> {
        let (wishes, wished) = channel();
        let (orders, ordered) = channel();
        let (news_sender, news) = channel();
        let (started, has_started) = channel();
        let is_over = Arc::new(AtomicBool::new(false));
        let next_entry = Arc::new(AtomicU64::new(0));
        let changes = Changes {
            args: args.clone(),
            asker: asker.clone(),
            orders: ordered,
            news: news_sender.clone(),
            wishes: wishes.clone(),
            next_entry: next_entry.clone(),
            is_over: is_over.clone(),
        };
        let process = Arc::<AtomicU32>::default();
        let (ends, of_node) = (is_over.clone(), process.clone());
        let verb = asker.verb;
        let serve = move || {
            let participant = match asker.join(&args) {
                Ok(participant) => participant,
                Err(failure) => return drop(started.send(Err(failure))),
            };
            let connection = match Connection::open(&participant, &args.node, &ends) {
                Ok(connection) => connection,
                Err(error) => return drop(started.send(Err(failure(error, Purpose::Look)))),
            };
            let _ = started.send(Ok(()));
            let mut asking = Asking {
                participant: &participant,
                node: args.node,
                client: asker.client,
                news: news_sender,
                wished,
                watched: Vec::new(),
                next_entry,
                process: of_node,
                looks: false,
            };
            asking.until(&ends, connection);
        };
        let mut session = Self { wishes, orders, news, is_over, process, threads: Vec::new() };
        session.spawn(verb, serve)?;
        session.spawn(&format!("{verb}-changes"), || changes.run())?;
        match has_started.recv() {
            Ok(started) => started.map(|()| session),
            Err(_) => Err(session.ended()),
        }
    }

    fn spawn(&mut self, name: &str, run: impl FnOnce() + Send + 'static) -> Result<(), Failure> {
        let thread = thread::Builder::new().name(name.into()).spawn(run);
        self.threads.push(thread.map_err(Failure::thread)?);
        Ok(())
    }

    /// The way for wishes, for other threads.
    pub(crate) fn wishes(&self) -> Sender<Wish> {
        self.wishes.clone()
    }

    /// What there is to tell, without waiting; an error if a thread has ended.
    pub(crate) fn news(&self) -> Result<Option<News>, Failure> {
        use std::sync::mpsc::TryRecvError;
        match self.news.try_recv() {
            Ok(news) => Ok(Some(news)),
            Err(TryRecvError::Empty) if !self.threads.iter().any(JoinHandle::is_finished) => {
                Ok(None)
            }
            Err(TryRecvError::Empty) => Err(self.ended()),
            Err(TryRecvError::Disconnected) => Err(self.ended()),
        }
    }

    /// The process of the node that was last found, where iceoryx2 tells it.
    pub(crate) fn process(&self) -> Option<u32> {
        Some(self.process.load(Ordering::Relaxed)).filter(|process| *process != 0)
    }

    pub(crate) fn wish(&self, wish: Wish) {
        // One that has ended is noticed with the next news.
        let _ = self.wishes.send(wish);
    }

    pub(crate) fn order(&self, order: Order) {
        let _ = self.orders.send(order);
    }

    fn ended(&self) -> Failure {
        Failure::found("a thread that asks the node has ended; its panic message says why")
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // Its panic has been reported.
            let _ = thread.join();
        }
    }
}
