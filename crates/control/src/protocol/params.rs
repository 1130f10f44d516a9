//! The declaration of a method's parameters.

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::Method;
use crate::members::Members;

/// The parameters of a method, which determine the type of its result.
pub trait Params: Serialize {
    /// The method.
    const METHOD: Method;
    /// Their names, as a request has them.
    const NAMES: &'static [&'static str];
    /// Whether the method changes something in the node; the others only look.
    const CHANGES: bool;
    /// Its result.
    type Result: Serialize + DeserializeOwned;
}

/// Parameters that can be read from a request.
pub(super) trait Read: Params + Sized {
    /// `None` where there are findings.
    fn read(members: &mut Members<'_>) -> Option<Self>;
}

/// The parameters of one method.
macro_rules! params {
    (
        $(#[$doc:meta])*
        $method:ident: $kind:ident $name:ident -> $result:ident {
            $($(#[$member_doc:meta])* $need:ident $member:ident $key:literal: $type:ty,)*
        }
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
        pub struct $name {
            $(
                $(#[$member_doc])*
                #[serde(rename = $key, skip_serializing_if = "crate::members::Member::is_omitted")]
                pub $member: $type,
            )*
        }

        impl $crate::protocol::Params for $name {
            const METHOD: $crate::protocol::Method = $crate::protocol::Method::$method;
            const NAMES: &'static [&'static str] = &[$($key),*];
            const CHANGES: bool = $crate::protocol::params::$kind;
            type Result = $result;
        }

        impl $crate::protocol::params::Read for $name {
            #[allow(unused_variables, reason = "some methods have no parameters")]
            fn read(members: &mut $crate::members::Members<'_>) -> Option<Self> {
                // All are read before a missing one is reported, as each may have a finding.
                $(let $member = members.$need($key);)*
                Some(Self { $($member: $member?,)* })
            }
        }
    };
}

#[allow(non_upper_case_globals, reason = "the words of `params!`")]
pub(super) const changes: bool = true;
#[allow(non_upper_case_globals, reason = "the words of `params!`")]
pub(super) const looks: bool = false;
