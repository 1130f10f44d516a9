//! The thread that reads from the node: what is due, and what is wished for.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender};
use std::thread;
use std::time::{Duration, Instant};

use isochrone_control::{ClientError, Code, DescribeParams, ForcesParams, GetParams};
use isochrone_ipc::{Participant, ipc};

use super::changes::entries;
use super::connection::{Connection, absence, give, whole};
use super::news::{News, Order, ReadValues, Wish};
use crate::operate::silence;

type Service = ipc::Service;

/// Between two looks for what the screen wants, and for telemetry.
const TURN: Duration = Duration::from_millis(10);
/// Between two looks at values: as often as eyes can follow digits.
const VALUES_INTERVAL: Duration = Duration::from_millis(200);
/// Between two looks at all else.
const STATE_INTERVAL: Duration = Duration::from_millis(1000);
/// Between two looks for a node that is gone.
const SEARCH_INTERVAL: Duration = Duration::from_millis(500);

/// The state of the thread.
pub(super) struct Asking<'p> {
    pub(super) participant: &'p Participant<Service>,
    pub(super) node: String,
    pub(super) client: Option<String>,
    pub(super) news: Sender<News>,
    pub(super) wished: Receiver<Wish>,
    pub(super) watched: Vec<String>,
    pub(super) next_entry: Arc<AtomicU64>,
    /// The process of the node; 0: not known.
    pub(super) process: Arc<AtomicU32>,
    /// The state of the node is wanted at once.
    pub(super) looks: bool,
}

impl<'p> Asking<'p> {
    pub(super) fn until(&mut self, is_over: &Arc<AtomicBool>, connection: Connection<'p>) {
        self.note_process(&connection);
        let mut connection = Some(connection);
        let mut search = Instant::now();
        while !is_over.load(Ordering::Relaxed) {
            self.participant.tend();
            if connection.is_none() && Instant::now() >= search {
                search = Instant::now() + SEARCH_INTERVAL;
                // One that was killed would go on being waited for.
                self.participant.clean_up();
                match Connection::open(self.participant, &self.node, is_over) {
                    Ok(open) => {
                        self.note_process(&open);
                        connection = Some(open);
                    }
                    Err(error) => self.tell(lost(&error)),
                }
            }
            let orders = self.read_wishes();
            let looks = std::mem::take(&mut self.looks);
            match &mut connection {
                Some(open) => {
                    if looks {
                        open.state_due = Instant::now();
                    }
                    if let Err(error) = self.turn(open, orders) {
                        self.tell(lost(&error));
                        connection = None;
                        search = Instant::now() + SEARCH_INTERVAL;
                    }
                }
                None => {
                    for order in orders {
                        let why = format!("node \"{}\" does not answer at the moment", self.node);
                        self.tell(News::Refused { order, why });
                    }
                }
            }
            thread::sleep(TURN);
        }
    }

    fn note_process(&self, connection: &Connection<'_>) {
        self.process.store(connection.client.process().unwrap_or_default(), Ordering::Relaxed);
    }

    fn tell(&self, news: News) {
        // The screen that would take it is gone only when this ends too.
        let _ = self.news.send(news);
    }

    fn read_wishes(&mut self) -> Vec<Order> {
        let mut orders = Vec::new();
        for wish in self.wished.try_iter() {
            match wish {
                Wish::Watch(names) => self.watched = names,
                Wish::Look => self.looks = true,
                Wish::Order(order) => orders.push(order),
            }
        }
        orders
    }

    /// Asks for what is due; an error if the node does not answer.
    fn turn(
        &mut self,
        connection: &mut Connection<'_>,
        orders: Vec<Order>,
    ) -> Result<(), ClientError> {
        if let Some(telemetry) = &mut connection.telemetry {
            let samples = telemetry.take();
            if !samples.is_empty() {
                self.tell(News::Timing(samples));
            }
        }
        let mut orders = orders.into_iter();
        while let Some(order) = orders.next() {
            match give(&mut connection.client, &order, &self.client) {
                Ok(done) => self.tell(News::Done(done)),
                Err(error) => {
                    self.tell(News::Refused { order, why: whole(&error) });
                    if !matches!(error, ClientError::Refused(_)) {
                        for order in orders {
                            self.tell(News::Refused { order, why: "it was not asked for".into() });
                        }
                        return Err(error);
                    }
                }
            }
            connection.state_due = Instant::now();
        }
        let now = Instant::now();
        if now >= connection.state_due {
            connection.state_due = now + STATE_INTERVAL;
            self.ask_for_state(connection)?;
        }
        if now >= connection.values_due || connection.watched != self.watched {
            connection.values_due = now + VALUES_INTERVAL;
            connection.watched.clone_from(&self.watched);
            self.ask_for_values(connection)?;
        }
        Ok(())
    }

    fn ask_for_state(&self, connection: &mut Connection<'_>) -> Result<(), ClientError> {
        let node = connection.client.call(&DescribeParams {})?;
        let sha256 = node.configuration.sha256.clone();
        let identity = (node.started_unix_ns, sha256, node.announced_units);
        if connection.started_unix_ns != Some(node.started_unix_ns) {
            connection.started_unix_ns = Some(node.started_unix_ns);
            self.next_entry.store(0, Ordering::Relaxed);
        }
        if connection.identity.as_ref() == Some(&identity) {
            self.tell(News::Described(node));
        } else {
            connection.identity = Some(identity);
            let signals = connection.client.signals(None)?;
            self.tell(News::Joined { node, signals });
        }
        let (alarms, process) = connection.client.alarms()?;
        self.tell(News::Alarms(alarms));
        self.tell(News::ProcessAlarms(process));
        self.tell(News::Forces(connection.client.pages(
            |offset| ForcesParams { offset: Some(offset), limit: None },
            |page| (page.total, page.forces),
        )?));
        let entries = entries(&mut connection.client, &self.next_entry)?;
        if !entries.is_empty() {
            self.tell(News::Journal(entries));
        }
        Ok(())
    }

    fn ask_for_values(&self, connection: &mut Connection<'_>) -> Result<(), ClientError> {
        if connection.watched.is_empty() {
            return Ok(());
        }
        let names = connection.watched.clone();
        match connection.client.call(&GetParams { names, ..GetParams::default() }) {
            Ok(page) => {
                let (values, quality) = (page.values, page.quality.unwrap_or_default());
                self.tell(News::Values(ReadValues { values, quality }));
            }
            Err(ClientError::Refused(failure)) if failure.code == Code::UnknownName => {
                // The configuration was changed: the signals are others now.
                connection.identity = None;
            }
            Err(ClientError::Refused(failure)) if failure.code == Code::Busy => {}
            Err(error) => return Err(error),
        }
        Ok(())
    }
}

fn lost(error: &ClientError) -> News {
    News::Lost { absence: absence(error), why: silence(error) }
}
