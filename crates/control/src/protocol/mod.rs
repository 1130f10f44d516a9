//! The methods of the service. Each has a file that declares and documents its parameters and its result.
//!
//! [`methods!`] lists them. Everything that covers all methods derives from that list, including the
//! [handlers](Handlers) that a node must have.

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
            const CHANGES: bool = $crate::protocol::$kind;
            type Result = $result;
        }

        impl $crate::protocol::Read for $name {
            #[allow(unused_variables, reason = "some methods have no parameters")]
            fn read(members: &mut $crate::members::Members<'_>) -> Option<Self> {
                // All are read before a missing one is reported, as each may have a finding.
                $(let $member = members.$need($key);)*
                Some(Self { $($member: $member?,)* })
            }
        }
    };
}

mod ack;
mod alarms;
mod apply;
mod begun;
mod describe;
mod force;
mod forces;
mod get;
mod journal;
mod release;
mod save;
mod set;
mod signals;
mod start;
mod switch;
mod trace;
mod undo;

use std::collections::BTreeMap;

use isochrone_engine::nearest_name;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::value::RawValue;

use crate::members::{Members, shown};
use crate::{Code, Refusal};

pub use begun::{Begun, Caller, Ticket};

/// By the name of a task.
pub type ByTask<T> = BTreeMap<String, T>;

#[allow(non_upper_case_globals, reason = "the words of `params!`")]
const changes: bool = true;
#[allow(non_upper_case_globals, reason = "the words of `params!`")]
const looks: bool = false;

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
trait Read: Params + Sized {
    /// `None` where there are findings.
    fn read(members: &mut Members<'_>) -> Option<Self>;
}

/// Carries out one method for a node.
pub trait Handle<P: Params> {
    /// Carries out the request, or begins to. Must return soon.
    ///
    /// # Errors
    /// The refusal; nothing has been changed then.
    fn handle(&mut self, params: P, caller: Caller) -> Result<Begun<P::Result>, Refusal>;
}

/// Asks a node for one method.
pub(crate) trait Asks {
    /// Why there is no result.
    type Error;

    fn ask<P: Params>(&mut self, params: &P) -> Result<P::Result, Self::Error>;
}

macro_rules! methods {
    ($($(#[$doc:meta])* $method:ident = $name:ident($params:ident),)*) => {
        $(pub use $name::*;)*

        /// A method of the service.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum Method {
            $($(#[$doc])* $method,)*
        }

        impl Method {
            /// All of them.
            pub const ALL: [Self; [$(Self::$method),*].len()] = [$(Self::$method),*];

            /// Names of its parameters.
            pub const fn params(self) -> &'static [&'static str] {
                match self {
                    $(Self::$method => $params::NAMES,)*
                }
            }

            /// Its name in a request.
            pub const fn as_str(self) -> &'static str {
                match self {
                    $(Self::$method => stringify!($name),)*
                }
            }

            /// Whether it changes something in the node; the others only look.
            pub const fn changes(self) -> bool {
                match self {
                    $(Self::$method => $params::CHANGES,)*
                }
            }

            /// An answer with every member that it can have.
            #[cfg(test)]
            fn example(self) -> Reply {
                match self {
                    $(Self::$method => Reply::$method($name::example()),)*
                }
            }
        }

        /// A call, checked as far as possible without the node. It serializes as its parameters.
        #[derive(Debug, Clone, PartialEq, Serialize)]
        #[serde(untagged)]
        pub enum Call {
            $($(#[$doc])* $method($params),)*
        }

        /// The result of a call.
        #[derive(Debug, Clone, PartialEq, Serialize)]
        #[serde(untagged)]
        pub enum Reply {
            $($(#[$doc])* $method(<$params as Params>::Result),)*
        }

        /// A handler for every method.
        pub trait Handlers: $(Handle<$params> +)* {}

        impl<N: $(Handle<$params> +)*> Handlers for N {}

        impl Call {
            /// The method.
            pub fn method(&self) -> Method {
                match self {
                    $(Self::$method(_) => Method::$method,)*
                }
            }

            /// Reads the parameters of a method.
            pub(crate) fn read(
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

            /// Asks a node for it.
            pub(crate) fn ask<A: Asks>(&self, node: &mut A) -> Result<Reply, A::Error> {
                match self {
                    $(Self::$method(params) => node.ask(params).map(Reply::$method),)*
                }
            }

            /// Lets its handler carry it out.
            ///
            /// # Errors
            /// As [`Handle::handle`].
            pub fn begin(
                self,
                node: &mut impl Handlers,
                caller: Caller,
            ) -> Result<Begun<Reply>, Refusal> {
                match self {
                    $(Self::$method(params) => {
                        Ok(node.handle(params, caller)?.map(Reply::$method))
                    })*
                }
            }
        }
    };
}

methods! {
    /// Describes the node.
    Describe = describe(DescribeParams),
    /// Lists its signals.
    Signals = signals(SignalsParams),
    /// Reads values of signals.
    Get = get(GetParams),
    /// Sets parameters.
    Set = set(SetParams),
    /// Forces signals.
    Force = force(ForceParams),
    /// Releases forces.
    Release = release(ReleaseParams),
    /// Lists the forces.
    Forces = forces(ForcesParams),
    /// Takes a `set` back.
    Undo = undo(UndoParams),
    /// Lists changes by operators.
    Journal = journal(JournalParams),
    /// Lists the active alarms: those of the node, and those of the process.
    Alarms = alarms(AlarmsParams),
    /// Acknowledges a process alarm.
    Ack = ack(AckParams),
    /// Returns the configuration with the current values.
    Save = save(SaveParams),
    /// Applies a new configuration.
    Apply = apply(ApplyParams),
    /// Lets it send that waits with its retained state.
    Start = start(StartParams),
    /// Hands it over to the process that stands by.
    Switch = switch(SwitchParams),
    /// Traces selected signals in every cycle.
    Trace = trace(TraceParams),
}

impl Method {
    /// The method of a name.
    pub(crate) fn of(name: &str) -> Result<Self, Refusal> {
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

#[cfg(test)]
mod page_tests;
