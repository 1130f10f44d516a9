//! The page of tasks.

use super::*;

#[test]
fn tasks_show_their_counts_and_the_jitter_of_all_cycles_of_a_second_and_the_shown_ones_of_a_minute()
{
    let mut model = plant();
    model.page = Page::Tasks;
    let lines = lines(&mut model, (80, 24));
    let rows = |name: &str| {
        let rows = lines.iter().filter(|line| line.starts_with(name));
        rows.map(|row| row.split_whitespace().collect::<Vec<_>>()).collect::<Vec<_>>()
    };
    let [counts, jitter] = &rows("fast ")[..] else { panic!("{lines:#?}") };
    assert_eq!(counts[1..], ["1", "ms", "123456", "2", "1", "1", "25.0%", "1000"]);
    assert_eq!(jitter[1..7], ["1.50", "us", "9.50", "us", "12.0", "us"], "{lines:#?}");
    assert_eq!(jitter[7..], ["2.50", "us", "3.97", "us", "4.00", "us", "3000/59981"]);
    let [counts, jitter] = &rows("slow ")[..] else { panic!("{lines:#?}") };
    assert_eq!(counts[7..], ["-", "-"], "a task of which nothing is known has no CPU of 0");
    assert_eq!(jitter[1..], ["-"; 7], "{lines:#?}");
    assert!(lines.iter().any(|line| line.contains("1 min of shown cycles")), "{lines:#?}");
    assert!(lines.iter().any(|line| line.contains("which telemetry shows, at most 50 a second")));
}

#[test]
fn the_processes_of_a_redundant_node_stand_above_its_tasks_which_stay_whole() {
    let mut model = plant();
    let mut node = node(1);
    let redundancy = serde_json::json!({
        "holder": 4711, "standby": 4803, "is_complete": true, "behind_cycles": 2, "takeovers": 3,
        "last_takeover": { "unix_ns": 1_000_000_000, "was_asked": true, "lost_cycles": 0 },
    });
    node.redundancy = Some(serde_json::from_value(redundancy).unwrap());
    model.take(News::Described(node));
    model.page = Page::Tasks;
    let shown = lines(&mut model, (80, 24));
    assert_eq!(shown[2], "held by pid 4711, pid 4803 stands by, 2 cycles behind");
    assert_eq!(shown[3], "3 takeovers, the last 1970-01-01T00:00:01.000Z: as the holder had asked");
    let text = shown.join("\n");
    assert_eq!(
        (text.matches("\nfast ").count(), text.matches("\nslow ").count()),
        (2, 2),
        "{text}"
    );
    let small = lines(&mut model, (80, 12)).join("\n");
    assert!(small.contains("task 1 to 1 of 2"), "{small}");
}

#[test]
fn how_the_cycles_of_a_task_that_follows_its_data_begin_stands_below() {
    let mut model = plant();
    let mut node = node(1);
    let placement = serde_json::json!({
        "cpu": 1, "scheduler": "fifo:80", "wake": "hybrid", "first_release_ns": 0, "longest_watch_ns": 0,
        "response_ns": null, "follow": { "service": "plant/level", "within_ns": 300_000 }, "sends": [],
    });
    node.tasks[0].placement = serde_json::from_value(placement).unwrap();
    model.take(News::Described(node));
    let follow = |number: u64| FollowSample {
        begun: CycleStartCounts { followed: number * 19, found_ready: 7, timed_out: number },
        wait_ns: 151_000,
        latency_ns: Some(2_130),
    };
    let now_ns = 2 * NOW_NS;
    let samples = (0..).zip(a_minute_of_samples(now_ns));
    let samples = samples.map(|(number, it)| Sample { follow: Some(follow(number)), ..it });
    model.take(News::Timing(samples.collect()));
    model.tick(now_ns);
    press(&mut model, "2");
    let shown = lines(&mut model, (80, 24));
    let row = shown.iter().rfind(|line| line.starts_with("fast ")).unwrap();
    let row: Vec<_> = row.split_whitespace().collect();
    assert_eq!(
        row[1..],
        ["950", "0", "50", "151", "us", "2.13", "us", "plant/level"],
        "{shown:#?}"
    );
    assert!(shown.iter().any(|line| line.contains("timed out    wait p50")), "{shown:#?}");
    assert!(shown.iter().any(|line| line.contains("slow ")), "{shown:#?}");
    let small = lines(&mut model, (80, 12));
    assert!(!small.iter().any(|line| line.contains("timed out")), "{small:#?}");
    assert!(small.iter().any(|line| line.contains("1 min of shown cycles")), "{small:#?}");
}

#[test]
fn a_task_page_that_does_not_show_all_tasks_says_so() {
    let mut model = plant();
    press(&mut model, "2");
    assert!(lines(&mut model, (80, 12))[11].contains("Up and Down: task 1 to 1 of 2"));
    press(&mut model, "↓");
    assert!(lines(&mut model, (80, 12))[11].contains("Up and Down: task 2 to 2 of 2"));
    assert!(!shown(&mut model).contains("Up and Down"));
}

#[test]
fn a_large_screen_shows_the_tasks_below_the_signals() {
    let mut model = plant();
    let lines = lines(&mut model, (140, 40));
    assert!(lines.iter().any(|line| line.contains("bank.20.y")), "{lines:#?}");
    assert!(lines.iter().any(|line| line.contains("1 min of shown cycles")), "{lines:#?}");
    assert!(lines.iter().any(|line| line.starts_with("slow")), "{lines:#?}");
}
