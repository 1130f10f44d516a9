//! The cost of a block instance in a cycle, from 10 to 1,000,000 instances in one task.
//!
//! `mixed` is the chain saw -> scale -> ramp; the others are a thousand instances of one type. The
//! throughput column is instances per second: its inverse is the cost of one instance and cycle.
//! `isochrone bench engine` measures the same with arms that take turns.
#![allow(missing_docs, reason = "criterion's macros make public functions")]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use isochrone_benches::engine;
use isochrone_blocks::CATALOGUE;
use isochrone_engine::Workload;

fn bench(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("step");
    let mut run = |workload: Workload, instances: usize| {
        let mut engine = engine(&workload, instances).expect("the workload is right");
        let mut cycle = 0;
        group.throughput(Throughput::Elements(instances as u64));
        group.bench_function(BenchmarkId::new(workload.name(), instances), |bencher| {
            bencher.iter(|| {
                engine.step(black_box(cycle));
                cycle += 1;
            });
        });
    };
    for instances in [10, 100, 1_000, 10_000, 100_000, 1_000_000] {
        run(Workload::Mixed, instances);
    }
    for block_type in CATALOGUE {
        run(Workload::Only(*block_type), 1_000);
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
