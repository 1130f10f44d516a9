//! Values of keys of inputs: what is wrong, where, and what would be right.

use isochrone_engine::Problem::*;

use crate::findings::{after, instead_of, value_of};

#[test]
fn values_of_inputs_that_are_out_of_range_are_refused_with_the_range() {
    value_of(OutOfRange, "type = \"LREAL\"")
        .finds("\"REAL\"", "cannot be \"REAL\"", "did you mean \"LREAL\"?")
        .finds("\"WORD\"", "cannot be \"WORD\"", "there is: LREAL, INT, BOOL, TIME");
    value_of(OutOfRange, "channel = 7").finds("-1", "channel -1", "from 0 to 65535").finds(
        "65536",
        "channel 65536",
        "from 0 to 65535",
    );
    after(Conflict, "channel = 7").finds(
        "signal = «\"level.y\"",
        "both signal and channel",
        "keep one",
    );
    instead_of(OutOfRange, "channel = 7").finds(
        "signal = «\"\"",
        "signal is empty",
        "such as \"level.y\"",
    );
    value_of(OutOfRange, "default = 0.5").finds("nan", "default NaN", "not NaN");
    value_of(WrongType, "default = 0.5")
        .finds("\"0\"", "a number, not a text", "write default = 0")
        .finds("\"1.5\"", "[[input]] default is a number, not a text", "write default = 1.5")
        .finds("\"0,5\"", "a number, not a text", "write default = 0.5")
        .finds("\"10 m\"", "a number, not a text", "write default = 10")
        .finds("\"inf\"", "a number, not a text", "")
        .finds("true", "a number, not a boolean", "");
    value_of(WrongType, "count = 3").finds(
        "\"3\"",
        "[[block]] count is a whole number, not a text",
        "write count = 3",
    );
    value_of(OutOfRange, "max_age = \"20ms\"")
        .finds("\"30\"", "the unit is missing", "write max_age = \"30ms\"")
        .finds("\"0\"", "the unit is missing", "max_age is longer than 0")
        .finds("\"200 msec\"", "there is no unit \"msec\"", "write max_age = \"200ms\"")
        .finds("\"200 ticks\"", "there is no unit \"ticks\"", "such as \"10ms\"")
        .finds("\"0ms\"", "max_age 0ms", "longer than 0");
    value_of(WrongType, "max_age = \"20ms\"")
        .finds("30", "a duration such as \"1ms\", not an integer", "write max_age = \"30ms\"")
        .finds("2.5", "a duration such as \"1ms\", not a float", "write max_age = \"2.5ms\"");
    after(OutOfRange, "type = \"INT\"")
        .finds(
            "default = «1.5",
            "default 1.5 is not a whole number",
            "INT holds whole numbers from -32768 to 32767",
        )
        .finds("default = «40000", "default 40000", "that INT can hold");
    value_of(OutOfRange, "on_stale = \"hold\"").finds(
        "\"hodl\"",
        "cannot be \"hodl\"",
        "did you mean \"hold\"?",
    );
}
