//! Verbs that bring a configuration to a running node, and from it to a file.

use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;

use isochrone_testing::plants::{TANK, tank};
use isochrone_testing::{Domain, Plant, assert_says, mount_refusal, not_tested};

/// The tank without its sensor: its ramp is between constants.
fn tank_alone() -> String {
    TANK.replace("value = \"level\"", "value = 1.0")
}

/// Another block and another constant.
const OTHER: &str = r#"
[[block]]
name = "more"
type = "LimRateOfChangeCI"
in = { value = "ramp.delayedValue", setChangeRate = 1.0 }
"#;

#[test]
fn an_online_change_is_shown_before_it_is_made_and_then_made() {
    let (domain, _node) = tank(&tank_alone());
    domain.write("new.toml", &(tank_alone().replace("10.0 ", "20.0 ") + OTHER));
    // A busy machine may have no time to spare between two cycles.
    let dry = domain.stdout("apply tank new.toml --dry-run");
    let changes = "\n  added    more\n  removed  nothing\n  changed  ramp.setChangeRate: 10 -> 20\n  kept     beat\n           guard\n           ramp\n";
    assert_says(&dry, &["nothing was changed; it would be", changes, "  cost     ", " us\n"]);
    assert_eq!(domain.stdout("get tank ramp.setChangeRate"), "10\n");
    domain.expect("get tank more.value", 1, &["more.value"]);
    domain.expect("journal tank", 0, &["nothing was changed"]);

    let done = domain.stdout("apply tank new.toml --allow-missed");
    assert_says(&done, &["applied, from cycle ", " of task \"fast\" on\n", changes]);
    assert_eq!(domain.stdout("get tank ramp.setChangeRate more.setChangeRate"), "20\n1\n");
    assert_says(&domain.stdout("journal tank"), &["apply 1, cycle ", ", by "]);
}

#[test]
fn a_dry_run_tells_values_that_were_set_as_they_are_and_will_be() {
    let (domain, _node) = tank(&tank_alone());
    domain.stdout("set tank ramp.setChangeRate=12.5 ramp.value=0.25");
    domain.write(
        "new.toml",
        tank_alone().replace("10.0 ", "20.0 ").replace("1500ms\", incrementRange = 1,", "2s\","),
    );
    let dry = domain.stdout("apply tank new.toml --dry-run");
    let told = [
        "ramp.setChangeRate: 12.5 -> 20\n",
        "beat.timeRange: T#1s500ms -> T#2s\n",
        "beat.incrementRange: 1 -> 0\n",
        "  stays    ramp.value at 0.25, as it was set (the file has 1)\n",
    ];
    assert_says(&dry, &told);
    assert_eq!(domain.stdout("get tank ramp.setChangeRate ramp.value"), "12.5\n0.25\n");
    let wired = tank_alone().replace("value = 1.0\n", "value = \"beat.value@prev\"\n");
    domain.write("new.toml", wired.replace("\"beat.value@prev\"", "\"ramp.delayedValue@prev\""));
    let dry = domain.stdout("apply tank new.toml --dry-run");
    assert_says(
        &dry,
        &["  changed  ramp.value: 0.25 -> ramp.delayedValue\n", "at 12.5, as it was"],
    );
}

#[test]
fn errors_of_a_new_configuration_are_shown_as_check_shows_them() {
    let (domain, _node) = tank(&tank_alone());
    let wrong = tank_alone()
        .replace("setChangeRate = ", "setChangeRat = ")
        .replace("\"1500ms\"", "\"soon\"")
        .replace("name = \"beat\"", "name = \"ramp\"");
    domain.write("new.toml", &wrong);
    let checked = domain.run("check new.toml").expect_code(2).stderr;
    // Two of them are those of the blocks and the output that read the ramp, which is the saw tooth here.
    assert_says(&checked, &["5 errors", "new.toml:22:", "new.toml:28:", "new.toml:30:"]);
    assert_says(&checked, &["new.toml:26:", "new.toml:33:"]);
    for more in ["", " --dry-run"] {
        let refused = domain.run(&format!("apply tank new.toml{more}")).expect_code(2);
        assert_eq!(refused.stdout, "");
        let shown = refused.stderr.strip_prefix("the node refuses, and nothing was changed:\n");
        assert_eq!(shown, Some(&*checked), "{}", refused.stderr);
    }
    domain.write("long.toml", &(tank_alone() + &"# long\n".repeat(40_000)));
    domain.expect(
        "apply tank long.toml",
        2,
        &["long.toml has 280", "256 KiB", "start the node again"],
    );
    domain.expect("apply tank none.toml", 2, &["none.toml"]);
    domain.expect("journal tank", 0, &["nothing was changed"]);
}

#[test]
fn what_cannot_be_changed_online_is_named_with_the_way_out() {
    let (domain, _node) = tank(&tank_alone());
    domain.write("new.toml", tank_alone().replace("5ms", "10ms"));
    domain.expect(
        "apply tank new.toml",
        1,
        &["task \"fast\" cannot be changed", "start it with the new"],
    );
    domain.stdout("force tank beat.value=7 --hold");
    domain.write("new.toml", tank_alone().replace("\"beat\"", "\"other\""));
    domain.expect(
        "apply tank new.toml --allow-missed",
        1,
        &["\"beat.value\" is forced", "release it first"],
    );
    domain.stdout("release tank --all");
    domain.stdout("apply tank new.toml --allow-missed");
    assert_says(&domain.stdout("show tank other.* --names"), &["other.value\n"]);
}

/// A task that has a cycle now and then.
fn with_slow_task(period: &str) -> Plant {
    Plant::new("tank").with("control = \"force\"").task("slow", period).ramp("ramp", "value = 1.0")
}

#[test]
fn a_change_of_the_configuration_waits_for_the_transactions_of_others() {
    let text = with_slow_task("2s");
    let (domain, _node) = tank(&text);
    domain.write("new.toml", text.replace("value = 1.0", "value = 2.0"));
    // Its first cycle is over then.
    domain.stdout("get tank ramp.value");
    domain.stdout("set tank ramp.setChangeRate=3");
    domain
        .run("apply tank new.toml --allow-missed")
        .expect_code(0)
        .prints(&["transaction 2, ", "ramp.value: 1 -> 2"]);
}

#[test]
fn an_apply_that_waits_says_for_what_and_is_ended_by_a_signal() {
    let text = with_slow_task("1h");
    let (domain, _node) = tank(&text);
    domain.write("new.toml", text.replace("value = 1.0", "value = 2.0"));
    // Its first cycle is over then.
    domain.stdout("get tank ramp.value");
    domain.stdout("set tank ramp.setChangeRate=3");
    let apply = domain.start_until("apply tank new.toml --allow-missed", "of others");
    apply.stop().expect_code(1).says(&["transaction 1 is still to come", "Ctrl-C"]);
}

#[test]
fn a_node_says_at_its_end_which_values_were_set_and_not_saved() {
    let (domain, node) = tank(&tank_alone());
    domain.stdout("set tank ramp.setChangeRate=12.5 ramp.value=0.25");
    domain.run("save tank -o saved.toml").expect_code(0);
    domain.run("set tank ramp.value=0.5 beat.timeRange=T#2s").expect_code(0);
    node.stop().expect_code(0).says(&[
        "note: 2 values were set and not saved: ramp.value = 0.5, beat.timeRange = 2000; `isochrone save`",
    ]);
    let node = domain.start_node("tank.toml", &tank_alone(), "");
    domain.stdout("set tank ramp.setChangeRate=12.5");
    domain.stdout("undo tank");
    domain.stdout("set tank ramp.value=0.5");
    domain.stdout("save tank");
    let end = node.stop().expect_code(0).stderr;
    assert!(!end.contains("not saved"), "{end}");
}

#[test]
fn a_save_says_that_the_next_start_would_be_refused() {
    let (domain, _node) = tank(&tank_alone());
    domain.stdout("set tank ramp.setChangeRate=12.5");
    let fine = domain.run("save tank -o saved.toml").expect_code(0).stderr;
    assert!(!fine.contains("refuse"), "{fine}");
    domain.run("set tank ramp.callOB=1").expect_code(0);
    let saved = domain.run("save tank -o saved.toml").expect_code(0).stderr;
    assert_says(
        &saved,
        &["warning: `run --strict` would refuse this", "callOB", "saved to saved.toml"],
    );
    domain.run("check saved.toml --strict").expect_code(2);
}

#[test]
fn a_comment_behind_a_saved_value_stays_in_its_column() {
    let (domain, _node) = tank(&tank_alone());
    for value in ["2.5", "12.125", "0.1234567890123", "7.0"] {
        domain.stdout(&format!("set tank ramp.setChangeRate={value}"));
        domain.run("save tank -o saved.toml").expect_code(0);
        let saved = domain.read("saved.toml");
        let line = saved.lines().find(|line| line.contains("# per second")).unwrap();
        let column = TANK.lines().find_map(|line| line.find("# per second")).unwrap();
        let width = format!("setChangeRate = {value} ").len();
        assert_eq!(line.find('#'), Some(column.max(width)), "{line}");
        assert!(line.starts_with(&format!("setChangeRate = {value} ")), "{line}");
    }
}

#[test]
fn a_file_that_is_read_only_is_not_saved_over() {
    let (domain, _node) = tank(&tank_alone());
    domain.stdout("set tank ramp.setChangeRate=2.5");
    fs::set_permissions(domain.path("tank.toml"), Permissions::from_mode(0o444)).unwrap();
    for to in ["--in-place", "-o tank.toml"] {
        domain.expect(
            &format!("save tank {to}"),
            1,
            &["cannot write ", "tank.toml: Permission denied", "it is as it was", "`save -o FILE`"],
        );
        assert_eq!(domain.read("tank.toml"), tank_alone());
        assert!(!domain.path("tank.toml.bak").exists());
    }
}

/// A disk that is full, and then one that is read-only: the node and the verb run where it is mounted.
const DISKS: &str = r#"
fail() { echo "FAILED: $1" >&2; cat node.err saved.err >&2; exit 101; }
isochrone() { "$0" "$@"; }
stays() {
    isochrone save tank "$@" >saved.out 2>saved.err
    test $? = 1 || fail "exit status of save $*"
    grep -q "cannot write .*disk/.*: $why" saved.err || fail "reason of save $*"
    grep -q 'save -o FILE' saved.err || fail "way out of save $*"
    cmp tank.toml disk/tank.toml || fail "the file after save $*"
    test "$(ls -A disk | tr '\n' ' ')" = "full tank.toml " || fail "files after save $*: $(ls -A disk)"
}
mkdir disk
mount -t tmpfs -o size=64k tmpfs disk || exit 100
cp tank.toml disk/tank.toml
"$0" run disk/tank.toml 2>node.err & node=$!
trap 'kill -KILL $node 2>/dev/null' EXIT
until grep -q "is running" node.err; do kill -0 $node || fail "the start"; sleep 0.01; done
isochrone set tank ramp.setChangeRate=2.5 >saved.out 2>saved.err || fail "set"
cat /dev/zero >disk/full 2>/dev/null
why='No space left'
stays --in-place
stays -o disk/tank.toml
stays -o disk/new.toml
mount -o remount,bind,ro disk || exit 100
why='Read-only file system'
stays --in-place
stays -o disk/tank.toml
stays -o disk/new.toml
kill -TERM $node
wait $node
"#;

#[test]
fn a_file_stays_as_it_is_when_its_disk_is_full_or_read_only() {
    if mount_refusal().is_some() {
        return not_tested("a full disk", "no mount namespace can be had");
    }
    let domain = Domain::with(&[("tank.toml", &tank_alone())]);
    domain.start_by(&["unshare", "-rm", "sh", "-c", DISKS], "").finish().expect_code(0);
}
