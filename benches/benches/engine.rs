//! The cost of a block instance in a cycle, from 10 to 1,000,000 instances in one task.
//!
//! `mixed` is the chain saw -> scale -> ramp; the others are a thousand instances of one type. The
//! throughput column is instances per second: its inverse is the cost of one instance and cycle.
//! `one by one` is `mixed` stepped instance by instance, as where they have constants of their own.
//! `copy` copies as many bytes as the image and the state of `mixed` have, which shows how fast the
//! memory is where a task is larger than the caches.
//! `isochrone bench engine` measures the same with arms that take turns.
#![allow(missing_docs, reason = "criterion's macros make public functions")]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use isochrone_benches::engine;
use isochrone_blocks::CATALOGUE;
use isochrone_engine::{Workload, WorkloadSize};

fn bench(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("step");
    let mut run = |name: &str, workload: Workload, instances: usize, shares: bool| {
        let mut engine = engine(&workload, instances).expect("the workload is right");
        if !shares {
            let mut words = vec![0.0; engine.state_words()];
            engine.copy_words(&mut words);
            // Nothing checks whether what was loaded is the same for all.
            engine.load_words(0, &words);
        }
        let mut cycle = 1;
        group.throughput(Throughput::Elements(instances as u64));
        group.bench_function(BenchmarkId::new(name, instances), |bencher| {
            bencher.iter(|| {
                engine.step(black_box(cycle));
                cycle += 1;
            });
        });
    };
    for instances in [10, 100, 1_000, 10_000, 100_000, 1_000_000] {
        run("mixed", Workload::Mixed, instances, true);
    }
    run("one by one", Workload::Mixed, 1_000, false);
    for block_type in CATALOGUE {
        run(block_type.name, Workload::Only(*block_type), 1_000, true);
    }
    for instances in [100_000, 1_000_000] {
        let WorkloadSize { slots, state_words, .. } = Workload::Mixed.size(instances);
        group.throughput(Throughput::Elements(instances as u64));
        group.bench_with_input(
            BenchmarkId::new("copy", instances),
            &(slots + state_words),
            |b, len| {
                let (from, mut to) = (vec![1.0_f64; *len], vec![0.0; *len]);
                b.iter(|| black_box(&mut to).copy_from_slice(black_box(&from)));
            },
        );
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
