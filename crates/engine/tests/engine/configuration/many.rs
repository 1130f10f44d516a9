//! Files with many mistakes.

use isochrone_engine::Problem;

use crate::findings::{VALID, findings};

#[test]
fn all_mistakes_of_a_file_are_reported_together_in_its_order() {
    use Problem::*;
    let mistakes = [
        ("name = \"level\"", "name = \"Level\"", BadName),
        ("phase = \"100us\"", "phase = \"2ms\"", OutOfRange),
        ("overrun =", "overun =", UnknownKey),
        ("channel = 7", "channel = \"7\"", WrongType),
        ("y1 = 0.0\n", "", MissingPin),
        ("yMin = 0.0", "ymin = 0.0", UnknownPin),
        ("type = \"LimRateOfChangeCI\"", "type = \"LimRate\"", UnknownBlockType),
        ("timeRange = 50", "timeRange = 5.0", TypeMismatch),
        ("task = \"fast\"\nsignals", "task = \"slow\"\nsignals", UnknownTask),
        ("\"scale.y\", \"ramp", "\"scael.y\", \"ramp", UnknownSource),
    ];
    let mut text = VALID.to_string();
    for (from, to, _) in mistakes {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        text = text.replace(from, to);
    }
    // Without a type; and its name is taken.
    text += "[[block]]\nname = \"saw\"\nin.x = 1\n";
    let found: Vec<Problem> = findings(&text).iter().map(|finding| finding.problem).collect();
    let expected = [
        BadName,
        OutOfRange,
        UnknownKey,
        WrongType,
        MissingPin,
        UnknownPin,
        UnknownBlockType,
        TypeMismatch,
        UnknownTask,
        UnknownSource,
        MissingKey,
        Duplicate,
    ];
    assert_eq!(found, expected);
}

#[test]
fn the_help_is_the_same_in_every_run() {
    let text = VALID.replace("value = \"scale.y\"", "value = \"q\"");
    let text = text.replace("\"scale.y\", ", "\"q.y\", ");
    let first: Vec<_> = findings(&text).into_iter().map(|finding| finding.help).collect();
    for _ in 0..20 {
        let again: Vec<_> = findings(&text).into_iter().map(|finding| finding.help).collect();
        assert_eq!(again, first);
    }
}

/// Blocks in a file of which every second line is a wire from a block that does not exist.
fn with_wrong_wires(blocks: usize) -> String {
    let mut text = "[node]\nname = \"n\"\n[[task]]\nname = \"t\"\nperiod = \"1ms\"\n".to_string();
    for block in 0..blocks {
        text += &format!(
            "[[block]]\nname = \"ramp_{block}\"\ntype = \"LimRateOfChangeCI\"\n\
             in.value = \"rmap_{block}.delayedValue\"\n"
        );
    }
    text
}

#[test]
fn every_wrong_wire_of_a_huge_file_is_found_and_the_first_ones_are_explained() {
    let found = findings(&with_wrong_wires(20_000));
    assert_eq!(found.len(), 20_000);
    for (block, finding) in found.iter().take(20).enumerate() {
        assert_eq!(finding.message, format!("there is no block \"rmap_{block}\""));
        let help = finding.help.as_deref().unwrap_or_default();
        assert_eq!(help, format!("did you mean \"ramp_{block}\"?"));
    }
    let last = found.last().and_then(|finding| finding.help.as_deref()).unwrap_or_default();
    assert!(last.starts_with("there are 20000: ramp_0, ramp_1, "), "{last}");
}

#[test]
fn every_wrong_wire_of_a_file_of_common_size_is_explained() {
    let found = findings(&with_wrong_wires(100));
    for (block, finding) in found.iter().enumerate() {
        let help = finding.help.as_deref().unwrap_or_default();
        assert_eq!(help, format!("did you mean \"ramp_{block}\"?"));
    }
}
