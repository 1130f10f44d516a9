//! The file that says which iceoryx2 domain to live in: a slip in it never leads into another one.

use std::fs;
use std::path::PathBuf;

use isochrone_testing::plants::RELAY;
use isochrone_testing::{Domain, Ended, Process};

/// Runs a verb with a file as its domain's configuration.
fn run(domain: &Domain, file: &str) -> Ended {
    domain.run(&format!("publish plant/level --value 1 --count 1 --iceoryx2-config {file}"))
}

#[test]
fn a_file_that_iceoryx2_would_half_understand_is_refused_with_the_place_and_the_way_out() {
    let domain = Domain::new();
    let root = domain.path("iceoryx2");
    let good = format!("[global]\nroot-path = {root:?}\nprefix = \"slip_\"\n");
    fs::create_dir(domain.path("folder")).unwrap();
    for (text, says) in [
        (
            good.replace("prefix", "prefx"),
            "bad.toml:3:1: [global] has no key \"prefx\"; did you mean \"prefix\"?",
        ),
        (
            good.replace("root-path", "root_path"),
            "bad.toml:2:1: [global] has no key \"root_path\"; did you mean \"root-path\"?",
        ),
        (
            good.replace("[global]", "# ä\n[globl]"),
            "bad.toml:2:2: the file has no key \"globl\"; did you mean \"global\"?",
        ),
        (good.replace("[global]", ""), "the file has no key \"root-path\"; it belongs in [global]"),
        (
            good.clone() + "[global.node]\n\"\\u001b[2J\" = 1\n",
            r#"[global.node] has no key "\u{1b}[2J"; there is: "#,
        ),
        (
            "[global]\nroot-path = \"iceoryx2\"\n".into(),
            "bad.toml:2:13: root-path \"iceoryx2\" is relative",
        ),
        ("[global]\nroot-path = \"./iceoryx2\"\n".into(), "begin it with /"),
        ("[global]\nroot-path = \"\"\n".into(), "bad.toml:2:13: root-path \"\" is relative"),
        (String::new(), "bad.toml: empty; write [global] with a root-path and a prefix"),
        ("# nothing\n\n".into(), "bad.toml: empty"),
        (good.replace("\"slip_\"", "7"), "bad.toml:3:10: not a valid iceoryx2 0.10 configuration"),
        (good.replace("\"slip_\"", "\"a/b\""), "bad.toml:3:10: not a valid iceoryx2"),
        (good.replace("\"slip_\"", ""), "bad.toml:3:10: not a valid iceoryx2"),
        (good.clone() + "prefix = \"twice_\"\n", "bad.toml:4:1: not a valid iceoryx2"),
        ("prefix = ".to_owned() + &"[".repeat(80_000), "bad.toml:1:"),
    ] {
        domain.write("bad.toml", &text);
        let ended = run(&domain, "bad.toml").expect_code(2).says(&[says]);
        assert!(ended.stderr.len() < 2_000 && !ended.stderr.contains('\u{1b}'), "{}", ended.stderr);
    }
    fs::write(domain.path("latin1.toml"), b"[global]\nprefix = \"\xe4\"\n").unwrap();
    for (file, says) in [
        (
            "latin1.toml",
            "latin1.toml:2:11: not a valid iceoryx2 0.10 configuration: this is not UTF-8",
        ),
        ("/dev/null", "/dev/null: not an ordinary file"),
        ("folder", "folder: not an ordinary file"),
        ("missing.toml", "missing.toml: no such file"),
    ] {
        run(&domain, file).expect_code(2).says(&[says]);
    }
    assert!(isochrone_testing::shared_memory("slip_").is_empty() && !root.exists());
}

#[test]
fn a_file_in_a_usual_place_is_held_to_the_same() {
    for place in ["config/iceoryx2.toml", "home/.config/iceoryx2/iceoryx2.toml"] {
        let domain = Domain::new();
        let file = domain.path(place);
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        let start = |arguments: &[&str]| {
            let mut command = domain.command(arguments);
            command.env("HOME", domain.path("home")).env_remove("ICEORYX2_CONFIG");
            Process::start(command).finish()
        };
        let publish = ["publish", "plant/level", "--value", "1", "--count", "1"];
        for (text, says) in [
            ("", "iceoryx2.toml: empty"),
            ("[global]\nprefx = \"x\"\n", "iceoryx2.toml:2:1: [global] has no key \"prefx\""),
            ("[global]\nroot-path = \"x\"\n", "iceoryx2.toml:2:13: root-path \"x\" is relative"),
        ] {
            fs::write(&file, text).unwrap();
            start(&publish).expect_code(2).says(&[says]);
        }
        fs::copy(domain.config_file(), &file).unwrap();
        let ended = start(&[&publish[..], &["-v"]].concat()).expect_code(0);
        assert_joined(&ended, &domain, place);
        domain.expect_no_leftovers();
    }
}

#[test]
fn the_environment_names_a_file_that_comes_before_the_usual_places_and_after_the_argument() {
    let domain = Domain::new();
    fs::create_dir_all(domain.path("config")).unwrap();
    domain.write("config/iceoryx2.toml", "");
    let start = |file: PathBuf, arguments: &[&str]| {
        let publish = ["publish", "plant/level", "--value", "1", "--count", "1", "-v"];
        let mut command = domain.command(&[&publish, arguments].concat());
        command.env("ICEORYX2_CONFIG", file);
        Process::start(command).finish()
    };
    let file = domain.config_file();
    let name = file.display().to_string();
    assert_joined(&start(file, &[]).expect_code(0), &domain, &name);
    let absent = domain.path("absent.toml");
    assert_joined(
        &start(absent.clone(), &["--iceoryx2-config", &name]).expect_code(0),
        &domain,
        &name,
    );
    start(absent, &[]).expect_code(2).says(&["absent.toml: no such file"]);
    assert!(start(PathBuf::new(), &[]).expect_code(2).stderr.contains("iceoryx2.toml: empty"));
}

#[test]
fn every_verb_that_joins_a_domain_takes_the_file_that_its_argument_names() {
    let domain = Domain::with(&[("node.toml", RELAY)]);
    for verb in [
        "alarms relay",
        "apply relay node.toml",
        "chain relay/in relay/out",
        "force relay x=1 --hold",
        "forces relay",
        "get relay x",
        "journal relay",
        "link --link /bin/true --connect 127.0.0.1:1 relay/in",
        "list",
        "publish relay/in --value 1",
        "record -o out.mcap",
        "release relay x",
        "run node.toml --cycles 1",
        "save relay",
        "scope relay x",
        "set relay x=1",
        "show relay",
        "subscribe relay/out",
        "undo relay",
        "view relay --port 0",
        "watch relay x",
    ] {
        let absent = ["absent.toml: no such file"];
        domain.expect(&format!("{verb} --iceoryx2-config absent.toml"), 2, &absent);
    }
}

#[test]
fn verbose_says_which_domain_was_joined_and_which_file_says_so() {
    let domain = Domain::new();
    let quiet = domain.run("publish plant/level --value 1 --count 1").expect_code(0);
    assert!(!quiet.stderr.contains("root path"), "{}", quiet.stderr);
    let ended = domain.run("publish plant/level --value 1 --count 1 -v").expect_code(0);
    assert_joined(&ended, &domain, "domain.toml");
}

#[track_caller]
fn assert_joined(ended: &Ended, domain: &Domain, file: &str) {
    let told = ended.stderr.lines().find(|line| line.contains("iceoryx2 domain:"));
    let told = told.unwrap_or_else(|| panic!("{}", ended.stderr));
    let root = format!("root path {}, prefix isotest", domain.path("iceoryx2").display());
    assert!(told.contains(&root) && told.contains(file), "{told}");
}
