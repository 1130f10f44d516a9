//! The program of docs/cpp.md, copied and pasted.

use isochrone_ipc::SignalReader;
use isochrone_testing::{Domain, PATIENCE, Plant};

use crate::installed::{build_project, folder, program_of, start, workspace};

/// What stands in the first block of this language.
fn block(page: &str, language: &str) -> String {
    let (_, block) = page.split_once(&format!("```{language}\n")).unwrap();
    block.split_once("```").unwrap().0.to_owned()
}

#[test]
fn the_program_of_the_page_builds_by_cmake_and_by_pkg_config_and_runs() {
    let page = std::fs::read_to_string(workspace().join("docs/cpp.md")).unwrap();
    let own = folder().join("page");
    std::fs::create_dir_all(&own).unwrap();
    std::fs::write(own.join("main.cpp"), block(&page, "cpp")).unwrap();
    std::fs::write(own.join("CMakeLists.txt"), block(&page, "cmake")).unwrap();
    build_project(&own, &own.join("build"));
    let by_pkg_config = program_of("squarer", &own.join("main.cpp"), &["-std=c++17"]);
    let level = Plant::new("level")
        .task("t", "1ms")
        .times(3.0, "level", "1.5")
        .output("plant/level", &["level.y"]);
    for program in [own.join("build/squarer"), by_pkg_config] {
        let domain = Domain::new();
        let _node = domain.start_node("level.toml", &level, "");
        let participant = domain.join("tester");
        let mut square = SignalReader::open(&participant, "plant/square", &["square"]).unwrap();
        let program = start(&domain, &program, &[]);
        let frame = square.wait(PATIENCE).unwrap();
        assert_eq!(frame.values().unwrap().collect::<Vec<_>>(), [("square", 20.25)]);
        assert!(frame.header().source_ns > 0, "{:?}", frame.header());
        let printed = program.finish().expect_code(0).stdout;
        assert_eq!(printed.lines().count(), 100, "{printed}");
        assert!(printed.lines().all(|line| line.starts_with("20.250000 m2, ")), "{printed}");
    }
}

#[test]
fn the_loops_that_are_shown_are_those_that_are_tested() {
    let lines = |text: &str| text.lines().map(str::trim).collect::<Vec<_>>().join("\n");
    let page = std::fs::read_to_string(workspace().join("docs/cpp.md")).unwrap();
    for program in ["actuator.cpp", "controller.cpp"] {
        let (_, shown) = page.split_once(&format!("```cpp\n// {program}\n")).unwrap();
        let shown = lines(shown.split_once("```").unwrap().0);
        let file = workspace().join("examples/cpp").join(program);
        assert!(lines(&std::fs::read_to_string(file).unwrap()).contains(&shown), "{shown}");
    }
}
