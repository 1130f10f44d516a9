//! Every case in `golden/` comes out bit for bit.

use std::fs;
use std::path::{Path, PathBuf};

use isochrone_testing::{Domain, Ended, assert_says, cells};

/// The folders of the cases. A folder that is no case is a mistake.
fn cases() -> Vec<PathBuf> {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../golden").canonicalize().unwrap();
    let mut cases: Vec<PathBuf> = fs::read_dir(&golden)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_dir())
        .collect();
    cases.sort();
    assert!(!cases.is_empty(), "{} holds no case", golden.display());
    for (case, file) in
        cases.iter().flat_map(|case| [(case, "config.toml"), (case, "expected.csv")])
    {
        assert!(case.join(file).is_file(), "{} has no {file}", case.display());
    }
    cases
}

fn run(args: &[&std::ffi::OsStr]) -> Ended {
    Domain::new().run_with(args)
}

/// Simulates a case; `Err` names the file, the place and both numbers.
fn check(case: &Path) -> Result<(), String> {
    let (config, inputs, expected) =
        (case.join("config.toml"), case.join("in.csv"), case.join("expected.csv"));
    let name = expected.display().to_string();
    let expected = fs::read_to_string(&expected).unwrap();
    let cycles = expected.lines().count().saturating_sub(1).to_string();
    let mut args =
        vec!["simulate".as_ref(), config.as_os_str(), "--cycles".as_ref(), cycles.as_ref()];
    if inputs.is_file() {
        args.extend(["--inputs".as_ref(), inputs.as_os_str()]);
    }
    let ran = run(&args);
    if ran.code() != 0 {
        return Err(format!("{name}: exit status {}: {}", ran.code(), ran.stderr));
    }
    compare(&expected, &ran.stdout).map_err(|difference| format!("{name}:{difference}"))
}

/// Headers as text, numbers as bits. `Err` says where the first difference is and how many there are.
fn compare(expected: &str, found: &str) -> Result<(), String> {
    let (expected, found) = (cells(expected), cells(found));
    let (Some(header), Some(found_header)) = (expected.first(), found.first()) else {
        return Err(format!("1: {} rows expected, {} found", expected.len(), found.len()));
    };
    if expected.len() < 2 {
        return Err("1: a case without rows shows nothing".into());
    }
    if header != found_header {
        return Err(format!("1: header {header:?} expected, {found_header:?} found"));
    }
    if expected.len() != found.len() {
        return Err(format!("{}: the last row expected, {} found", expected.len(), found.len()));
    }
    let bits = |text: &str| text.parse::<f64>().ok().map(f64::to_bits);
    let mut differences = Vec::new();
    for (line, (expected, found)) in expected.iter().zip(&found).enumerate().skip(1) {
        if expected.len() != header.len() || found.len() != header.len() {
            let (expected, found) = (expected.len(), found.len());
            differences.push(format!("{}: {expected} values expected, {found} found", line + 1));
        }
        for ((column, expected), found) in header.iter().zip(expected).zip(found) {
            if bits(expected).is_none() || bits(expected) != bits(found) {
                differences
                    .push(format!("{}: {column}: {expected} expected, {found} found", line + 1));
            }
        }
    }
    match differences.as_slice() {
        [] => Ok(()),
        [first] => Err(first.clone()),
        [first, rest @ ..] => Err(format!("{first}; {} more differences", rest.len())),
    }
}

#[test]
fn every_case_comes_out_bit_for_bit() {
    let failures: Vec<String> = cases().iter().filter_map(|case| check(case).err()).collect();
    assert!(failures.is_empty(), "{} cases differ:\n{}", failures.len(), failures.join("\n"));
}

#[test]
fn a_case_that_differs_is_reported_with_its_place() {
    let expected = "cycle,a.y,b.y\n0,0.1,NaN\n1,-0.0,inf\n";
    for (found, difference) in [
        (expected, None),
        ("cycle,a.y,b.y\n0.0,1e-1,NaN\n1,-0,inf\n", None),
        ("", Some("1: 3 rows expected, 0 found")),
        ("cycle,a.y,c.y\n0,0.1,NaN\n1,-0.0,inf\n", Some("1: header")),
        ("cycle,a.y,b.y\n0,0.1,NaN\n", Some("3: the last row expected, 2 found")),
        (
            "cycle,a.y,b.y\n0,0.1,NaN\n1,-0.0,inf\n2,0,0\n",
            Some("3: the last row expected, 4 found"),
        ),
        ("cycle,a.y,b.y\n0,0.1,NaN\n1,0.0,inf\n", Some("3: a.y: -0.0 expected, 0.0 found")),
        ("cycle,a.y,b.y\n0,0.1,NaN\n1,-0.0\n", Some("3: 3 values expected, 2 found")),
        ("cycle,a.y,b.y\n0,0.1,x\n1,-0.0,inf\n", Some("2: b.y: NaN expected, x found")),
        (
            "cycle,a.y,b.y\n0,0.10000000000000002,0\n1,-0.0,inf\n",
            Some("2: a.y: 0.1 expected, 0.10000000000000002 found; 1 more"),
        ),
    ] {
        match (difference, compare(expected, found)) {
            (None, compared) => assert_eq!(compared, Ok(()), "{found}"),
            (Some(difference), compared) => assert_says(&compared.unwrap_err(), &[difference]),
        }
    }
    assert!(compare("cycle\n", "cycle\n").is_err(), "nothing to compare");
}
