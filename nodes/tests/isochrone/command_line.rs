//! What the command line says about itself, and what it refuses.

use isochrone_testing::{Domain, Ended, assert_says};

/// The verbs that the program declares.
fn verbs() -> Vec<String> {
    let command = isochrone_cli::command();
    let shown = command.get_subcommands().filter(|verb| !verb.is_hide_set());
    shown.map(|verb| verb.get_name().to_owned()).collect()
}

fn run(args: &str) -> Ended {
    Domain::new().run(args)
}

#[test]
fn the_help_names_every_verb_and_what_the_exit_status_means() {
    let help = run("--help").silently();
    assert_says(&help, &verbs());
    assert_says(
        &help,
        &["Usage: isochrone", "Exit status: 0", "1 completed", "2 usage", "3 no", "4 too little"],
    );
    assert_says(
        &help,
        &["stdout", "stderr", "--verbose", "RUST_LOG", "Without a verb, runs `demo`"],
    );
    assert_eq!(run("help").silently(), help);
}

#[test]
fn the_help_of_a_verb_says_all_that_it_needs() {
    let needs = [
        ("demo", "--seconds|[default: 10]|--json|three processes"),
        ("check", "<FILE>|TOML|--strict|--json|Examples:"),
        ("run", "<FILE>|--seconds|--cycles|--report|--json|--strict|Ctrl-C|SIGTERM|Examples:"),
        (
            "simulate",
            "<FILE>|--cycles|--inputs|--output|\"-\" for stdout|--task|last row holds|Examples:",
        ),
        (
            "publish",
            "[SERVICE]...|--from|--speed|max|--value|--wave|sawtooth|sine|step|square|--csv|--amplitude|--offset|--frequency|--rate|--count|Examples:",
        ),
        ("replay", "<FILE.mcap>|--config|--tolerance|--report|--output|bit for bit|Examples:"),
        ("subscribe", "<SERVICE>|--csv|--stats|--count|--seconds|--json|latency|Examples:"),
        ("chain", "<SERVICE>|--seconds|--json|latency|lost|unknown|Examples:"),
        ("blocks", "[BLOCK]|--json|--format|markdown|Examples:"),
        ("doctor", "--cpu|--json|Changes nothing|Examples:"),
        ("link", "--listen|--connect|--zenoh|cargo install|ssh|Examples:"),
        ("list", "--json|--names|rate|signals|Examples:"),
        ("bench", "jitter|latency|engine"),
        ("compare", "--json|reports of `bench`"),
        ("completions", "<SHELL>|bash|zsh|fish|Examples:"),
    ];
    for (verb, needs) in needs {
        let help = run(&format!("{verb} --help")).silently();
        assert_says(&help, &needs.split('|').collect::<Vec<_>>());
    }
}

#[test]
fn the_help_of_every_verb_explains_its_arguments_and_gives_examples() {
    let program = isochrone_cli::command();
    for verb in verbs() {
        let help = run(&format!("{verb} --help")).silently();
        assert_says(&help, &[format!("Usage: isochrone {verb}")]);
        let command = program.find_subcommand(&verb).unwrap();
        for argument in command.get_arguments().filter(|argument| !argument.is_hide_set()) {
            let explained = argument.get_help().map(ToString::to_string).unwrap_or_default();
            let words = explained.split_whitespace().count();
            assert!(words > 1, "{verb}: {} is not explained", argument.get_id());
            assert_says(&help, argument.get_long().as_slice());
        }
        // What needs no argument, or has verbs below it, needs no example.
        if command.get_positionals().next().is_some() {
            assert_says(&help, &["Examples:"]);
        }
        let short = run(&format!("{verb} -h")).silently();
        assert_says(&short, &[format!("Usage: isochrone {verb}")]);
        assert_eq!(run(&format!("help {verb}")).silently(), help);
        let help = run("--help").silently();
        let line = help.lines().find(|line| line.trim().starts_with(&verb));
        let words = line.unwrap_or_default().split_whitespace().count();
        assert!(words > 3, "{verb} has no summary");
    }
}

#[test]
fn the_version_is_that_of_the_package() {
    let version = concat!("isochrone ", env!("CARGO_PKG_VERSION"), "\n");
    assert_eq!(run("--version").silently(), version);
    assert_eq!(run("-V").silently(), version);
    for verb in verbs() {
        assert_says(&run(&format!("{verb} --version")).silently(), &[env!("CARGO_PKG_VERSION")]);
    }
}

#[test]
fn a_program_of_another_name_says_that_name_wherever_it_is_called() {
    let folder = Domain::new();
    std::os::unix::fs::symlink(env!("CARGO_BIN_EXE_isochrone"), folder.path("my-plant")).unwrap();
    let run = |args: &str| {
        let mut command = std::process::Command::new(folder.path("my-plant"));
        Ended::from(command.args(args.split_whitespace()).output().unwrap()).silently()
    };
    assert_says(&run("--help"), &["Usage: my-plant"]);
    assert_says(&run("run --help"), &["Usage: my-plant run", "  my-plant run "]);
    assert_says(&run("list --help"), &["  my-plant list"]);
    assert_eq!(run("--version"), concat!("my-plant ", env!("CARGO_PKG_VERSION"), "\n"));
    assert_says(&run("completions bash"), &["_my__plant()", "complete -F _my__plant_and_names"]);
    assert_says(&run("completions zsh"), &["#compdef my-plant", "(my-plant \"$@\""]);
    assert_says(
        &run("completions fish"),
        &["complete -c my-plant", "function __fish_my_plant_services"],
    );
    for shell in ["bash", "zsh", "fish"] {
        let script = run(&format!("completions {shell}"));
        let calls = |line: &&str| !line.contains("`isochrone") && !line.contains("isochrone'");
        let called = script.lines().filter(calls).find(|line| line.contains("_isochrone"));
        assert_eq!(called, None, "{shell}");
    }
}

#[test]
fn what_the_command_line_does_not_know_is_refused_by_name() {
    for (args, named) in [
        ("frobnicate", &["'frobnicate'", "--help"][..]),
        ("simulat x.toml", &["'simulat'", "'simulate'"]),
        ("--frob", &["'--frob'"]),
        ("check --strickt x.toml", &["'--strickt'", "'--strict'"]),
        ("check a.toml b.toml", &["'b.toml'"]),
        ("check", &["<FILE>"]),
        ("run", &["<FILE>"]),
        ("simulate", &["<FILE>", "--cycles"]),
        ("simulate x.toml --cycles 1.5", &["'1.5'", "--cycles"]),
        ("simulate x.toml --cycles 99999999999999999999", &["'99999999999999999999'", "--cycles"]),
        ("publish", &["<SERVICE>"]),
        ("publish plant/analog", &["--value", "--wave", "--csv"]),
        ("publish plant/analog --wave cosine", &["'cosine'", "sawtooth", "sine", "step", "square"]),
        ("subscribe", &["<SERVICE>"]),
        ("watch level --seconds -5ms", &["'-5ms'", "cannot be negative", "500ms or 5min"]),
        ("demo --seconds --json", &["'--json'", "is a number and a unit"]),
        ("record -o x.mcap --split -5ms", &["'-5ms'", "10min, 1h, 500MB or 1GB"]),
        ("publish plant/analog --value 1 --rate -5Hz", &["'-5Hz'", "give frames per second"]),
        ("blocks --format html", &["'html'", "text", "markdown", "json"]),
        ("blocks A B", &["'B'"]),
        ("completions", &["<SHELL>"]),
        ("completions tcsh", &["'tcsh'", "bash", "zsh", "fish"]),
    ] {
        let error = run(args).refused(2);
        assert_says(&error, named);
    }
}

#[test]
fn completions_know_every_verb_and_its_flags() {
    for shell in ["bash", "zsh", "fish"] {
        let script = run(&format!("completions {shell}")).silently();
        assert_says(&script, &verbs());
        assert_says(&script, &["strict", "cycles", "inputs", "amplitude", "markdown"]);
    }
}

#[test]
fn results_that_cannot_be_written_are_an_error() {
    for args in ["blocks", "blocks --json", "completions bash"] {
        let full = std::fs::File::create("/dev/full").unwrap();
        let args: Vec<&str> = args.split_whitespace().collect();
        let ran = Ended::from(Domain::new().command(&args).stdout(full).output().unwrap());
        assert_eq!(ran.code(), 1, "{args:?}");
        assert_says(&ran.stderr, &["cannot write to stdout", "No space left"]);
    }
}

#[test]
fn a_name_with_a_slip_is_answered_with_the_one_that_was_meant() {
    let error = run("blocks sawtooth").refused(2);
    assert_says(&error, &["no block type \"sawtooth\"", "did you mean \"SawTooth\"?"]);
}

#[test]
fn the_log_level_shows_in_the_log_and_not_in_the_result() {
    let folder = Domain::new();
    let quiet = folder.run("blocks").silently();
    let loud = folder.run("blocks -vvv");
    assert_eq!((loud.code(), loud.stdout), (0, quiet));
}
