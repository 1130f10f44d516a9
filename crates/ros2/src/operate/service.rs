//! One service of ROS: requests and answers.

use std::sync::Arc;

use isochrone_recording::message::{Definitions, MessageType, RosValue, decode, encode};
use rustdds::mio1::{Registry, Token};
use rustdds::policy::Durability;

use crate::config::{Profile, QualityOfService};
use crate::dds::{Asker, Dds, Reader, Received, Writer};
use crate::failure::Failure;

/// One service of ROS.
pub(super) struct RosService {
    name: String,
    request: Arc<MessageType>,
    response: Arc<MessageType>,
    reader: Reader,
    writer: Writer,
}

impl RosService {
    /// Serves `rcl_interfaces/srv/KIND` by its full name in ROS.
    pub(super) fn open(
        dds: &Dds,
        definitions: &Definitions,
        name: &str,
        kind: &str,
    ) -> Result<Self, Failure> {
        let find = |half: &str| {
            definitions.find(&format!("rcl_interfaces/{kind}_{half}")).map_err(Failure::found)
        };
        let (request, response) = (find("Request")?, find("Response")?);
        let quality = QualityOfService::of(Profile::Default);
        let reader = dds.reader(&format!("rq{name}Request"), &request.dds_name(), quality)?;
        let answers = format!("rr{name}Reply");
        let writer = dds.writer(&answers, &response.dds_name(), quality, Durability::Volatile)?;
        Ok(Self { name: name.to_owned(), request, response, reader, writer })
    }

    /// Lets a poll wake when a request comes.
    pub(super) fn register(&mut self, registry: &Registry, token: Token) -> std::io::Result<()> {
        self.reader.register(registry, token)
    }

    /// Answers the requests that came.
    pub(super) fn answer_all(&mut self, mut answer: impl FnMut(&RosValue) -> RosValue) {
        while let Some(received) = self.reader.next() {
            let Received::Message(body, sender) = received else { continue };
            let Some((asker, body)) = Asker::of(&sender, body) else { continue };
            let request = match decode(&self.request, &body.bytes, body.order) {
                Ok(request) => request,
                Err(error) => {
                    tracing::warn!("{}: a request is not answered: {error}", self.name);
                    continue;
                }
            };
            match encode(&self.response, &answer(&request)) {
                Ok(body) => drop(self.writer.answer(asker.answer(&body), asker.request())),
                Err(error) => tracing::error!("{}: cannot answer: {error}", self.name),
            }
        }
    }
}
