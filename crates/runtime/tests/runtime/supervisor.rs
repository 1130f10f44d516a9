//! A supervisor that panics.

use std::fmt::Debug;
use std::thread;

use isochrone_engine::{Plan, Rules, Source};
use isochrone_runtime::journal::Journal;
use isochrone_runtime::{End, Node, NodePanicked};
use isochrone_testing::in_own_process;
use isochrone_timing::WarningCode;
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Metadata, Subscriber};

/// A log that cannot be written: the supervisor panics at the first message on the block. A busy machine may bring
/// others before.
struct Closed;

/// Whether a message is on the block.
#[derive(Default)]
struct IsOnBlock(bool);

impl Visit for IsOnBlock {
    fn record_debug(&mut self, _: &Field, value: &dyn Debug) {
        self.0 |= format!("{value:?}").contains("scale");
    }
}

impl Subscriber for Closed {
    fn enabled(&self, _: &Metadata<'_>) -> bool {
        thread::current().name() == Some("supervisor")
    }

    fn event(&self, event: &Event<'_>) {
        let mut found = IsOnBlock::default();
        event.record(&mut found);
        assert!(!found.0, "the log is closed");
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}
}

/// A block reports an error as soon as its limits are set the wrong way round.
const NODE: &str = r#"
[node]
name = "n"
[[task]]
name = "fast"
period = "1ms"
[[block]]
name = "scale"
type = "ScaleLinear"
in = { x = 1.0, x1 = 0.0, y1 = 0.0, x2 = 5.0, y2 = 1.0, yMin = -10.0, yMax = 10.0 }
"#;

#[test]
fn a_supervisor_that_panics_ends_the_node_in_order_and_that_is_the_error() {
    in_own_process(|| {
        tracing::subscriber::set_global_default(Closed).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("j.jsonl");
        let plan = Plan::new(Source::new("n.toml", NODE), &Rules::default()).unwrap();
        let journal = Journal::open(&path, &plan).unwrap();
        let node = Node::prepare_alone(&plan).unwrap().with_journal(journal).unwrap().start();
        let events = node.events();
        node.set([("scale.yMin", 20.0)]).unwrap();
        // It ends by itself, and those who wait for it come to know.
        node.wait();
        assert!(!node.is_running());
        events.for_each(drop);
        assert_eq!(node.unfinished_tasks().count(), 0);
        let error = node.finish().unwrap_err();
        assert_eq!(
            error.to_string(),
            "the node's supervisor panicked, and the node has ended: the log is closed"
        );
        let NodePanicked::Supervisor { panic, outcome, .. } = &error else { panic!("{error}") };
        assert_eq!(
            (&*panic.message, &outcome.end),
            ("the log is closed", &End::SupervisorPanicked)
        );
        assert!(outcome.tasks[0].cycles > 0, "what the tasks did is known: {outcome:?}");
        let codes: Vec<_> = error.report().warnings.into_iter().map(|it| it.code).collect();
        assert!(codes.contains(&WarningCode::Panicked), "{codes:?}");
        // The journal is closed as ever.
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains("\"scale.yMin\"") && text.contains("{\"end\""), "{text}");
    });
}
