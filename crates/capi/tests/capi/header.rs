//! The committed header is what the sources say.

use std::path::Path;

#[test]
fn the_header_is_what_cbindgen_makes_of_the_sources() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut made = Vec::new();
    cbindgen::generate(folder).unwrap().write(&mut made);
    let file = folder.join("include/isochrone.h");
    if std::env::var_os("ISOCHRONE_TEST_PAGES").is_some_and(|value| value == "write") {
        std::fs::write(&file, &made).unwrap();
    }
    let (made, kept) = (String::from_utf8(made).unwrap(), std::fs::read_to_string(&file).unwrap());
    assert!(made == kept, "print it anew: see cbindgen.toml\n{made}");
}
