//! Each file of the corpus, without a fuzzer.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use isochrone_fuzz::TARGETS;

/// The corpus is in each checkout.
const MOST_BYTES: u64 = 300_000;
const MOST_FILES: usize = 40;

fn corpus() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus")
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{folder:?}: {error}"));
    entries.map(|entry| entry.unwrap().path()).collect()
}

#[test]
fn every_target_keeps_its_rules_with_each_file_of_its_corpus() {
    let mut broken = Vec::new();
    for target in TARGETS {
        for file in files(&corpus().join(target.name)) {
            let bytes = fs::read(&file).unwrap();
            assert!(bytes.len() <= target.max_bytes, "{file:?}: {} bytes", bytes.len());
            if std::panic::catch_unwind(|| (target.read)(&bytes)).is_err() {
                broken.push(file);
            }
        }
    }
    assert!(broken.is_empty(), "the rules are broken, as said above, with {broken:#?}");
}

#[test]
fn the_corpus_is_small_and_each_folder_of_it_has_a_target() {
    let folders = files(&corpus());
    let named = |path: &PathBuf| path.file_name().unwrap().to_str().unwrap().to_owned();
    let names: BTreeSet<String> = folders.iter().map(named).collect();
    assert_eq!(names, TARGETS.iter().map(|target| target.name.to_owned()).collect());
    let all: Vec<Vec<PathBuf>> = folders.iter().map(|folder| files(folder)).collect();
    for files in &all {
        assert!((1..=MOST_FILES).contains(&files.len()), "{} files: {files:?}", files.len());
    }
    let bytes = all.iter().flatten().map(|file| file.metadata().unwrap().len()).sum::<u64>();
    assert!(bytes <= MOST_BYTES, "{bytes} bytes; minimise it by `bash .ci/fuzz merge`");
}
