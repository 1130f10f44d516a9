//! The page of a running node: what it says, and what it sets.

use std::time::Duration;

use crate::served::{Served, serve, served_tank};
use isochrone_testing::Domain;
use isochrone_testing::plants::tank;
use rustix::process::Signal;
use serde_json::{Value, json};

fn value(domain: &Domain, name: &str) -> String {
    domain.run(&format!("get tank {name}")).expect_code(0).stdout.trim().to_owned()
}

#[test]
fn a_parameter_is_set_with_the_token_alone_and_taken_back_and_the_journal_says_by_what() {
    let (domain, _node) = tank(&served_tank());
    let set = |rate: &str| json!({ "name": "ramp.setChangeRate", "value": rate });
    let readable = Served::start(&domain, "tank");
    let reply = readable.post("/set", &set("5"));
    assert_eq!(reply.status, 403);
    assert!(reply.body.contains("--allow-write"), "{reply:?}");
    readable.process.stop().expect_code(0);

    let served = Served::start(&domain, "tank --allow-write");
    let token = served.url.split_once("#token=").unwrap().1;
    let other = token.replace(|c: char| c.is_ascii_digit(), "a");
    let json = "Content-Type: application/json\r\n";
    for headers in [
        json.to_owned(),
        format!("{json}X-Isochrone-Token: \r\n"),
        format!("{json}X-Isochrone-Token: {other}\r\n"),
        format!("{json}X-Isochrone-Token: {token}0\r\n"),
        format!("{json}X-Isochrone-Token: {token}\r\nOrigin: http://evil.example\r\n"),
    ] {
        let reply = served.request("POST /set", &headers, &set("5").to_string());
        assert_eq!(reply.status, 403, "{headers} {reply:?}");
    }
    // The signals are known once the node has told them.
    served.events().until("state", |state| state["list"] != 0);
    for (name, text, says) in [
        ("ramp.setChangeRate", "60", "60 is outside of the limits: 0 to 50"),
        ("ramp.setChangeRate", "fast", "a value is true, false, a number"),
        ("ramp.value", "5", "is wired"),
        ("ramp.setChangeRat", "5", "no such signal"),
    ] {
        let reply = served.post("/set", &json!({ "name": name, "value": text }));
        assert_eq!(reply.status, 409, "{reply:?}");
        assert!(reply.body.contains(says), "{reply:?}");
    }
    assert_eq!(value(&domain, "ramp.setChangeRate"), "10");
    let done = served.post("/set", &set("7.5")).json();
    let told = done["told"].as_str().unwrap();
    assert!(told.starts_with("set ramp.setChangeRate to 7.5 1/s, from cycle "), "{told}");
    assert!(told.ends_with("(was 10 1/s)"), "{told}");
    assert_eq!(value(&domain, "ramp.setChangeRate"), "7.5");
    let warned =
        served.post("/set", &json!({ "name": "trim.setChangeRate", "value": "-1" })).json();
    assert!(
        warned["warnings"][0].as_str().is_some_and(|it| it.contains("setChangeRate is negative")),
        "{warned}"
    );
    let undone = served.post("/undo", &json!({ "transaction": done["transaction"] }));
    assert_eq!(undone.status, 200, "{undone:?}");
    assert_eq!(value(&domain, "ramp.setChangeRate"), "10");
    let journal = domain.stdout("journal tank");
    assert_eq!(journal.matches("(view)").count(), 3, "{journal}");
}

#[test]
fn a_curve_has_the_spike_of_a_single_cycle() {
    let (domain, _node, served) = serve("tank");
    let mut page = served.page(&[], &["scale.y", "trim.value"]);
    page.until("curves", |news| news["curves"]["scale.y"].is_array());
    // Sets values before a cycle, or, where that has begun on a busy machine, now; returns the cycle.
    let set = |values: &str, at: &str| {
        let mut done = domain.run(&format!("set tank {values} --at {at} --json"));
        if done.stderr.contains("it has begun") {
            done = domain.run(&format!("set tank {values} --json"));
        }
        let done = done.expect_code(0).json();
        done["tasks"]["fast"]["cycle"].as_u64().unwrap()
    };
    let intervals = |news: &Value, name: &str| {
        news["curves"][name].as_array().map_or(Vec::new(), |intervals| intervals.clone())
    };
    // Where the node misses the cycle of the spike, both values come at once; where it misses those around it, the
    // spike has an interval of its own.
    let spike = (1..=20).find_map(|attempt| {
        // Both wait for their cycles, one behind the other.
        let end = set("scale.x=9", "+600") + 1;
        let ended = set(&format!("scale.x=1 trim.value={attempt}"), &end.to_string());
        let mut found = None;
        page.until("curves", |news| {
            let mut new = intervals(news, "scale.y").into_iter();
            found = found.take().or_else(|| new.find(|it| it[1] == 1.0 && it[2] == 9.0));
            intervals(news, "trim.value").iter().any(|it| it[3] == f64::from(attempt))
        });
        found.filter(|_| ended == end)
    });
    let spike = spike.expect("an interval with the spike");
    // On a busy machine the task itself misses cycles, which is another flag.
    let flags = spike[4].as_u64().unwrap();
    assert_eq!(flags & !4, 0, "every cycle that ran was received");
}

#[test]
fn a_curve_for_which_no_room_is_left_is_said_to_have_none_until_another_page_is_closed() {
    let many = "[[block]]\nname = \"many\"\ntype = \"SawTooth\"\ncount = 80\nin = { incrementRange = 1 }\n";
    let (domain, _node) = tank(&(served_tank() + many));
    let served = Served::start(&domain, "tank");
    let page = |first: usize| {
        let names: Vec<_> = (first..first + 16).map(|n| format!("many.{n}.value")).collect();
        served.page(&[], &names.iter().map(String::as_str).collect::<Vec<_>>())
    };
    let mut pages: Vec<_> = (0..4).map(|number| page(number * 16)).collect();
    for (number, page) in pages.iter_mut().enumerate() {
        page.until("curves", |news| {
            news["curves"][format!("many.{}.value", number * 16)].is_array()
        });
    }
    let mut last = page(64);
    let refused = last.until("refused", |refused| !refused["many.79.value"].is_null());
    assert_eq!(refused.as_object().unwrap().len(), 16, "{refused}");
    let why = refused["many.64.value"].as_str().unwrap();
    assert!(why.contains("64 signals of task \"fast\""), "{why}");
    drop(pages);
    last.until("refused", |refused| refused.as_object().is_some_and(|it| it.is_empty()));
    last.until("curves", |news| news["curves"]["many.79.value"].is_array());
}

#[test]
fn the_jitter_is_of_every_cycle_while_a_page_is_open() {
    let (_domain, _node, served) = serve("tank");
    let mut page = served.events();
    let is_whole = |jitter: &Value| {
        let fast = &jitter["tasks"]["fast"];
        fast["every_cycle"] == true && fast["all"]["count"].as_u64() > Some(100)
    };
    let jitter = page.until("jitter", is_whole);
    let fast = &jitter["tasks"]["fast"];
    let classes = fast["classes"].as_array().unwrap().iter().map(|it| it.as_u64().unwrap());
    assert_eq!(Some(classes.sum::<u64>()), fast["all"]["count"].as_u64(), "{jitter}");
}

#[test]
fn a_node_that_is_killed_is_said_to_be_gone_and_its_curves_go_on_when_it_is_back() {
    let (domain, first, served) = serve("tank");
    let mut page = served.page(&["scale.y"], &[]);
    // One of its own: which of a row and an interval comes first is open.
    let mut chart = served.page(&[], &["scale.y"]);
    page.until("rows", |rows| rows["scale.y"]["value"] == "1");
    chart.until("curves", |news| news["curves"]["scale.y"].is_array());
    first.kill();
    let gone = page.until("state", |state| state["state"] != "runs");
    assert!(gone["why"].as_str().is_some_and(|why| why.contains("\"tank\"")), "{gone}");
    page.until("rows", |rows| rows["scale.y"]["value"].is_null());
    let _second = domain.start_node("tank.toml", &served_tank(), "");
    page.until("state", |state| state["state"] == "runs");
    page.until("rows", |rows| rows["scale.y"]["value"] == "1");
    // The gap is a gap.
    chart.until("curves", |news| {
        let new = news["curves"]["scale.y"].as_array();
        new.is_some_and(|new| new.iter().any(|it| it[4].as_u64().is_some_and(|it| it & 1 == 1)))
    });
}

#[test]
fn a_node_that_is_stopped_is_said_to_be_silent_and_how_to_go_on_and_its_curves_show_what_it_missed()
{
    let (_domain, node, served) = serve("tank");
    let mut page = served.page(&["scale.y"], &["scale.y"]);
    let missed = |news: &Value| {
        let new = news["curves"]["scale.y"].as_array();
        new.is_some_and(|new| new.iter().any(|it| it[4].as_u64().is_some_and(|it| it & 4 == 4)))
    };
    page.until("curves", |news| news["curves"]["scale.y"].is_array());
    node.signal(Signal::STOP);
    std::thread::sleep(Duration::from_millis(100));
    node.signal(Signal::CONT);
    page.until("curves", missed);

    node.signal(Signal::STOP);
    let silent = page.until("state", |state| state["state"] == "silent");
    let why = silent["why"].as_str().unwrap();
    assert!(why.contains("has said nothing for more than a second"), "{why}");
    assert!(why.contains(&format!("is stopped: continue it (kill -CONT {})", node.id())), "{why}");
    page.until("rows", |rows| rows["scale.y"]["value"].is_null());
    node.signal(Signal::CONT);
    page.until("state", |state| state["state"] == "runs");
    page.until("rows", |rows| rows["scale.y"]["value"] == "1");
}

#[test]
fn a_value_for_which_no_room_is_left_says_why_it_is_missing_until_another_page_is_closed() {
    let many = "[[block]]\nname = \"many\"\ntype = \"SawTooth\"\ncount = 400\nin = { incrementRange = 1 }\n";
    let (domain, _node) = tank(&(served_tank() + many));
    let served = Served::start(&domain, "tank");
    let pins = ["value", "incrementRange", "numberSteps"];
    let names = pins.iter().flat_map(|pin| (0..400).map(move |n| format!("many.{n}.{pin}")));
    let names: Vec<_> = names.collect();
    let mut pages: Vec<_> = names
        .chunks(120)
        .map(|part| served.page(&part.iter().map(String::as_str).collect::<Vec<_>>(), &[]))
        .collect();
    let last = &mut pages.pop().unwrap();
    let name = names.last().unwrap();
    let rows = last.until("rows", |rows| rows[name]["why"].is_string());
    assert!(rows[name]["why"].as_str().unwrap().contains("more than 1000 values"), "{rows}");
    assert!(rows[name]["value"].is_null(), "{rows}");
    drop(pages);
    last.until("rows", |rows| rows[name]["value"].is_string() && rows[name]["why"].is_null());
}

#[test]
fn without_a_name_the_only_node_is_shown_and_ctrl_c_ends_it_though_pages_are_open() {
    let domain = Domain::new();
    domain.expect("view --port 0", 3, &["no node runs in this domain"]);
    let tank = domain.start_node("tank.toml", &served_tank(), "");
    domain.expect("view tnak --port 0", 3, &["did you mean \"tank\"?"]);
    let served = Served::start(&domain, "");
    let port = served.port;
    let mut pages: Vec<_> = (0..3).map(|_| served.page(&[], &[])).collect();
    let state = pages[0].until("state", |state| state["node"]["node"] == "tank");
    assert_eq!(state["node"]["tasks"][0]["name"], "fast");
    let busy = domain.run(&format!("view tank --port {port}")).expect_code(1);
    let says = format!("port {port} is in use; give another one with --port");
    assert!(busy.stderr.contains(&says), "{}", busy.stderr);

    let other = domain.start_node("other.toml", &served_tank().replace("tank", "other"), "");
    domain.expect("view --port 0", 2, &["name one: other, tank"]);

    served.process.signal(Signal::INT);
    served.process.finish().expect_code(0);
    pages.into_iter().for_each(|page| drop(page.read_to_end()));
    other.stop().expect_code(0);
    tank.stop().expect_code(0);
    assert!(domain.leftovers().is_empty(), "{:?}", domain.leftovers());
}
