//! The configurations are right, and compute what their comments say.

use std::path::{Path, PathBuf};

use isochrone::engine::{Plan, Rules, Source, TaskEngine};
use isochrone::ipc::{FrameLayout, SignalSpec, check_service_name};

fn folder() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn configurations() -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder()).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    let is_configuration = |path: &PathBuf| {
        path.extension().is_some_and(|end| end == "toml") && !path.ends_with("Cargo.toml")
    };
    paths.filter(is_configuration).collect()
}

/// Plans a configuration as `isochrone run` does.
fn plan(path: &Path) -> Plan {
    let rules = Rules {
        service_name: |name| check_service_name(name).map_err(|cause| cause.to_string()),
        ..Rules::default()
    };
    Plan::new(Source::read(path).unwrap(), &rules)
        .unwrap_or_else(|wrong| panic!("{wrong}: {:?}", wrong.all))
}

fn frame(engine: &TaskEngine, plan: &Plan, task: usize) -> Vec<f64> {
    let mut frame = vec![f64::NAN; plan.tasks[task].outputs[0].signals.len()];
    engine.read_output(0, &mut frame);
    frame
}

#[test]
fn every_configuration_is_planned_without_a_warning() {
    let paths = configurations();
    assert!(paths.len() >= 3, "{paths:?}");
    for path in paths {
        let plan = plan(&path);
        assert!(plan.warnings.is_empty(), "{path:?}: {:?}", plan.warnings);
    }
}

#[test]
fn every_configuration_steps_without_an_error_of_a_block() {
    for path in configurations() {
        let plan = plan(&path);
        let mut engines = TaskEngine::build(&plan).unwrap();
        for cycle in 0..1_000 {
            engines.iter_mut().for_each(|engine| engine.step(cycle));
        }
        for (task, engine) in engines.iter().enumerate() {
            assert_eq!(engine.block_errors(), 0, "{path:?}");
            let frame = frame(engine, &plan, task);
            let signals = plan.tasks[task].outputs.iter().flat_map(|output| &output.signals);
            for (signal, value) in signals.zip(&frame) {
                // No sample comes here, so the age of an input is endless.
                let is_endless = signal.name.ends_with(".age") && *value == f64::INFINITY;
                assert!(value.is_finite() || is_endless, "{path:?}: {} = {value}", signal.name);
            }
        }
    }
}

#[test]
fn every_output_has_a_layout_that_can_be_announced() {
    for path in configurations() {
        for task in plan(&path).tasks {
            for output in task.outputs {
                let signals = output.signals.iter().map(|signal| {
                    SignalSpec::new(signal.name.clone(), signal.value_type.to_string())
                });
                let layout = FrameLayout {
                    signals: signals.collect(),
                    period_ns: Some(task.settings.period_ns),
                };
                layout.check().unwrap();
            }
        }
    }
}

#[test]
fn the_level_follows_the_sensor_and_the_ramp_follows_the_level() {
    let plan = plan(&folder().join("level.toml"));
    let mut engines = TaskEngine::build(&plan).unwrap();
    let engine = &mut engines[0];
    engine.set_input(0, 20736.0, 1);
    engine.step(0);
    let three_quarters = 1.7 / 27648.0 * 20736.0;
    assert_eq!(frame(engine, &plan, 0), [20736.0, three_quarters, 0.01, 0.0]);
    (1..200).for_each(|cycle| engine.step(cycle));
    assert_eq!(frame(engine, &plan, 0), [20736.0, three_quarters, three_quarters, 1.0]);
    // A broken wire, and a sensor beyond its range.
    engine.set_input(0, -4864.0, 2);
    engine.step(200);
    assert_eq!(frame(engine, &plan, 0)[1..], [0.0, three_quarters - 0.01, 2.0]);
    engine.set_input(0, 32511.0, 3);
    engine.step(201);
    assert_eq!(frame(engine, &plan, 0)[1], 1.7);
}

#[test]
fn the_heartbeat_counts_up_ten_times_a_second_and_passes_into_the_negative() {
    let plan = plan(&folder().join("level.toml"));
    let mut engines = TaskEngine::build(&plan).unwrap();
    for (cycle, value) in
        [(0, 0.0), (99, 0.0), (100, 1.0), (3_276_700, 32767.0), (3_276_800, -32768.0)]
    {
        engines[0].step(cycle);
        assert_eq!(frame(&engines[0], &plan, 0)[3], value, "cycle {cycle}");
    }
}

#[test]
fn the_tanks_reach_their_set_points_and_the_display_shows_them() {
    let plan = plan(&folder().join("two_tasks.toml"));
    let mut engines = TaskEngine::build(&plan).unwrap();
    let [fast, slow] = engines.as_mut_slice() else { panic!("two tasks") };
    let mut reached_ms = [None; 3];
    let set_points = [50.0, 75.0, 100.0].map(|percent| (1.7_f64 / 100.0 * percent).min(1.7));
    for ms in 0..6_000 {
        fast.step(ms);
        if ms % 10 == 0 {
            slow.step(ms / 10); // 500 us later
        }
        let levels = frame(fast, &plan, 0);
        if ms == 1 {
            assert_eq!(levels, [0.001; 3], "the set-points are there after one cycle");
        }
        for ((reached_ms, level), set_point) in reached_ms.iter_mut().zip(levels).zip(set_points) {
            if level == set_point {
                reached_ms.get_or_insert(ms);
            }
        }
    }
    assert_eq!(frame(fast, &plan, 0), set_points);
    for (shown, percent) in frame(slow, &plan, 1).into_iter().zip([50.0, 75.0, 100.0]) {
        assert!((shown - percent).abs() < 1e-9, "{shown}");
    }
    let demands: Vec<_> =
        plan.tasks[1].variables.iter().map(|it| (&*it.name, it.initial)).collect();
    assert_eq!(demands, [("demand_0", 50.0), ("demand_1", 75.0), ("demand_2", 100.0)]);
    slow.give_variable(1, 100.0);
    slow.step(600);
    (6_000..9_000).for_each(|ms| fast.step(ms));
    assert_eq!(frame(fast, &plan, 0), [set_points[0], set_points[2], set_points[2]]);
    let [half, more, full] = reached_ms.map(Option::unwrap);
    assert!(
        more - half > half / 4 && full - more > more - half,
        "fuller means slower: {reached_ms:?}"
    );
}

#[test]
fn a_thousand_chains_climb_the_same_stairs() {
    let plan = plan(&folder().join("chains.toml"));
    assert_eq!(plan.instances(), 3_000);
    let mut engines = TaskEngine::build(&plan).unwrap();
    for cycle in 0..220_u64 {
        engines[0].step(cycle);
        let frame = frame(&engines[0], &plan, 0);
        let saw = 2764.0 * (cycle / 10 % 11) as f64;
        assert_eq!(frame[..2], [saw, 1.7 / 27648.0 * saw], "cycle {cycle}");
        assert_eq!(frame[2], frame[3], "the first and the last ramp");
    }
}

/// Signals of the only output, cycle by cycle, while `operate` gives variables before each cycle.
fn simulate(
    name: &str,
    cycles: u64,
    mut operate: impl FnMut(u64, &Plan, &mut TaskEngine),
) -> Vec<Vec<f64>> {
    let plan = plan(&folder().join(name));
    let mut engines = TaskEngine::build(&plan).unwrap();
    let step = |cycle| {
        operate(cycle, &plan, &mut engines[0]);
        engines[0].step(cycle);
        frame(&engines[0], &plan, 0)
    };
    (0..cycles).map(step).collect()
}

fn give(plan: &Plan, engine: &mut TaskEngine, name: &str, value: f64) {
    let variables = &plan.tasks[0].variables;
    engine.give_variable(variables.iter().position(|it| it.name == name).unwrap(), value);
}

#[test]
fn the_level_arrives_from_a_pump_at_its_limit_without_winding_up() {
    let rows = simulate("level-control.toml", 1_500, |_, _, _| {});
    let at_limit = rows.iter().filter(|row| row[3] == f64::from(0x6002)).count();
    assert!(at_limit > 100, "the pump is at its limit for {at_limit} cycles");
    let highest = rows.iter().map(|row| row[1]).fold(0.0, f64::max);
    assert!((1.0..1.1).contains(&highest), "{highest} m");
    let last = rows.last().unwrap();
    assert!((last[1] - 1.0).abs() < 1e-3 && (last[2] - 0.02).abs() < 1e-3, "{last:?}");
}

#[test]
fn to_manual_mode_and_back_the_power_makes_no_step() {
    let rows = simulate("manual-automatic.toml", 400, |cycle, plan, engine| {
        give(plan, engine, "manual", f64::from(u8::from((100..200).contains(&cycle))));
    });
    let powers: Vec<f64> = rows.iter().map(|row| row[2]).collect();
    assert!(powers[100..=200].iter().all(|power| *power == powers[100]), "held in manual mode");
    for cycle in [100, 101, 200, 201] {
        let step = (powers[cycle] - powers[cycle - 1]).abs();
        assert!(step < 0.5, "{step} % in cycle {cycle}");
    }
}

#[test]
fn the_outer_controller_of_the_cascade_follows_the_flow_while_the_inner_one_is_in_manual_mode() {
    let rows = simulate("cascade.toml", 1_500, |cycle, plan, engine| {
        give(plan, engine, "manual", f64::from(u8::from((200..300).contains(&cycle))));
        give(plan, engine, "valve", if cycle < 220 { 0.0 } else { 45.0 });
    });
    for row in &rows[202..300] {
        assert_eq!(row[2], row[3], "its output is the flow");
    }
    let step = (rows[301][4] - rows[300][4]).abs();
    assert!(step < 2.0, "{step} % back in automatic mode");
    let last = rows.last().unwrap();
    assert!((last[1] - 1.0).abs() < 0.01, "{last:?}");
}

#[test]
fn the_valve_closes_when_no_sensor_is_there_and_the_alarm_tells_it() {
    let plan = plan(&folder().join("sensor-failure.toml"));
    let mut engines = TaskEngine::build(&plan).unwrap();
    let reading = |ok| {
        let (age_s, source_ns, flags) = (0.0, 0, isochrone::engine::Flags::NONE);
        isochrone::engine::InputReading { value: 3.5, ok, age_s, source_ns, flags }
    };
    let mut valve = Vec::new();
    for cycle in 0..200 {
        engines[0].read_input(0, &reading(!(50..120).contains(&cycle)));
        engines[0].step(cycle);
        valve.push(frame(&engines[0], &plan, 0)[3]);
    }
    assert!(valve[50] > 15.0, "{}", valve[50]);
    // 20 %/s, in steps of 100 ms.
    assert!(valve.windows(2).all(|pair| (pair[1] - pair[0]).abs() <= 2.0 + 1e-9));
    assert!(valve[65..120].iter().all(|opening| *opening == 0.0));
    assert!(valve[121] < 2.1 && valve[199] > 15.0, "{} {}", valve[121], valve[199]);
}
