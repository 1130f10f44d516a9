//! Keys, sections and names of entries: what is wrong, where, and what would be right.

use isochrone_engine::Problem::*;

use crate::findings::{VALID, assert_mistakes, assert_one, plan};

#[test]
fn the_configuration_that_all_mistakes_are_made_in_is_valid() {
    let plan = plan(VALID).unwrap();
    assert!(plan.warnings.is_empty(), "{:?}", plan.warnings);
    assert_eq!(plan.instances(), 5);
}

#[test]
fn unknown_keys_are_errors_at_every_level() {
    assert_mistakes(
        r#"
        UnknownKey: instead of ob = 35
            «perid = 35  | [[task]] has no key "perid" | did you mean "period"?
            «zzzzzz = 35 | zzzzzz                      | name, period, ob
        UnknownKey
            [[task]]       -> [[«tsk]]\nname = "x"\n[[task]] | the file has no key "tsk"      | did you mean "task"?
            name = "level" -> name = "level"\n«names = 1     | [node] has no key "names"      | did you mean "name"?
            channel = 7    -> «chanel = 7                    | [[input]] has no key "chanel"  | did you mean "channel"?
            count = 3      -> count = 3\n«cuont = 3          | [[block]] has no key "cuont"   | did you mean "count"?
            signals =      -> «sevice = 1\nsignals =         | [[output]] has no key "sevice" | did you mean "service"?
        "#,
    );
}

#[test]
fn missing_keys_and_sections_are_reported_at_their_section() {
    assert_mistakes(
        r#"
        MissingKey: instead of [node]\nname = "level"\n
            «         | the file has no [node] | begin with [node]
            «[node]\n | [node] has no name     | write name =
        MissingKey
            [[task]]\nname = "fast"\nperiod = "1ms"\n -> «[[task]]\nname = "fast"\n | [[task]] has no period | write period = "1ms"
            [[block]]\nname = "saw" -> «[[input]]\n[[block]]\nname = "saw" | [[input]] has no name | write name =
            [[block]]\nname = "saw"\n -> «[[block]]\n | [[block]] has no name | write name =
            [[block]]\nname = "saw"\ntype = "SawTooth"\n -> «[[block]]\nname = "saw"\n | [[block]] has no type | write type =
            [[output]]\nservice = "plant/level"\n -> «[[output]]\n | [[output]] has no service | write service =
            [[output]] -> «[[output]]\nservice = "other"\n[[output]] | [[output]] has no signals | write signals =
        "#,
    );
}

#[test]
fn a_task_without_a_name_is_reported_and_a_reference_to_it_too() {
    let text = "[node]\nname = \"n\"\n«[[task]]\nperiod = \"1ms\"\n";
    assert_one("name", text, MissingKey, "[[task]] has no name", "write name = ");
    let found = crate::findings::findings(
        "[node]\nname = \"n\"\n[[task]]\nperiod = \"1ms\"\n[[input]]\nname = \"i\"\ntask = \"t\"\n",
    );
    assert_eq!(
        found.iter().map(|finding| finding.problem).collect::<Vec<_>>(),
        [MissingKey, UnknownTask]
    );
    assert_eq!(found[1].help.as_deref(), Some("there is none"));
}

#[test]
fn a_task_name_with_a_space_is_refused() {
    let text = "[node]\nname = \"n\"\n[[task]]\nname = «\"a b\"\nperiod = \"1ms\"\n";
    assert_one("space", text, BadName, "not a valid name", "a letter or _, then");
}

#[test]
fn names_with_which_no_node_could_run_are_refused_with_the_most_that_one_can() {
    let text = |node: usize, task: usize| {
        let (node, task) = ("n".repeat(node), "t".repeat(task));
        format!("[node]\nname = \"{node}\"\n[[task]]\nname = \"{task}\"\nperiod = \"1ms\"\n")
    };
    assert!(plan(&text(118, 200)).is_ok());
    for too_long in [text(119, 200), text(118, 201)] {
        assert!(plan(&too_long).is_err());
    }
    let task = "t".repeat(201);
    let text = format!("[node]\nname = \"n\"\n[[task]]\nname = «\"{task}\"\nperiod = \"1ms\"\n");
    assert_one("long", &text, BadName, "not a valid name", "at most 200 in all");
}

#[test]
fn a_file_without_a_task_is_an_error_however_it_says_so() {
    let rest = "[node]\nname = \"n\"\n[[block]]\nname = \"s\"\ntype = \"SawTooth\"\n";
    let help = "a task gives the blocks their period";
    let none = "the file has no [[task]]";
    let (list, one) = ("task is written as [[task]], not as an integer", "write [[task]]");
    let single = "[task] has one pair of brackets too few";
    for (tasks, problem, message, help) in [
        ("«", MissingKey, none, help),
        ("«task = []\n", MissingKey, none, help),
        ("task = «5\n", WrongType, list, one),
        ("«[task]\n", WrongType, single, one),
        ("task = [«5]\n", WrongType, "task is a table, not an integer", ""),
    ] {
        assert_one(tasks, &format!("{tasks}{rest}"), problem, message, help);
    }
}

#[test]
fn with_several_tasks_every_entry_must_name_its_own() {
    let tasks = "[node]\nname = \"n\"\n[[task]]\nname = \"a\"\nperiod = \"1ms\"\n\
        [[task]]\nname = \"b\"\nperiod = \"1ms\"\n";
    for entry in [
        "[[block]]\nname = «\"s\"\ntype = \"SawTooth\"\n",
        "[[input]]\nname = «\"i\"\n",
        "[[input]]\nname = \"i\"\ntask = \"a\"\n[[output]]\nservice = «\"s\"\nsignals = [\"i\"]\n",
    ] {
        let (message, help) = ("does not say which task", "there are several tasks: a, b");
        assert_one(entry, &format!("{tasks}{entry}"), MissingKey, message, help);
    }
}

#[test]
fn names_that_do_not_follow_the_rule_are_refused_with_the_rule() {
    assert_mistakes(
        r#"
        BadName: instead of "level"
            «"Level"  | "Level" is not a valid name | a lowercase letter, then
            «"1level" | not a valid name            | a lowercase letter, then
            «"a/b"    | not a valid name            | a lowercase letter, then
            «""       | not a valid name            | a lowercase letter, then
        BadName: value of name = "saw"
            "{i}"  | not a valid name | a letter or _, then
            "säge" | not a valid name | a letter or _, then
        BadName
            name = "start"\ntype = "INT" -> name = "start"\ntype = "INT"\n[[input]]\nname = «"a.b" | not a valid name | a letter or _, then
        "#,
    );
}

#[test]
fn sections_of_another_kind_are_refused_with_the_kind() {
    assert_mistakes(
        r#"
        WrongType
            [block.in]\nstartValue = "start"\ntimeRange = 50\nendlessSteps = true -> in = «5 | [[block]] in is a table, not an integer
            [node]\nname = "level" -> node = «"level" | node is a table, not a text
            name = "level" -> name = «5 | [node] name is a text, not an integer
        "#,
    );
}

#[test]
fn one_slip_in_a_key_is_one_error() {
    assert_mistakes(
        r#"
        UnknownKey
            [node]                      -> [«nod]                     | has no key | did you mean
            [node]\nname                -> [node]\n«nmae              | has no key | did you mean
            [[task]]                    -> [[«taks]]                  | has no key | did you mean
            [[task]]\nname              -> [[task]]\n«nmae            | has no key | did you mean
            period =                    -> «perod =                   | has no key | did you mean
            priority =                  -> «priorty =                 | has no key | did you mean
            name = "raw"\ntype          -> name = "raw"\n«tpye        | has no key | did you mean
            [[block]]\nname = "scale"   -> [[block]]\n«nme = "scale"  | has no key | did you mean
            type = "ScaleLinear"        -> «typ = "ScaleLinear"       | has no key | did you mean
            count =                     -> «cuont =                   | has no key | did you mean
            service = "plant/level"     -> «sevice = "plant/level"    | has no key | did you mean
            signals =                   -> «signal =                  | has no key | did you mean
        UnknownPin
            yMax = 1.75 -> «yMx = 1.75 | has no input pin "yMx" | did you mean "yMax"?
        "#,
    );
}

#[test]
fn what_is_wrong_with_the_value_of_a_misspelt_key_is_said_once_the_key_is_right() {
    assert_mistakes(
        r#"
        UnknownKey
            period = "1ms" -> «perod = 1 | has no key "perod" | did you mean "period"?
        WrongType
            period = "1ms" -> period = «1 | is a duration such as
        "#,
    );
}

#[test]
fn a_key_that_is_near_none_gets_a_list_in_which_each_stands_once() {
    let text = VALID.replace("[node]", "[global]\nx = 1\n[node]");
    let found = crate::findings::findings(&text);
    let help = found[0].help.as_deref().unwrap();
    assert_eq!(
        help,
        "there is: node, protect, limits, task, input, variable, block, alarm, output"
    );
}
