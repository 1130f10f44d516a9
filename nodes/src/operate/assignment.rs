//! `NAME=VALUE` on a command line. What a value is, the node knows, which has the signal.

use std::str::FromStr;

use isochrone_control::{ClientError, Code, Values, Written};

use super::node::{self, Purpose, refusal};
use crate::base::failure::Failure;

/// A signal and the value that it is to get.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Assignment {
    name: String,
    value: String,
}

impl FromStr for Assignment {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) = text.split_once('=').filter(|(name, _)| !name.is_empty()).ok_or(
            "write NAME=VALUE without blanks, such as ramp.setChangeRate=5, after the name of the node; \
             a --comment of several words needs quotes",
        )?;
        Ok(Self { name: name.to_owned(), value: value.trim().to_owned() })
    }
}

/// All values, in the order in which they are written.
pub(super) fn values(assignments: &[Assignment]) -> Values<Written> {
    assignments.iter().map(|Assignment { name, value }| (name, value.as_str())).collect()
}

/// The value of a name as it was written.
pub(super) fn written(assignments: &[Assignment], name: &str) -> Option<String> {
    let of_name = assignments.iter().rfind(|one| one.name == name);
    of_name.map(|one| one.value.clone())
}

/// How a verb ends whose request was not carried out. A value that cannot be read is a mistake in the words of the
/// command line.
pub(super) fn failure(error: ClientError, assignments: &[Assignment]) -> Failure {
    match error {
        ClientError::Refused(refused)
            if refused.code == Code::InvalidParams
                && refused.findings.iter().any(|it| written(assignments, &it.name).is_some()) =>
        {
            Failure::usage(refusal(&refused, Purpose::Change))
        }
        error => node::failure(error, Purpose::Change),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_behind_the_first_sign_is_the_value() {
        let read = |text: &str| text.parse::<Assignment>();
        let assignments = ["a.b= 16#8F00 ", "c==", "d="].map(|text| read(text).unwrap());
        let expected: Values<Written> =
            [("a.b", "16#8F00"), ("c", "="), ("d", "")].into_iter().collect();
        assert_eq!(values(&assignments), expected);
        for text in ["a.b", "=5", ""] {
            let error = read(text).unwrap_err();
            assert!(error.contains("NAME=VALUE"), "{text}: {error}");
        }
    }
}
