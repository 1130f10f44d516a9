//! What README and docs say of the blocks, the configuration and the command line is what the program
//! knows.

use std::path::Path;
use std::process::Command;

fn read(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file);
    std::fs::read_to_string(path).unwrap()
}

/// What `isochrone blocks` prints in a format.
fn blocks(format: &str) -> String {
    let command = ["blocks", "--format", format];
    let printed = Command::new(env!("CARGO_BIN_EXE_isochrone")).args(command).output().unwrap();
    String::from_utf8(printed.stdout).unwrap()
}

#[test]
fn the_block_table_of_the_readme_is_that_of_the_catalogue() {
    let readme = read("README.md");
    let (_, rest) = readme.split_once("<!-- blocks -->\n").expect("the table's beginning");
    let (table, _) = rest.split_once("<!-- end -->").expect("the table's end");
    // The pins are on the reference page.
    let first_two = |line: &str| line.splitn(4, '|').take(3).collect::<Vec<_>>().join("|") + "|\n";
    let expected: String = blocks("markdown").lines().map(first_two).collect();
    assert_eq!(
        table, expected,
        "paste the first two columns of `isochrone blocks --format markdown`"
    );
}

#[test]
fn the_reference_page_of_the_blocks_is_that_of_the_catalogue() {
    let help = "write the output of `isochrone blocks --format page` to docs/blocks.md";
    assert_eq!(read("docs/blocks.md"), blocks("page"), "{help}");
}

#[test]
fn the_reference_page_of_the_configuration_is_that_of_the_keys() {
    let printed =
        Command::new(env!("CARGO_BIN_EXE_isochrone")).args(["check", "--reference"]).output();
    let page = String::from_utf8(printed.unwrap().stdout).unwrap();
    let help = "write the output of `isochrone check --reference` to docs/configuration.md";
    assert_eq!(read("docs/configuration.md"), page, "{help}");
}

#[test]
fn the_reference_page_of_the_command_line_is_that_of_the_program() {
    let printed = Command::new(env!("CARGO_BIN_EXE_isochrone")).arg("reference").output().unwrap();
    assert!(
        read("docs/cli.md") == String::from_utf8(printed.stdout).unwrap(),
        "the command line has changed; cargo run -- reference > docs/cli.md"
    );
}
