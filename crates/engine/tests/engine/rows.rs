//! What a recording keeps of a cycle, and wires in other hands than the tasks'.

use crate::two_tasks;
use crate::two_tasks::{input, output, ramp};
use isochrone_engine::orders::{AtEnd, Inbox, Order, SlotForce, Store, Work};
use isochrone_engine::{Flags, InputReading, Plan, TaskEngine};

fn plan() -> Plan {
    two_tasks::plan(
        &(input("x", "fast")
            + &ramp("a", "fast", "x", 100.0)
            + &ramp("b", "slow", "a.delayedValue", 50.0)
            + &output("fast", &["a.delayedValue", "x"])
            + &output("slow", &["b.delayedValue", "a.delayedValue"])),
    )
}

fn row(engine: &TaskEngine) -> Vec<f64> {
    let mut row = vec![f64::from_bits(7); engine.row_len() + 1];
    engine.read_row(&mut row);
    assert_eq!(row.pop().map(f64::to_bits), Some(7), "a row is as long as it says");
    row
}

fn reading(value: f64) -> InputReading {
    let (age_s, source_ns, flags) = (0.5, 3, Flags::STALE);
    InputReading { value, ok: false, age_s, source_ns, flags }
}

#[test]
fn a_row_has_what_went_into_the_cycle_and_what_came_of_it() {
    let (mut fast, mut slow) = two_tasks::engines(&plan());
    fast.read_input(0, &reading(3.0));
    slow.step(0);
    assert!(row(&slow)[1].is_nan(), "nothing was read of a task that has not run");
    fast.step(4);
    fast.step(5);
    slow.step(1);
    let stale = Flags::STALE.bits() as f64;
    assert_eq!(row(&fast)[..4], [0.0, 3.0, 0.0, 0.5]);
    let flags = fast.output_flags(0).bits() as f64;
    assert!(flags >= stale);
    assert_eq!(row(&fast)[4], flags);
    let mut sent = [0.0; 2];
    fast.read_output(0, &mut sent);
    assert_eq!(row(&fast)[5..], sent);
    assert_eq!(row(&slow)[..3], [0.0, 5.0, 0.0]);
}

#[test]
fn a_row_has_what_an_input_read_under_a_force_and_counts_what_was_done() {
    let plan = plan();
    let (mut fast, _slow) = two_tasks::engines(&plan);
    // The input is the image's first slot.
    let stores = [Store::new(0, 9.0)].into();
    let forces = [SlotForce::new(0, AtEnd::Restore, [].into())].into();
    let force = Work::Force { stores, forces, cycles: None };
    let rate = (0..fast.image().len()).find(|slot| plan.slot_name(0, *slot) == "a.setChangeRate");
    let stores = [Store::new(rate.unwrap(), 5.0)].into();
    let set = Work::Set { feeds: [].into(), stores };
    let mut inbox = Inbox::new(8);
    for work in [force, set] {
        inbox.take(Order::new(None, work)).unwrap();
    }
    inbox.apply(&mut fast, 0, 0, drop);
    fast.read_input(0, &reading(3.0));
    fast.step(0);
    assert_eq!(row(&fast)[..2], [2.0, 3.0], "what is held is another matter");
    let mut sent = [0.0; 2];
    fast.read_output(0, &mut sent);
    assert_eq!(sent[1], 9.0);
}

#[test]
fn loose_wires_bring_a_task_what_it_is_handed_and_nothing_else() {
    let plan = plan();
    let (mut fast, mut slow) = two_tasks::engines(&plan);
    let (mut of_fast, mut of_slow) = (fast.loosen(), slow.loosen());
    assert_eq!(of_slow.sources().collect::<Vec<_>>(), [0]);
    let mut parcels = Vec::new();
    for cycle in 0..3 {
        fast.read_input(0, &reading(100.0));
        fast.step(cycle);
        parcels.extend(of_fast.given().map(|(to, parcel)| (to, parcel.clone())));
    }
    let stamps: Vec<_> = parcels.iter().map(|(to, it)| (*to, it.cycle(), it.changes())).collect();
    assert_eq!(stamps, [(1, Some(0), 0), (1, Some(1), 0), (1, Some(2), 0)]);
    slow.step(0);
    assert!(row(&slow)[1].is_nan(), "the task that computes them hands over nothing by itself");
    of_slow.hand(0, &parcels[1].1);
    slow.step(1);
    assert_eq!(row(&slow)[1], 1.0);
    let mut second = two_tasks::engines(&plan);
    for cycle in 0..2 {
        second.0.read_input(0, &reading(100.0));
        second.0.step(cycle);
        if cycle == 0 {
            // It reads defaults, as it did here.
            second.1.step(0);
        }
    }
    second.1.step(1);
    assert_eq!(row(&slow)[3..], row(&second.1)[3..]);
}
