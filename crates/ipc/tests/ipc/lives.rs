//! What remains of processes that end, and of those that are killed.

use std::io::{BufRead, BufReader};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use crate::variants::{
    NOW_NS, joined, kill, layout, open_reader, open_writer, remove_leftovers, send,
};
use isochrone_ipc::{Depth, FramePublisher, FrameSubscriber, Participant, Service, ipc};
use isochrone_testing::{Domain, role, role_domain};

fn is_named(file: &Path, end: &str) -> bool {
    file.to_string_lossy().ends_with(end)
}

/// The file that counts the nodes of a domain in which nobody is any more.
fn node_counter(domain: &Domain) -> PathBuf {
    drop(domain.join_variant::<ipc::Service>("tester"));
    domain.files().into_iter().find(|file| is_named(file, "global_mgmt")).unwrap()
}

#[test]
fn nothing_is_left_when_all_have_gone() {
    let (domain, node) = joined::<ipc::Service>();
    let mut reader = open_reader(&node, Depth::All);
    let mut writer = open_writer(&node);
    send(&mut writer, 1.0, 1);
    let held = reader.newest(NOW_NS);
    assert!(domain.files().len() > 5);
    assert!(!domain.remove_leftovers(), "the domain is in use");
    drop(node);
    send(&mut writer, 2.0, 2);
    drop(writer);
    assert_eq!(held.unwrap().values(), [1.0]);
    drop(reader);

    let files = domain.files();
    let ends = ["_node.0_10_0.global_mgmt", "isochrone.roots", "isochrone.lock"];
    assert_eq!(files.len(), ends.len(), "{files:?}");
    assert!(ends.iter().all(|end| files.iter().any(|file| is_named(file, end))), "{files:?}");
    remove_leftovers(&domain);
    assert_eq!(domain.files(), Vec::<PathBuf>::new());
    assert!(!domain.remove_leftovers());
}

#[test]
fn a_domain_is_tidied_by_the_last_of_those_who_use_it() {
    let fixture = Domain::new();
    let domain = isochrone_ipc::Domain::from_file(&fixture.file()).unwrap();
    let node = Participant::join("brief", &domain).unwrap();
    let writer = open_writer(&node);
    drop(domain);
    drop(node);
    assert!(fixture.files().len() > 3);
    drop(writer);
    assert_eq!(fixture.files(), Vec::<PathBuf>::new());
}

#[test]
fn nothing_is_left_of_an_isolated_domain_also_after_those_who_were_killed() {
    let domain = Domain::new();
    let child = start_publisher(&domain);
    kill(child);
    let (files, folder) = (domain.files(), domain.folder().to_owned());
    assert!(files.len() > 5);
    drop(domain);
    let left: Vec<_> = files.iter().filter(|file| file.exists()).collect();
    assert!(left.is_empty() && !folder.exists(), "{left:?}");
}

#[test]
fn a_domain_lives_on_after_its_leftovers_were_removed() {
    let domain = Domain::new();
    drop(domain.join_variant::<ipc::Service>("tester"));
    remove_leftovers(&domain);
    let node = domain.join_variant::<ipc::Service>("tester");
    open_writer(&node);
}

#[test]
fn a_domain_lives_on_after_a_process_was_killed_while_it_made_the_node_counter() {
    // Made but not sized, and sized but not filled: nobody may read it yet.
    for bytes in [0, 16] {
        let domain = Domain::new();
        let counter = std::fs::File::options().write(true).open(node_counter(&domain)).unwrap();
        counter.set_len(0).unwrap();
        counter.set_len(bytes).unwrap();
        counter.set_permissions(std::fs::Permissions::from_mode(0o200)).unwrap();
        drop(domain.join_variant::<ipc::Service>("tester"));
    }
}

#[test]
fn what_is_half_made_in_a_domain_whose_prefix_begins_with_ours_is_left_alone() {
    let domain = Domain::new();
    let root = domain.folder().join("other");
    // A hexadecimal digit is what the rest of a name begins with, too.
    for longer in ["x", "a", "a_"] {
        let prefix = domain.prefix() + longer;
        let other = domain.at(&root, &prefix);
        drop(Participant::join("other", &other).unwrap());
        let files = domain.files();
        let counter = files
            .iter()
            .find(|file| file.file_name().unwrap().to_string_lossy().starts_with(&prefix))
            .unwrap();
        std::fs::File::options().write(true).open(counter).unwrap().set_len(0).unwrap();
        drop(domain.join_variant::<ipc::Service>("tester"));
        assert!(counter.exists(), "{}", counter.display());
        std::fs::remove_file(counter).unwrap();
        remove_leftovers(&other);
        assert_eq!(other.files(), Vec::<PathBuf>::new());
    }
}

#[test]
fn a_domain_with_another_root_path_and_our_prefix_keeps_its_segments() {
    let (domain, node) = joined::<ipc::Service>();
    let mut reader = open_reader(&node, Depth::Newest);
    let mut writer = open_writer(&node);
    let elsewhere = tempfile::tempdir().unwrap();
    let there = domain.at(elsewhere.path(), &domain.prefix());
    let before = domain.files();
    for _ in 0..2 {
        // Its own dead are none of ours either.
        let other = Participant::join("other", &there).unwrap();
        let mut ours = FrameSubscriber::open(&other, "x", 1, Depth::Newest).unwrap();
        drop(domain.join_variant::<ipc::Service>("tester"));
        assert!(ours.newest(1).is_none());
        drop((ours, other));
        there.remove_leftovers();
    }
    let gone: Vec<_> = before.iter().filter(|file| !domain.files().contains(file)).collect();
    // The node counter is one for a prefix.
    assert!(gone.iter().all(|file| is_named(file, "global_mgmt")), "{gone:?}");
    send(&mut writer, 3.0, 1);
    assert_eq!(reader.newest(NOW_NS).unwrap().values(), [3.0]);
    let newcomer = domain.join_variant::<ipc::Service>("tester");
    let second = FramePublisher::open(&newcomer, "x", &layout(&["a:LREAL"])).unwrap_err();
    assert!(second.to_string().contains("has one writer"), "{second}");
}

#[test]
fn what_can_be_no_node_counter_is_removed() {
    for bytes in [&[][..], &[0; 16], b"what is this?"] {
        let domain = Domain::new();
        std::fs::write(node_counter(&domain), bytes).unwrap();
        drop(domain.join_variant::<ipc::Service>("tester"));
    }
}

#[test]
fn what_is_no_file_among_the_descriptions_of_services_holds_nobody_up() {
    let domain = Domain::new();
    let services = domain.root_path().join("services");
    std::fs::create_dir_all(&services).unwrap();
    let name = format!("{}{}.service", domain.prefix(), "e".repeat(40));
    let path = services.join(name);
    let made = Command::new("mkfifo").arg(&path).status().unwrap();
    assert!(made.success());
    let node = domain.join_variant::<ipc::Service>("tester");
    open_writer(&node);
    drop(node);
    std::fs::remove_file(path).unwrap();
}

#[test]
fn a_publisher_that_lives_elsewhere_blocks_and_one_that_was_killed_does_not() {
    let domain = Domain::new();
    let shape = layout(&["a:LREAL"]);
    let node = domain.join_variant::<ipc::Service>("tester");
    let mut reader = open_reader(&node, Depth::Newest);
    for life in 0..3 {
        let child = start_publisher(&domain);
        let error = FramePublisher::open(&node, "x", &shape).unwrap_err().to_string();
        assert!(error.contains("\"victim\" (ipc-"), "{error}");
        assert!(error.contains(&format!("pid {})", child.id())), "{error}");
        kill(child);

        let mut writer = open_writer(&node);
        send(&mut writer, f64::from(life), 1_000 + life as u64);
        let frame = reader.newest(NOW_NS).unwrap();
        assert_eq!(frame.values(), [f64::from(life)], "the dead one's frames are older");
    }
    drop((reader, node));
    remove_leftovers(&domain);
    assert_eq!(domain.files(), Vec::<PathBuf>::new());
}

#[test]
fn a_dead_publisher_of_whom_only_the_place_in_the_service_is_left_gives_way() {
    let (domain, node) = joined::<ipc::Service>();
    let mut reader = open_reader(&node, Depth::Newest);
    let nodes = domain.root_path().join("nodes");
    let traces = || -> Vec<_> {
        std::fs::read_dir(&nodes).unwrap().map(|entry| entry.unwrap().path()).collect()
    };
    let living = traces();
    let child = start_publisher(&domain);
    kill(child);
    for trace in traces().iter().filter(|trace| !living.contains(trace)) {
        if trace.is_dir() {
            std::fs::remove_dir_all(trace).unwrap()
        } else {
            std::fs::remove_file(trace).unwrap()
        }
    }

    let mut writer = open_writer(&node);
    send(&mut writer, 7.0, 1_000);
    assert_eq!(reader.newest(1_000).unwrap().values(), [7.0]);
}

#[test]
fn a_node_counter_that_others_may_write_to_is_closed_by_who_joins() {
    let domain = Domain::new();
    // As programs make it that use iceoryx2 without this crate.
    let node = iceoryx2::node::NodeBuilder::new().config(domain.config());
    let node = node.create::<iceoryx2::service::ipc::Service>().unwrap();
    let mode = || {
        let counters = domain.files().into_iter().filter(|file| is_named(file, ".global_mgmt"));
        let [counter] = &counters.collect::<Vec<_>>()[..] else {
            panic!("one: {:?}", domain.files())
        };
        std::fs::metadata(counter).unwrap().permissions().mode() & 0o777
    };
    assert_eq!(mode(), 0o666);
    drop(domain.join_variant::<ipc::Service>("tester"));
    assert_eq!(mode(), 0o600);
    drop(node);
}

#[test]
fn all_of_a_domain_is_writable_by_its_owner_only() {
    let (domain, node) = joined::<ipc::Service>();
    let _reader = open_reader(&node, Depth::All);
    let _writer = open_writer(&node);
    let files = domain.files();
    assert!(files.len() > 5);
    for file in files {
        let mode = std::fs::metadata(&file).unwrap().permissions().mode();
        assert_eq!(mode & 0o077, 0, "{} has {mode:o}", file.display());
    }
}

#[test]
fn joining_removes_what_a_killed_process_left() {
    let domain = Domain::new();
    let child = start_publisher(&domain);
    kill(child);
    assert!(domain.files().len() > 5);
    drop(domain.join_variant::<ipc::Service>("tester"));
    remove_leftovers(&domain);
    assert_eq!(domain.files(), Vec::<PathBuf>::new());
}

/// Runs this test binary again, as a process that publishes until it is killed.
fn start_publisher(domain: &Domain) -> Child {
    let mut child = role("lives::publishes_until_killed", &domain.file())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let said = BufReader::new(child.stdout.take().unwrap()).lines();
    let ready = said.map(Result::unwrap).any(|line| line.ends_with("published"));
    assert!(ready);
    child
}

#[test]
#[ignore = "is run by the tests that kill it"]
fn publishes_until_killed() {
    let Some(domain) = role_domain() else { return };
    let node = Participant::join("victim", &domain).unwrap();
    let mut writer = open_writer(&node);
    for n in 0..10 {
        send(&mut writer, -1.0, n);
    }
    println!("\npublished");
    std::thread::sleep(std::time::Duration::from_secs(60));
}

#[test]
fn many_that_join_and_leave_at_once_all_succeed() {
    let domain = Domain::new();
    std::thread::scope(|scope| {
        for thread in 0..8 {
            let domain = &domain;
            scope.spawn(move || {
                for _ in 0..20 {
                    let node = domain.join_variant::<ipc::Service>("tester");
                    let service = format!("x{thread}");
                    let shape = layout(&["a:LREAL"]);
                    let mut writer = FramePublisher::open(&node, &service, &shape).unwrap();
                    let mut reader = FrameSubscriber::open(&node, &service, 1, Depth::All).unwrap();
                    send(&mut writer, 1.0, 1);
                    assert!(reader.newest(NOW_NS).is_some());
                }
            });
        }
    });
}

#[test]
fn a_node_name_that_cannot_be_is_refused() {
    let domain = Domain::new();
    for name in ["ü", &"x".repeat(129)] {
        let error = Participant::join(name, &domain).unwrap_err();
        assert!(error.to_string().contains("at most 128 ASCII"), "{error}");
    }
}

#[test]
fn a_participant_can_be_shared_between_threads() {
    fn shareable<T: Send + Sync>() {}
    fn check<S: Service>() {
        shareable::<Participant<S>>();
    }
    check::<ipc::Service>();
}

#[test]
fn a_configuration_file_is_read_and_a_bad_one_named() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("iceoryx2.toml");
    let missing = isochrone_ipc::Domain::from_file(&path).unwrap_err();
    assert!(missing.to_string().contains(": no such file; "), "{missing}");
    let read = |text: &str| {
        std::fs::write(&path, format!("[global]\n{text}\n")).unwrap();
        isochrone_ipc::Domain::from_file(&path)
    };
    let domain = read(
        "prefix = \"line7_\"\n[defaults.publish-subscribe]\nsubscriber-expired-connection-buffer = 64",
    )
    .unwrap();
    assert_eq!(domain.prefix(), "line7_");
    let kept = domain.config().defaults.publish_subscribe.subscriber_expired_connection_buffer;
    assert_eq!(kept, 8, "whatever the file says");
    assert_eq!(domain.config().global.creation_timeout.as_millis(), 20);
    let bad = read("prefix = 7").unwrap_err().to_string();
    assert!(bad.contains(path.to_str().unwrap()), "{bad}");
    assert!(bad.contains("not a valid iceoryx2 0.10 configuration"), "{bad}");
    let unknown = read("prefx = \"line7_\"").unwrap_err().to_string();
    assert!(unknown.contains(":2:1: [global] has no key \"prefx\"; "), "{unknown}");
    let relative = read("root-path = \"here\"").unwrap_err();
    let relative = relative.to_string();
    assert!(
        relative.contains(":2:") && relative.contains("root-path \"here\" is relative"),
        "{relative}"
    );
    let unusable = isochrone_ipc::Domain::from_file(Path::new("")).unwrap_err();
    assert!(unusable.to_string().contains(": not a usable file path; "), "{unusable}");
}
