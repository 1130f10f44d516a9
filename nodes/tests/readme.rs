//! The README's block table is the catalogue's.

use std::path::Path;
use std::process::Command;

#[test]
fn the_block_table_of_the_readme_is_that_of_the_catalogue() {
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("../README.md");
    let readme = std::fs::read_to_string(readme).unwrap();
    let (_, rest) = readme.split_once("<!-- blocks -->\n").expect("the table's beginning");
    let (table, _) = rest.split_once("<!-- end -->").expect("the table's end");
    let command = ["blocks", "--format", "markdown"];
    let printed = Command::new(env!("CARGO_BIN_EXE_isochrone")).args(command).output().unwrap();
    let printed = String::from_utf8(printed.stdout).unwrap();
    assert_eq!(table, printed, "paste the output of `isochrone {}`", command.join(" "));
}
