//! Values of keys of inputs: what is wrong, where, and what would be right.

use crate::findings::assert_mistakes;

#[test]
fn values_of_inputs_that_are_out_of_range_are_refused_with_the_range() {
    assert_mistakes(
        r#"
        OutOfRange: value of type = "LREAL"
            "REAL" | cannot be "REAL" | did you mean "LREAL"?
            "WORD" | cannot be "WORD" | there is: LREAL, INT, BOOL, TIME
        OutOfRange: value of channel = 7
            -1    | channel -1    | from 0 to 65535
            65536 | channel 65536 | from 0 to 65535
        WrongType: value of default = 0.5
            "0"    | a number, not a text                      | write default = 0
            "1.5"  | [[input]] default is a number, not a text | write default = 1.5
            "0,5"  | a number, not a text                      | write default = 0.5
            "10 m" | a number, not a text                      | write default = 10
            "inf"  | a number, not a text
            true   | a number, not a boolean
        OutOfRange: value of max_age = "20ms"
            "30"        | the unit is missing      | write max_age = "30ms"
            "0"         | the unit is missing      | max_age is longer than 0
            "200 msec"  | there is no unit "msec"  | write max_age = "200ms"
            "200 ticks" | there is no unit "ticks" | such as "10ms"
            "0ms"       | max_age 0ms              | longer than 0
        WrongType: value of max_age = "20ms"
            30  | a duration such as "1ms", not an integer | write max_age = "30ms"
            2.5 | a duration such as "1ms", not a float    | write max_age = "2.5ms"
        OutOfRange: after type = "INT"
            default = «1.5   | default 1.5 is not a whole number | INT holds whole numbers from -32768 to 32767
            default = «40000 | default 40000                     | that INT can hold
        WrongType: before channel = 7
            range = «4.0      | range is an array of two numbers, smallest and largest | write range = [0.0, 50.0]
            range = «[4.0]    | range is an array of two numbers                       | inf and -inf
            finite = «"false" | finite is true or false, not a text                    | write finite = false
        OutOfRange: before channel = 7
            range = «[20, 4]    | [[input]] range: 20.0 to 4.0 is no range | write range
            range = «[nan, 4.0] | NaN to 4.0 is no range                   | write range
        Conflict
            channel = 7 -> range = [4, 20]\nfinite = «false | both range and finite = false | keep one
            type = "INT" -> type = "INT"\nfinite = «true  | not for INT                   | leave finite out
        Conflict: before [[block]]\nname = "scale"
            [[input]]\nname = "on"\ntype = "BOOL"\nrange = «[0, 1] | range is not for BOOL | leave range out
        Conflict
            channel = 7 -> channel = 7\nsignal = «"level.y" | both signal and channel | keep one
        OutOfRange
            channel = 7       -> signal = «""       | signal is empty  | such as "level.y"
            default = 0.5     -> default = «nan     | default NaN      | not NaN
            on_stale = "hold" -> on_stale = «"hodl" | cannot be "hodl" | did you mean "hold"?
        WrongType
            count = 3 -> count = «"3" | [[block]] count is a whole number, not a text | write count = 3
        "#,
    );
}
