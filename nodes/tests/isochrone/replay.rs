//! `replay`: a recorded run is repeated bit for bit, and what is not as it was is found where it begins.

use crate::recorded_run::{CHANGED, CYCLES, MISSED, configuration, record, record_with};
use isochrone_recording::{Carried, ClockReading, Writer};
use isochrone_testing::{Domain, Ended, assert_says, cells};

/// A folder with the recording of a run.
fn recorded() -> Domain {
    let folder = Domain::new();
    record(&folder.path("run.mcap"));
    folder
}

/// The recording with other rows.
fn edited(
    mut edit: impl FnMut(&str, &mut isochrone_recording::RowHead, &mut Vec<f64>) -> bool,
) -> Domain {
    let folder = Domain::new();
    record_with(&folder.path("run.mcap"), &mut edit);
    folder
}

#[test]
fn a_run_with_all_that_may_happen_is_repeated_bit_for_bit() {
    let folder = recorded();
    let said = folder.run("replay run.mcap --output all.csv").silently();
    let cycles = CYCLES - (MISSED.end - MISSED.start);
    let (slow, values) = (CYCLES / 4, 3 * cycles + 2 * (CYCLES / 4));
    let expected = format!("{values} values in {} cycles of 2 tasks of \"level\"", cycles + slow);
    assert_eq!(said, format!("the same, bit for bit: {expected}\n"));

    let csv = folder.read("all.csv");
    let rows = cells(&csv);
    let heading = ["time_s", "cycle", "task", "plant/level.ramp.delayedValue"];
    assert_eq!(rows[0][..4], heading);
    assert_eq!(rows.len() as u64, 1 + cycles + slow);
    // It is what the recording has.
    folder.run("export run.mcap --task fast -o fast.csv").expect_code(0);
    let fast = folder.read("fast.csv");
    let fast = cells(&fast);
    let column = fast[0].iter().position(|name| *name == "out.plant/level.ramp.delayedValue");
    let exported: Vec<&str> = fast[1..].iter().map(|row| row[column.unwrap()]).collect();
    let repeated = rows[1..].iter().filter(|row| row[2] == "fast").map(|row| row[3]);
    assert_eq!(repeated.collect::<Vec<_>>(), exported);
}

#[test]
fn one_bit_of_one_value_is_found_at_its_cycle_and_signal() {
    for (task, at, column, name) in
        [("fast", 77, 8, "back.delayedValue"), ("slow", 12, 4, "follow.delayedValue")]
    {
        let folder = edited(|of, head, values| {
            if of == task && head.cycle == at {
                values[column] = f64::from_bits(values[column].to_bits() ^ 1);
            }
            true
        });
        let said = folder.run("replay run.mcap --report report.json").refused(1);
        let place = format!("in cycle {at} of task \"{task}\": \"{name}\" of \"plant/");
        assert_says(&said, &[place.as_str(), " 1 differs"]);
        let report = folder.json("report.json");
        assert_eq!((&report["is_same"], &report["different_values"]), (&false.into(), &1.into()));
        assert_eq!(report["signals"][0]["first"]["cycle"], at);
        assert_eq!(report["signals"][0]["signal"], name);
        // As large a difference as that is none that matters.
        folder.run("replay run.mcap --tolerance 1e-9").silently();
        assert_says(&folder.run("replay run.mcap --tolerance -0").refused(1), &[" 1 differs"]);
    }
}

#[test]
fn a_changed_configuration_shows_where_it_begins_to_differ_and_by_how_much() {
    let folder = recorded();
    let other = configuration().replace("setChangeRate = 40.0", "setChangeRate = 30.0");
    folder.write("new.toml", &other);
    let ran = folder.run("replay run.mcap --config new.toml --report report.json");
    assert_eq!(ran.code(), 1, "{}", ran.stderr);
    assert_says(
        &ran.stderr,
        &["\"follow.delayedValue\" of \"plant/slow\" was ", "1 online change"],
    );
    // What the slow task computes enters the fast one.
    assert_says(
        &ran.stdout,
        &["slow: plant/slow.follow.delayedValue: ", "fast: plant/level.back."],
    );
    assert!(!ran.stdout.contains("ramp.delayedValue"), "{}", ran.stdout);
    let report = folder.json("report.json");
    let follow = &report["signals"][0];
    assert_eq!(follow["signal"], "follow.delayedValue");
    assert!(follow["largest_difference"].as_f64().unwrap() > 0.0);
    folder.run("replay run.mcap --config new.toml --tolerance 1000").expect_code(0);
}

#[test]
fn what_a_configuration_and_a_recording_do_not_share_is_said() {
    let folder = recorded();
    let other = configuration()
        .replace("name = \"target\"", "name = \"goal\"")
        .replace("\"target\"", "\"goal\"")
        .replace("name = \"slow\"\nperiod = \"4ms\"", "name = \"slow\"\nperiod = \"2ms\"");
    folder.write("new.toml", &other);
    let ran = folder.run("replay run.mcap --config new.toml");
    assert_eq!(ran.code(), 1, "{}", ran.stderr);
    assert_says(
        &ran.stderr,
        &[
            "the recording has no input \"goal\" of task \"fast\"; it keeps its default",
            "task \"fast\" does not publish plant/level.target here; it is not compared",
            "task \"fast\" has no input target here",
            "the recording has no plant/level.goal of task \"fast\"",
            "task \"slow\" had another period",
        ],
    );
}

#[test]
fn a_task_is_compared_up_to_the_first_row_that_was_lost_and_so_is_who_reads_it() {
    let folder = edited(|task, head, _| {
        match (task, head.cycle) {
            ("fast", 200..205) => return false,
            ("fast", 205) => head.lost = 5,
            _ => {}
        }
        true
    });
    let said = folder.run("replay run.mcap --report report.json").refused(4);
    assert_says(
        &said,
        &[
            "task \"fast\" cannot be compared from cycle 200 on: 5 rows were lost before cycle 205",
            "task \"slow\" cannot be compared from cycle 50 on: it reads cycle 20",
        ],
    );
    let report = folder.json("report.json");
    assert_eq!(report["tasks"][0]["uncompared_from"], 200);
    assert_eq!(report["tasks"][0]["uncompared_cycles"], CYCLES - 205);
    assert_eq!(report["is_same"], false);
}

#[test]
fn rows_that_are_missing_without_a_word_and_operations_without_an_entry_end_the_comparison() {
    let folder = edited(|task, head, _| task != "slow" || head.cycle != 30);
    let said = folder.run("replay run.mcap").refused(4);
    assert_says(
        &said,
        &["task \"slow\" cannot be compared from cycle 30 on: cycles before cycle 31"],
    );

    let folder = edited(|task, head, values| {
        if task == "fast" && head.cycle >= 320 {
            values[0] += 1.0;
        }
        true
    });
    let said = folder.run("replay run.mcap").refused(4);
    assert_says(
        &said,
        &["cannot be compared from cycle 320 on: what was done to it is not in the"],
    );
}

#[test]
fn a_file_that_was_cut_off_is_repeated_as_far_as_it_goes() {
    let folder = recorded();
    let whole = std::fs::read(folder.path("run.mcap")).unwrap();
    let closed: Vec<usize> = (0..6).map(|part| whole.len() * part / 6).collect();
    for length in closed.into_iter().skip(1) {
        folder.write("cut.mcap", &whole[..length]);
        let ran = folder.run("replay cut.mcap");
        let is_told = ran.stderr.contains("was not closed") || ran.stderr.contains("has no cycle");
        assert!([2, 4].contains(&ran.code()) && is_told, "{length}: {} {}", ran.code(), ran.stderr);
        if ran.code() == 4 {
            let Ended { stdout: part, .. } =
                folder.run("replay cut.mcap --incomplete").expect_code(0);
            assert!(part.starts_with("the same, bit for bit: "), "{length}: {part}");
        }
    }
}

/// Where the records of a kind begin.
fn places(bytes: &[u8], kind: u8) -> Vec<usize> {
    let (mut at, mut places) = (8, Vec::new());
    while let Some(head) = bytes.get(at..at + 9) {
        places.extend((head[0] == kind).then_some(at));
        at += 9 + u64::from_le_bytes(head[1..].try_into().unwrap()) as usize;
    }
    places
}

#[test]
fn a_length_that_passes_the_end_of_a_file_is_not_taken_for_its_end() {
    let folder = Domain::new();
    record(&folder.path("run.mcap"));
    let whole = std::fs::read(folder.path("run.mcap")).unwrap();
    // As it is if its node is killed: without the end, which says where the chunks are.
    let mut killed = whole[..places(&whole, 0x0f)[0]].to_vec();
    folder.write("bad.mcap", &killed);
    let said = folder.run("replay bad.mcap --report part.json").refused(4);
    assert_says(&said, &["what came after cycle 399 of \"fast\" is not known", "only a part"]);
    let report = folder.json("part.json");
    assert_eq!((&report["is_complete"], &report["is_same"]), (&false.into(), &false.into()));
    let Ended { stdout: said, .. } = folder.run("replay bad.mcap --incomplete").expect_code(0);
    assert!(said.starts_with("the same, bit for bit: "), "{said}");

    // The first chunk describes the tasks.
    let chunk = places(&killed, 0x06)[1];
    killed[chunk + 4] ^= 0x20;
    folder.write("bad.mcap", &killed);
    let said = folder.run("replay bad.mcap").refused(4);
    assert_says(&said, &["bad.mcap is damaged: 1 part left out", "not read: ", " bytes"]);
    let ran = folder.run("replay bad.mcap --incomplete");
    assert_eq!(ran.code(), 0, "{}", ran.stderr);
    assert_says(&ran.stderr, &["cannot be compared from cycle"]);
}

#[test]
fn what_is_no_recording_of_a_node_is_refused_with_the_way_out() {
    let folder = Domain::new();
    let clock = ClockReading::default();
    let out = std::fs::File::create(folder.path("services.mcap")).unwrap();
    let mut writer = Writer::create(out, clock).unwrap();
    let carried = Carried { service: "plant/level".into(), ..Carried::default() };
    let channel = writer.add(&carried).unwrap();
    let frame = isochrone_recording::Frame {
        header: Default::default(),
        values: &[],
        received_ns: 0,
        due_ns: 0,
        sent_ns: 0,
        lost: 0,
    };
    writer.write(channel, &frame).unwrap();
    writer.finish().map_err(|(error, _)| error).unwrap();
    let said = folder.run("replay services.mcap").refused(2);
    assert_says(&said, &["is a recording of services (1 frame)", "publish --from services.mcap"]);

    folder.write("text.mcap", "cycle,x\n0,1\n");
    folder.run("replay text.mcap").refused(2);
    folder.run("replay none.mcap").refused(2);
    record(&folder.path("run.mcap"));
    let same = folder.run("replay run.mcap --tolerance -0").silently();
    assert!(same.starts_with("the same, within 0.0: "), "{same}");
    assert_says(
        &folder.run("replay run.mcap --tolerance -1").refused(2),
        &["give the largest difference of two values"],
    );
    let said = folder.run("replay run.mcap --report run.mcap").refused(2);
    assert_says(&said, &["would overwrite what is read"]);
}

/// A file with a bit changed somewhere is repeated as far as that goes, or refused.
#[test]
fn a_damaged_file_never_passes_for_a_run_that_differs_without_saying_that_it_is_damaged() {
    let folder = recorded();
    let whole = std::fs::read(folder.path("run.mcap")).unwrap();
    for step in 0..24 {
        let at = 9 + (whole.len() - 9) * step / 24;
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (step % 8);
        folder.write("bad.mcap", &bytes);
        let ran = folder.run("replay bad.mcap");
        assert!([2, 4].contains(&ran.code()), "byte {at}: {} {}", ran.code(), ran.stderr);
    }
}

#[test]
fn all_exports_of_a_recording_count_their_times_from_its_first_cycle() {
    let folder = recorded();
    let mut origins = Vec::new();
    for task in ["fast", "slow"] {
        let arguments = format!("export run.mcap --task {task} --columns unix_ns -o out.csv");
        folder.run(&arguments).expect_code(0);
        let csv = folder.read("out.csv");
        let rows = cells(&csv);
        assert_eq!(rows[0][..3], ["time_s", "cycle", "unix_ns"]);
        origins.extend(rows[1..].iter().map(|row| {
            let after_ns = row[0].parse::<f64>().unwrap() * 1e9;
            row[2].parse::<i64>().unwrap() - after_ns.round() as i64
        }));
    }
    origins.dedup();
    assert_eq!(origins.len(), 1, "{origins:?}");
    let said = folder.run("export run.mcap --task fast --columns flags -o out.csv").refused(2);
    assert_says(&said, &["`flags` is of frames"]);
    let said = folder.run("export run.mcap --columns unix_ns -o out.mcap").refused(2);
    assert_says(&said, &["--columns is for CSV"]);
}

#[test]
fn what_the_inputs_of_a_run_read_is_exported_and_simulated_as_it_is() {
    let folder = recorded();
    folder.write("level.toml", configuration());
    folder.run("export run.mcap --task fast -o fast.csv").expect_code(0);
    folder.run("simulate level.toml --inputs fast.csv --output again.csv").silently();
    let (exported, again) = (folder.read("fast.csv"), folder.read("again.csv"));
    let (exported, again) = (cells(&exported), cells(&again));
    assert_eq!(again.len() as u64, 1 + CYCLES, "the rows are for their cycles, missed ones hold");
    let column = |rows: &[Vec<&str>], name: &str| {
        rows[0].iter().position(|it| *it == name).unwrap_or_else(|| panic!("{name}"))
    };
    for (of_run, name) in [
        ("out.plant/level.target", "target"),
        ("out.plant/level.ramp.delayedValue", "ramp.delayedValue"),
    ] {
        let (of_run, name) = (column(&exported, of_run), column(&again, name));
        // Until somebody operated the node.
        for cycle in 1..60 {
            assert_eq!(exported[cycle][of_run], again[cycle][name], "cycle {}", cycle - 1);
        }
    }
    // A column of an input that the configuration does not have is one that was meant.
    let other = configuration()
        .replace("name = \"target\"", "name = \"goal\"")
        .replace("\"target\"", "\"goal\"");
    folder.write("level.toml", &other);
    let said = folder.run("simulate level.toml --inputs fast.csv").refused(2);
    assert_says(&said, &["there is no input \"in.target\"; there is: goal"]);
}

#[test]
fn the_online_change_of_the_run_is_in_effect_from_its_cycles_on() {
    let folder = recorded();
    folder.run("export run.mcap --task slow -o slow.csv").expect_code(0);
    let csv = folder.read("slow.csv");
    let rows = cells(&csv);
    let changes = rows[0].iter().position(|name| *name == "from.fast.changes").unwrap();
    let first = rows[1..].iter().find(|row| row[changes].parse() == Ok(1.0)).unwrap();
    assert_eq!(first[1], CHANGED[1].to_string(), "until then it has the wires from before");
}
