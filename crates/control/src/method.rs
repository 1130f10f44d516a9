//! The methods of the service.

use isochrone_engine::nearest_name;
use serde::Serialize;
use serde_json::value::RawValue;

use super::members::{Members, shown};
use super::params::{
    AlarmsParams, ApplyParams, DescribeParams, ForceParams, ForcesParams, GetParams, JournalParams,
    Params, Read, ReleaseParams, SaveParams, SetParams, SignalsParams, TraceParams, UndoParams,
};
use super::{Code, Refusal};

macro_rules! methods {
    ($($(#[$doc:meta])* $method:ident $name:literal $params:ident,)*) => {
        /// A method of the service.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum Method {
            $($(#[$doc])* $method,)*
        }

        impl Method {
            /// All of them.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$method),*];

            /// Names of its parameters.
            pub const fn params(self) -> &'static [&'static str] {
                match self {
                    $(Self::$method => $params::NAMES,)*
                }
            }

            /// Its name in a request.
            pub const fn as_str(self) -> &'static str {
                match self {
                    $(Self::$method => $name,)*
                }
            }
        }

        /// What a request asks for, checked as far as it can be without the node.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Call {
            $($(#[$doc])* $method($params),)*
        }

        /// What a request is answered with.
        #[derive(Debug, Clone, PartialEq, Serialize)]
        #[serde(untagged)]
        pub enum Reply {
            $($(#[$doc])* $method(<$params as Params>::Result),)*
        }

        impl Call {
            /// The method.
            pub fn method(&self) -> Method {
                match self {
                    $(Self::$method(_) => Method::$method,)*
                }
            }

            /// Reads the parameters of a method.
            pub(super) fn read(
                method: Method,
                params: Option<&RawValue>,
            ) -> Result<Self, Refusal> {
                let mut members = Members::of(params)?;
                match method {
                    $(Method::$method => {
                        let read = $params::read(&mut members);
                        members.finish(read).map(Self::$method)
                    })*
                }
            }
        }
    };
}

methods! {
    /// What the node is.
    Describe "describe" DescribeParams,
    /// Which signals it has.
    Signals "signals" SignalsParams,
    /// Values of signals.
    Get "get" GetParams,
    /// Sets parameters.
    Set "set" SetParams,
    /// Forces signals.
    Force "force" ForceParams,
    /// Releases forces.
    Release "release" ReleaseParams,
    /// What is forced.
    Forces "forces" ForcesParams,
    /// Takes a `set` back.
    Undo "undo" UndoParams,
    /// What operators did.
    Journal "journal" JournalParams,
    /// What is wrong now.
    Alarms "alarms" AlarmsParams,
    /// The configuration with the values of now.
    Save "save" SaveParams,
    /// Another configuration.
    Apply "apply" ApplyParams,
    /// Every cycle of chosen signals.
    Trace "trace" TraceParams,
}

impl Method {
    /// Whether it changes something in the node; all others only look.
    pub const fn changes(self) -> bool {
        matches!(self, Self::Set | Self::Force | Self::Release | Self::Undo | Self::Apply)
    }

    /// The method of a name.
    pub(super) fn of(name: &str) -> Result<Self, Refusal> {
        let found = Self::ALL.into_iter().find(|method| method.as_str() == name);
        found.ok_or_else(|| {
            let names = Self::ALL.map(Self::as_str);
            let help = match nearest_name(name, names) {
                Some(nearest) => format!("did you mean \"{nearest}\"?"),
                None => format!("there is: {}", names.join(", ")),
            };
            let shown = shown(name);
            Refusal::new(Code::UnknownMethod, format!("there is no method \"{shown}\"; {help}"))
        })
    }
}
