//! Files as nobody writes them: the program says what is wrong, briefly, and does not pass on what
//! they say to the terminal.

use isochrone_testing::{Domain, Ended, assert_says};

/// What is printed is read by people.
const READABLE_BYTES: usize = 100_000;

#[track_caller]
fn check(folder: &Domain, file: &str) -> Ended {
    let ran = folder.run(&format!("check {file}"));
    assert!(ran.stderr.len() < READABLE_BYTES, "{} bytes", ran.stderr.len());
    ran
}

#[test]
fn an_error_in_a_line_of_any_length_is_shown_where_it_is() {
    for (filler, count) in [("[", 80_000), (" ", 70_000), ("\t", 200_000), ("ä = 1 # 水", 20_000)]
    {
        let folder = Domain::with(&[("f.toml", &format!("period = {}", filler.repeat(count)))]);
        assert_says(&check(&folder, "f.toml").refused(2), &["f.toml:1:", "not TOML"]);
    }
    for at in [0, 10_000, 20_000] {
        let keys = |keys: std::ops::Range<u32>| -> String {
            keys.map(|key| format!("k{key} = 1, ")).collect()
        };
        let before = format!("x = {{ {}", keys(0..at));
        let text = format!("# ä\n{before}§ = 1, {} }}\n", keys(at..20_000));
        let folder = Domain::with(&[("f.toml", &text)]);
        let place = format!("[f.toml:2:{}]", before.len() + 1);
        assert_says(&check(&folder, "f.toml").refused(2), &[&place, "k", "§ = 1"]);
    }
}

#[test]
fn several_errors_of_one_long_line_are_each_shown() {
    let blanks = " ".repeat(70_000);
    let text = format!(
        "# {}\n[node]\nname = \"n\"\n[[task]]\nname = \"t\"\nperiod = \"1ms\"\n[[block]]\n\
         name = \"b\"\ntype = \"LimRateOfChangeCI\"\nin = {{ {blanks}bad = 1, {blanks}worse = 2 }}\n",
        "ä".repeat(70_000),
    );
    let folder = Domain::with(&[("f.toml", &text)]);
    let shown = check(&folder, "f.toml").refused(2);
    assert_says(&shown, &["[f.toml:10:70008]", "[f.toml:10:140017]", "\"bad\"", "\"worse\""]);
}

#[test]
fn of_thousands_of_errors_the_first_are_shown() {
    let text: String = (0..20_000).map(|key| format!("k{key} = 1\n")).collect();
    let folder = Domain::with(&[("f.toml", &text)]);
    let shown = check(&folder, "f.toml").refused(2);
    assert_says(&shown, &["f.toml: 20002 errors", "the first 20 are shown", "\"k17\""]);
}

#[test]
fn what_a_configuration_says_to_the_terminal_is_escaped() {
    let text = "[node]\nname = \"\\u001b[2J\u{9b}31m\"\n[[task]]\nname = \"t\\n\\u202eX\"\n\
        period = \"1ms \\u001b]0;title\\u0007\"\n\"k\\u001b[31m\" = 1\n[[output]]\n\
        service = \"\\u001b\u{9b}\"\nsignals = [\"\\u001b\"]\n";
    let folder =
        Domain::with(&[("f.toml", text), ("raw.toml", "[node]\nname = \u{1b}[31m\u{7f}\n")]);
    for args in
        ["check f.toml", "check --json f.toml", "simulate f.toml --cycles 1", "check raw.toml"]
    {
        let ran = folder.run(args);
        assert_eq!(ran.code(), 2);
        for printed in [&ran.stdout, &ran.stderr] {
            let command =
                printed.chars().find(|c| c.is_control() && *c != '\n' || *c == '\u{202e}');
            assert_eq!(command, None, "{args}\n{printed}");
        }
        assert_says(&ran.stderr, &[r"\u001b"]);
    }
    let document = folder.run("check --json f.toml").json();
    let message = document["errors"][0]["message"].as_str().unwrap();
    assert_eq!(message, r#"[node] name "\u001b[2J\u009b31m" is not a valid name"#);
}

#[test]
fn what_a_file_name_or_a_recording_says_to_the_terminal_is_escaped() {
    let name = "f\u{1b}[31m.toml";
    let folder = Domain::with(&[(name, "x = 1\n"), ("in.csv", "a\u{1b}[31m\u{9b}\n1\n")]);
    for (args, says) in [
        (&["check", name][..], r"f\u001b[31m.toml: 3 errors"),
        (&["check", "no\u{1b}[31m.toml"], r"cannot read no\u001b[31m.toml"),
        (&["publish", "plant/level", "--csv", "in.csv"], r"a\u{1b}[31m\u{9b}"),
        (&["publish", "plant/level", "--csv", "no\u{1b}.csv"], r"no\u001b.csv"),
    ] {
        let ran = folder.run_with(args);
        assert_says(&ran.refused(2), &[says]);
    }
}
