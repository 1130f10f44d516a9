//! Programs in C and C++ that expect of the interface what its header says.

use std::path::Path;

use isochrone_ipc::{Depth, FrameHeader, FrameSubscriber, ipc};
use isochrone_testing::{Domain, Process, wait_until};

use crate::installed::{Valgrind, command, program, start, static_program};

/// The program does what it expects, and leaves nothing in the domain.
#[track_caller]
fn meets_its_expectations(program: &Path, valgrind: Valgrind) {
    let domain = Domain::new();
    let ended = Process::start(command(&domain, program, &[], valgrind)).finish().expect_code(0);
    assert_eq!((ended.stdout.as_str(), ended.stderr.as_str()), ("done\n", ""));
    domain.expect_no_leftovers();
}

#[test]
fn frames_cross_with_names_units_flags_and_losses() {
    meets_its_expectations(&program("frames", "frames.c", &["-std=c99"]), Valgrind::No);
}

#[test]
fn frames_cross_without_an_error_of_memory() {
    meets_its_expectations(
        &program("frames_valgrind", "frames.c", &["-std=c99", "-g"]),
        Valgrind::KnownValues,
    );
}

#[test]
fn null_closed_handles_and_other_threads_are_errors_and_nothing_else() {
    meets_its_expectations(&program("misuse", "misuse.c", &["-std=c99"]), Valgrind::No);
}

#[test]
fn misuse_touches_no_memory() {
    meets_its_expectations(
        &program("misuse_valgrind", "misuse.c", &["-std=c99", "-g"]),
        Valgrind::KnownValues,
    );
}

#[test]
fn a_program_can_have_the_library_in_itself() {
    meets_its_expectations(
        &static_program("frames_static", "frames.c", &["-std=c99"]),
        Valgrind::No,
    );
}

#[test]
fn the_cpp_header_does_what_it_says_with_exceptions_and_without() {
    meets_its_expectations(&program("cpp17", "cpp17.cpp", &["-std=c++17"]), Valgrind::No);
    let without = ["-std=c++17", "-fno-exceptions", "-fno-rtti"];
    meets_its_expectations(&program("cpp17_without", "cpp17.cpp", &without), Valgrind::No);
}

#[test]
fn the_cpp_header_makes_no_error_of_memory() {
    meets_its_expectations(
        &program("cpp17_valgrind", "cpp17.cpp", &["-std=c++17", "-g"]),
        Valgrind::KnownValues,
    );
}

#[test]
fn a_cycle_makes_no_system_call() {
    let domain = Domain::new();
    let program = program("cycle", "cycle.c", &["-std=gnu11"]);
    let ended = start(&domain, &program, &[]).finish().expect_code(0);
    assert_eq!(ended.stdout, "done\n", "{}", ended.stderr);
}

#[test]
fn a_service_that_is_written_already_is_refused_and_one_of_a_plain_writer_can_be_taken_over() {
    let domain = Domain::new();
    let reader = domain.join("reader");
    let _readers = ["plant/far", "plant/plain"]
        .map(|service| FrameSubscriber::open(&reader, service, 1, Depth::Newest).unwrap());
    let (link, _end) = domain.plain_link::<ipc::Service>("plant/far");
    let _writer = domain.plain_writer::<ipc::Service>("plant/plain");
    let program = program("writers", "writers.c", &["-std=c99"]);
    let pid = format!("pid {})", std::process::id());
    let mut running = start(&domain, &program, &["plant/far", "plant/plain", &pid]);
    let mut sequence = 0;
    wait_until("the program has ended", || {
        let mut frame = link.loan_slice(1).unwrap();
        *frame.user_header_mut() = FrameHeader { sequence, ..FrameHeader::default() };
        frame.send().unwrap();
        sequence += 1;
        running.is_over()
    });
    let ended = running.finish().expect_code(0);
    assert_eq!((ended.stdout.as_str(), ended.stderr.as_str()), ("done\n", ""));
}
