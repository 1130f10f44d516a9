//! Sending messages on a topic, also past a reader that hangs.

use std::time::{Duration, Instant};

use rustdds::policy::Durability;

use crate::config::QualityOfService;
use crate::dds::{Dds, Unsent, Writer};
use crate::failure::Failure;
use crate::names::dds_topic;

/// How long a topic may be stuck before its writer is replaced.
const STUCK: Duration = Duration::from_millis(200);
/// Between two replacements of a writer.
const REPLACE_INTERVAL: Duration = Duration::from_secs(2);

/// Sends messages on a topic.
///
/// RustDDS keeps a reliable message until all readers that it takes for matching have confirmed it, 8192 of them, and
/// takes no more then. Readers of another type, or of a process that is stopped, never do. Then the writer is replaced:
/// the others find the new one within a moment.
pub(super) struct Outlet<'d> {
    dds: &'d Dds,
    topic: String,
    type_name: String,
    quality: QualityOfService,
    writer: Writer,
    stuck: Option<Instant>,
    replaced: Option<Instant>,
}

impl<'d> Outlet<'d> {
    /// By the full name of the topic in ROS, and that of the type in DDS.
    pub(super) fn open(
        dds: &'d Dds,
        topic: &str,
        type_name: String,
        quality: QualityOfService,
    ) -> Result<Self, Failure> {
        let topic = dds_topic(topic);
        let writer = dds.writer(&topic, &type_name, quality, Durability::Volatile)?;
        Ok(Self { dds, topic, type_name, quality, writer, stuck: None, replaced: None })
    }

    /// Sends a message, and returns whether that worked.
    pub(super) fn send(&mut self, body: Vec<u8>) -> bool {
        match self.writer.send(body) {
            Ok(()) => {
                self.stuck = None;
                true
            }
            Err(Unsent::NoRoom) => {
                let stuck = self.stuck.get_or_insert_with(Instant::now).elapsed();
                let may_replace =
                    self.replaced.is_none_or(|replaced| replaced.elapsed() >= REPLACE_INTERVAL);
                if stuck >= STUCK && may_replace {
                    self.replace();
                }
                false
            }
            Err(Unsent::Failed(cause)) => {
                tracing::warn!("cannot send on {}: {cause}", self.topic);
                false
            }
        }
    }

    fn replace(&mut self) {
        tracing::warn!(
            "a subscriber of {} confirms nothing: it hangs, or it is of another type; its publisher begins anew",
            self.topic
        );
        self.replaced = Some(Instant::now());
        self.stuck = None;
        let opened =
            self.dds.writer(&self.topic, &self.type_name, self.quality, Durability::Volatile);
        if let Ok(writer) = opened {
            self.dds.forget_writer(self.writer.guid());
            self.writer = writer;
        }
    }
}

impl Drop for Outlet<'_> {
    fn drop(&mut self) {
        self.dds.forget_writer(self.writer.guid());
    }
}
