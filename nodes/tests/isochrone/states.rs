//! What is wrong with a service stands in the alarms of its reader as long as it lasts.

use std::time::Duration;

use iceoryx2::prelude::ipc;
use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{FrameHeader, SignalReader};
use isochrone_testing::plants::{RELAY, tank};
use isochrone_testing::{Domain, PATIENCE, Plant, Process, wait_until};
use serde_json::Value;

/// The alarms of a node with this code.
fn alarms(domain: &Domain, node: &str, code: &str) -> Vec<Value> {
    let listed = domain.run(&format!("alarms {node} --json")).expect_code(0).stdout;
    let listed: Vec<Value> = serde_json::from_str(&listed).unwrap();
    listed.into_iter().filter(|alarm| alarm["code"] == code).collect()
}

#[track_caller]
fn wait_for_alarm(domain: &Domain, node: &str, code: &str) -> Value {
    let mut found = Vec::new();
    wait_until(code, || {
        found = alarms(domain, node, code);
        !found.is_empty()
    });
    found.remove(0)
}

/// Sends frames that only have such a stamp, until a node has or has not an alarm any more.
fn send_until(domain: &Domain, ahead_ns: u64, mut is_met: impl FnMut() -> bool) {
    let port = domain.plain_writer::<ipc::Service>("relay/in");
    let mut sequence = 0;
    wait_until("a writer of another make is noticed", || {
        let mut sample = port.loan_slice(1).unwrap();
        let publish_ns = Monotonic.now_ns() + ahead_ns;
        *sample.user_header_mut() = FrameHeader { sequence, publish_ns, ..FrameHeader::default() };
        sample.payload_mut()[0] = 2.0;
        sample.send().unwrap();
        sequence += 1;
        // A look at the alarms takes long.
        sequence % 50 == 0 && is_met()
    });
}

#[test]
fn a_second_writer_and_stamps_of_another_clock_are_alarms_until_they_are_over() {
    let (domain, mut node) = tank(RELAY);
    let is_there = |code: &str| !alarms(&domain, "relay", code).is_empty();
    send_until(&domain, 1_000_000_000_000, || is_there("future_stamps"));
    node.wait_for("has a stamp of another clock any more");
    wait_until("the stamps are forgotten", || !is_there("future_stamps"));

    let publisher = domain.start("publish relay/in --value 1 --signals x");
    wait_until("a good frame came", || {
        domain.run("get relay x").expect_code(0).stdout.trim() == "1"
    });
    // It is over soon after the last frame.
    let mut seen = Vec::new();
    send_until(&domain, 0, || {
        seen = alarms(&domain, "relay", "other_writer");
        !seen.is_empty()
    });
    let alarm = &seen[0];
    assert_eq!((&alarm["name"], &alarm["task"]), (&"relay/in".into(), &"t".into()), "{alarm}");
    let meaning = alarm["meaning"].as_str().unwrap();
    let (publisher_is, own_is) =
        (format!("(isochrone, pid {})", publisher.id()), format!("pid {})", std::process::id()));
    for part in ["second publisher: ", &publisher_is, &own_is, "`isochrone list`"] {
        assert!(meaning.contains(part), "{part}: {meaning}");
    }
    node.wait_for("service \"relay/in\" has one publisher again");
    wait_until("the second publisher is forgotten", || !is_there("other_writer"));
    publisher.stop().expect_code(0);
    node.stop().expect_code(0).prints(&["second publisher"]);
}

#[test]
fn a_channel_that_carries_another_signal_is_an_alarm_until_it_carries_its_own_again() {
    let (domain, _node) = tank(&RELAY.replace("\"relay/in\"", "\"relay/in\"\nchannel = 0"));
    let publish = |signals: &str| -> Process {
        let mut publisher =
            domain.start(&format!("publish relay/in --value 1,2 --signals {signals}"));
        publisher.wait_for("publishing");
        publisher
    };
    let is_there = || !alarms(&domain, "relay", "moved_channel").is_empty();
    let first = publish("x,y");
    wait_until("the first signal came", || {
        domain.run("get relay x").expect_code(0).stdout.trim() == "1"
    });
    assert!(!is_there());
    first.stop().expect_code(0);
    let second = publish("y,x");
    let alarm = wait_for_alarm(&domain, "relay", "moved_channel");
    assert_eq!(alarm["name"], "x", "{alarm}");
    let meaning = alarm["meaning"].as_str().unwrap();
    assert!(meaning.contains("was \"x\" and is \"y\" now"), "{alarm}");
    second.stop().expect_code(0);
    let _third = publish("x,y");
    wait_until("it is in its place again", || !is_there());
}

/// A node that reads the output of the other and sends it on.
fn of_loop(name: &str, other: &str, keys: &str) -> String {
    RELAY
        .replace("\"relay\"", &format!("\"{name}\""))
        .replace("relay/in", &format!("loop/{other}"))
        .replace("relay/out", &format!("loop/{name}"))
        .replace("[[output]]", &format!("{keys}\n[[output]]"))
}

#[test]
fn a_loop_of_nodes_that_hands_a_flag_round_for_ever_is_an_alarm_until_it_is_closed_by_feedback() {
    let (domain, _first) = tank(&of_loop("a", "b", ""));
    let second = domain.start_node("b.toml", &of_loop("b", "a", ""), "");
    let alarm = wait_for_alarm(&domain, "a", "old_source");
    let meaning = alarm["meaning"].as_str().unwrap();
    assert!(meaning.contains("service \"loop/b\" say UPSTREAM"), "{alarm}");
    second.stop().expect_code(0);
    let _second = domain.start_node("closed.toml", &of_loop("b", "a", "feedback = true"), "");
    wait_until("it is over", || alarms(&domain, "a", "old_source").is_empty());
}

#[test]
fn frames_that_a_task_follows_are_an_alarm_while_they_come_after_it_has_given_up() {
    let follow = "follow = { service = \"relay/in\", within = \"4ms\" }";
    let text = RELAY.replace("period = \"2ms\"", &format!("period = \"20ms\"\n{follow}"));
    let domain = Domain::new();
    let mut node = domain.start_node("relay.toml", &text, "--report report.json");
    let late = domain.start("publish relay/in --value 1 --signals x --rate 50 --phase 12ms");
    let alarm = wait_for_alarm(&domain, "relay", "late_frames");
    assert_eq!((&alarm["name"], &alarm["task"]), (&"relay/in".into(), &"t".into()), "{alarm}");
    let meaning = alarm["meaning"].as_str().unwrap();
    // On a busy machine the publisher may send some of its frames in time.
    let said = ["which waits 4.00 ms for them", "now within the 4.00 ms for which the task waits"];
    assert!(said.iter().any(|it| meaning.contains(it)) && meaning.contains("write "), "{alarm}");
    assert!(domain.stdout("list").contains("missed  1 alarm\n"));
    // Whether others would come in time depends on how busy the machine is.
    late.stop().expect_code(0);
    node.wait_for("no longer come late for task \"t\"");
    wait_until("it is over", || alarms(&domain, "relay", "late_frames").is_empty());
    node.stop().expect_code(0).prints(&["warning [late_frames]"]);
    let task = &domain.json("report.json")["tasks"][0];
    // On a busy machine frames may lie ready when the node comes to its CPU.
    let began_with_them = ["followed", "found_ready"].map(|count| task[count].as_u64().unwrap());
    assert!(began_with_them.iter().sum::<u64>() > 50, "cycles of a stretch: {task}");
}

/// What a node says of a source whose frames every other cycle of its task waits for in vain. What the task sends says
/// when it has given up: the source then sends that frame and the next one, and in turn at once and after such a time.
fn said_of_late_source(keys: &str, turns: [Duration; 2]) -> String {
    let follow = "follow = { service = \"relay/in\", within = \"4ms\" }";
    let text = RELAY.replace("period = \"2ms\"", &format!("period = \"20ms\"\n{keys}\n{follow}"));
    let (domain, _node) = tank(&text);
    let participant = domain.join("tester");
    let mut out = SignalReader::open(&participant, "relay/out", &["x"]).unwrap();
    let port = domain.plain_writer::<ipc::Service>("relay/in");
    let (mut sequence, mut newest, mut is_taken, mut meaning) = (0, 0.0, true, String::new());
    let mut turns = turns.into_iter().cycle();
    wait_until("late_frames", || {
        let frame = out.wait(PATIENCE).expect("the task cycles");
        let (_, value) = frame.values().unwrap().next().unwrap();
        if value == newest && !is_taken {
            is_taken = true;
            return false;
        }
        (newest, is_taken) = (newest + 1.0, false);
        std::thread::sleep(turns.next().unwrap());
        for _ in 0..2 {
            let mut sample = port.loan_slice(1).unwrap();
            let publish_ns = Monotonic.now_ns();
            *sample.user_header_mut() =
                FrameHeader { sequence, publish_ns, ..FrameHeader::default() };
            sample.payload_mut()[0] = newest;
            sample.send().unwrap();
            sequence += 1;
        }
        // A look at the alarms takes long.
        if sequence % 100 == 0 {
            let alarms = alarms(&domain, "relay", "late_frames");
            meaning = alarms.first().map_or("", |it| it["meaning"].as_str().unwrap()).to_owned();
        }
        !meaning.is_empty()
    });
    let own = format!("pid {}) sends now within the 4.00 ms", std::process::id());
    assert!(meaning.contains(&own), "{meaning}");
    meaning
}

#[test]
fn a_source_that_its_follower_may_starve_is_named_with_the_command_that_helps() {
    let meaning = said_of_late_source("priority = 80", [Duration::ZERO; 2]);
    let command = format!("chrt -a -f -p 81 {}", std::process::id());
    assert!(meaning.contains("if the task keeps its source from running"), "{meaning}");
    assert!(meaning.contains(&command), "{meaning}");
}

#[test]
fn a_source_off_the_grid_is_named_and_to_be_aligned() {
    let meaning = said_of_late_source("", [Duration::ZERO, Duration::from_millis(10)]);
    assert!(meaning.contains("if the source is off the grid, align it"), "{meaning}");
    assert!(!meaning.contains("chrt"), "{meaning}");
}

#[test]
fn limits_that_manual_mode_has_switched_off_are_an_alarm_until_the_range_is_reached() {
    let (domain, mut node) = tank(
        &Plant::new("tank")
            .with("control = \"force\"")
            .task("t", "2ms")
            .block(
                "valve",
                "LimRateOfChangeAdvancedCI",
                "autoValue = 100.0, setPosUpRateLim = 0.001, setHighLim = 10.0, 17 = { manualValue = 20.0, manOp = true }",
            )
            .with("count = 20")
            .output("tank/valve", &["valve.17.outputValue", "valve.17.highLim"]),
    );
    domain
        .run("check tank.toml")
        .expect_code(0)
        .prints(&["block \"valve.17\" (LimRateOfChangeAdvancedCI): when manOp"]);
    wait_until("manual mode", || domain.stdout("get tank valve.17.outputValue") == "20\n");
    assert!(alarms(&domain, "tank", "limits_off").is_empty());
    domain.run("set tank valve.17.manOp=false").expect_code(0);
    let alarm = wait_for_alarm(&domain, "tank", "limits_off");
    assert_eq!((&alarm["name"], &alarm["status"]), (&"valve.17".into(), &Value::Null), "{alarm}");
    let meaning = alarm["meaning"].as_str().unwrap();
    assert!(meaning.contains("limits are off after manual mode"), "{alarm}");
    node.wait_for("block \"valve.17\" (LimRateOfChangeAdvancedCI): its limits are off");
    // A force shows another output; where the block itself stands, its limits are off as before.
    domain.run("force tank valve.17.outputValue=5 --hold").expect_code(0);
    let cycle = || {
        let got = domain.run("get tank valve.17.highLim --json").json();
        got["tasks"]["t"]["cycle"].as_u64().unwrap()
    };
    let forced = cycle();
    wait_until("some cycles", || cycle() > forced + 20);
    assert_eq!(domain.run("get tank valve.17.outputValue").expect_code(0).stdout, "5\n");
    assert_eq!(alarms(&domain, "tank", "limits_off").len(), 1);
    domain.run("release tank valve.17.outputValue").expect_code(0);
    assert_eq!(alarms(&domain, "tank", "limits_off").len(), 1);
    domain.run("set tank valve.17.manualValue=5 valve.17.manOp=true").expect_code(0);
    wait_until("it is over", || alarms(&domain, "tank", "limits_off").is_empty());
    node.wait_for("and its limits are on");
    node.stop().expect_code(0);
}
