//! The library as `cmake --install` leaves it, and programs that are built against that.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use isochrone_testing::{Domain, Process};

/// Where everything is built and installed, once for all tests.
pub(crate) fn folder() -> &'static Path {
    Path::new(env!("CARGO_TARGET_TMPDIR"))
}

fn crate_folder() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The folder of the workspace.
pub(crate) fn workspace() -> &'static Path {
    crate_folder().ancestors().nth(2).unwrap()
}

/// Runs a tool to its end.
#[track_caller]
fn run(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let [stdout, stderr] =
        [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(output.status.success(), "{command:?}: {}\n{stdout}\n{stderr}", output.status);
    stdout
}

/// Configures, builds and installs a project of CMake.
fn cmake(source: &Path, build: &Path, settings: &[String], install: bool) {
    run(Command::new("cmake").args(["-S".as_ref(), source, "-B".as_ref(), build]).args(settings));
    run(Command::new("cmake").arg("--build").arg(build));
    if install {
        run(Command::new("cmake").arg("--install").arg(build));
    }
}

/// The prefix with the library, installed from this build.
pub(crate) fn prefix() -> &'static Path {
    static PREFIX: OnceLock<PathBuf> = OnceLock::new();
    PREFIX.get_or_init(|| {
        let prefix = folder().join("prefix");
        let _ = std::fs::remove_dir_all(&prefix);
        let settings = [
            format!("-DCMAKE_INSTALL_PREFIX={}", prefix.display()),
            "-DCMAKE_INSTALL_LIBDIR=lib".to_owned(),
            "-DISOCHRONE_PROFILE=dev".to_owned(),
            format!("-DISOCHRONE_TARGET_DIR={}", folder().parent().unwrap().display()),
        ];
        cmake(crate_folder(), &folder().join("library"), &settings, true);
        prefix
    })
}

/// Builds a project that finds the installed library.
pub(crate) fn build_project(source: &Path, build: &Path) {
    let settings = [
        format!("-DCMAKE_PREFIX_PATH={}", prefix().display()),
        "-DCMAKE_COMPILE_WARNING_AS_ERROR=ON".to_owned(),
    ];
    cmake(source, build, &settings, false);
}

/// A program of examples/cpp, built as its CMakeLists.txt says.
pub(crate) fn example(name: &str) -> PathBuf {
    static EXAMPLES: OnceLock<PathBuf> = OnceLock::new();
    let examples = EXAMPLES.get_or_init(|| {
        let build = folder().join("examples");
        build_project(&workspace().join("examples/cpp"), &build);
        build
    });
    examples.join(name)
}

/// What pkg-config says of the installed library.
fn flags(arguments: &[&str]) -> Vec<String> {
    let mut command = Command::new("pkg-config");
    command.args(arguments).arg("isochrone");
    command.env("PKG_CONFIG_PATH", prefix().join("lib/pkgconfig"));
    run(&mut command).split_whitespace().map(str::to_owned).collect()
}

/// Compiles a file of tests/capi/programs with the flags of pkg-config, linked to the shared library.
pub(crate) fn program(name: &str, source: &str, options: &[&str]) -> PathBuf {
    program_of(name, &programs().join(source), options)
}

/// As [`program`], of any file.
pub(crate) fn program_of(name: &str, source: &Path, options: &[&str]) -> PathBuf {
    compile(name, source, options, &flags(&["--cflags", "--libs"]))
}

/// As [`program`], linked to the static library.
pub(crate) fn static_program(name: &str, source: &str, options: &[&str]) -> PathBuf {
    let flags = flags(&["--cflags", "--libs", "--static"]).into_iter();
    let flags: Vec<_> = flags
        .map(|flag| if flag == "-lisochrone" { "-l:libisochrone.a".to_owned() } else { flag })
        .collect();
    compile(name, &programs().join(source), options, &flags)
}

fn programs() -> PathBuf {
    crate_folder().join("tests/capi/programs")
}

fn compile(name: &str, source: &Path, options: &[&str], flags: &[String]) -> PathBuf {
    let program = folder().join(name);
    let mut command =
        Command::new(if source.extension().is_some_and(|end| end == "cpp") { "c++" } else { "cc" });
    command.args(["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-pthread"]).args(options);
    command.arg(source).arg("-o").arg(&program).args(flags);
    run(&mut command);
    program
}

/// Whether a program runs by valgrind, where an error of memory ends it with status 99.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Valgrind {
    No,
    /// Also for values that nobody wrote.
    All,
    /// For a program that reads what it publishes: it has the same memory at two addresses, and valgrind takes what was
    /// written at one of them for unwritten at the other.
    KnownValues,
}

/// A program with arguments in a domain, not started yet.
pub(crate) fn command(
    domain: &Domain,
    program: &Path,
    arguments: &[&str],
    valgrind: Valgrind,
) -> Command {
    let mut command = if valgrind != Valgrind::No {
        let mut command = Command::new("valgrind");
        command.args(["--quiet", "--error-exitcode=99", "--leak-check=full", "--fair-sched=yes"]);
        command.args([
            "--show-leak-kinds=definite,indirect",
            "--errors-for-leak-kinds=definite,indirect",
        ]);
        let undefined = if valgrind == Valgrind::All { "yes" } else { "no" };
        command.arg(format!("--undef-value-errors={undefined}")).arg(program);
        command
    } else {
        Command::new(program)
    };
    command.args(arguments).env("ICEORYX2_CONFIG", domain.config_file());
    command.env("LD_LIBRARY_PATH", prefix().join("lib"));
    command
}

/// Starts a program in a domain.
pub(crate) fn start(domain: &Domain, program: &Path, arguments: &[&str]) -> Process {
    Process::start(command(domain, program, arguments, Valgrind::No))
}
