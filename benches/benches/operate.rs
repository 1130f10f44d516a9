//! The cost of a request to a cycle: a thousand values of a thousand instances, set, forced or read.
//!
//! Orders are made beforehand, as the ordinary thread makes them; what is timed is what the cycle does
//! with them.
#![allow(missing_docs, reason = "criterion's macros make public functions")]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use isochrone_blocks::{BlockType, lim_rate_of_change::LimRateOfChangeCI};
use isochrone_control::desk::{Feeds, Operator, PreparedRequest, RequestTerms, Selection};
use isochrone_engine::orders::Order;
use isochrone_engine::{Plan, Rules, Source, TaskEngine, Workload};
use isochrone_model::{Hold, Value};

const VALUES: usize = 1_000;

/// A task of a thousand ramps, and its operator.
struct Desk {
    engine: TaskEngine,
    operator: Operator,
    names: Vec<String>,
}

impl Desk {
    fn new() -> Self {
        let workload = Workload::Only(BlockType::of::<LimRateOfChangeCI>());
        let text = workload.source(VALUES).text;
        let text = text.replacen("[node]\n", "[node]\ncontrol = \"force\"\n", 1);
        let plan = Plan::new(Source::new("bench", text), &Rules::default()).expect("it is right");
        let engine = TaskEngine::build(&plan).expect("it can be built").remove(0);
        let names = (0..VALUES).map(|index| format!("block.{index}.setChangeRate")).collect();
        Self { engine, operator: Operator::new(&plan, Feeds::Services), names }
    }

    fn values(&self, count: usize) -> impl Iterator<Item = (&str, Value)> {
        self.names.iter().take(count).map(|name| (name.as_str(), Value::Number(7.0)))
    }

    fn order(&mut self, prepared: PreparedRequest) -> Box<Order> {
        self.operator.send(prepared).1.remove(0).1
    }

    fn set(&mut self) -> Box<Order> {
        let set = self.operator.set(self.values(VALUES), RequestTerms::default(), &[0]);
        self.order(set.expect("it is right"))
    }

    fn force(&mut self, count: usize) -> Box<Order> {
        let values = self.values(count);
        let force = self.operator.force(values, Hold::UntilReleased, RequestTerms::default(), &[0]);
        self.order(force.expect("it is right"))
    }

    fn read(&mut self) -> Box<Order> {
        let names = self.names.iter().map(String::as_str);
        let selection = Selection::of(self.operator.signals(), names, 0, VALUES);
        let read = self.operator.read(selection.expect("it is right").with_quality());
        self.order(read)
    }
}

fn bench(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("request of 1000 values");
    group.throughput(Throughput::Elements(VALUES as u64));
    let mut apply = |name: &str, forced: usize, order: fn(&mut Desk) -> Box<Order>| {
        let mut desk = Desk::new();
        if forced > 0 {
            let mut force = desk.force(forced);
            desk.engine.apply(&mut force, 0, 0);
        }
        let mut order = order(&mut desk);
        group.bench_function(name, |bencher| {
            bencher.iter(|| desk.engine.apply(black_box(&mut order), 0, 0));
        });
    };
    apply("set", 0, Desk::set);
    apply("set, one forced", 1, Desk::set);
    apply("set, all forced", VALUES, Desk::set);
    apply("force again, all forced", VALUES, |desk| desk.force(VALUES));
    let mut desk = Desk::new();
    let mut order = desk.read();
    group.bench_function("read", |bencher| {
        bencher.iter(|| desk.engine.read(black_box(&mut order), 0));
    });
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
