//! A Python for tests: `target/python`, as `.ci/run` makes it, or the `python3` on the path. Without the
//! packages that a test needs it skips itself, but not where `CI` is set.

use std::path::{Path, PathBuf};
use std::process::Command;

use isochrone_testing::not_tested;

/// A Python that can import these modules; `packages` says how to install them.
pub(crate) fn python(modules: &str, packages: &str) -> Option<PathBuf> {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/python/bin/python3");
    let candidates = [own, PathBuf::from("python3")];
    let found = candidates.into_iter().find(|python| {
        let probe = Command::new(python).args(["-c", &format!("import {modules}")]).output();
        probe.is_ok_and(|probe| probe.status.success())
    });
    let why = format!("no python3 has {modules}; pip install {packages}");
    if found.is_none() {
        let may_lack = std::env::var("ISOCHRONE_TEST_WITHOUT").is_ok_and(|lacks| lacks == "python");
        assert!(may_lack || std::env::var_os("CI").is_none(), "{why}");
        not_tested("what Python reads and writes", &why);
    }
    found
}
