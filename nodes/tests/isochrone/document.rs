//! A configuration as a page to print.

use isochrone_testing::Domain;

/// Two tasks, every kind of thing, and texts that would be markup elsewhere.
const PLANT: &str = r#"
[node]
name = "tank"
control = "force"
[limits]
"ramp.setChangeRate" = [0.0, 2.0]
[[protect]]
names = ["scale.*"]
[[task]]
name = "fast"
period = "2ms"
[[task]]
name = "slow"
period = "20ms"
[[input]]
name = "raw"
service = "plant/raw"
task = "fast"
signal = "lev<el>\"&"
unit = "<m>"
range = [0.0, 20.0]
max_age = "100ms"
comment = "</td><script>alert('LT-101')</script>"
[[input]]
name = "flow"
service = "plant/flow"
task = "fast"
[[input]]
name = "pump"
type = "BOOL"
service = "plant/pump"
task = "fast"
[[input]]
name = "by_hand"
task = "fast"
[[variable]]
name = "setpoint"
initial = 1.0
range = [0.0, 1.5]
task = "fast"
unit = "m"
comment = "Wanted level"
[[block]]
name = "scale"
type = "ScaleLinear"
task = "fast"
unit = "m"
comment = "From current to level"
in = { x = "raw", x1 = 4.0, y1 = 0.0, x2 = 20.0, y2 = 1.6, yMin = 0.0, yMax = 1.6 }
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
task = "fast"
units = { setChangeRate = "m/s" }
in = { value = "setpoint", setChangeRate = 0.5 }
[[block]]
name = "trend"
type = "LimRateOfChangeCI"
task = "slow"
count = 1000
[block.in]
value = "ramp.delayedValue"
setChangeRate = 0.1
[block.in.7]
setChangeRate = 0.7
[[output]]
service = "plant/level"
task = "fast"
comment = "For the historian"
signals = ["raw", "raw.ok", "scale.y", "setpoint", "flow", "pump", "by_hand"]
[[output]]
service = "plant/trend"
task = "slow"
unit = "m"
signals = ["trend.0.delayedValue", "trend.999.delayedValue"]
"#;

fn page(domain: &Domain) -> String {
    domain.write("plant.toml", PLANT);
    domain.run("document plant.toml -o plant.html").expect_code(0);
    domain.read("plant.html")
}

/// The cells of the rows of a table whose caption begins like this.
fn rows(page: &str, caption: &str) -> Vec<Vec<String>> {
    let table = page.split("<caption>").find(|table| table.starts_with(caption));
    let table = table.unwrap_or_else(|| panic!("no table {caption}: {page}"));
    let body = table.split("</table>").next().unwrap().split("<tbody>").nth(1).unwrap();
    let cell = |cell: &str| {
        let text = cell.split_once('>').map_or(cell, |(_, text)| text);
        text.split("</t").next().unwrap().to_owned()
    };
    let row = |row: &str| {
        let row = row.replace("<th", "<td");
        row.split("<td").skip(1).map(cell).collect()
    };
    body.split("</tr>").map(row).filter(|row: &Vec<_>| !row.is_empty()).collect()
}

#[track_caller]
fn has(rows: &[Vec<String>], row: &[&str]) {
    assert!(rows.iter().any(|known| known.iter().eq(row)), "{row:?}: {rows:#?}");
}

#[test]
fn the_page_has_every_part_of_the_configuration_with_units_and_comments() {
    let domain = Domain::new();
    let page = page(&domain);
    has(
        &rows(&page, "Given by operators; task fast"),
        &["setpoint", "LREAL", "m", "1.0", "0.0 to 1.5", "Wanted level"],
    );
    let inputs = &rows(&page, "Task fast")[0];
    assert_eq!(inputs[..3], ["raw", "LREAL", "&lt;m&gt;"]);
    let others = &rows(&page, "Task fast")[1..];
    let units: Vec<&str> = others.iter().map(|row| row[2].as_str()).collect();
    assert_eq!(units, ["announced", "", ""]);
    assert_eq!(inputs[4..6], ["0.0 to 20.0", "0.0; stale after 100ms: holds its last value"]);
    let scale = rows(&page, "task fast, number 1 of 2 in the order of execution");
    has(&scale, &["x", "in", "LREAL", "\u{2190} raw", "&lt;m&gt;", "Signal to scale."]);
    has(&scale, &["x1", "in", "LREAL", "4.0", "", "First point, abscissa."]);
    assert_eq!(scale[7][..5], ["y", "out", "LREAL", "\u{2192} plant/level[2]", "m"]);
    let ramp = rows(&page, "task fast, number 2 of 2");
    assert_eq!(ramp[1][..5], ["setChangeRate", "in", "LREAL", "0.5", "m/s"]);
    assert_eq!(ramp[2][3], "0.0 (default)");
    let output = rows(&page, "One frame every 20ms, by task slow");
    has(&output, &["1", "trend.999.delayedValue", "LREAL", "m"]);
    has(&rows(&page, "Limits"), &["ramp.setChangeRate", "0.0", "2.0"]);
    has(&rows(&page, "Protected"), &["scale.*"]);
    for text in ["From current to level", "For the historian", "signals forced", "every 2ms"] {
        assert!(page.contains(text), "{text}");
    }
}

#[test]
fn instances_that_are_alike_are_one_table() {
    let domain = Domain::new();
    let page = page(&domain);
    assert!(page.contains("<code>trend.0 to trend.6, trend.8 to trend.999</code>"), "{page}");
    let alike = rows(&page, "999 instances alike, {i} is their number; task slow");
    assert_eq!(alike[0][3], "\u{2190} ramp.delayedValue of task fast");
    assert_eq!(alike[5][3], "\u{2192} plant/trend[0\u{2026}1]");
    let other = rows(&page, "task slow, number 8 of 1000");
    assert_eq!(other[1][3], "0.7");
}

#[test]
fn the_cross_references_say_who_writes_and_who_reads_each_signal() {
    let domain = Domain::new();
    let references = rows(&page(&domain), "Inputs, variables, and the outputs");
    has(&references, &["setpoint", "m", "operators", "ramp.value, plant/level[3]"]);
    has(&references, &["raw.ok", "", "task fast", "plant/level[1]"]);
    has(&references, &["scale.y", "m", "scale, task fast", "plant/level[2]"]);
    has(&references, &["ramp.delayedValue", "", "ramp, task fast", "trend.0\u{2026}999.value"]);
    let raw = references.iter().find(|row| row[0] == "raw").unwrap();
    assert_eq!(raw[2..], ["plant/raw[lev&lt;el&gt;&quot;&amp;]", "scale.x, plant/level[0]"]);
}

#[test]
fn alarms_are_readers_and_their_signals_are_written_by_them() {
    let alarms = "[[alarm]]\nname = \"high\"\nwhen = \"scale.y > raw\"\n\
                  [[output]]\nservice = \"plant/alarms\"\ntask = \"fast\"\n\
                  signals = [\"high.active\", \"high.ok\"]\n";
    let domain = Domain::with(&[("alarms.toml", &(PLANT.to_owned() + alarms))]);
    domain.run("document alarms.toml -o alarms.html").expect_code(0);
    let references = rows(&domain.read("alarms.html"), "Inputs, variables, and the outputs");
    let row = |name: &str| references.iter().find(|row| row[0] == name).unwrap();
    for signal in ["scale.y", "raw"] {
        assert!(row(signal)[3].contains("alarm high"), "{:?}", row(signal));
    }
    for (signal, channel) in [("high.active", 0), ("high.ok", 1)] {
        let (by, read) = ("alarm high, task fast", format!("plant/alarms[{channel}]"));
        assert_eq!(row(signal)[2..], [by, &read]);
    }
}

#[test]
fn no_text_becomes_markup_and_the_page_fetches_nothing() {
    let domain = Domain::new();
    let page = page(&domain);
    assert!(!page.contains("<script"), "{page}");
    assert!(page.contains("&lt;/td&gt;&lt;script&gt;alert(&#39;LT-101&#39;)"), "{page}");
    assert!(page.contains("default-src 'none'"));
    assert!(!page.contains("http:") && !page.contains("https:") && !page.contains("url("));
}

#[test]
fn the_page_is_that_of_its_configuration_and_of_nothing_else() {
    let domain = Domain::new();
    let first = page(&domain);
    assert_eq!(page(&domain), first);
    let checked = domain.answer("check plant.toml --json");
    assert_eq!(checked["node"], "tank");
    let sum = std::process::Command::new("sha256sum").arg(domain.path("plant.toml")).output();
    let sum = String::from_utf8(sum.unwrap().stdout).unwrap();
    assert!(first.contains(&format!("<code>{}</code>", sum.split(' ').next().unwrap())), "{sum}");
    assert!(first.contains(&format!("isochrone {}", env!("CARGO_PKG_VERSION"))));
}

#[test]
fn the_configuration_is_not_overwritten_and_errors_leave_the_old_page() {
    let domain = Domain::new();
    let first = page(&domain);
    domain.expect(
        "document plant.toml -o plant.toml",
        2,
        &["plant.toml would overwrite what is read"],
    );
    assert_eq!(domain.read("plant.toml"), PLANT);
    domain.write("broken.toml", PLANT.replace("ScaleLinear", "ScaleLinea"));
    domain.expect("document broken.toml -o plant.html", 2, &["did you mean \"ScaleLinear\"?"]);
    assert_eq!(domain.read("plant.html"), first);
    domain.expect("document plant.toml -o missing/plant.html", 2, &["there is no folder missing"]);
    assert_eq!(domain.stdout("document plant.toml -o /dev/stdout"), first);
}
