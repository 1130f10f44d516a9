//! What is recorded is published again as it was: names, values, pace.

use std::time::Duration;

use isochrone_testing::{Domain, Ended, Plant, cells};

/// Rows at an uneven pace, with values that not every way of writing them keeps.
const RECORDED: &str = "time_s,cycle,level.y,\"tank, full\",status\n\
    0.0,0,0.1,1.0,36608.0\n\
    0.001,1,0.30000000000000004,0.0,0.0\n\
    0.0135,2,-1e-300,1.0,NaN\n\
    0.0135,3,1.7976931348623157e308,1.0,inf\n\
    0.2,4,-0.0,0.0,3.0\n";

/// Publishes a file while a subscriber with these flags takes every frame. A publisher that is alone
/// waits for nobody: on a busy machine the subscriber may come too late for the first frames. Returns how the
/// publisher ended.
fn published(domain: &Domain, publish: &str, subscribe: &str) -> Ended {
    for _ in 0..20 {
        let mut subscriber = domain.start_until(
            &format!("subscribe there/again {subscribe}"),
            "waiting for service \"there/again\"",
        );
        let ended = domain.expect(&format!("publish there/again {publish}"), 0, &["publishing"]);
        if let Some(subscriber) = subscriber.ended_within(Duration::from_secs(2)) {
            subscriber.expect_code(0);
            return ended;
        }
    }
    panic!("twenty subscribers came too late");
}

#[test]
fn a_recording_is_published_with_its_names_its_values_and_its_pace() {
    let domain = Domain::with(&[("first.csv", RECORDED)]);
    let ended = published(&domain, "--csv first.csv", "--csv second.csv --count 5");
    // When a frame was due is exact, however late the machine let it be sent.
    assert_eq!(domain.read("second.csv"), RECORDED, "{}", ended.stderr);
    published(&domain, "--csv second.csv", "--csv third.csv --count 5");
    assert_eq!(domain.read("third.csv"), RECORDED);
}

#[test]
fn a_simulation_whose_outputs_share_a_signal_is_published_with_that_signal_once() {
    let domain = Domain::new();
    let two = Plant::new("two")
        .task("t", "10ms")
        .saw("saw", "startValue = 5, incrementRange = 1, endlessSteps = true")
        .saw("other", "startValue = 9")
        .output("there/one", &["saw.value"])
        .output("there/two", &["other.value", "saw.value"]);
    domain.write("two.toml", two);
    domain.run("simulate two.toml --cycles 4 --output first.csv").expect_code(0);
    let header = domain.read("first.csv").lines().next().unwrap().to_owned();
    assert_eq!(header.matches("saw.value").count(), 2, "rows hold every signal of every output");
    published(&domain, "--csv first.csv --rate 100", "--csv second.csv --count 4");
    let second = domain.read("second.csv");
    assert_eq!(second.lines().next().unwrap().matches("saw.value").count(), 1, "{second}");
    let values = second.lines().skip(1).map(|row| row.split(',').nth(2).unwrap().to_owned());
    assert_eq!(values.collect::<Vec<_>>(), ["5.0", "6.0", "7.0", "8.0"], "{second}");
}

#[test]
fn a_simulation_is_published_at_the_pace_that_it_simulated() {
    let domain = Domain::new();
    let slow = Plant::new("slow")
        .task("t", "100ms")
        .with("phase = \"30ms\"")
        .saw("saw", "startValue = 5, incrementRange = 1, endlessSteps = true")
        .output("there/saw", &["saw.value"]);
    domain.write("slow.toml", slow);
    domain.run("simulate slow.toml --cycles 4 --times --output first.csv").expect_code(0);
    let simulated = "time_s,cycle,saw.value\n0.0,0,5.0\n0.1,1,6.0\n0.2,2,7.0\n0.3,3,8.0\n";
    assert_eq!(domain.read("first.csv"), simulated);
    let published = published(&domain, "--csv first.csv", "--csv second.csv --count 4");
    assert!(published.stderr.contains("its recorded pace, 10 Hz"), "{}", published.stderr);
    assert_eq!(domain.read("second.csv"), simulated);
}

#[test]
fn a_file_without_times_says_at_which_rate_it_is_published_and_how_to_set_another() {
    let domain = Domain::with(&[("untimed.csv", "cycle,level\n0,1.0\n1,2.0\n")]);
    let published = domain.run("publish there/untimed --csv untimed.csv").expect_code(0);
    let note = "at 1000 Hz, as the file has no column time_s; --rate sets another";
    assert!(published.stderr.contains(note), "{}", published.stderr);
    let chosen = domain.run("publish there/untimed --csv untimed.csv --rate 50").expect_code(0);
    assert!(!chosen.stderr.contains("time_s"), "{}", chosen.stderr);
}

#[test]
fn a_recording_is_kept_until_there_is_a_frame_to_replace_it() {
    let domain = Domain::with(&[("keep.csv", RECORDED), ("report.json", "{}")]);
    let files = "--csv keep.csv --report report.json --seconds 0.2";
    domain.run(&format!("subscribe there/not {files}")).expect_code(3);
    domain.run("subscribe there/not --csv new.csv --seconds 0.2").expect_code(3);
    assert!(!domain.path("new.csv").exists());

    let _publisher = domain.publish("there/again --value 1 --signals level");
    let none_such = "subscribe there/again --csv keep.csv --signals volume --count 1";
    domain.run(none_such).expect_code(2);
    assert_eq!(
        (domain.read("keep.csv"), domain.read("report.json")),
        (RECORDED.into(), "{}".into())
    );
    domain.run("subscribe there/again --csv keep.csv --count 1").expect_code(0);
    assert!(domain.read("keep.csv").starts_with("time_s,cycle,level\n0.0,"));
    assert_eq!(domain.read("keep.csv").lines().count(), 2);
}

#[test]
fn a_rate_takes_the_place_of_the_recorded_pace() {
    let domain = Domain::with(&[("first.csv", RECORDED)]);
    published(&domain, "--csv first.csv --rate 500", "--csv second.csv --count 5");
    let second = domain.read("second.csv");
    let times = cells(&second).into_iter().skip(1).map(|row| row[0].parse::<f64>().unwrap());
    let times: Vec<f64> = times.collect();
    let gaps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let on_grid = |gap: &f64| (gap / 0.002 - (gap / 0.002).round()).abs() < 1e-6 && *gap > 0.001;
    assert!(gaps.len() == 4 && gaps.iter().all(on_grid), "{second}");
}

#[test]
fn signals_are_chosen_by_name_and_frames_by_their_number() {
    let domain = Domain::with(&[("first.csv", RECORDED)]);
    let publish = "--csv first.csv --signals status,level.y";
    published(&domain, publish, "--csv second.csv --every 2 --signals level.y --count 3");
    let expected = "time_s,cycle,level.y\n0.0,0,0.1\n0.0135,2,-1e-300\n0.2,4,-0.0\n";
    assert_eq!(domain.read("second.csv"), expected);
    published(&domain, publish, "--csv third.csv --count 5");
    assert!(
        domain.read("third.csv").starts_with("time_s,cycle,status,level.y\n0.0,0,36608.0,0.1\n")
    );

    domain.expect(
        "publish a/b --csv first.csv --signals levl",
        2,
        &["no column \"levl\"; there is: level.y"],
    );
}

#[test]
fn constants_have_names_and_a_truth_is_a_bool() {
    let domain = Domain::new();
    let _publisher =
        domain.start("publish there/again --value 1.5,true,-3 --signals level,full,low --rate 100");
    let ended = domain.run("subscribe there/again --count 1").expect_code(0);
    assert!(ended.stdout.ends_with("level=1.5 full=TRUE low=-3.0\n"), "{}", ended.stdout);
    domain.expect(
        "subscribe there/again --signals levle --count 1",
        2,
        &["did you mean \"level\"?"],
    );
    domain.expect(
        "subscribe there/again --signals volume --count 1",
        2,
        &["no signal \"volume\"; it has: level, full, low"],
    );
}

#[test]
fn what_would_publish_other_values_than_meant_is_refused() {
    let domain = Domain::new();
    domain.write("bare.csv", "1,2\n3,4\n");
    domain.write("changed.csv", "time_s,cycle,a\n0.0,0,1.0\ntime_s,cycle,a,b\n0.1,1,1.0,2.0\n");
    domain.write("back.csv", "time_s,a\n1.0,1\n0.5,2\n");
    domain.write("endless.csv", "time_s,a\n1.0,1\ninf,2\n");
    domain.write("times.csv", "time_s,cycle\n0.0,0\n");
    domain.write("huge.csv", "a\n1e400\n");
    domain.write("paced.csv", "time_s,a\n1.0,1\n1.5,2\n");
    for (arguments, says) in [
        ("--csv bare.csv", "bare.csv:1: the first row names the columns"),
        ("--csv changed.csv", "changed.csv:3: another header"),
        ("--csv back.csv", "back.csv:3: column \"time_s\": \"0.5\""),
        ("--csv endless.csv", "endless.csv:3: column \"time_s\": \"inf\""),
        ("--csv times.csv", "no column of values beside time_s and cycle"),
        ("--csv huge.csv", "huge.csv:2: column \"a\": \"1e400\" is beyond"),
        ("--csv /dev/zero", "/dev/zero:1: this is not text"),
        ("--csv .", "cannot read ."),
        ("--value 1e400", "beyond what a value can be"),
        ("--value yes", "true or false"),
        ("--value 1,2 --signals a", "names 1 signal for 2 channels"),
        ("--value 1,2 --signals a,a", "\"a\" twice"),
        ("--value 1,2 --signals time_s,a", "\"time_s\" is no name for a signal"),
        ("--wave sine --signals cycle", "\"cycle\" is no name for a signal"),
        ("--value 1,2,3 --signals a,,b", "name 2 is empty"),
        ("--value 200ms", "a TIME is a number of milliseconds"),
        ("--wave sine --amplitude inf", "give a number"),
        (
            "--value 1 --rate 500 --phase 2ms",
            "--phase 2.00 ms is not less than the 2.00 ms between",
        ),
        ("--value 1 --phase 3", "the unit is missing"),
        ("--csv paced.csv --phase 200us", "these keep their recorded pace; give --rate too"),
    ] {
        domain.expect(&format!("publish there/again {arguments}"), 2, &[says]);
    }
    for reserved in ["isochrone/x", "isochrone/level/telemetry"] {
        let says = ["for what nodes say of themselves"];
        domain.expect(&format!("publish {reserved} --value 1"), 2, &says);
    }
}
