//! What operators may do with a node, for each `control` that its configuration can say, and every method.

use std::fs;

use crate::node::Node;
use isochrone_control::{
    AckParams, ApplyParams, Client, ClientError, Code, DescribeParams, ForceParams, GetParams,
    Hold, JournalParams, Method, Params, Refusal, ReleaseParams, SetParams, SwitchParams,
    TraceParams, UndoParams, Value,
};
use isochrone_testing::PATIENCE;
use isochrone_testing::plants::{RAMP, tank};

fn with_control(control: &str) -> String {
    let ramp = RAMP.replace("\"tank\"", "\"level\"");
    ramp.replace("\"force\"", &format!("\"{control}\""))
        + "\n[[alarm]]\nname = \"high\"\nwhen = \"ramp.delayedValue >= 0.0\"\n"
}

/// What a method needs, least first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Right {
    Read,
    Set,
    Force,
}

impl Right {
    /// How a configuration gives it.
    fn written(self) -> &'static str {
        match self {
            Self::Read => "control = \"read\"",
            Self::Set => "control = \"set\"",
            Self::Force => "control = \"force\"",
        }
    }
}

/// What the page on the protocol says that a method needs. What its handler asks for must be the same.
fn needed(method: Method) -> Right {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/control.md");
    let page = fs::read_to_string(path).unwrap();
    let heading = format!("\n### {}\n", method.as_str());
    let section = page.split_once(&heading).and_then(|(_, rest)| rest.split("\n### ").next());
    [Right::Force, Right::Set, Right::Read]
        .into_iter()
        .find(|right| section.is_some_and(|section| section.contains(right.written())))
        .unwrap_or_else(|| panic!("docs/control.md: say what right {} takes", method.as_str()))
}

fn asked<P: Params>(node: &mut Node, params: &P) -> Result<(), Refusal> {
    refusal(node.client.call(params))
}

fn refusal<T>(answer: Result<T, ClientError>) -> Result<(), Refusal> {
    match answer {
        Ok(_) => Ok(()),
        Err(ClientError::Refused(failure)) => Err(failure),
        Err(error) => panic!("{error}"),
    }
}

/// Asks for something that can be done where it is allowed, if all methods before have been asked for.
fn ask(node: &mut Node, method: Method) -> Result<(), Refusal> {
    let all = vec!["*.*".to_owned()];
    let values = |value: f64| [("ramp.value", value)].into_iter().collect();
    match method {
        Method::Get => asked(node, &GetParams { names: all, ..GetParams::default() }),
        Method::Set => asked(node, &SetParams { values: values(1.0), ..SetParams::default() }),
        Method::Force => {
            let seconds = Hold::UntilReleased;
            asked(node, &ForceParams { values: values(2.0), seconds, ..ForceParams::default() })
        }
        Method::Release => asked(node, &ReleaseParams { names: all, client: None }),
        Method::Undo => asked(node, &UndoParams { transaction: 1, client: None }),
        Method::Ack => asked(node, &AckParams { alarm: "high".to_owned(), ..AckParams::default() }),
        // There is no other process to hand it to, which is found out after the right to do so.
        Method::Switch => match asked(node, &SwitchParams {}) {
            Err(refusal) if refusal.code == Code::CannotChange => Ok(()),
            other => other,
        },
        Method::Trace => {
            let signals = Some(vec!["ramp.value".to_owned()]);
            asked(node, &TraceParams { signals, ..TraceParams::default() })
        }
        Method::Apply => {
            let configuration = with_control("force");
            let allow_missed = Some(true);
            asked(node, &ApplyParams { configuration, allow_missed, ..ApplyParams::default() })
        }
        // What needs no parameters is asked for by its name.
        other => refusal(node.client.call_json(other.as_str(), "{}")),
    }
}

#[test]
fn a_node_does_what_its_control_allows_and_refuses_all_else_with_the_way_out() {
    for (control, right) in [("read", Right::Read), ("set", Right::Set), ("force", Right::Force)] {
        let mut node = Node::start(&with_control(control));
        for method in Method::ALL {
            let answer = ask(&mut node, method);
            if needed(method) <= right {
                assert_eq!(answer, Ok(()), "{control}: {method:?}");
                continue;
            }
            let failure = answer.expect_err(method.as_str());
            assert_eq!(failure.code, Code::Forbidden, "{control}: {method:?}: {failure}");
            let way_out = needed(method).written();
            assert!(failure.to_string().contains(way_out), "{control}: {method:?}: {failure}");
        }
        if right == Right::Read {
            assert_eq!(node.get(&["ramp.value"]).get("ramp.value"), Some(Value::Number(25.0)));
            assert_eq!(node.call(&JournalParams::default()).total, 0);
            assert!(!node.call(&DescribeParams {}).configuration.changed);
        }
    }
}

#[test]
fn whoever_may_not_force_may_not_try_a_configuration_either() {
    let mut node = Node::start(&with_control("set"));
    let (configuration, dry_run) = (with_control("set"), Some(true));
    let failure = node.refused(&ApplyParams { configuration, dry_run, ..ApplyParams::default() });
    assert_eq!(failure.code, Code::Forbidden, "{failure}");
}

#[test]
fn a_node_that_nobody_may_operate_has_no_service_for_it() {
    let (domain, _process) = tank(&with_control("off"));
    let participant = domain.join("operator");
    let error = Client::connect(&participant, "level", PATIENCE).unwrap_err();
    assert!(matches!(error, ClientError::NotOperated { .. }), "{error}");
}
