use super::*;
use crate::bench::made_up::{bound_rule, gate, ratio_rule};

/// A gate as its file has it, in JSON.
fn read(text: &str) -> Result<Gate, String> {
    serde_json::from_str(text).map_err(|error| error.to_string())
}

#[test]
fn a_percentile_that_there_is_not_is_an_error_that_names_the_rule() {
    let rule = |percentile: &str| {
        format!(r#"{{ "arm": "hybrid", "percentile": "{percentile}", "at_most_ns": 1 }}"#)
    };
    let error =
        read(&format!(r#"{{ "rule": [{}, {}] }}"#, rule("p50"), rule("p99.9"))).unwrap_err();
    assert!(error.contains("rule 2: there is no percentile \"p99.9\""), "{error}");
    assert!(error.contains("p99_9"), "{error}");
}

#[test]
fn a_rule_has_exactly_one_bound() {
    let of = |bound: &str| {
        read(&format!(r#"{{ "rule": [{{ "arm": "hybrid", "percentile": "p50"{bound} }}] }}"#))
    };
    let (sleep, least, most) =
        (r#", "times_lower_than": "sleep""#, r#", "at_least": 2"#, r#", "at_most_ns": 5"#);
    for bound in [
        String::new(),
        sleep.to_owned(),
        least.to_owned(),
        [sleep, least, most].concat(),
        [sleep, most].concat(),
        [least, most].concat(),
    ] {
        let error = of(&bound).unwrap_err();
        assert!(error.contains("rule 1: give either"), "{bound}: {error}");
    }
    assert_eq!(of(&[sleep, least].concat()), Ok(ratio_rule("p50", 2.0)));
    assert_eq!(of(most), Ok(bound_rule("p50", 5.0)));
    assert!(of(r#", "at_most_ns": 0"#).unwrap_err().contains("greater than 0"));
}

#[test]
fn an_arm_that_will_not_be_measured_is_found_beforehand() {
    let gate =
        gate([bound_rule("p50", 1.0), ratio_rule("p50", 1.0)].map(|g| g.rules[0].clone()).into());
    assert_eq!(gate.check_arms(&["sleep", "hybrid"]), Ok(()));
    let error = gate.check_arms(&["hybrid", "spin"]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "rule 2: this bench has no arm \"sleep\", only hybrid, spin; change the rule or --arms"
    );
    assert!(gate.check_arms(&["sleep"]).unwrap_err().to_string().contains("rule 1"));
}

#[test]
fn a_file_says_rules_and_how_many_turns_may_be_invalid_and_nothing_else() {
    let rule = r#"{ "arm": "hybrid", "percentile": "p50", "at_most_ns": 7 }"#;
    assert_eq!(read(&format!(r#"{{ "rule": [{rule}] }}"#)).unwrap(), bound_rule("p50", 7.0));
    let lenient = read(&format!(r#"{{ "rule": [{rule}], "invalid_turns": 0.5 }}"#)).unwrap();
    assert_eq!(lenient.invalid_turns, 0.5);
    assert!(read(r#"{ "rule": [], "rules": [] }"#).is_err());
    assert!(read(&format!(r#"{{ "rule": [{}] }}"#, rule.replace("at_most_ns", "atmost"))).is_err());
}

#[test]
fn a_bound_that_is_no_number_above_0_makes_no_sense() {
    let ratio = |at_least| WrittenRule {
        times_lower_than: Some("sleep".into()),
        at_least: Some(at_least),
        ..written()
    };
    let bound = |at_most_ns| WrittenRule { at_most_ns: Some(at_most_ns), ..written() };
    for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        for (key, rule) in [("at_least", ratio(value)), ("at_most_ns", bound(value))] {
            let value = value.to_string();
            let refusal = rule.checked(3).unwrap_err().to_string();
            assert_eq!(
                refusal,
                format!("rule 3: {key} is {value}; it must be a number greater than 0")
            );
        }
    }
}

#[test]
fn invalid_turns_are_a_part_of_all_turns_from_0_to_1() {
    let gate = |invalid_turns| Gate::try_from(WrittenGate { rule: vec![], invalid_turns });
    for part in [-0.1, 1.1, 20.0, f64::NAN, f64::INFINITY] {
        let error = gate(part).unwrap_err();
        assert!(error.to_string().starts_with(&format!("invalid_turns is {part}; ")), "{error}");
    }
    for part in [0.0, 0.2, 1.0] {
        assert!(gate(part).is_ok());
    }
}

#[test]
fn an_arm_is_not_compared_with_itself() {
    let rule =
        WrittenRule { times_lower_than: Some("hybrid".into()), at_least: Some(1.0), ..written() };
    let refusal = rule.checked(2).unwrap_err().to_string();
    assert!(
        refusal.starts_with("rule 2: the arm \"hybrid\" is compared with itself; "),
        "{refusal}"
    );
}

fn written() -> WrittenRule {
    WrittenRule {
        arm: "hybrid".into(),
        percentile: "p50".into(),
        times_lower_than: None,
        at_least: None,
        at_most_ns: None,
    }
}
