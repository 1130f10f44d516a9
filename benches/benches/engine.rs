//! What a block instance costs in a cycle, from 10 to 1,000,000 instances in one task.
//!
//! `mixed` is the chain saw -> scale -> ramp; the others are a thousand instances of one type. The
//! throughput column is instances per second: its inverse is the cost of one instance and cycle.
#![allow(missing_docs, reason = "criterion's macros make public functions")]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use isochrone_engine::{Plan, Rules, Source, TaskEngine};

const HEAD: &str = "[node]\nname = \"bench\"\n[[task]]\nname = \"t\"\nperiod = \"1ms\"\n";

/// A third of the instances each are saws, scales and ramps, wired in chains.
fn mixed(instances: usize) -> String {
    let count = instances.div_ceil(3);
    format!(
        "{HEAD}\
        [[block]]\nname = \"saw\"\ntype = \"SawTooth\"\ncount = {count}\n\
        in = {{ timeRange = 10, incrementRange = 2764, numberSteps = 10 }}\n\
        [[block]]\nname = \"scale\"\ntype = \"ScaleLinear\"\ncount = {count}\n\
        in = {{ x = \"saw.{{i}}.value\", x1 = 0, y1 = 0, x2 = 27648, y2 = 1.7, yMin = 0, yMax = 1.7 }}\n\
        [[block]]\nname = \"ramp\"\ntype = \"LimRateOfChangeCI\"\ncount = {count}\n\
        in = {{ value = \"scale.{{i}}.y\", setChangeRate = 10 }}\n"
    )
}

fn only(block_type: &str, pins: &str) -> String {
    format!(
        "{HEAD}[[block]]\nname = \"b\"\ntype = \"{block_type}\"\ncount = 1000\nin = {{ {pins} }}\n"
    )
}

fn engine(text: String) -> (TaskEngine, u64) {
    let source = Source { name: "bench".into(), text: text.into() };
    let plan = Plan::new(source, &Rules::default()).expect("the bench's configuration is right");
    let instances = plan.instances() as u64;
    (TaskEngine::build(&plan).remove(0), instances)
}

fn bench(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("step");
    let mut run = |id: BenchmarkId, text: String| {
        let (mut engine, instances) = engine(text);
        let mut cycle = 0;
        group.throughput(Throughput::Elements(instances));
        group.bench_function(id, |bencher| {
            bencher.iter(|| {
                engine.step(black_box(cycle));
                cycle += 1;
            });
        });
    };
    for instances in [10, 100, 1_000, 10_000, 100_000, 1_000_000] {
        run(BenchmarkId::new("mixed", instances), mixed(instances));
    }
    for (block_type, pins) in [
        ("SawTooth", "timeRange = 10, incrementRange = 2764, numberSteps = 10"),
        ("ScaleLinear", "x = 13824, x1 = 0, y1 = 0, x2 = 27648, y2 = 1.7, yMin = 0, yMax = 1.7"),
        ("LimRateOfChangeCI", "value = 1e12, setChangeRate = 10"),
        (
            "LimRateOfChangeAdvancedCI",
            "autoValue = 1e12, setPosUpRateLim = 10, setHighLim = inf, setLowLim = -inf",
        ),
    ] {
        run(BenchmarkId::new(block_type, 1000), only(block_type, pins));
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
