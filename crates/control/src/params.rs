//! What the methods are asked with.

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::members::{Member, Members};
use super::results::{
    AlarmsResult, ApplyResult, DescribeResult, ForceResult, ForcesResult, GetResult, JournalResult,
    SaveResult, SetResult, SignalsResult, TraceResult,
};
use super::{Finding, Hold, Method, Values};

/// The parameters of a method, which say what it answers.
pub trait Params: Serialize {
    /// The method.
    const METHOD: Method;
    /// What it answers.
    type Result: Serialize + DeserializeOwned;
}

/// Parameters that can be read from a request.
pub(super) trait Read: Params + Sized {
    /// `None` where there are findings.
    fn read(members: &mut Members<'_>) -> Option<Self>;
}

macro_rules! params {
    ($(
        $(#[$doc:meta])*
        $method:ident, $name:ident -> $result:ident {
            $($(#[$member_doc:meta])* $need:ident $member:ident $key:literal: $type:ty,)*
        }
    )*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, Default, PartialEq, Serialize)]
        pub struct $name {
            $(
                $(#[$member_doc])*
                #[serde(rename = $key, skip_serializing_if = "Member::is_omitted")]
                pub $member: $type,
            )*
        }

        impl $name {
            /// Names of the parameters, as a request has them.
            pub const NAMES: &'static [&'static str] = &[$($key),*];
        }

        impl Params for $name {
            const METHOD: Method = Method::$method;
            type Result = $result;
        }

        impl Read for $name {
            #[allow(unused_variables, reason = "some methods have no parameters")]
            fn read(members: &mut Members<'_>) -> Option<Self> {
                // All are read before any is missed: each may have a finding.
                $(let $member = members.$need($key);)*
                Some(Self { $($member: $member?,)* })
            }
        }
    )*};
}

params! {
    /// Of `describe`: none.
    Describe, DescribeParams -> DescribeResult {}

    /// Of `signals`: which ones.
    Signals, SignalsParams -> SignalsResult {
        /// A name or a glob; all signals without it.
        optional pattern "match": Option<String>,
        /// How many to leave out.
        optional offset "offset": Option<u64>,
        /// At most so many; 1000 without it.
        optional limit "limit": Option<u64>,
    }

    /// Of `get`: which values.
    Get, GetParams -> GetResult {
        /// Names and globs, at most 4096.
        required names "names": Vec<String>,
        /// How many to leave out.
        optional offset "offset": Option<u64>,
        /// At most so many; 4096 without it.
        optional limit "limit": Option<u64>,
    }

    /// Of `set`: one transaction.
    Set, SetParams -> SetResult {
        /// The new values.
        required values "values": Values,
        /// The cycle, where all values are of one task; the next one without it.
        optional at "at": Option<u64>,
        /// Why; for the journal.
        optional comment "comment": Option<String>,
        /// Who; for the journal.
        optional client "client": Option<String>,
    }

    /// Of `force`: one transaction.
    Force, ForceParams -> ForceResult {
        /// What the signals are held at.
        required values "values": Values,
        /// For how long.
        required seconds "seconds": Hold,
        /// The cycle, where all values are of one task; the next one without it.
        optional at "at": Option<u64>,
        /// Why; for the journal.
        optional comment "comment": Option<String>,
        /// Who; for the journal.
        optional client "client": Option<String>,
    }

    /// Of `release`: which forces.
    Release, ReleaseParams -> SetResult {
        /// Names and globs, at most 4096.
        required names "names": Vec<String>,
        /// Who; for the journal.
        optional client "client": Option<String>,
    }

    /// Of `forces`: which page.
    Forces, ForcesParams -> ForcesResult {
        /// How many to leave out.
        optional offset "offset": Option<u64>,
        /// At most so many.
        optional limit "limit": Option<u64>,
    }

    /// Of `undo`: what to take back.
    Undo, UndoParams -> SetResult {
        /// The number of a `set`.
        required transaction "transaction": u64,
        /// Who; for the journal.
        optional client "client": Option<String>,
    }

    /// Of `journal`: which entries.
    Journal, JournalParams -> JournalResult {
        /// The first one's `sequence`; the oldest that is kept without it.
        optional since "since": Option<u64>,
        /// At most so many.
        optional limit "limit": Option<u64>,
    }

    /// Of `alarms`: which page.
    Alarms, AlarmsParams -> AlarmsResult {
        /// How many to leave out.
        optional offset "offset": Option<u64>,
        /// At most so many.
        optional limit "limit": Option<u64>,
    }

    /// Of `save`: which piece.
    Save, SaveParams -> SaveResult {
        /// From which byte on.
        optional offset "offset": Option<u64>,
    }

    /// Of `apply`: the new configuration.
    Apply, ApplyParams -> ApplyResult {
        /// Its TOML text.
        required configuration "configuration": String,
        /// The file that holds it; for the journal.
        optional file "file": Option<String>,
        /// Only say what it would change and cost.
        optional dry_run "dry_run": Option<bool>,
        /// Also if it costs cycles.
        optional allow_missed "allow_missed": Option<bool>,
        /// Why; for the journal.
        optional comment "comment": Option<String>,
        /// Who; for the journal.
        optional client "client": Option<String>,
    }

    /// Of `trace`: `signals` of a new one, or the `id` of one that is to go on, or to end.
    Trace, TraceParams -> TraceResult {
        /// Names and globs of signals of one task.
        optional signals "signals": Option<Vec<String>>,
        /// Of a trace.
        optional id "id": Option<String>,
        /// Whether it is to end.
        optional end "end": Option<bool>,
    }
}

impl Member for Hold {
    const EXPECTED: &'static str = "a number of seconds, or null: until it is released";

    fn read(text: &str) -> Result<Self, Vec<Finding>> {
        let seconds: Option<f64> = serde_json::from_str(text).map_err(|_| Vec::new())?;
        Ok(seconds.map_or(Self::UntilReleased, Self::Seconds))
    }
}
