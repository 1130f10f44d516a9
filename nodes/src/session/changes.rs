//! The thread that has the node changed. It has a place of its own at the node while it does so: what
//! an operator confirms never waits behind what the screen reads.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::time::Duration;

use isochrone_control::{Client, ClientError, Entry, JournalParams};

use super::asker::Asker;
use super::connection::{PATIENCE, give, whole};
use super::news::{CompletedOrder, News, Order, Wish};
use crate::operate::NodeArgs;

/// Between two looks whether the screen was left.
const TURN: Duration = Duration::from_millis(100);

/// The arguments of the thread.
pub(crate) struct Changes {
    pub(crate) args: NodeArgs,
    pub(crate) asker: Asker,
    pub(crate) orders: Receiver<Order>,
    pub(crate) news: Sender<News>,
    /// To the thread that reads.
    pub(crate) wishes: Sender<Wish>,
    /// The `sequence` of the next entry of the journal that is not known.
    pub(crate) next_entry: Arc<AtomicU64>,
    pub(crate) is_over: Arc<AtomicBool>,
}

impl Changes {
    pub(crate) fn run(self) {
        while !self.is_over.load(Ordering::Relaxed) {
            match self.orders.recv_timeout(TURN) {
                Ok(order) => self.carry_out(order),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    fn carry_out(&self, order: Order) {
        let Self { args, asker, is_over, .. } = self;
        let news = match change(args, asker, is_over, &order, |client| self.tell_journal(client)) {
            Outcome::Done(done) => News::Done(done),
            Outcome::Refused(why) => News::Refused { order, why },
            Outcome::NoPlace => {
                // The place that reads has to do.
                let _ = self.wishes.send(Wish::Order(order));
                return;
            }
        };
        // The screen that would take it is gone only when this ends too.
        let _ = self.news.send(news);
        let _ = self.wishes.send(Wish::Look);
    }

    /// A change is in the journal before it is reported, so that it can be taken back at once.
    fn tell_journal(&self, client: &mut Client) {
        // What does not come now comes with the next look.
        if let Ok(entries) = entries(client, &self.next_entry) {
            let _ = self.news.send(News::Journal(entries));
        }
    }
}

/// Has the node carry out an order, at a place of its own; `then` asks more of it once that is done.
pub(crate) fn change(
    args: &NodeArgs,
    asker: &Asker,
    is_over: &Arc<AtomicBool>,
    order: &Order,
    then: impl FnOnce(&mut Client),
) -> Outcome {
    let participant = match asker.join(args) {
        Ok(participant) => participant,
        Err(failure) => {
            let why = failure.report().map(ToString::to_string);
            return Outcome::Refused(why.unwrap_or_default());
        }
    };
    let client = match Client::connect_to_act(&participant, &args.node, PATIENCE) {
        Ok(client) => client,
        Err(ClientError::Full { .. }) => return Outcome::NoPlace,
        Err(error) => return Outcome::Refused(whole(&error)),
    };
    let mut client = client.interrupted_by(is_over.clone());
    match give(&mut client, order, &asker.client) {
        Ok(done) => {
            then(&mut client);
            Outcome::Done(done)
        }
        Err(error) => Outcome::Refused(whole(&error)),
    }
}

/// The outcome of an order.
pub(crate) enum Outcome {
    Done(CompletedOrder),
    Refused(String),
    /// As many clients ask the node as it takes.
    NoPlace,
}

/// The entries of the journal that are not known yet.
pub(crate) fn entries(
    client: &mut Client,
    next_entry: &AtomicU64,
) -> Result<Vec<Entry>, ClientError> {
    let mut entries: Vec<Entry> = Vec::new();
    loop {
        let since = Some(next_entry.load(Ordering::Relaxed));
        let page = client.call(&JournalParams { since, limit: None })?;
        let is_last = page.entries.len() as u64 >= page.total || page.entries.is_empty();
        if let Some(last) = page.entries.last() {
            next_entry.fetch_max(last.sequence + 1, Ordering::Relaxed);
        }
        entries.extend(page.entries);
        if is_last {
            return Ok(entries);
        }
    }
}
