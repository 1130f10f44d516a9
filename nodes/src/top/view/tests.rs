//! Tests of what the screen shows.

mod dialogs;
mod tasks;

use isochrone_control::{
    Action, ActiveAlarm, DescribeResult, Entry, Force, Hold, Role, SignalDescription, Value, Values,
};
use isochrone_timing::CycleStartCounts;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::buffer::Buffer;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use ratatui::style::Color;

use super::*;
use crate::base::session::{
    Absence, CompletedOrder, FollowSample, News, Order, ReadValues, Sample,
};
use crate::top::fixtures::{a_minute_of_samples, alarm, entry, force, node, read, signal};
use crate::top::input::action;

const NOW_NS: u64 = 100_000_000_000;

/// A node with an input that is not ok, a forced output, an alarm and a few hundred signals more.
fn plant() -> Model {
    let mut model = Model::default();
    let mut signals = vec![
        signal("level", Role::Input, "LREAL"),
        signal("ramp.setChangeRate", Role::Parameter, "LREAL"),
        signal("ramp.delayedValue", Role::Output, "LREAL"),
        signal("ramp.status", Role::Output, "WORD"),
    ];
    signals.extend((0..300).map(|n| signal(&format!("bank.{n}.y"), Role::Output, "LREAL")));
    model.take(News::Joined { node: node(1), signals });
    model.take(News::Alarms(vec![alarm("level", None), alarm("scale", Some(0x8203))]));
    model.take(News::Forces(vec![force("ramp.delayedValue", 1.25)]));
    model.take(News::Timing(a_minute_of_samples(NOW_NS)));
    model.tick(NOW_NS);
    for value in [1.0, 2.0, 4.0] {
        let values = [
            ("level", Value::Number(value)),
            ("level.ok", Value::Bool(false)),
            ("ramp.setChangeRate", Value::Number(5.0)),
            ("ramp.delayedValue", Value::Number(1.25)),
            ("ramp.status", Value::Integer(0x8203)),
        ];
        let quality = [
            ("level".to_owned(), vec!["STALE".to_owned()]),
            ("bank.1.y".to_owned(), vec!["STALE".to_owned(), "UPSTREAM".to_owned()]),
        ];
        model.take(News::Values(ReadValues { quality: quality.into(), ..read(values) }));
    }
    model
}

fn buffer(model: &mut Model, size: (u16, u16), palette: Palette) -> Buffer {
    let mut terminal = Terminal::new(TestBackend::new(size.0, size.1)).unwrap();
    model.set_rows(rows(Rect::new(0, 0, size.0, size.1), model));
    terminal.draw(|frame| draw(frame, model, palette)).unwrap();
    terminal.backend().buffer().clone()
}

fn lines(model: &mut Model, size: (u16, u16)) -> Vec<String> {
    let buffer = buffer(model, size, Palette::Plain);
    let line = |y| (0..size.0).map(|x| buffer[(x, y)].symbol()).collect::<String>();
    (0..size.1).map(|y| line(y).trim_end().to_owned()).collect()
}

fn shown(model: &mut Model) -> String {
    lines(model, (80, 24)).join("\n")
}

#[track_caller]
fn assert_shows(model: &mut Model, texts: &[&str]) {
    let shown = shown(model);
    for text in texts {
        assert!(shown.contains(text), "{text}\n{shown}");
    }
}

/// Presses keys; returns the last order that this gave.
fn press(model: &mut Model, keys: &str) -> Option<Order> {
    let mut order = None;
    for key in keys.chars() {
        let code = match key {
            '\n' => KeyCode::Enter,
            '\u{1b}' => KeyCode::Esc,
            '\u{8}' => KeyCode::Backspace,
            '\t' => KeyCode::Tab,
            '↓' => KeyCode::Down,
            key => KeyCode::Char(key),
        };
        let action = action(model.focus(), KeyEvent::new(code, KeyModifiers::NONE));
        order = action.and_then(|action| model.act(action));
    }
    order
}

#[test]
fn signals_have_marks_roles_values_units_and_a_trend() {
    let lines = lines(&mut plant(), (80, 24));
    assert!(lines[0].starts_with("tank  tank.toml  set and force"), "{lines:#?}");
    assert_eq!(lines[1], " 1 Signals   2 Tasks   3 Alarms (2)   4 Forces (1)");
    let row = |name: &str| {
        let row = lines.iter().find(|line| line.get(3..).is_some_and(|it| it.starts_with(name)));
        row.unwrap_or_else(|| panic!("{name}\n{lines:#?}")).split_whitespace().collect::<Vec<_>>()
    };
    assert_eq!(row("level"), ["!", "level", "input", "4", "m/s", "▁▃█"]);
    assert_eq!(row("ramp.setChange"), ["ramp.setChangeRate", "parameter", "5", "m/s", "▁▁▁"]);
    assert_eq!(row("ramp.delayed"), ["F", "ramp.delayedValue", "output", "1.25", "m/s", "▁▁▁"]);
    assert_eq!(row("ramp.status")[2], "16#8203");
    assert_eq!(row("bank.0.y"), ["bank.0.y", "output", "-", "m/s"], "not known is no 0");
    assert!(lines[21].contains("level  not ok  STALE  LREAL  task fast  what "), "{lines:#?}");
    assert_eq!(row("bank.1.y")[..2], ["?", "bank.1.y"], "computed from what is stale");
}

#[test]
fn nothing_is_drawn_with_a_colour_where_none_is_wanted_and_never_with_a_background() {
    for page in Page::ALL {
        let mut model = plant();
        model.page = page;
        let plain = buffer(&mut model, (80, 24), Palette::Plain);
        assert!(plain.content().iter().all(|cell| cell.fg == Color::Reset), "{page:?}");
        let colour = buffer(&mut model, (80, 24), Palette::Colour);
        assert!(colour.content().iter().all(|cell| cell.bg == Color::Reset), "{page:?}");
        assert!(colour.content().iter().any(|cell| cell.fg == Color::Red), "{page:?}");
        let text = |buffer: &Buffer| {
            buffer.content().iter().map(|cell| cell.symbol().to_owned()).collect::<String>()
        };
        assert_eq!(text(&plain), text(&colour), "colour says nothing that a letter does not");
    }
}

#[test]
fn an_alarm_of_many_words_is_whole_where_there_is_room_and_else_says_that_it_is_cut() {
    let mut model = plant();
    let meaning = "what is wrong with it ".repeat(20) + "and what to do";
    model.take(News::Alarms(vec![ActiveAlarm { meaning, ..alarm("level", None) }]));
    press(&mut model, "3");
    assert_shows(&mut model, &["and what to do"]);
    let small = lines(&mut model, (80, 12));
    assert!(
        small.iter().any(|line| line.chars().count() == 80 && line.ends_with('…')),
        "{small:#?}"
    );
    assert!(small.iter().any(|line| line.starts_with("level ")), "{small:#?}");
}

#[test]
fn alarms_and_forces_have_pages_of_their_own() {
    let mut model = plant();
    press(&mut model, "3");
    assert_shows(&mut model, &["scale", "16#8203", "11-14 22:13:20", "what is wrong with scale"]);
    // The selected one stands below the list, whole.
    assert_shows(&mut model, &["task fast, since cycle 42, 2023-11-14T22:13:20.000Z: what is"]);
    press(&mut model, "\t");
    assert_shows(&mut model, &["ramp.delayedValue", "1.25", "time left", "0 s fast", "ann"]);
    assert_shows(&mut model, &["since cycle 100 of task fast, until cycle 5100"]);
    let ends = Force { until_cycle: Some(123_456 + 12_000), ..force("level", 1.0) };
    let held = Force { until_cycle: None, ..force("ramp.delayedValue", 1.25) };
    model.take(News::Forces(vec![ends, held]));
    assert_shows(&mut model, &["12 s fast", "held fast"]);
    model.take(News::Alarms(Vec::new()));
    model.take(News::Forces(Vec::new()));
    assert_shows(&mut model, &["nothing is forced", " 3 Alarms   4 Forces"]);
    press(&mut model, "3");
    assert_shows(&mut model, &["nothing is wrong"]);
}

#[test]
fn what_happened_is_said_for_a_while_and_on_its_page() {
    let mut model = plant();
    press(&mut model, "i\n");
    model.take(News::Described(node(1)));
    model.tick(NOW_NS + 10_000_000_000);
    assert_shows(&mut model, &["level is no parameter"]);
    model.take(News::Described(node(1)));
    model.tick(NOW_NS + 16_000_000_000);
    assert!(!shown(&mut model).contains("no parameter"));
    press(&mut model, "\n");
    assert_shows(&mut model, &["level is no parameter"]);
    press(&mut model, "4");
    assert!(!shown(&mut model).contains("no parameter"));
}

#[test]
fn a_screen_that_is_too_small_says_so_and_shows_no_half_of_a_value() {
    let mut model = plant();
    for (width, height) in [(40, 10), (20, 5), (79, 24), (80, 11)] {
        let text = lines(&mut model, (width, height)).join(" ");
        let said = format!("top needs 80x12 characters, and this terminal has {width}x{height}.");
        assert!(text.contains(&said), "{text}");
        assert!(!text.contains("level") && !fits(Rect::new(0, 0, width, height)), "{text}");
    }
    assert!(lines(&mut model, (80, 12)).iter().any(|line| line.contains("m/s")));
    let values = [("level", Value::Integer(-2_147_483_647))];
    let signals = vec![signal("level", Role::Input, "TIME")];
    model.take(News::Joined { node: node(1), signals });
    model.take(News::Values(read(values)));
    assert_shows(&mut model, &["T#-24d20h31m2…"]);
}

#[test]
fn an_error_of_the_node_is_shown_whole_and_can_be_scrolled() {
    let mut model = plant();
    let order = Order::Undo { transaction: 3, what: String::new() };
    let why: String = (0..60).map(|n| format!("finding {n} is wrong in some way\n")).collect();
    model.take(News::Refused { order, why });
    assert_shows(&mut model, &["The node says", "Not done: undo transaction 3", "finding 0 "]);
    press(&mut model, &"↓".repeat(500));
    assert_shows(&mut model, &["finding 59 "]);
    press(&mut model, "\n");
    assert!(!shown(&mut model).contains("finding"));
}

#[test]
fn a_search_lists_what_contains_it_while_it_is_typed_and_escape_takes_it_back() {
    let mut model = plant();
    press(&mut model, "/BANK.29");
    assert_shows(&mut model, &["/BANK.29", "11 of 304 listed", "bank.299.y"]);
    press(&mut model, "\n");
    assert_eq!(model.focus(), Focus::List);
    press(&mut model, "/9");
    assert_shows(&mut model, &["/BANK.299", "1 of 304 listed"]);
    press(&mut model, "\u{1b}");
    assert_shows(&mut model, &["/BANK.29", "11 of 304 listed"]);
    press(&mut model, "\u{1b}");
    assert_shows(&mut model, &["304 of 304 listed"]);
}

#[test]
fn a_node_that_is_gone_is_said_and_its_last_values_are_not_shown_as_new() {
    let mut model = plant();
    model.take(News::Lost { absence: Absence::Ended, why: "node \"tank\" ended".into() });
    let text = shown(&mut model);
    assert!(text.contains("looking for the node: node \"tank\" ended"), "{text}");
    assert!(
        text.starts_with(
            "tank  tank.toml  has ended\n 1 Signals   2 Tasks   3 Alarms   4 Forces\n"
        ),
        "{text}"
    );
    assert!(!text.contains("1.25"), "{text}");
    model.take(News::Joined { node: node(2), signals: vec![signal("new", Role::Input, "INT")] });
    assert_shows(&mut model, &["node \"tank\" answers again", "new", "1 of 1 listed"]);
    model.page = Page::Tasks;
    model.tick(NOW_NS * 2);
    assert!(!shown(&mut model).contains("3000/59981"), "the timing was that of another run");
}

#[test]
fn values_that_are_old_because_the_node_is_silent_are_said_to_be() {
    let mut model = plant();
    model.tick(NOW_NS + 1_000_000_000);
    model.tick(NOW_NS + 1_900_000_000);
    assert!(!shown(&mut model).contains("no answer"));
    model.tick(NOW_NS + 4_000_000_000);
    assert_shows(&mut model, &["no answer for 3.0 s: the values are old"]);
    model.take(News::Described(node(1)));
    model.tick(NOW_NS + 5_000_000_000);
    assert!(!shown(&mut model).contains("no answer"));
}

#[test]
fn names_are_as_wide_as_they_need_and_long_ones_keep_their_pins() {
    let row = |model: &mut Model, size, pin: &str| {
        let lines = lines(model, size);
        let row = lines.iter().find(|line| line.contains(pin));
        row.unwrap_or_else(|| panic!("{pin}\n{lines:#?}")).clone()
    };
    let mut model = plant();
    assert!(row(&mut model, (160, 50), "setChangeRate").contains("setChangeRate   parameter"));
    let block = "cooling_water_return_temperature_limiter";
    let pins = ["error", "setChangeRate"].map(|pin| format!("{block}.{pin}"));
    let signals = pins.map(|name| signal(&name, Role::Parameter, "LREAL")).to_vec();
    model.take(News::Joined { node: node(1), signals });
    let narrow = row(&mut model, (80, 24), "….setChangeRate parameter");
    assert!(narrow.contains("cooling_water"), "{narrow}");
    row(&mut model, (160, 50), &format!("{block}.setChangeRate parameter"));
    let detail = lines(&mut model, (80, 24))[21].clone();
    assert!(detail.ends_with('…') && detail.chars().count() == 80, "{detail}");
}

#[test]
fn names_that_command_a_terminal_are_shown_as_text() {
    let mut model = Model::default();
    let signals = vec![signal("a\u{1b}[2Jb", Role::Output, "LREAL")];
    model.take(News::Joined { node: node(1), signals });
    assert_shows(&mut model, &[r"a\u001b[2Jb"]);
}

#[test]
fn everything_can_be_drawn_on_a_screen_of_any_size() {
    let mut model = plant();
    let why = "a long reason ".repeat(50);
    for keys in ["", "2", "3", "4", "?", "\u{1b}1p\n", "1", "\n"] {
        press(&mut model, keys);
        for width in [1, 7, 39, 80, 200] {
            for height in [1, 3, 9, 24, 50] {
                buffer(&mut model, (width, height), Palette::Colour);
            }
        }
    }
    model.take(News::Refused { order: Order::Undo { transaction: 1, what: String::new() }, why });
    for size in [(1, 1), (5, 3), (80, 4)] {
        press(&mut model, "↓");
        buffer(&mut model, size, Palette::Plain);
    }
}
