//! The choice of a CPU on machines made of files.

use std::time::Duration;

use crate::machines::{CONTAINER, Fake, GUEST, LAPTOP, METAL};
use isochrone_machine::{Avoided, BoundThread, Choice, Observation, Reason};

const SECOND: Duration = Duration::from_secs(1);

/// Nothing happens for a second.
#[track_caller]
fn observed(fake: &Fake) -> Observation {
    Observation::of(&fake.machine(), || SECOND).unwrap()
}

#[track_caller]
fn chosen(fake: &Fake) -> Choice {
    observed(fake).choose().unwrap()
}

/// A machine of CPUs that nothing tells apart.
fn plain(cpus: &str) -> Fake {
    let fake = Fake::new(&[]);
    fake.write("sys/devices/system/cpu/online", cpus);
    fake.write("proc/self/status", format!("Cpus_allowed_list:\t{cpus}\n"));
    fake
}

#[test]
fn a_cpu_that_is_to_be_avoided_is_chosen_only_if_all_are() {
    let observation = observed(&plain("0-2"));
    let avoid = |cpus: &[usize]| {
        let avoided =
            |cpu: &usize| Avoided { cpu: *cpu, has: "a.t, which the task follows".into() };
        observation.choose_off(&cpus.iter().map(avoided).collect::<Vec<_>>()).unwrap()
    };
    assert_eq!(avoid(&[2]).cpu, 1);
    assert_eq!(avoid(&[1, 2]).to_string(), "CPU 2 is left to a.t, which the task follows");
    let all = avoid(&[0, 1, 2]);
    assert_eq!(all.cpu, observation.choose().unwrap().cpu);
    assert_eq!(
        all.to_string(),
        "CPUs 0, 1 are as good, and the last is taken; it has a.t, which the task follows, because no CPU is without \
         such a task"
    );
    assert_eq!(avoid(&[7]), observation.choose().unwrap());
}

/// A program's process and one more thread of it.
fn run(fake: &Fake, process: u32, threads: [(&str, &str); 2], policy: u32) {
    for (thread, (name, cpus)) in (process..).zip(threads) {
        let stat = format!(
            "{thread} ({name}) S 1 0 0 0 -1 4194304 {} 17 0 50 {policy} 0 0 0",
            ["0"; 28].join(" ")
        );
        let status = format!("Name:\tx\nCpus_allowed_list:\t{cpus}\n");
        for folder in [format!("proc/{process}/task/{thread}"), format!("proc/{thread}")] {
            // The folder of another thread than the first is not listed below /proc.
            if thread == process || folder.contains("task") {
                fake.write(&format!("{folder}/stat"), &stat);
                fake.write(&format!("{folder}/status"), &status);
            }
        }
    }
}

fn interrupts(counts: [u64; 2]) -> String {
    let [first, second] = counts;
    format!(
        "     CPU0  CPU1\n 36:  {first}  {second}  PCI-MSIX  1-edge  virtio1-req.0\nLOC:  5  900000  Local timer\n"
    )
}

#[test]
fn of_cpus_that_are_alike_the_last_is_chosen() {
    let choice = chosen(&plain("0-3"));
    assert_eq!(choice, Choice { cpu: 3, reasons: vec![Reason::Last { alike: vec![0, 1, 2] }] });
    assert_eq!(choice.to_string(), "CPUs 0, 1, 2 are as good, and the last is taken");
}

#[test]
fn one_cpu_is_chosen_without_looking_at_it() {
    let one = plain("0");
    let observation =
        Observation::of(&one.machine(), || panic!("there is no choice to wait for")).unwrap();
    assert_eq!(observation.choose().unwrap().reasons, [Reason::Only]);
    assert_eq!(chosen(&Fake::new(&[GUEST, CONTAINER])).cpu, 0, "the container has only this one");
}

#[test]
fn without_a_word_of_the_kernel_nothing_is_chosen() {
    assert_eq!(Observation::of(&Fake::new(&[]).machine(), || SECOND), None);
}

#[test]
fn an_isolated_cpu_goes_before_the_others() {
    let metal = chosen(&Fake::new(&[METAL]));
    assert_eq!((metal.cpu, metal.reasons), (3, vec![Reason::Isolated]));
    let fake = plain("0-3");
    fake.write("sys/devices/system/cpu/nohz_full", "1-2\n");
    let choice = chosen(&fake);
    assert_eq!(
        (choice.cpu, choice.to_string()),
        (2, "it is isolated; CPU 1 is as good, and the last is taken".into())
    );
}

/// As the kernel starts programs on a machine with `isolcpus=2-3`.
#[test]
fn an_isolated_cpu_is_chosen_although_programs_start_without_it() {
    let fake = plain("0-3");
    fake.write("sys/devices/system/cpu/isolated", "2-3\n");
    fake.write("proc/self/status", "Cpus_allowed_list:\t0-1\n");
    assert_eq!(chosen(&fake).cpu, 3);
    fake.write("proc/self/cgroup", "0::/cell\n");
    fake.write("sys/fs/cgroup/cell/cpuset.cpus.effective", "0-2\n");
    assert_eq!(chosen(&fake).cpu, 2, "the cpuset excludes the other");
    fake.write("proc/self/status", "Cpus_allowed_list:\t0\n");
    assert_eq!(chosen(&fake).cpu, 0, "somebody bound this process to it");
}

#[test]
fn a_cpu_that_the_process_may_not_use_or_that_is_offline_is_never_chosen() {
    let fake = plain("0-3");
    fake.write("proc/self/status", "Cpus_allowed_list:\t0-2\n");
    assert_eq!(chosen(&fake).cpu, 2);
    fake.write("sys/devices/system/cpu/online", "0-1,3\n");
    assert_eq!(chosen(&fake).cpu, 1);
}

#[test]
fn what_devices_do_now_goes_before_what_they_did_since_the_start() {
    let fake = plain("0-1");
    fake.write("proc/interrupts", interrupts([50_000_000, 10]));
    let observe = |fired: u64| {
        Observation::of(&fake.machine(), || {
            fake.write("proc/interrupts", interrupts([50_000_000, 10 + fired]));
            SECOND / 2
        })
    };
    let choice = observe(1_200).unwrap().choose().unwrap();
    assert_eq!(choice.cpu, 0);
    assert_eq!(choice.to_string(), "devices interrupt it 0 times per second, and CPU 1 2400 times");
    fake.write("proc/interrupts", interrupts([50_000_000, 10]));
    let mut shared = observe(1_200).unwrap();
    shared.bind(BoundThread { process: None, name: "level.fast".into(), cpu: 0 });
    assert_eq!(
        shared.choose().unwrap().to_string(),
        "no task is pinned to it, and CPU 0 has level.fast; devices interrupt it 2400 times per second, and CPU 0 \
         only 0 times, which counts less"
    );
    fake.write("proc/interrupts", interrupts([50_000_000, 10]));
    let choice = observe(40).unwrap().choose().unwrap();
    assert_eq!(choice.cpu, 1, "80 a second make no difference");
    assert_eq!(
        choice.to_string(),
        "devices have interrupted it 50 times since the machine started, and CPU 0 50000000 times"
    );
}

#[test]
fn a_few_interrupts_more_and_the_timer_make_no_difference() {
    let fake = plain("0-1");
    fake.write("proc/interrupts", interrupts([1_000, 2_900]));
    assert_eq!(chosen(&fake).reasons, [Reason::Last { alike: vec![0] }]);
}

#[test]
fn tasks_and_nodes_that_run_are_kept_apart() {
    let fake = plain("0-1");
    run(&fake, 700, [("isochrone", "0-1"), ("fast) x", "1")], 1);
    let choice = chosen(&fake);
    assert_eq!(choice.cpu, 0);
    assert_eq!(choice.to_string(), "no task is pinned to it, and CPU 1 has fast) x (pid 700)");

    let mut observation = observed(&fake);
    for expected in [0, 1, 0, 1] {
        let cpu = observation.choose().unwrap().cpu;
        observation.bind(BoundThread { process: None, name: "next".into(), cpu });
        assert_eq!((cpu, observation.cpus[cpu].bound.is_empty()), (expected, false));
    }
}

#[test]
fn a_cpu_that_is_shared_is_said_to_be_with_what() {
    let bind = |observation: &mut Observation, name: &str, cpu| {
        observation.bind(BoundThread { process: None, name: name.into(), cpu });
    };
    let mut observation = observed(&plain("0-1"));
    let why = |observation: &Observation| observation.choose().unwrap().to_string();
    bind(&mut observation, "fast", 1);
    assert_eq!(why(&observation), "no task is pinned to it, and CPU 1 has fast");
    bind(&mut observation, "slow", 0);
    assert_eq!(
        why(&observation),
        "every CPU has a task already; fast runs there too; CPU 0 is as good, and the last is taken"
    );
    bind(&mut observation, "other", 1);
    assert_eq!(
        why(&observation),
        "only one task is pinned to it, and more to CPU 1; slow runs there too"
    );

    let one = plain("0");
    run(&one, 700, [("isochrone", "0-1"), ("fast", "0")], 1);
    let mut observation = observed(&one);
    for name in ["a", "b", "c"] {
        bind(&mut observation, name, 0);
    }
    assert_eq!(
        why(&observation),
        "it is the only CPU that this process may use; fast (pid 700), a, b and 1 more run there too"
    );
    observation.name(0, "other", "level.other");
    observation.name(0, "fast", "level.fast");
    assert!(why(&observation).contains("; level.fast, a, b and"), "{}", why(&observation));
}

#[test]
fn a_task_without_a_priority_counts_and_a_program_that_is_bound_as_a_whole_does_not() {
    let fake = plain("0-1");
    run(&fake, 700, [("stress-ng", "1"), ("stress-ng", "1")], 0);
    assert_eq!(chosen(&fake).cpu, 1);
    run(&fake, 800, [("isochrone", "0-1"), ("slow", "1")], 0);
    assert_eq!(chosen(&fake).cpu, 0);
    run(&fake, 900, [("cyclictest", "0"), ("cyclictest", "0")], 1);
    assert_eq!(chosen(&fake).cpu, 1, "a real-time program counts whoever bound it");
}

#[test]
fn a_core_of_its_own_goes_before_half_of_a_busy_one() {
    let fake = plain("0-3");
    for (cpu, core) in [(0, "0,2"), (1, "1,3"), (2, "0,2"), (3, "1,3")] {
        let path = format!("sys/devices/system/cpu/cpu{cpu}/topology/thread_siblings_list");
        fake.write(&path, core);
    }
    run(&fake, 700, [("isochrone", "0-3"), ("fast", "3")], 1);
    let choice = chosen(&fake);
    assert_eq!(choice.cpu, 2, "CPU 1 shares the core of CPU 3");
    assert!(choice.reasons.contains(&Reason::OwnCore), "{choice}");
}

#[test]
fn a_laptop_keeps_the_last_cpu_as_nothing_much_happens_there() {
    assert_eq!(
        chosen(&Fake::new(&[METAL, LAPTOP]).without("sys/devices/system/cpu/nohz_full")).cpu,
        3
    );
}
