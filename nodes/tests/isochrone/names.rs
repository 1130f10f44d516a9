//! Names of services: those that no service can have are refused before anything is touched.

use isochrone_testing::Domain;

#[test]
fn a_name_that_no_service_can_have_is_refused_with_exit_status_2() {
    let domain = Domain::new();
    let long = "s".repeat(239);
    for (name, says) in [
        ("", "the service name is empty"),
        (" ", "begins or ends with a blank"),
        ("plant/level ", "begins or ends with a blank"),
        ("plänt", "contains 'ä'; only printable ASCII characters"),
        ("plant\u{1b}[2J", r"contains '\u{1b}'; only printable ASCII characters"),
        ("iox2://plant", "which iceoryx2 keeps for itself"),
        (&long, "239 bytes long; at most 238"),
    ] {
        for verb in [&["publish", name, "--value", "1"][..], &["subscribe", name]] {
            let ended = domain.start_with(verb).finish().expect_code(2).says(&[says]);
            assert!(!ended.stderr.contains('\u{1b}') && ended.stdout.is_empty(), "{verb:?}");
        }
    }
    domain.expect_no_leftovers();
}

#[test]
fn a_name_of_238_bytes_and_one_with_a_blank_in_it_carry_frames() {
    let domain = Domain::new();
    for name in [&"s".repeat(238), "tank 3/level"] {
        let mut publisher = domain.start_with(&["publish", name, "--value", "1"]);
        publisher.wait_for("publishing");
        domain.start_with(&["subscribe", name, "--count", "3"]).finish().expect_code(0);
    }
}

#[test]
fn a_recording_whose_columns_cannot_be_signals_is_refused_with_exit_status_2() {
    let domain = Domain::with(&[("in.csv", "fill\u{7}level\n1\n")]);
    domain.expect(
        "publish plant/level --csv in.csv",
        2,
        &[r"fill\u{7}level", "a name has no control characters"],
    );
}
