//! Tests in processes of their own.

use std::any::type_name;
use std::path::Path;
use std::process::Command;

use isochrone_ipc::Domain;

use crate::afresh;

/// Says that this process runs one test alone.
const ALONE: &str = "ISOCHRONE_TEST_ALONE";
/// The domain of a process that plays a [`role`].
const DOMAIN: &str = "ISOCHRONE_TEST_DOMAIN";

/// Runs the body of the test that calls this in a process of its own: for tests that change the limits of their
/// process, lock its memory, or look at what it has mapped. Give it a closure in the test function itself.
#[track_caller]
pub fn in_own_process<F: FnOnce()>(body: F) {
    if std::env::var_os(ALONE).is_some() {
        return body();
    }
    // program::module::test::{{closure}}
    let test = type_name::<F>().trim_end_matches("::{{closure}}");
    let test = test.split_once("::").map_or(test, |(_program, test)| test);
    let mut command = this_test(test);
    let output = afresh(command.env(ALONE, "1")).output().unwrap();
    let said =
        [output.stdout, output.stderr].map(|said| String::from_utf8_lossy(&said).into_owned());
    assert!(output.status.success() && said[0].contains("1 passed"), "{}\n{}", said[0], said[1]);
}

/// A process of this test program that plays a part in another test: `test` is the path of an ignored test, which
/// asks [`role_domain`] for its domain. Its standard output begins with the harness's own lines.
pub fn role(test: &str, domain: &Path) -> Command {
    let mut command = this_test(test);
    command.arg("--ignored").env(DOMAIN, domain);
    afresh(&mut command);
    command
}

/// The domain that [`role`] gave this process; `None` where somebody runs the ignored tests by hand.
pub fn role_domain() -> Option<Domain> {
    let file = std::env::var_os(DOMAIN)?;
    Some(Domain::from_file(Path::new(&file)).unwrap())
}

fn this_test(test: &str) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", test, "--nocapture"]);
    command
}
