//! Gives the shared library its name: programs find the version that they were built with.

fn main() {
    // Before 1.0, each minor version may change the interface.
    let version = [env!("CARGO_PKG_VERSION_MAJOR"), env!("CARGO_PKG_VERSION_MINOR")].join(".");
    println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libisochrone.so.{version}");
    println!("cargo::rerun-if-changed=build.rs");
}
