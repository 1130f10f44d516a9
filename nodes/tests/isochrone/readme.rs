//! What README and docs say of the blocks, the configuration and the command line is what the program
//! knows.

use isochrone_testing::Domain;
use std::path::Path;

fn read(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file);
    std::fs::read_to_string(path).unwrap()
}

/// Compares a page with what the program prints. With `ISOCHRONE_TEST_PAGES=write` the page becomes that.
fn assert_page(file: &str, printed: &str) {
    if std::env::var("ISOCHRONE_TEST_PAGES").is_ok_and(|pages| pages == "write") {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file);
        return std::fs::write(path, printed).unwrap();
    }
    assert!(
        read(file) == printed,
        "{file} is not what the program prints; ISOCHRONE_TEST_PAGES=write cargo test -p isochrone-cli \
         --test isochrone readme:: prints all such pages anew"
    );
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
    let expected = printed("blocks --format markdown");
    assert_page("README.md", &readme.replacen(table, &expected, 1));
}

#[test]
fn the_readme_is_read_in_a_few_minutes() {
    let lines = read("README.md").lines().count();
    assert!(lines <= 150, "README.md has {lines} lines: what goes beyond 150 belongs into docs/");
}

#[test]
fn the_reference_page_of_the_blocks_is_that_of_the_catalogue() {
    assert_page("docs/blocks.md", &printed("blocks --format page"));
}

#[test]
fn the_reference_page_of_the_configuration_is_that_of_the_keys() {
    assert_page("docs/configuration.md", &printed("check --reference"));
}

#[test]
fn the_reference_page_of_the_command_line_is_that_of_the_program() {
    assert_page("docs/cli.md", &printed("reference"));
}
