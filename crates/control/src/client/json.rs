//! Calls with parameters and results in JSON, for languages that have no types for them.

use isochrone_ipc::Service;
use serde_json::value::RawValue;

use crate::client::asking::Client;
use crate::client::error::ClientError;
use crate::protocol::{Asks, Params};
use crate::{Call, Code, Method, Refusal};

impl<S: Service> Client<S> {
    /// As [`call`](Self::call), with the name of the method, and its parameters and its result as JSON. The parameters
    /// are checked before anything is sent.
    ///
    /// # Errors
    /// There is no such method, or it has other parameters; otherwise as [`call`](Self::call).
    pub fn call_json(&mut self, method: &str, params: &str) -> Result<String, ClientError> {
        let call = read(method, params).map_err(ClientError::Refused)?;
        let reply = call.ask(self)?;
        serde_json::to_string(&reply).map_err(|cause| self.misunderstood(cause))
    }
}

impl<S: Service> Asks for Client<S> {
    type Error = ClientError;

    fn ask<P: Params>(&mut self, params: &P) -> Result<P::Result, ClientError> {
        self.call(params)
    }
}

fn read(method: &str, params: &str) -> Result<Call, Refusal> {
    let method = Method::of(method)?;
    let no_json =
        |cause| Refusal::new(Code::Parse, format!("the parameters are not JSON: {cause}"));
    let params: &RawValue = serde_json::from_str(params).map_err(no_json)?;
    Call::read(method, Some(params))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_call_is_read_by_its_name_and_refused_in_words_before_anybody_is_asked() {
        assert_eq!(read("get", r#"{"names": ["a"]}"#).unwrap().method(), Method::Get);
        let refused = |method, params| {
            let refusal = read(method, params).unwrap_err();
            (refusal.code, refusal.to_string())
        };
        let (code, message) = refused("gte", "{}");
        assert_eq!(code, Code::UnknownMethod);
        assert!(message.contains("did you mean \"get\"?"), "{message}");
        let (code, message) = refused("get", "{");
        assert_eq!(code, Code::Parse);
        assert!(message.starts_with("the parameters are not JSON: "), "{message}");
        let (code, message) = refused("get", r#"{"name": "a"}"#);
        assert_eq!(code, Code::InvalidParams);
        assert!(message.contains("name"), "{message}");
    }
}
