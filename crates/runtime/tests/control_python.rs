//! The client in Python, against a node in another process.
//!
//! It needs `pip install iceoryx2==0.10.0`, in `target/python` (as `.ci/run` makes it) or for the
//! `python3` on the path. Without it the test skips itself, but not where `CI` is set.

mod operated;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use isochrone_ipc::IsolatedDomain;
use operated::{Running, name};

#[test]
#[ignore = "is run by the test that asks it"]
fn takes_requests() {
    operated::take_requests();
}

/// A Python that has iceoryx2.
fn python() -> Option<PathBuf> {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/python/bin/python3");
    let found = [own, PathBuf::from("python3")].into_iter().find(|python| {
        let probe = Command::new(python).args(["-c", "import iceoryx2"]).output();
        probe.is_ok_and(|probe| probe.status.success())
    });
    if found.is_none() {
        let why = "no python3 has the package iceoryx2; pip install iceoryx2==0.10.0";
        assert!(std::env::var_os("CI").is_none(), "{why}");
        println!("not tested: {why}");
    }
    found
}

fn operate(domain: &IsolatedDomain, python: &Path, arguments: &[&str]) -> Output {
    let program = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/python/operate.py");
    let mut command = Command::new(python);
    command.arg(program).args(arguments).env("ICEORYX2_CONFIG", domain.file());
    // Nothing is written beside the programs.
    command.env("PYTHONDONTWRITEBYTECODE", "1").output().unwrap()
}

#[test]
fn a_client_in_python_lists_reads_sets_and_forces_and_is_refused_in_words() {
    let Some(python) = python() else { return };
    let domain = IsolatedDomain::new("isotest").unwrap();
    let _level = Running::start(&domain, "takes_requests", "level");
    let ask = |arguments: &[&str]| {
        let output = operate(&domain, &python, arguments);
        let text = |bytes| String::from_utf8(bytes).unwrap();
        (output.status.code(), text(output.stdout), text(output.stderr))
    };
    let (code, list, told) = ask(&["level", "list"]);
    assert_eq!((code, list.lines().count()), (Some(0), 5000), "{told}");
    assert_eq!(list.lines().next(), Some("block.0.setChangeRate LREAL parameter"));
    assert_eq!(ask(&["level", "list", &name(3)]).1.lines().count(), 1);

    let (set, get) = (name(3) + "=0.1", name(3));
    let (code, done, told) = ask(&["level", "set", &set, "--at", "5"]);
    let expected = format!("transaction 1 in cycle: fast 5\n{}: 3.0 -> 0.1\n", name(3));
    assert_eq!((code, done), (Some(0), expected), "{told}");
    assert_eq!(ask(&["level", "get", &get]).1, format!("{}=0.1\n", name(3)));
    let (code, done, told) = ask(&["level", "force", &set, "--seconds", "2"]);
    assert_eq!(code, Some(0), "{told}");
    assert!(done.starts_with("transaction 2 in cycle: fast 0"), "{done}");

    let (code, _, told) = ask(&["level", "get", "nothing"]);
    assert_eq!((code, &*told), (Some(1), "refused (1): there is no signal \"nothing\"\n"));
    let (code, _, told) = ask(&["level", "set", "a=1", "--at", "soon"]);
    assert_eq!(code, Some(1));
    assert!(told.contains("\"at\" cannot be \"soon\"; give a whole number"), "{told}");
    let (code, _, told) = ask(&["levl", "get", &get]);
    assert_eq!(code, Some(3), "{told}");
    assert!(told.contains("no node \"levl\" takes requests here"), "{told}");
    assert_eq!(ask(&["level"]).0, Some(2));
}
