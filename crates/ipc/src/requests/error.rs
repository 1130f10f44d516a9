//! Errors of sending requests and answers.

use thiserror::Error;

use super::MAX_MESSAGE_BYTES;

/// Why [`RequestClient::send`](super::RequestClient::send) sent nothing.
#[derive(Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum RequestError {
    /// The request is longer than 256 KiB.
    #[error(
        "service {service:?}: a request of {bytes} bytes; at most {MAX_MESSAGE_BYTES} are possible: divide it"
    )]
    TooLong {
        /// Name of the service.
        service: String,
        /// Length of the request.
        bytes: usize,
    },
    /// Servers still hold all earlier requests of this client.
    #[error(
        "service {service:?}: its server has not let go of the requests before this one; try again later, or see whether the process is stopped"
    )]
    NoRoom {
        /// Name of the service.
        service: String,
    },
    /// No server is connected: it has ended, or the connection to it failed.
    #[error("service {service:?}: nobody is there to answer; see that its process runs")]
    NoServer {
        /// Name of the service.
        service: String,
    },
    /// iceoryx2 failed.
    #[error("service {service:?}: the request could not be sent: {cause}; open the service again")]
    Failed {
        /// Name of the service.
        service: String,
        /// What iceoryx2 says.
        cause: String,
    },
}

/// Why [`Request::answer`](super::Request::answer) sent nothing.
#[derive(Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum AnswerError {
    /// The answer is longer than 256 KiB, or than whoever opened the server provided for.
    #[error(
        "service {service:?}: an answer of {bytes} bytes; at most {limit} are possible: divide it"
    )]
    TooLong {
        /// Name of the service.
        service: String,
        /// Length of the answer.
        bytes: usize,
        /// Longest answer.
        limit: usize,
    },
    /// Clients hold all answers that there is memory for.
    #[error("service {service:?}: its clients have not let go of earlier answers; try again later")]
    NoRoom {
        /// Name of the service.
        service: String,
    },
    /// iceoryx2 failed.
    #[error("service {service:?}: the answer could not be sent: {cause}")]
    Failed {
        /// Name of the service.
        service: String,
        /// What iceoryx2 says.
        cause: String,
    },
}

isochrone_model::debug_as_display!(RequestError, AnswerError);
