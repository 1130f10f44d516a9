//! `simulate --plot`: what is drawn, and what is refused before anything runs.

use isochrone_testing::{Domain, Plant, assert_says};
use serde_json::{Value, json};

/// Signals of several units and types.
fn wiring() -> Plant {
    Plant::new("wire")
        .task("t", "1ms")
        .column("a", "LREAL")
        .with("unit = \"m\"")
        .column("c", "LREAL")
        .with("unit = \"m\"")
        .column("n", "INT")
        .column("b", "BOOL")
        .block("w", "ScaleLinear", "x = \"c\", x1 = 0, y1 = 0, x2 = 1, y2 = 1, yMin = 0, yMax = 5")
        .output("out", &["a", "c", "n", "b", "w.status"])
}

const ROWS: &str = "a,c,n,b\n1,2,3,0\n2,9,-3,1\n1,2,3,0\n";

fn wire() -> Domain {
    let folder = Domain::with(&[("wire.toml", &wiring())]);
    folder.write("in.csv", ROWS);
    folder
}

/// What a page carries for its script.
fn data(page: &str) -> Value {
    let (_, data) = page.split_once("id=\"data\">").unwrap();
    serde_json::from_str(data.split_once("</script>").unwrap().0).unwrap()
}

const SIMULATE: &str = "simulate wire.toml --inputs in.csv --output out.csv";

#[test]
fn one_run_writes_the_rows_and_the_picture_of_all_outputs() {
    let folder = wire();
    folder.write("out.svg", "old");
    folder.run(&format!("{SIMULATE} --plot out.svg")).expect_code(0);
    assert_eq!(folder.read("out.csv").lines().count(), 4);
    let svg = folder.read("out.svg");
    assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"), "{svg}");
    let texts: Vec<&str> = svg.lines().filter(|line| !line.starts_with('<')).collect();
    assert_says(
        &texts.join(" "),
        &["wire", "simulated: 3 cycles of 1 ms", "16#6002", "FALSE", "TRUE", "time in us"],
    );
    // A pane for metres, one for what has no unit, one of words, and the lane, in this order.
    let at = |name: &str| texts.iter().position(|text| *text == name).unwrap();
    let order = ["a", "c", "n", "w.status", "b"].map(at);
    assert!(order.is_sorted(), "{order:?}");
}

#[test]
fn the_page_has_the_picture_and_the_values_and_fetches_nothing() {
    let folder = wire();
    folder.run(&format!("{SIMULATE} --plot out.html --signals a,b")).expect_code(0);
    let page = folder.read("out.html");
    assert_says(&page, &["default-src 'none'", "<svg ", "simulated: 3 cycles of 1 ms"]);
    let signals = data(&page)["signals"].clone();
    let names = signals.as_array().unwrap().iter().map(|it| &it["name"]).collect::<Vec<_>>();
    assert_eq!(names, ["a", "b"]);
    assert_eq!(signals[0]["buckets"], json!([1.0, 2.0, 1.0]));
    assert_eq!(signals[1]["buckets"], json!([0.0, 1.0, 0.0]));
    assert!(!page.contains("src=") && !page.contains("url("), "{page}");
}

/// A signal that is TRUE in one cycle of a task, between two cycles of a slower one.
fn spike() -> Plant {
    Plant::new("spike")
        .task("slow", "10ms")
        .task("fast", "1ms")
        .with("phase = \"500us\"")
        .on("fast")
        .block("late", "TON", "IN = true, PT = \"53ms\"")
        .block("spike", "R_TRIG", "CLK = \"late.Q\"")
        .output("fast", &["spike.Q"])
        .on("slow")
        .saw("saw", "incrementRange = 1, endlessSteps = true")
        .output("slow", &["saw.value"])
}

#[test]
fn a_signal_is_drawn_with_the_cycles_of_its_own_task_whichever_makes_the_rows() {
    let folder = Domain::with(&[("spike.toml", &spike())]);
    folder.run("simulate spike.toml --cycles 10 --output slow.csv --plot slow.html").expect_code(0);
    assert!(!folder.read("slow.csv").contains("1.0,1"), "{}", folder.read("slow.csv"));
    let page = data(&folder.read("slow.html"));
    let [fast, slow] = [0, 1].map(|index| page["signals"][index]["buckets"].as_array().unwrap());
    // Cycles of `fast` from 0.5 ms on, up to the last one of `slow` at 90 ms.
    let up = |row: &usize| fast[*row] == 1.0;
    assert_eq!((fast.len(), (0..fast.len()).filter(up).collect()), (90, vec![53]));
    assert_eq!(slow.len(), 10);
    assert_eq!(page["tasks"][1]["begin"], 0.0005);
    folder
        .run("simulate spike.toml --task fast --cycles 90 --output - --plot f.html")
        .expect_code(0);
    let page = data(&folder.read("f.html"));
    assert_eq!(page["signals"][0]["buckets"], json!(fast));
    assert_eq!(page["tasks"][1]["begin"], 0.0, "the first cycle of --task is at 0");
}

#[test]
fn what_is_no_number_among_many_cycles_is_in_the_page() {
    let folder = wire();
    let row = |cycle: i32| if cycle == 4_000 { "NaN,2,3,0\n" } else { "1,2,3,0\n" };
    folder.write("in.csv", "a,c,n,b\n".to_owned() + &(0..5_000).map(row).collect::<String>());
    folder.run(&format!("{SIMULATE} --plot out.html --signals a,c")).expect_code(0);
    let page = folder.read("out.html");
    assert_says(&page, &["a (NaN or infinite under the bar)"]);
    let page = data(&page);
    let buckets = page["signals"][0]["buckets"].as_array().unwrap();
    let odd: Vec<_> = (0..buckets.len()).filter(|it| buckets[*it] != 1.0).collect();
    assert_eq!((odd, &buckets[2_000]), (vec![2_000], &json!([1.0, 1.0, 1])));
}

#[test]
fn what_cannot_be_drawn_is_refused_with_the_way_out_and_nothing_is_written() {
    let folder = wire();
    for (options, says) in [
        ("--plot out.png", "out.png: end the name with .svg or .html"),
        ("--plot out.svg --signals aa", "aa"),
        ("--plot none/out.svg", "cannot write none/out.svg: there is no folder none"),
        ("--signals a", "--plot"),
        ("--output two.svg --plot ./two.svg", "stands for two results"),
    ] {
        let ended = folder.run(&format!("simulate wire.toml --inputs in.csv {options}")).refused(2);
        assert_says(&ended, &[says]);
    }
    let names: Vec<String> = (0..25).map(|index| format!("x{index}")).collect();
    let many = names.iter().fold(Plant::new("many").task("t", "1ms"), |it, n| it.column(n, "INT"));
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    folder.write("many.toml", many.output("out", &names));
    let run = |options: &str| folder.run(&format!("simulate many.toml --cycles 3 {options}"));
    assert_says(
        &run("--plot out.svg").refused(2),
        &["these are 25 signals, and a picture has room for 24: name some with --signals"],
    );
    assert!(!folder.path("out.svg").exists());
    run("--plot out.svg --signals x1*").expect_code(0);
    assert!(folder.read("out.svg").contains("x19"));
}

#[test]
fn a_picture_that_finds_no_room_is_an_error() {
    let ended = wire().run(&format!("{SIMULATE} --plot /dev/full")).refused(2);
    assert_says(&ended, &["/dev/full: end the name with .svg or .html"]);
    let folder = wire();
    std::os::unix::fs::symlink("/dev/full", folder.path("full.svg")).unwrap();
    let ended = folder.run(&format!("{SIMULATE} --plot full.svg")).expect_code(1);
    assert_says(&ended.stderr, &["cannot write full.svg: No space left on device"]);
}
