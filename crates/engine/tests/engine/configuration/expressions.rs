//! Expressions with mistakes: each is found, with its place inside the text in the file.

use isochrone_engine::Problem::{
    self, BadExpression, BadName, Conflict, Loop, MissingKey, TypeMismatch, UnknownPin,
    UnknownSource, WrongType,
};

use crate::findings::{assert_one, findings, plan};
use crate::one_task::{TASK, blocks, output, ramp};

/// A node with `sp` and `pv`, LREAL, and `stop`, BOOL, which the expressions may name, and these entries.
fn node(entries: &str) -> String {
    let variable = |name: &str, rest: &str| format!("[[variable]]\nname = \"{name}\"\n{rest}\n");
    [
        TASK.to_owned(),
        variable("sp", "initial = 1.0"),
        variable("pv", "initial = 2.0"),
        variable("stop", "type = \"BOOL\"\ninitial = false"),
        output(&["sp", "pv", "stop"]),
        entries.to_owned(),
    ]
    .concat()
}

/// An Expr with this `out`.
fn expr(name: &str, out: &str) -> String {
    format!("[[block]]\nname = \"{name}\"\ntype = \"Expr\"\nout = {out}\n")
}

#[track_caller]
fn one(entries: &str, problem: Problem, message: &str, help: &str) {
    assert_one(entries, &node(entries), problem, message, help);
}

#[test]
fn a_name_that_does_not_exist_is_found_with_the_nearest_one() {
    let out = r#"{ a = "sp - «spp", b = "pv - 1.0" }"#;
    one(&expr("e", out), UnknownSource, "no input or variable \"spp\"", "did you mean \"sp\"?");
    let out = r#"{ a = "«r.delayedValu > 1.0" }"#;
    one(&(ramp("r", "1.0") + &expr("e", out)), UnknownPin, "delayedValu", "\"r.delayedValue\"");
    let out = r#"{ a = '1.0 + «"sp@prev"' }"#;
    one(&expr("e", out), UnknownSource, "no value of the cycle before", "@prev goes behind");
}

#[test]
fn a_name_that_does_not_exist_is_also_found_on_a_loop_of_expressions() {
    for (out, message, help) in [
        (
            r#"{ sum = '«"e.summ@prev" + sp', on = "sp > 0.0" }"#,
            "no output pin \"summ\"",
            "\"e.sum\"",
        ),
        (r#"{ o = '«e' }"#, "\"e\" is a block, not a signal", ""),
        (r#"{ o = '«"e@prev"' }"#, "\"e\" is a block, not a signal", ""),
        (r#"{ Sum = '«"e.sum@prev" + sp' }"#, "no output pin \"sum\"", "\"e.Sum\""),
        (r#"{ o = '«"e.o@prev@prev"' }"#, "no output pin \"o@prev\"", "\"e.o\""),
        (r#"{ o = 'SEL(sp > 1.0, 0.0, «"e.nope@prev")' }"#, "no output pin \"nope\"", ""),
    ] {
        one(&expr("e", out), UnknownPin, message, help);
    }
    let several = expr("e", r#"{ o = '«"e.{i}.nope@prev" + 1.0' }"#) + "count = 3\n";
    one(&several, UnknownPin, "no output pin \"nope\"", "");
    let loops =
        expr("a", r#"{ o = '"b.o@prev" + 1.0' }"#) + &expr("b", r#"{ o = 'a.o + «"a.p@prev"' }"#);
    one(&loops, UnknownPin, "block \"a\" (Expr) has no output pin \"p\"", "\"a.o\"");
}

#[test]
fn a_mistake_is_found_where_it_stands_in_a_text_with_escapes_or_of_several_lines() {
    one(&expr("e", r#"{ a = "sp + «stop" }"#), BadExpression, "[block.out] a: stop is BOOL", "");
    let escaped = r#"{ a = "\"s\u0070\" + «stop" }"#;
    one(&expr("e", escaped), BadExpression, "stop is BOOL", "BOOL_TO_INT(stop)");
    let lines = "\n[block.out]\na = '''\nsp\n  + «stop'''\n";
    let lines = format!("[[block]]\nname = \"e\"\ntype = \"Expr\"{lines}");
    one(&lines, BadExpression, "stop is BOOL", "");
    one(&expr("e", r#"{ a = "sp «== pv" }"#), BadExpression, "==", "equality is =");
}

#[test]
fn every_mistake_of_a_file_is_found_at_once() {
    let entries = expr("e", r#"{ a = "spp", b = "1 +", c = "stop + 1", d = "pvv and stop" }"#)
        + &expr("f", r#"{ a = "e.a + stopp" }"#);
    let mut messages: Vec<_> =
        findings(&node(&entries)).into_iter().map(|finding| finding.message).collect();
    messages.sort();
    assert_eq!(messages.len(), 5, "{messages:#?}");
}

#[test]
fn what_is_wrong_with_an_expression_is_not_said_again_of_what_reads_it() {
    let entries = expr("e", r#"{ a = "1.0 + «stop" }"#)
        + &expr("f", r#"{ a = "e.a + 1.0" }"#)
        + &ramp("r", "\"f.a\"");
    one(&entries, BadExpression, "stop is BOOL", "");
}

#[test]
fn an_expr_has_expressions_and_no_pins_and_no_other_block_has_any() {
    one("«[[block]]\nname = \"e\"\ntype = \"Expr\"\n", MissingKey, "no expressions", "out = {");
    one(&expr("e", "«{}"), MissingKey, "no expressions", "out = {");
    let pins = expr("e", "{ a = \"sp\" }") + "in = «{ x = 1.0 }\n";
    one(&pins, Conflict, "an Expr has no input pins", "its expressions name");
    let other = ramp("r", "1.0") + "out = «{ a = \"sp\" }\n";
    one(&other, Conflict, "for type = \"Expr\" only", "");
    one(&expr("e", "{ a = «1.5 }"), WrongType, "as text, not a float", "write a = \"1.5\"");
}

#[test]
fn an_output_has_a_name_that_wires_can_have_and_that_is_not_status() {
    one(&expr("e", "{ «status = \"sp\" }"), BadName, "\"status\" of its own", "another name");
    one(&expr("e", "{ «'a.b' = \"sp\" }"), BadName, "\"a.b\"", "letters, digits and _");
    let wire = expr("e", "{ a = \"sp\" }") + &ramp("r", "«\"e.b\"");
    one(&wire, UnknownPin, "block \"e\" (Expr) has no output pin \"b\"", "there is: a, status");
}

#[test]
fn the_type_of_an_output_is_that_of_its_expression() {
    let bool = expr("e", "{ a = \"sp > pv\" }") + &ramp("r", "«\"e.a\"");
    one(&bool, TypeMismatch, "\"e.a\" is BOOL, but pin value takes LREAL", "");
    let chain = expr("f", "{ a = \"e.a OR 1.0 > «stop\" }") + &expr("e", "{ a = \"sp > pv\" }");
    one(&chain, BadExpression, "stop is BOOL", "");
}

#[test]
fn a_loop_of_expressions_without_prev_is_found_as_any_loop() {
    let two = expr("a", "{ y = \"«b.y + 1.0\" }") + &expr("b", "{ y = \"a.y\" }");
    one(&two, Loop, "loop: a -> b -> a", "@prev");
    let own = expr("a", "{ x = \"sp\", y = \"«a.x + 1.0\" }");
    one(&own, Loop, "loop: a -> a", "name its own with @prev, or use another Expr");
}

#[test]
fn an_expression_that_depends_on_itself_has_the_first_type_with_which_it_is_right() {
    let types = |out: &str| {
        let text = node(&(expr("e", out) + &output(&["e.a", "e.b"]).replace("\"s\"", "\"t\"")));
        let plan = plan(&text).unwrap_or_else(|found| panic!("{found}"));
        plan.tasks[0].outputs[1].signals.iter().map(|it| it.value_type.to_string()).collect()
    };
    let cases: [(&str, [&str; 2]); 4] = [
        (r#"{ a = '"e.a@prev" + 1', b = '("e.b@prev" OR stop) AND sp > 0.0' }"#, ["LREAL", "BOOL"]),
        (r#"{ a = 'LREAL_TO_INT("e.a@prev" + 1)', b = '"e.b@prev" + T#10ms' }"#, ["INT", "TIME"]),
        (r#"{ a = '"e.b@prev" OR stop', b = '"e.a@prev" AND "e.b@prev"' }"#, ["BOOL", "BOOL"]),
        (
            r#"{ a = 'SEL("e.b@prev" > 5.0, "e.a@prev", stop)', b = 'SEL("e.a@prev", "e.b@prev" + 1.0, 0.0)' }"#,
            ["BOOL", "LREAL"],
        ),
    ];
    for (out, expected) in cases {
        let found: Vec<String> = types(out);
        assert_eq!(found, expected, "{out}");
    }
    let wrong = expr("e", r#"{ a = '"e.a@prev" OR 1.0 > «stop' }"#);
    one(&wrong, BadExpression, "stop is BOOL", "");
}

#[test]
fn the_types_of_a_long_chain_of_expressions_are_found_in_reasonable_time() {
    const BLOCKS: usize = 3_000;
    let block = |number: usize| {
        expr(&format!("e{number}"), &format!("{{ y = \"e{}.y + 1.0\" }}", number + 1))
    };
    let latch = |number: usize| {
        expr(
            &format!("q{number}"),
            &format!(r#"{{ y = '"q{number}.y@prev" OR sp > {number}.0' }}"#),
        )
    };
    let chain: String = (0..BLOCKS).map(block).collect();
    let latches: String = (0..BLOCKS).map(latch).collect();
    let text = node(&(chain + &expr(&format!("e{BLOCKS}"), "{ y = \"sp\" }") + &latches));
    assert_eq!(plan(&text).unwrap().instances(), 2 * BLOCKS + 1);
}

#[test]
fn a_unit_is_of_an_output_and_not_of_what_an_expression_reads() {
    let units = expr("e", "{ a = \"sp - pv\" }") + "unit = \"m\"\n";
    let plan = plan(&node(&(units + &output(&["e.a"]).replace("\"s\"", "\"t\"")))).unwrap();
    assert_eq!(plan.tasks[0].outputs[1].signals[0].unit, "m");
    let wrong = expr("e", "{ a = \"sp > pv\" }") + "units = { «sp = \"m\" }\n";
    one(&wrong, UnknownPin, "Expr has no pin \"sp\"", "there is: a, status");
}

#[test]
fn the_operands_of_an_expression_are_no_signals_to_protect_or_to_limit() {
    let entries = expr("e", "{ a = \"sp - pv\" }");
    one(
        &(entries.clone() + "[limits]\n«\"e.sp\" = [0.0, 1.0]\n"),
        UnknownSource,
        "\"e.sp\"",
        "a, status",
    );
    let limit = entries + "[limits]\n«\"e.a\" = [0.0, 1.0]\n";
    one(&limit, Conflict, "no parameter that has limits", "");
}

#[test]
fn an_expression_that_can_only_fail_is_warned_of() {
    one(
        &expr("«e", "{ a = \"sp / 0.0\" }").replace("\"«e", "«\"e"),
        Problem::ConstantError,
        "16#8210",
        "",
    );
    let text = node(&expr("e", "{ a = \"sp / pv\" }"));
    assert!(plan(&text).unwrap().warnings.is_empty());
}

#[test]
fn instances_read_the_instances_with_their_number() {
    let count = |out: &str| expr("e", out).replace("type", "count = 3\ntype");
    let ramps = blocks("r", 2, "LimRateOfChangeCI", "value = 1.0, setChangeRate = inf");
    let entries = ramps.clone() + &count(r#"{ a = '«"r.{i}.delayedValue"' }"#);
    one(&entries, UnknownSource, "\"r.2\", which instance 2 of e is wired to", "r.0 to r.1");
    let single = expr("e", r#"{ a = '1.0 + «"r.{i}.delayedValue@prev"' }"#);
    let message = "\"r.{i}.delayedValue@prev\" has {i}, the number of the reading instance, and e has no count";
    one(&format!("{ramps}{single}"), UnknownSource, message, "as in \"r.0.delayedValue@prev\", or");
    let entries = format!("{ramps}{}", single.replace("type", "count = 1\ntype"));
    assert!(plan(&node(&entries.replace('«', ""))).is_ok());
    let bare = count(r#"{ a = "r.«{i}.delayedValue" }"#);
    one(&bare, BadExpression, "{i}", "double quotes");
}
