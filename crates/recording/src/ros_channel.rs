//! Channels of ROS 2, as `ros2 bag record` writes them: their messages as frames.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use isochrone_ipc::FrameHeader;
use mcap::records::{Channel as ChannelRecord, MessageHeader, SchemaHeader};

use crate::cdr::CdrReader;
use crate::encoded::FrameHead;
use crate::message::{Definitions, MessageNumbers, MessageType, decode};
use crate::{Carried, CdrError, ClockReading, Uncarried};

const CDR: &str = "cdr";
/// Most fields of a type that are named where they are left out.
const MOST_NAMED: usize = 20;

/// The schemas of a file, by their numbers.
#[derive(Default)]
pub(crate) struct Schemas {
    by_id: BTreeMap<u16, Schema>,
}

/// A type of messages, or why it cannot be read.
type Schema = Result<Arc<RosType>, String>;

/// A type of messages, and what becomes of them.
struct RosType {
    message: Arc<MessageType>,
    numbers: MessageNumbers,
}

impl Schemas {
    /// Adds a schema, and returns about how many bytes that takes.
    pub(crate) fn learn(&mut self, header: &SchemaHeader, text: &[u8]) -> usize {
        if self.by_id.contains_key(&header.id) {
            return 0;
        }
        let schema = match &*header.encoding {
            "ros2msg" => ros_type(&header.name, text),
            "" => return 0,
            other => Err(format!("its schema is {other}, and only ros2msg is read")),
        };
        self.by_id.insert(header.id, schema);
        text.len()
    }
}

fn ros_type(name: &str, text: &[u8]) -> Schema {
    let text = std::str::from_utf8(text).map_err(|_| format!("the definition of {name}: no UTF-8"));
    let wrong = |error| format!("its definition: {error}");
    let message = Definitions::of_schema(name, text?).and_then(|them| them.find(name));
    let message = message.map_err(wrong)?;
    let numbers = MessageNumbers::of(&message).map_err(wrong)?;
    Ok(Arc::new(RosType { message, numbers }))
}

/// A channel whose messages become frames.
pub(crate) struct RosChannel {
    pub(crate) carried: Carried,
    of: Arc<RosType>,
    /// How many messages there were.
    messages: u64,
}

/// What a channel of another program is.
pub(crate) enum Foreign {
    Ros(RosChannel),
    /// It is no such one, or nothing of it becomes a frame.
    Other,
}

impl Foreign {
    /// Of a channel; what is left out of it goes to the list.
    pub(crate) fn of(
        record: &ChannelRecord,
        schemas: &Schemas,
        uncarried: &mut BTreeSet<Uncarried>,
    ) -> Self {
        let Some(schema) = schemas.by_id.get(&record.schema_id) else { return Self::Other };
        if record.message_encoding != CDR {
            return Self::Other;
        }
        let service = record.topic.strip_prefix('/').unwrap_or(&record.topic).to_owned();
        let mut leave_out = |what: String| {
            uncarried.insert(Uncarried { service: service.clone(), what });
        };
        let of = match schema {
            Ok(of) => of.clone(),
            Err(why) => {
                leave_out(why.clone());
                return Self::Other;
            }
        };
        let numbers = &of.numbers;
        if numbers.paths.is_empty() {
            let name = of.message.ros_name();
            leave_out(format!("a {name} has no number that all messages have"));
            return Self::Other;
        }
        if !numbers.others.is_empty() {
            leave_out(listed(&numbers.others));
        }
        let carried = Carried { service, signals: numbers.signals(), ..Carried::default() };
        Self::Ros(RosChannel { carried, of, messages: 0 })
    }
}

/// The first of them.
fn listed(others: &[String]) -> String {
    let (named, more) = others.split_at(others.len().min(MOST_NAMED));
    let more = match more.len() {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    named.join(", ") + &more
}

impl RosChannel {
    /// About how many bytes its description takes.
    pub(crate) fn bytes(&self) -> usize {
        let signals = self.carried.signals.iter();
        signals.map(|signal| size_of_val(signal) + signal.name.len()).sum()
    }

    /// What a message says; says why, where it is none of this type.
    pub(crate) fn read(
        &mut self,
        message: &MessageHeader,
        data: &[u8],
        clock: ClockReading,
        values: &mut Vec<f64>,
    ) -> Result<FrameHead, String> {
        let number = self.messages;
        self.messages += 1;
        let RosType { message: of, numbers } = &*self.of;
        let mut read = || {
            let (body, order) = CdrReader::plain(data)?;
            let message = decode(of, body, order)?;
            numbers.read(&message, values)?;
            Ok(numbers.stamp_unix_ns(&message))
        };
        let stamp_unix_ns = read().map_err(|error: CdrError| {
            let (service, of) = (&self.carried.service, of.ros_name());
            format!("a message of /{service} that is no {of}: {error}")
        })?;
        let header = FrameHeader {
            sequence: number,
            cycle: number,
            release_ns: clock.monotonic_ns(message.log_time),
            publish_ns: clock.monotonic_ns(message.publish_time),
            source_ns: stamp_unix_ns.map_or(0, |unix_ns| clock.monotonic_ns(unix_ns)),
            ..FrameHeader::default()
        };
        Ok(FrameHead { header, received_ns: clock.monotonic_ns(message.log_time), lost: 0 })
    }
}
