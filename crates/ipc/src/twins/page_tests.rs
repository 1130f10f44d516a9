use super::*;

fn page() -> (tempfile::TempDir, TwinPage) {
    let folder = tempfile::tempdir().unwrap();
    let page = TwinPage::open(&folder.path().join("page")).unwrap();
    (folder, page)
}

#[test]
fn a_new_term_is_higher_than_the_old_one_and_than_the_time_and_says_whose_it_is() {
    for (from, unix_ns) in [(0, 100), (99, 100), (100, 100), (1_000, 100), (1_001, 100)] {
        for seat in [1, 2] {
            let new = next_term(from, seat, unix_ns);
            assert!(new > from && new >= unix_ns && new <= from.max(unix_ns) + 5);
            assert_eq!(new & CLOSED, 0);
            assert_eq!(TwinPage::seat_of(new), seat);
        }
    }
}

#[test]
fn one_of_two_takes_over_from_a_term() {
    let (folder, page) = page();
    let other = TwinPage::open(&folder.path().join("page")).unwrap();
    let first = page.take_over(0, 1, 100).unwrap();
    page.open_to_standby(first);
    assert_eq!(other.take_over(0, 2, 100), None);
    let second = other.take_over(first, 2, 100).unwrap();
    assert_eq!(page.term(), second);
}

#[test]
fn nobody_takes_over_from_a_holder_that_is_closed_to_that_but_to_start_the_node() {
    let (_folder, page) = page();
    let first = page.begin(1, 100).unwrap();
    assert_eq!((page.term(), page.is_open(first)), (first, false));
    assert_eq!(page.take_over(first, 2, 100), None);
    page.open_to_standby(first);
    page.close_to_standby(first);
    assert_eq!(page.take_over(first, 2, 100), None);
    page.open_to_standby(first);
    let second = page.take_over(first, 2, 100).unwrap();
    // What the one before does is too late.
    page.open_to_standby(first);
    page.close_to_standby(first);
    assert_eq!((page.term(), page.is_open(second)), (second, false));
    assert!(page.begin(1, 100).unwrap() > second);
}

#[test]
fn the_frames_of_a_cycle_are_claimed_once() {
    let (_folder, page) = page();
    assert!(page.claim(0, 0) && !page.claim(0, 0));
    assert!(page.claim(0, 5) && !page.claim(0, 4) && page.claim(1, 4));
}

#[test]
fn a_task_has_its_place_by_its_name() {
    let (_folder, page) = page();
    assert_eq!(page.place_of("fast"), Some(0));
    assert_eq!(page.place_of("slow"), Some(1));
    assert_eq!(page.place_of("fast"), Some(0));
    page.forget_tasks();
    assert_eq!(page.place_of("slow"), Some(0));
    for task in 1..MAX_TWIN_TASKS {
        assert_eq!(page.place_of(&task.to_string()), Some(task));
    }
    assert_eq!(page.place_of("one too many"), None);
}

#[test]
fn a_page_of_another_layout_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("page");
    fs::write(&file, [7; WORDS * 8]).unwrap();
    let refused = TwinPage::open(&file).unwrap_err();
    assert!(refused.to_string().contains("another version"), "{refused}");
}
