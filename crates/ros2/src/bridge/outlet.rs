//! Sending messages on a topic, also past a reader that hangs.

use std::time::{Duration, Instant};

use isochrone_model::Flags;
use rustdds::policy::Durability;

use crate::config::{OnBad, QualityOfService};
use crate::dds::{Dds, Unsent, Writer};
use crate::failure::Failure;
use crate::names::{dds_topic, topic_of_ros};

/// How long a topic may be stuck before its writer is replaced.
const STUCK: Duration = Duration::from_millis(200);
/// Between two replacements of a writer.
const REPLACE_INTERVAL: Duration = Duration::from_secs(2);

/// Sends messages on a topic.
///
/// RustDDS keeps a reliable message until all readers that it takes for matching have confirmed it, 8192 of them, and
/// takes no more then. Readers of another type, or of a process that is
/// stopped, never do, and those of one that was killed are taken for living until its lease has ended. Then the writer is replaced:
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

    /// The topic's name in ROS.
    pub(super) fn topic(&self) -> &str {
        topic_of_ros(&self.topic)
    }

    /// Sends a message, or says why that did not work.
    pub(super) fn send(&mut self, body: Vec<u8>) -> Result<(), String> {
        match self.writer.send(body) {
            Ok(()) => {
                self.stuck = None;
                Ok(())
            }
            Err(Unsent::NoRoom) => {
                let stuck = self.stuck.get_or_insert_with(Instant::now).elapsed();
                let may_replace =
                    self.replaced.is_none_or(|replaced| replaced.elapsed() >= REPLACE_INTERVAL);
                if stuck >= STUCK && may_replace {
                    self.replace();
                }
                Err("a subscriber confirms nothing, and as many messages wait for it as are kept"
                    .into())
            }
            Err(Unsent::Failed(cause)) => Err(cause),
        }
    }

    fn replace(&mut self) {
        tracing::warn!(
            "a subscriber of {} confirms nothing: it is stopped, it was killed and its lease (10 or 20 s) has not ended, or \
             it is of another type; the topic's publisher begins anew",
            self.topic()
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

/// How the flags of a frame keep it back.
pub(super) fn kept_back(flags: Flags, on_bad: OnBad) -> String {
    let words = flags.without(Flags::FORCED).words().collect::<Vec<_>>().join(" ");
    match on_bad {
        OnBad::Hold => format!(
            "a frame is not sent: its flags are {words}, on_bad is \"hold\", and no good one came before it"
        ),
        _ => format!("a frame is not sent: its flags are {words}, and on_bad is \"stop\""),
    }
}

impl Drop for Outlet<'_> {
    fn drop(&mut self) {
        self.dds.forget_writer(self.writer.guid());
    }
}
