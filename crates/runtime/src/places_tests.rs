use std::fs;
use std::path::Path;

use isochrone_engine::{Rules, Source};

use super::*;

/// The CPUs of tasks that are written like this, on a machine of three CPUs.
#[track_caller]
fn placed(tasks: &[&str]) -> Vec<Option<usize>> {
    let names = ["a", "b", "c", "d"];
    let task = |(name, keys): (&str, &&str)| format!("[[task]]\nname = \"{name}\"\n{keys}\n");
    let tasks: String = names.into_iter().zip(tasks).map(task).collect();
    let plan = plan(&tasks);
    let root = tempfile::tempdir().unwrap();
    write(root.path(), "sys/devices/system/cpu/online", "0-2");
    write(root.path(), "proc/self/status", "Cpus_allowed_list:\t0-2\n");
    let places = Places::on(&plan, &Machine::below(root.path()));
    (0..plan.tasks.len()).map(|task| places.cpu(task)).collect()
}

#[track_caller]
fn plan(tasks: &str) -> Plan {
    let text = format!("[node]\nname = \"n\"\n{tasks}").into();
    let source = Source { name: "test.toml".into(), text };
    Plan::new(source, &Rules::default()).unwrap()
}

fn write(root: &Path, path: &str, text: &str) {
    fs::create_dir_all(root.join(path).parent().unwrap()).unwrap();
    fs::write(root.join(path), text).unwrap();
}

#[test]
fn a_task_with_a_priority_gets_a_cpu_and_one_without_may_move() {
    assert_eq!(placed(&["period = \"1ms\"\npriority = 80", "period = \"1ms\""]), [Some(2), None]);
    assert_eq!(placed(&["period = \"1ms\"\ncpu = \"auto\""]), [Some(2)]);
    assert_eq!(placed(&["period = \"1ms\"\npriority = 80\ncpu = \"any\""]), [None]);
}

#[test]
fn the_highest_priority_chooses_first_and_tasks_are_kept_apart() {
    let slow = "period = \"100ms\"\npriority = 50";
    let fast = "period = \"1ms\"\npriority = 50";
    let first = "period = \"10ms\"\npriority = 80";
    assert_eq!(placed(&[slow, fast, first]), [Some(0), Some(1), Some(2)]);
    assert_eq!(placed(&[slow, slow, slow, slow]), [Some(2), Some(1), Some(0), Some(2)]);
}

#[test]
fn a_cpu_that_is_named_is_kept_and_avoided() {
    let named = "period = \"1ms\"\npriority = 10\ncpu = 2";
    let open = "period = \"1ms\"\npriority = 80";
    assert_eq!(placed(&[named, open]), [Some(2), Some(1)]);
    assert_eq!(placed(&["period = \"1ms\"\ncpu = 7"]), [Some(7)], "the kernel refuses it");
}

#[test]
fn on_a_machine_that_tells_nothing_a_task_may_move() {
    let plan = plan("[[task]]\nname = \"a\"\nperiod = \"1ms\"\npriority = 80\n");
    let root = tempfile::tempdir().unwrap();
    let places = Places::on(&plan, &Machine::below(root.path()));
    assert_eq!(places.as_slice(), [CpuPlace::Anywhere]);
}

/// Tasks that have a service of their own name each, and follow one of another task, by its name, or nothing.
fn following(tasks: &[(&str, u8, &str)]) -> String {
    let task = |(name, priority, followed): &(&str, u8, &str)| {
        let (mut follow, mut input) = (String::new(), String::new());
        if !followed.is_empty() {
            follow = format!("follow = {{ service = \"{followed}\", within = \"100us\" }}\n");
            input = format!(
                "[[input]]\nname = \"from_{name}\"\ntask = \"{name}\"\nservice = \"{followed}\"\n"
            );
        }
        format!(
            "[[task]]\nname = \"{name}\"\nperiod = \"1ms\"\npriority = {priority}\n{follow}{input}\
             [[block]]\nname = \"saw_{name}\"\ntask = \"{name}\"\ntype = \"SawTooth\"\n\
             in = {{ incrementRange = 1 }}\n\
             [[output]]\nservice = \"{name}\"\ntask = \"{name}\"\nsignals = [\"saw_{name}.value\"]\n"
        )
    };
    tasks.iter().map(task).collect()
}

/// The CPUs of such tasks on a machine with these, beside nodes that run.
#[track_caller]
fn placed_following(
    tasks: &[(&str, u8, &str)],
    cpus: &str,
    running: &[Neighbour],
) -> (Vec<Option<usize>>, Places) {
    let plan = plan(&following(tasks));
    let root = tempfile::tempdir().unwrap();
    write(root.path(), "sys/devices/system/cpu/online", cpus);
    write(root.path(), "proc/self/status", &format!("Cpus_allowed_list:\t{cpus}\n"));
    let places = Places::beside(&plan, &Machine::below(root.path()), running);
    ((0..plan.tasks.len()).map(|task| places.cpu(task)).collect(), places)
}

#[test]
fn a_task_is_kept_off_the_cpu_of_the_one_that_it_would_keep_from_sending() {
    let three = [("a", 80, ""), ("other", 80, ""), ("b", 80, "a")];
    let (cpus, places) = placed_following(&three, "0-1", &[]);
    assert_eq!(cpus, [Some(1), Some(0), Some(0)]);
    assert_eq!(
        places.reason(2).as_deref(),
        Some(
            "CPU 1 is left to n.a, which the task follows; every CPU has a task already; n.other runs there too"
        )
    );
    // One of lower priority lets its source run.
    let lower = [("a", 80, ""), ("other", 80, ""), ("b", 79, "a")];
    assert_eq!(placed_following(&lower, "0-1", &[]).0, [Some(1), Some(0), Some(1)]);
}

#[test]
fn behind_its_source_a_task_of_lower_priority_runs_on_its_cpu_rather_than_beside_one_that_it_meets()
{
    let chain = [("a", 80, ""), ("b", 80, "a"), ("c", 70, "b")];
    let (cpus, places) = placed_following(&chain, "0-1", &[]);
    assert_eq!(cpus, [Some(1), Some(0), Some(0)]);
    assert_eq!(
        places.reason(2).as_deref(),
        Some(
            "CPU 1 is left to n.a, which needs it at the same time as the task; every CPU has a task already; n.b runs \
             there too"
        )
    );
    assert_eq!(placed_following(&chain, "0-2", &[]).0, [Some(2), Some(1), Some(0)], "each its own");
    let late = |text: String| text.replace("1ms\"", "1ms\"\nphase = \"600us\"");
    let auto = |text: String| text.replace("1ms\"", "1ms\"\nphase = \"auto\"");
    let source = plan(&late(following(&[("a", 80, "")])).replace("1ms\"", "1ms\"\ncpu = 1"));
    let first = plan(&late(following(&[("b", 80, "a")])).replace("1ms\"", "1ms\"\ncpu = 0"));
    let running = [&source, &first].map(|of| Neighbour::planned("m", &of.tasks[0]));
    let behind = plan(&auto(following(&[("c", 70, "b")])));
    let root = tempfile::tempdir().unwrap();
    write(root.path(), "sys/devices/system/cpu/online", "0-1");
    write(root.path(), "proc/self/status", "Cpus_allowed_list:\t0-1\n");
    let places = Places::beside(&behind, &Machine::below(root.path()), &running);
    assert_eq!(places.cpu(0), Some(0), "at the phase that it will have");
    let star = [("a", 80, ""), ("b", 70, "a"), ("c", 70, "a")];
    assert_eq!(placed_following(&star, "0-1", &[]).0, [Some(1), Some(0), Some(1)]);
}

#[test]
fn a_source_is_kept_off_the_cpus_of_those_that_follow_it_though_they_choose_first() {
    let star = [("a", 70, ""), ("b", 80, "a"), ("c", 80, "a")];
    assert_eq!(placed_following(&star, "0-1", &[]).0, [Some(1), Some(0), Some(0)]);
    let chain = [("a", 80, ""), ("c", 80, "b"), ("b", 80, "a"), ("d", 80, "c")];
    assert_eq!(placed_following(&chain, "0-1", &[]).0, [Some(1), Some(1), Some(0), Some(0)]);
}

#[test]
fn where_there_is_no_other_cpu_a_task_runs_on_that_of_its_source() {
    let two = [("a", 80, ""), ("b", 80, "a")];
    assert_eq!(placed_following(&two, "0", &[]).0, [Some(0), Some(0)]);
    let circle = [("a", 80, "c"), ("b", 80, "a"), ("c", 80, "b")];
    assert!(placed_following(&circle, "0-1", &[]).0.iter().all(Option::is_some));
}

#[test]
fn a_task_is_kept_off_the_cpu_of_a_source_in_another_node_and_of_one_that_follows_it() {
    let other = plan(&following(&[("a", 80, "z")]).replace("1ms\"", "1ms\"\ncpu = 1"));
    let running = [Neighbour::planned("m", &other.tasks[0])];
    for (task, reason) in [
        (("b", 80, "a"), "CPU 1 is left to m.a, which the task follows"),
        (("z", 80, ""), "CPU 1 is left to m.a, which follows the task"),
    ] {
        let (cpus, places) = placed_following(&[task], "0-1", &running);
        assert_eq!(cpus, [Some(0)]);
        assert_eq!(places.reason(0).as_deref(), Some(reason));
    }
    assert_eq!(placed_following(&[("c", 80, "")], "0-1", &running).0, [Some(1)]);
}
