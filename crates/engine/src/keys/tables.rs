//! The tables of a configuration file and their keys.

use isochrone_blocks::is_cyclic_ob;
use isochrone_model::{Access, AlarmSeverity, Overrun, Wake};

use super::rules::*;
use super::{Absent, Form, Key, Range, TableKeys};
use crate::config::{Bad, Cpu, OnDamaged, OnStale, OnWarmStart};

/// Version that introduced a key. So far, all keys date from the first one.
const FIRST: &str = "0.1";

/// Declares the keys of a table: `CONSTANT "key" ["unit"]: form, absent;`.
macro_rules! keys {
    (
        $(#[doc = $doc:literal])+
        $table:ident $title:literal {
            $($(#[doc = $key_doc:literal])+ $KEY:ident $name:literal $([$unit:literal])?: $form:expr, $absent:expr;)*
        }
    ) => {
        $(#[doc = $doc])+
        pub(crate) mod $table {
            #![allow(unused_imports, reason = "not every table has keys of every form")]
            use super::{Absent::*, Form::*, *};

            $(pub(crate) static $KEY: Key = Key {
                name: $name,
                form: $form,
                unit: concat!($($unit)?),
                absent: $absent,
                since: FIRST,
                raw_doc: concat!($($key_doc),+),
            };)*

            pub(crate) static TABLE: TableKeys =
                TableKeys { title: $title, raw_doc: concat!($($doc),+), keys: &[$(&$KEY),*] };
        }
    };
}

keys! {
    /// A configuration file is TOML and consists of these tables.
    file "the file" {
        /// The node itself: its name, and what may be done to it while it runs.
        NODE "node": Table, Required("[node]");
        /// Signals that stay as they are while the node runs.
        PROTECT "protect": Tables, Means("no signal is protected");
        /// Bounds of parameters and variables that are set while the node runs.
        LIMITS "limits": Table, Means("no bounds but those of the types");
        /// Tasks: when blocks run.
        TASK "task": Tables, Required("[[task]]");
        /// Inputs: values that other processes publish.
        INPUT "input": Tables, Means("no input");
        /// Variables: values that operators give.
        VARIABLE "variable": Tables, Means("no variable");
        /// Function blocks: what the node computes.
        BLOCK "block": Tables, Means("no block");
        /// Process alarms: conditions that people should know of.
        ALARM "alarm": Tables, Means("no process alarm");
        /// Outputs: frames that the node publishes.
        OUTPUT "output": Tables, Means("no output");
    }
}

keys! {
    /// The node itself.
    node "[node]" {
        /// Name of the node; its own services are named `isochrone/<name>/…`. `layout` is reserved.
        NAME "name": Name(NODE_NAME), Required("\"level\"");
        /// What may be done to the values of the running node: `off` and `read` allow no change, `set` lets parameters and variables be set, `force` also lets signals be forced and the configuration be replaced (`apply`).
        CONTROL "control": Word(words!(Access::ALL)), Default("\"set\"");
        /// Whether a restart goes on where the node ended: what its blocks remember, last input values, and what was set.
        RETAIN "retain": Truth, Default("false");
        /// How old the state of a task may be. One whose state is older starts cold; what was set comes back at any age.
        RETAIN_FOR "retain_for": duration(|age_ns| age_ns > 0, "longer than 0"), Default("\"10min\"");
        /// How often the state is written, if anything has changed; that of a slower task after each of its cycles.
        RETAIN_EVERY "retain_every": duration(
            |interval_ns| interval_ns >= 100_000_000,
            "\"100ms\" or longer",
        ), Default("\"1s\"");
        /// What a start does if the state, and the one before it, are damaged: `stop` ends with exit status 2, `cold` starts without.
        ON_DAMAGED "on_damaged": Word(words!(OnDamaged::ALL)), Default("\"stop\"");
        /// When a start that goes on from the state begins to send: `send` with its first cycle, `confirm` after `isochrone start NODE`.
        WARM_START "warm_start": Word(words!(OnWarmStart::ALL)), Default("\"send\"");
    }
}

keys! {
    /// Signals that nobody may set or force while the node runs.
    protect "[[protect]]" {
        /// Their names, as wires would have them; `*` stands for any characters within one part of a name. Protecting an input protects its `.ok`.
        NAMES "names": Texts, Required("[\"pump.*\"]");
    }
}

keys! {
    /// Parameters and variables by name, each with the smallest and the largest value that it may be set or forced to: `"ramp.setChangeRate" = [0.0, 50.0]`. In a name, `*` stands for any characters within one part: `"ramp.*.setChangeRate"` is that of every instance. A constant in the file must be within the bounds, too. A variable that has a `range` must not stand here.
    limits "[limits]" {}
}

keys! {
    /// A cyclic task, like a PLC's cyclic-interrupt OB: one thread that runs its blocks at a fixed period.
    task "[[task]]" {
        /// Unique name.
        NAME "name": Name(ENTRY_NAME), Required("\"fast\"");
        /// Time between two releases.
        PERIOD "period": duration(
            |period_ns| (10_000..=3_600_000_000_000).contains(&period_ns),
            "from \"10us\" to \"1h\"",
        ), Required("\"1ms\"");
        /// OB number by which `callOB` can refer to the task; unique.
        OB "ob": integer(
            |ob| i16::try_from(ob).is_ok_and(is_cyclic_ob),
            "30 to 38 or 123 to 32767",
        ), Means("no number");
        /// Offset of the releases on the grid shared by all tasks. `"auto"` places them between the kernel's ticks, as far from them as the period allows; `run` also keeps clear of the tasks, of this node and of others that run, on the same CPU. A task that follows a service gets the phase of the task that sends it, where that runs on the same grid.
        PHASE "phase": duration(|_| true, "less than the period, or \"auto\""), Default("\"0ns\"");
        /// SCHED_FIFO priority of the thread.
        PRIORITY "priority": integer(
            |priority| (1..=89).contains(&priority),
            "a SCHED_FIFO priority from 1 to 89",
        ), Means("normal scheduling");
        /// CPU that the thread is pinned to. `auto` chooses it when the node starts, among those that the process may use, by these rules in this order: not in the way of the source that the task follows or of a task that follows it, the fewest pinned threads, isolated, the fewest pinned threads on its core, the fewest interrupts of devices per second, the fewest since the machine started, the highest number. `any` does not pin the thread.
        CPU "cpu": WordOrInteger(
            words!(Cpu::WORDS),
            Range { accepts: |cpu| (0..=1023).contains(&cpu), words: "the number of a CPU, from 0 to 1023" },
        ), Means("`\"auto\"` with a priority, else `\"any\"`");
        /// How the thread waits for a release: `sleep` sleeps until the release, `hybrid` sleeps until a margin before it and then watches the clock, `spin` watches the clock all the time.
        WAKE "wake": Word(words!(Wake::ALL)), Means("`\"hybrid\"` with a priority, else `\"sleep\"`");
        /// Fixed margin of a hybrid wait. Cannot be combined with `cpu_budget`.
        MARGIN "margin": duration(|margin_ns| margin_ns > 0, "longer than 0"), Means("the margin adapts");
        /// Largest share of a CPU that the adaptive margin of a hybrid wait may use. Cannot be combined with `margin`.
        CPU_BUDGET "cpu_budget" ["CPU"]: Number(Range {
            accepts: |budget| (0.01..=0.5).contains(&budget),
            words: "a fraction of one CPU, from 0.01 to 0.5",
        }), Default("0.2");
        /// What happens to missed releases: `skip` skips them, `catch_up` runs them late (at most 8 in a row), `stop` ends the node.
        OVERRUN "overrun": Word(words!(Overrun::ALL)), Default("\"skip\"");
        /// Number of missed releases that ends the node, regardless of `overrun`.
        ON_OVERRUN "on_overrun": Table, Means("no limit");
        /// A service whose frames the cycles begin with, instead of at their releases.
        FOLLOW "follow": Table, Means("cycles begin at their releases");
    }
}

keys! {
    /// A cycle begins as soon as a new frame is there, but not before its release: `follow = { service = "plant/analog", within = "300us" }`. From its release on, the task watches the clock and the service.
    follow "[task.follow]" {
        /// Service of one of the task's inputs.
        SERVICE "service": Text, Required("\"plant/analog\"");
        /// How long after its release a cycle begins at the latest, whether a frame has come or not. It counts as margin: added to a fixed `margin`, it must still be less than the period.
        WITHIN "within": duration(|within_ns| within_ns > 0, "longer than 0, less than the period"), Required("\"300us\"");
    }
}

keys! {
    /// The limit on missed releases: `on_overrun = { misses = 3, cycles = 1000 }`.
    on_overrun "[task.on_overrun]" {
        /// The node ends after this many missed releases ...
        MISSES "misses" ["releases"]: integer(|misses| (1..=1000).contains(&misses), "from 1 to 1000"), Required("3");
        /// ... within this many cycles; not less than `misses`.
        CYCLES "cycles" ["cycles"]: integer(|cycles| cycles > 0, "greater than 0"), Required("1000");
    }
}

keys! {
    /// One value that another process publishes.
    input "[[input]]" {
        /// Unique name, used in wires.
        NAME "name": Name(ENTRY_NAME), Required("\"level_raw\"");
        /// Type of the samples. A sample that the type cannot hold is rejected and counted, and the input keeps its last valid value.
        TYPE "type": Word(words!(VALUE_TYPES)), Default("\"LREAL\"");
        /// Service that publishes it. Required by `run` and `check --strict`, not by `simulate`. What operators give is a `[[variable]]`.
        SERVICE "service": Text, Means("only `simulate`, or a program that gives the value, can run the node");
        /// Index in the service's frame, from 0. Cannot be combined with `signal`.
        CHANNEL "channel": integer(|channel| (0..=65_535).contains(&channel), "from 0 to 65535"), Default("0");
        /// Name in the layout that the publisher announces. Cannot be combined with `channel`.
        SIGNAL "signal": Text, Means("selected by `channel`");
        /// Task that reads it.
        TASK "task": Text, Means("the only task");
        /// Value before the first sample.
        DEFAULT "default": Value, Default("0");
        /// Smallest and largest sample. One outside is rejected and counted as one that the type cannot hold is. Values of `simulate` and of a program that feeds the input are taken as they are.
        RANGE "range": Bounds, Means("no bounds but those of the type");
        /// Whether a sample that is NaN or infinite is rejected (LREAL only). `false` takes it; cannot be combined with `range`.
        FINITE "finite": Truth, Default("true");
        /// Age above which the value is stale, counted from the publication of the sample.
        MAX_AGE "max_age": duration(|age_ns| age_ns > 0, "longer than 0"), Means("never stale");
        /// What a stale input reads: `hold` its last value, `default` its `default`, `{ ramp = 5.0 }` its `default`, which it approaches at that rate (LREAL only).
        ON_STALE "on_stale": WordOrTable(words!(OnStale::WORDS), "{ ramp = 5.0 }"), Default("\"hold\"");
        /// What a frame with any flag but `FORCED` is taken for: `ignore` takes its samples, `stale` does not, so that the input is stale until a good frame comes. A sender's last frame makes the input stale in any case.
        BAD "bad": Word(words!(Bad::ALL)), Default("\"ignore\"");
        /// Unit of the value, such as `m`. Samples that their publisher announces with another unit are rejected. Without it, the announced unit is shown, but not passed on to outputs. Not for BOOL and TIME.
        UNIT "unit": Line(MOST_UNIT), Means("the one that the publisher announces");
        /// What the value is, for people.
        COMMENT "comment": Line(MOST_COMMENT), Means("no comment");
        /// Whether the input closes a loop of nodes that read each other. Its flags and the age of its samples are then not handed on to the outputs, where they would go round for ever.
        FEEDBACK "feedback": Truth, Default("false");
    }
}

keys! {
    /// A stale input approaches its default: `on_stale = { ramp = 5.0 }`.
    on_stale "[input.on_stale]" {
        /// How fast it goes to the default, and back to the samples when they come again; one step in each cycle of the task.
        RAMP "ramp" ["units/s"]: Number(Range {
            accepts: |rate| rate > 0.0 && rate.is_finite(),
            words: "greater than 0",
        }), Required("5.0");
    }
}

keys! {
    /// One value that operators give: a set point, a switch, a number of a recipe. Any number of pins may read it. It has no `.ok` and no `.age`.
    variable "[[variable]]" {
        /// Unique name, used in wires, and not that of an input.
        NAME "name": Name(ENTRY_NAME), Required("\"setpoint\"");
        /// Type of the value.
        TYPE "type": Word(words!(VALUE_TYPES)), Default("\"LREAL\"");
        /// Value until an operator sets another. `save` writes the running value here.
        INITIAL "initial": Value, Required("0");
        /// The smallest and the largest value that it may be set or forced to: its line of `[limits]`. `initial` must be within it. Not for BOOL.
        RANGE "range": Bounds, Means("no bounds but those of the `type`");
        /// Unit of the value, such as `m`. Not for BOOL and TIME.
        UNIT "unit": Line(MOST_UNIT), Means("no unit");
        /// What the value is for, for people.
        COMMENT "comment": Line(MOST_COMMENT), Means("no comment");
        /// Task that it belongs to. Other tasks read it by wire.
        TASK "task": Text, Means("the only task");
    }
}

keys! {
    /// One or more instances of a function block.
    block "[[block]]" {
        /// Unique name, used in wires.
        NAME "name": Name(ENTRY_NAME), Required("\"ramp\"");
        /// Block type, as `isochrone blocks` lists them.
        TYPE "type": Text, Required("\"LimRateOfChangeCI\"");
        /// Task that runs it.
        TASK "task": Text, Means("the only task");
        /// Number of instances. Several instances are named `ramp.0`, `ramp.1` and so on; `{i}` in a wire stands for the number of the reading instance.
        COUNT "count" ["instances"]: integer(
            |count| (1..=1_000_000).contains(&count),
            "from 1 to 1000000",
        ), Default("1");
        /// Unit of its main output, which is the first that is an LREAL or an INT.
        UNIT "unit": Line(MOST_UNIT), Means("the unit that the block type gives");
        /// Units of its pins by name, inputs and outputs: `units = { setChangeRate = "m/s" }`.
        UNITS "units": Table, Means("the units that the block type gives");
        /// What the block is for, for people.
        COMMENT "comment": Line(MOST_COMMENT), Means("no comment");
        /// Its input pins: for each a number, `true` or `false`, or a wire.
        IN "in": Table, Means("every pin takes its default");
        /// The outputs of an `Expr`, and the expression of each: `out = { error = "sp - pv" }`. For `type = "Expr"` only, which must have it.
        OUT "out": Table, Means("an error for an `Expr`");
    }
}

keys! {
    /// The input pins of a block by name, each set to a constant or to a wire as text. In a block with a `count`, `[block.in.17]` sets pins of instance 17 alone; all others of its pins are as in `[block.in]`.
    pins "[block.in]" {}
}

keys! {
    /// The outputs of an `Expr` by name, each with its expression in structured text, which names signals as wires do. A name with other characters than letters, digits, `_` and `.`, such as `pump-1.y`, `sum.y@prev` or `level.{i}.y`, stands in double quotes: `out = { sum = '"total.sum@prev" + flow' }`. The output's type is that of the expression. docs/expressions.md has the operators and functions.
    out "[block.out]" {}
}

keys! {
    /// The units of a block's pins by name. Only an LREAL or an INT can have one.
    units "[block.units]" {}
}

keys! {
    /// One process alarm: a condition that people should know of. `NAME.active` and `NAME.ok`, both BOOL, are signals like the output pins of a block.
    alarm "[[alarm]]" {
        /// Unique name, and not that of a block.
        NAME "name": Name(ENTRY_NAME), Required("\"high_level\"");
        /// The condition: a BOOL expression in IEC structured text, such as `level.y > 1.6 AND NOT stop`.
        WHEN "when": Text, Required("\"level.y > 1.6\"");
        /// For how long the condition must hold before the alarm is active, on the task's grid.
        FOR "for": duration(|_| true, "0 or longer"), Default("\"0s\"");
        /// How far the signal must come back before the alarm is over, in the signal's unit. Only where `when` is one comparison by `>` `>=` `<` `<=`.
        HYSTERESIS "hysteresis": Number(Range {
            accepts: |hysteresis| hysteresis >= 0.0 && hysteresis.is_finite(),
            words: "0 or greater",
        }), Default("0.0");
        /// What it asks of people: `warning` and `critical` are acknowledged, `info` is an event that nobody acknowledges.
        SEVERITY "severity": Word(words!(AlarmSeverity::ALL)), Default("\"warning\"");
        /// What it says to people.
        TEXT "text": Line(MOST_COMMENT), Means("the condition");
        /// Task that evaluates it.
        TASK "task": Text, Means("the task of the signal that the condition names first");
    }
}

keys! {
    /// One frame that the node publishes in every cycle of its task.
    output "[[output]]" {
        /// Service to publish on; unique, and not beginning with `isochrone/`.
        SERVICE "service": Text, Required("\"plant/level\"");
        /// Task whose cycles publish it.
        TASK "task": Text, Means("the only task");
        /// The channels in order: names of inputs, variables, output pins and alarms.
        SIGNALS "signals": Texts, Required("[\"block.pin\"]");
        /// Unit of those of its signals, LREAL or INT, that have none where they come from. An input with a `service` needs a unit of its own then.
        UNIT "unit": Line(MOST_UNIT), Means("each signal has its own, or none");
        /// How many readers the service has places for. Each costs a look with every frame and memory for two more of them. It counts for whoever creates the service: a node that is to change it has to start before all readers.
        READERS "readers" ["readers"]: integer(|readers| (1..=64).contains(&readers), "from 1 to 64"), Default("16");
        /// What the frame is for, for people.
        COMMENT "comment": Line(MOST_COMMENT), Means("no comment");
    }
}

/// Every table of a configuration file, in the order in which a file has them.
pub static TABLES: [&TableKeys; 16] = [
    &file::TABLE,
    &node::TABLE,
    &protect::TABLE,
    &limits::TABLE,
    &task::TABLE,
    &on_overrun::TABLE,
    &follow::TABLE,
    &input::TABLE,
    &on_stale::TABLE,
    &variable::TABLE,
    &block::TABLE,
    &units::TABLE,
    &pins::TABLE,
    &out::TABLE,
    &alarm::TABLE,
    &output::TABLE,
];
