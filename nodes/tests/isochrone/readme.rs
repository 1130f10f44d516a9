//! What README and docs say of the blocks, the configuration and the command line is what the program
//! knows.

use isochrone_testing::Domain;
use std::path::Path;

fn read(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file);
    std::fs::read_to_string(path).unwrap()
}

/// What the program prints.
fn printed(arguments: &str) -> String {
    Domain::new().run(arguments).expect_code(0).stdout
}

#[test]
fn the_block_table_of_the_readme_is_that_of_the_catalogue() {
    let readme = read("README.md");
    let (_, rest) = readme.split_once("<!-- blocks -->\n").expect("the table's beginning");
    let (table, _) = rest.split_once("<!-- end -->").expect("the table's end");
    // The pins are on the reference page.
    let first_two = |line: &str| line.splitn(4, '|').take(3).collect::<Vec<_>>().join("|") + "|\n";
    let expected: String = printed("blocks --format markdown").lines().map(first_two).collect();
    assert_eq!(
        table, expected,
        "paste the first two columns of `isochrone blocks --format markdown`"
    );
}

#[test]
fn the_reference_page_of_the_blocks_is_that_of_the_catalogue() {
    let help = "write the output of `isochrone blocks --format page` to docs/blocks.md";
    assert_eq!(read("docs/blocks.md"), printed("blocks --format page"), "{help}");
}

#[test]
fn the_reference_page_of_the_configuration_is_that_of_the_keys() {
    let page = printed("check --reference");
    let help = "write the output of `isochrone check --reference` to docs/configuration.md";
    assert_eq!(read("docs/configuration.md"), page, "{help}");
}

#[test]
fn the_reference_page_of_the_command_line_is_that_of_the_program() {
    assert!(
        read("docs/cli.md") == printed("reference"),
        "the command line has changed; cargo run -- reference > docs/cli.md"
    );
}
