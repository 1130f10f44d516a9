//! `simulate`: files, numbers and ways to fail.

use std::io::{BufRead, BufReader, Read};
use std::process::Stdio;

use isochrone_processes::Child;
use isochrone_testing::{Domain, Ended, PATIENCE, Plant, assert_says, cells};

/// What goes in comes out.
fn wiring() -> Plant {
    Plant::new("wire")
        .task("t", "1ms")
        .column("a", "LREAL")
        .column("n", "INT")
        .with("default = 7")
        .column("b", "BOOL")
        .column("d", "TIME")
        .output("out", &["a", "n", "b", "d"])
}

const HEADER: &str = "cycle,a,n,b,d\n";

/// The file `wire.toml` and `in.csv` with this content.
fn wire(inputs: impl AsRef<[u8]>) -> Domain {
    let folder = Domain::with(&[("wire.toml", &wiring())]);
    folder.write("in.csv", inputs);
    folder
}

fn simulate(inputs: &str) -> Ended {
    wire(inputs).run("simulate wire.toml --inputs in.csv")
}

#[test]
fn a_row_of_inputs_is_a_cycle_and_columns_come_in_any_order() {
    let out = simulate("d,a,b,n\n5,0.25,true,-3\n-6,1e3,FALSE,+4\n7, -2 ,1,32767\n").silently();
    assert_eq!(
        out,
        "cycle,a,n,b,d\n0,0.25,-3.0,1.0,5.0\n1,1000.0,4.0,0.0,-6.0\n2,-2.0,32767.0,1.0,7.0\n"
    );
}

#[test]
fn a_column_that_stands_twice_with_the_same_values_counts_once() {
    let once = simulate("a,n,b,d\n0.5,2,1,4\n0.25,6,0,8\n").silently();
    assert_eq!(simulate("a,n,a,b,d,a\n0.5,2,0.5,1,4,0.5\n0.25,6,0.25,0,8,0.25\n").silently(), once);
}

#[test]
fn the_last_row_holds() {
    let folder = wire("a,n,b,d\n1,2,1,4\n5,6,0,8\n");
    let out = folder.run("simulate wire.toml --inputs in.csv --cycles 4").silently();
    assert_eq!(
        out.lines().skip(2).collect::<Vec<_>>(),
        ["1,5.0,6.0,0.0,8.0", "2,5.0,6.0,0.0,8.0", "3,5.0,6.0,0.0,8.0"]
    );
    let out = folder.run("simulate wire.toml --inputs in.csv --cycles 1").silently();
    assert_eq!(out, format!("{HEADER}0,1.0,2.0,1.0,4.0\n"));
}

#[test]
fn no_cycles_are_a_header() {
    let folder = wire("a,n,b,d\n1,2,1,4\n");
    assert_eq!(folder.run("simulate wire.toml --cycles 0").silently(), HEADER);
    assert_eq!(folder.run("simulate wire.toml --cycles 0 --inputs in.csv").silently(), HEADER);
}

#[test]
fn without_inputs_the_cycles_must_be_said_and_all_inputs_keep_their_default() {
    let folder = wire("");
    assert_says(&folder.run("simulate wire.toml").refused(2), &["--cycles"]);
    let out = folder.run("simulate wire.toml --cycles 2").silently();
    assert_eq!(out, format!("{HEADER}0,0.0,7.0,0.0,0.0\n1,0.0,7.0,0.0,0.0\n"));
}

#[test]
fn an_input_without_a_column_keeps_its_default_and_that_is_said() {
    let Ended { stdout: out, stderr: notes, .. } = simulate("a\n1\n2\n").expect_code(0);
    assert_eq!(out, format!("{HEADER}0,1.0,7.0,0.0,0.0\n1,2.0,7.0,0.0,0.0\n"));
    for column in ["\"n\"", "\"b\"", "\"d\""] {
        assert_says(
            &notes,
            &[format!("note: in.csv has no column {column}; the input keeps its default")],
        );
    }
    assert!(!notes.contains("\"a\""), "{notes}");
}

#[test]
fn inputs_as_other_programs_write_them_are_read() {
    for inputs in [
        "\u{feff}a,n,b,d\n1,2,1,3\n".to_owned(),
        "a,n,b,d\r\n1,2,1,3\r\n".into(),
        "a,n,b,d\n\n1,2,1,3\n\n\n".into(),
        "a,n,b,d\n1,2,1,3".into(),
        "\"a\",\"n\",\"b\",\"d\"\n\"1\",\"2\",\"1\",\"3\"\n".into(),
        " a , n ,\tb,d\n 1 , 2 ,\t1,3\n".into(),
    ] {
        assert_eq!(
            simulate(&inputs).silently(),
            format!("{HEADER}0,1.0,2.0,1.0,3.0\n"),
            "{inputs:?}"
        );
    }
}

#[test]
fn inputs_that_make_no_sense_are_refused_with_their_place() {
    let zeros = [0; 4096];
    for (inputs, says) in [
        (b"a,x\n1,2\n".as_slice(), &["in.csv:1", "no input \"x\"", "there is: a, n, b, d"][..]),
        (b"cycle,time_s\n0,1\n", &["in.csv:1", "no column of values beside cycle and time_s"]),
        (
            b"cycle,journal.entries,\x1b[2J\n0,0,1\n",
            &["beside cycle and journal.entries and \\u001b[2J"],
        ),
        (b"aa,n\n1,2\n", &["no input \"aa\"", "did you mean \"a\"?"]),
        (b"a,,n\n1,2,3\n", &["in.csv:1", "column 2 has no name"]),
        (b"d\nT#200ms\n", &["in.csv:2", "\"T#200ms\"", "a TIME is a number of milliseconds"]),
        (b"A\n1\n", &["in.csv:1", "\"A\""]),
        (b"a;n\n1;2\n", &["in.csv:1", "\"a;n\"", "separated by commas"]),
        (b"1,2\n3,4\n", &["in.csv:1", "\"1\"", "a, n, b, d"]),
        (b"a,n,a\n3,2,3\n1,2,3\n", &["in.csv:3", "two columns \"a\"", "differ"]),
        (b"a,n\n1,2\n1\n", &["in.csv:3", "1 for 2"]),
        (b"a\n1,5\n", &["in.csv:2", "2 for 1"]),
        (b"a,n\n1,2\n\n1,two\n", &["in.csv:4", "\"n\"", "\"two\"", "not a number"]),
        ("\u{feff}a\r\n\r\n1\r\n\r\n\r\nx\r\n".as_bytes(), &["in.csv:6", "\"x\""]),
        (b"\n\na\n1\n\nx", &["in.csv:6", "\"x\""]),
        (b"\n\nx\n1\n", &["in.csv:3", "\"x\""]),
        (b"a,n\n1,\n", &["in.csv:2", "\"n\"", "\"\""]),
        (b"a\n0x10\n", &["in.csv:2", "\"0x10\""]),
        (b"a\ntrue\n", &["in.csv:2", "\"true\""]),
        (b"b\nyes\n", &["in.csv:2", "\"b\"", "\"yes\"", "true, false, 0 or 1"]),
        (b"", &["in.csv", "no rows", "first row names the columns"]),
        (b"a,n\n", &["in.csv", "no rows"]),
        (b"a\n1\n\xff\n", &["in.csv:3", "UTF-8"]),
        (b"\xff\xfe\n", &["in.csv:1", "UTF-8"]),
        (&zeros, &["in.csv:1", "not text"]),
    ] {
        let error = wire(inputs).run("simulate wire.toml --inputs in.csv").refused(2);
        assert_says(&error, says);
        assert!(error.len() < 500, "{error}");
    }
    let folder = wire("");
    std::fs::create_dir(folder.path("folder")).unwrap();
    for (name, says) in [("missing", "No such file"), ("folder", "directory")] {
        let error = folder.run(&format!("simulate wire.toml --inputs {name}")).refused(2);
        assert_says(&error, &["cannot read", name, says]);
    }
    let wiring = wiring();
    let none = wiring.split("[[input]]").next().unwrap();
    let folder = Domain::with(&[("none.toml", none), ("in.csv", "a\n1\n")]);
    let error = folder.run("simulate none.toml --inputs in.csv").refused(2);
    assert_says(&error, &["no input \"a\"", "the configuration has none"]);
}

#[test]
fn a_recording_is_simulated_without_its_times() {
    let out = simulate("time_s,cycle,a,n,b,d\n12.5,7,1,2,1,4\nlater,x,5,6,0,8\n").silently();
    assert_eq!(out, format!("{HEADER}0,1.0,2.0,1.0,4.0\n1,5.0,6.0,0.0,8.0\n"));
}

#[test]
fn a_signal_with_the_name_of_the_column_of_cycles_has_another_in_the_output() {
    let config = wiring().replace("\"a\"", "\"cycle\"");
    let folder = Domain::with(&[("wire.toml", &config), ("in.csv", "time_s,cycle\n0,5\n1,7\n")]);
    let Ended { stdout: out, .. } = folder.run("simulate wire.toml --inputs in.csv").expect_code(0);
    let expected = "cycle,cycle_,n,b,d\n0,5.0,7.0,0.0,0.0\n1,7.0,7.0,0.0,0.0\n";
    assert_eq!(out, expected);
}

#[test]
fn more_columns_than_a_frame_has_values_are_refused() {
    let names = |count: u32| (0..count).map(|i| format!("x{i}")).collect::<Vec<_>>().join(",");
    let error = wire(names(100_000)).run("simulate wire.toml --inputs in.csv").refused(2);
    assert_says(&error, &["in.csv:1", "100000 columns", "at most 65536"]);
}

#[test]
fn a_value_that_the_type_cannot_hold_is_rejected_and_counted() {
    let rows = [
        ("1.5,-32768,1,2147483647", "1.5,-32768.0,1.0,2147483647.0"),
        ("NaN,32768,2,2147483648", "NaN,-32768.0,1.0,2147483647.0"),
        ("inf,1.5,-1,0.5", "inf,-32768.0,1.0,2147483647.0"),
        ("-inf,NaN,0.5,inf", "-inf,-32768.0,1.0,2147483647.0"),
        ("1e308,inf,NaN,NaN", "1e308,-32768.0,1.0,2147483647.0"),
        ("0,32767,0,-2147483648", "0.0,32767.0,0.0,-2147483648.0"),
    ];
    let (inputs, expected): (Vec<_>, Vec<_>) = rows.into_iter().unzip();
    let Ended { stdout: out, stderr: notes, .. } =
        simulate(&format!("a,n,b,d\n{}\n", inputs.join("\n"))).expect_code(0);
    let found: Vec<&str> =
        out.lines().skip(1).map(|line| line.split_once(',').unwrap().1).collect();
    assert_eq!(found, expected);
    assert_says(
        &notes,
        &["12 samples were rejected", "the first: n is INT, which cannot hold 32768.0 (cycle 1)"],
    );
    assert_eq!(notes.lines().count(), 1, "{notes}");
}

#[test]
fn a_last_row_that_holds_is_rejected_once() {
    let folder = wire("a,n,b,d\n0,1,0,0\n0,1.5,0,0\n");
    let Ended { stdout: out, stderr: notes, .. } =
        folder.run("simulate wire.toml --inputs in.csv --cycles 1000").expect_code(0);
    assert_eq!(out.lines().last(), Some("999,0.0,1.0,0.0,0.0"));
    assert_says(&notes, &["1 sample was rejected", "1.5 (cycle 1)"]);
}

#[test]
fn every_number_reads_back_to_the_same_bits_in_its_shortest_form() {
    let texts = [
        "0.1",
        "0.30000000000000004",
        "5e-324",
        "2.2250738585072014e-308",
        "1.7976931348623157e308",
        "-0.0",
        "1e22",
        "9007199254740993",
        "123456789.12345678",
        "-1e-7",
        "1e16",
        "inf",
        "-inf",
        "NaN",
        "3.141592653589793",
    ];
    let Ended { stdout: out, .. } = simulate(&format!("a\n{}\n", texts.join("\n"))).expect_code(0);
    let rows = cells(&out);
    assert_eq!(rows.len(), 1 + texts.len());
    for (text, row) in texts.iter().zip(&rows[1..]) {
        let (written, read): (f64, f64) = (text.parse().unwrap(), row[1].parse().unwrap());
        assert_eq!(written.to_bits(), read.to_bits(), "{text}: {}", row[1]);
        assert!(row[1].len() <= text.len() + 2, "{text} became {}", row[1]);
    }
}

#[test]
fn the_output_goes_to_a_file_when_there_is_one() {
    let folder = wire("a,n,b,d\n1,2,1,4\n");
    let text = folder.run("simulate wire.toml --inputs in.csv").silently();
    folder.write("out.csv", "an older and longer file\n".repeat(100));
    for (output, found) in [("out.csv", "out.csv"), ("./new.csv", "new.csv")] {
        let out =
            folder.run(&format!("simulate wire.toml --inputs in.csv --output {output}")).silently();
        assert_eq!((out.as_str(), folder.read(found)), ("", text.clone()), "{output}");
    }
    assert_eq!(folder.run("simulate wire.toml --inputs in.csv --output -").silently(), text);
}

#[test]
fn what_is_read_is_not_overwritten() {
    let folder = wire("a,n,b,d\n1,2,1,4\n");
    for file in ["wire.toml", "in.csv", "./in.csv"] {
        let before = folder.read(file);
        let error =
            folder.run(&format!("simulate wire.toml --inputs in.csv --output {file}")).refused(2);
        assert_says(&error, &[file, "would overwrite"]);
        assert_eq!(folder.read(file), before);
    }
}

#[test]
fn an_output_that_cannot_be_written_is_an_error() {
    let folder = wire("");
    std::fs::create_dir(folder.path("folder")).unwrap();
    for (output, code, says) in [
        ("nowhere/out.csv", 2, "there is no folder nowhere"),
        ("folder", 2, "directory"),
        ("in.csv/out.csv", 2, "Not a directory"),
        ("/dev/full", 1, "No space left"),
    ] {
        for cycles in [0, 1, 100_000] {
            let error = folder
                .run(&format!("simulate wire.toml --cycles {cycles} --output {output}"))
                .refused(code);
            assert_says(&error, &["cannot write", output, says]);
        }
    }
    let full = std::fs::File::create("/dev/full").unwrap();
    let args = ["simulate", "wire.toml", "--cycles", "3"];
    let ran = Ended::from(folder.command(&args).stdout(full).output().unwrap());
    assert_eq!(ran.code(), 1);
    assert_says(&ran.stderr, &["cannot write to stdout", "No space left"]);
}

#[test]
fn an_input_that_is_refused_leaves_the_output_as_it_was() {
    let folder = wire("x\n1\n");
    folder.write("out.csv", "precious\n");
    folder.run("simulate wire.toml --inputs in.csv --output out.csv").refused(2);
    folder.run("simulate wire.toml --cycles 3 --task nobody --output out.csv").refused(2);
    assert_eq!(folder.read("out.csv"), "precious\n");
}

#[test]
fn a_reader_that_goes_away_ends_the_run_in_silence() {
    let folder = wire("");
    let cycles = u64::MAX.to_string();
    let args = ["simulate", "wire.toml", "--cycles", &cycles];
    let mut command = folder.command(&args);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = Child::start("the simulation", &mut command).unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout().unwrap()).read_line(&mut line).unwrap();
    assert_eq!(line, HEADER);
    let ended = child.wait_within(PATIENCE).unwrap().expect("it runs on, though nobody reads");
    let mut error = String::new();
    child.stderr().unwrap().read_to_string(&mut error).unwrap();
    assert_eq!((ended.code(), error.as_str()), (Some(0), ""));
}
