//! Numbered file names: `level_0002.mcap` for `level.mcap`.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use super::folder_of;

/// The name of a file with a number: `shot_0002.svg` is the second `shot.svg`. A name without an extension gets
/// `.mcap`.
pub(crate) fn numbered(path: &Path, number: u64) -> PathBuf {
    let (mut name, ending) = parts(path);
    name.push(format!("{number:04}"));
    name.push(ending);
    path.with_file_name(name)
}

/// The highest number among the files with such names; 0 if there is none, or the folder cannot be read.
pub(super) fn highest_number(path: &Path) -> u64 {
    let (begin, ending) = parts(path);
    let names = fs::read_dir(folder_of(path)).into_iter().flatten().flatten();
    names.filter_map(|entry| number_in(&entry.file_name(), &begin, &ending)).max().unwrap_or(0)
}

fn number_in(name: &OsStr, begin: &OsStr, ending: &OsStr) -> Option<u64> {
    let digits = name.as_bytes().strip_prefix(begin.as_bytes())?.strip_suffix(ending.as_bytes())?;
    let is_number = digits.len() >= 4 && digits.iter().all(u8::is_ascii_digit);
    if is_number { std::str::from_utf8(digits).ok()?.parse().ok() } else { None }
}

/// The parts of a name before and after the number.
fn parts(path: &Path) -> (OsString, OsString) {
    let mut begin = path.file_stem().unwrap_or_default().to_owned();
    begin.push("_");
    let mut ending = OsString::from(".");
    ending.push(path.extension().unwrap_or(OsStr::new("mcap")));
    (begin, ending)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_stands_before_the_ending_and_is_known_again() {
        for (path, expected) in [
            ("level.mcap", "level_0007.mcap"),
            ("data/level", "data/level_0007.mcap"),
            ("a.b.svg", "a.b_0007.svg"),
            ("level_0002.mcap", "level_0002_0007.mcap"),
        ] {
            assert_eq!(numbered(Path::new(path), 7), Path::new(expected));
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("level.mcap");
        assert_eq!(highest_number(&path), 0);
        let others = ["level_0099.csv", "level_2.mcap", "level_new.mcap", "levels_0009.mcap"];
        for name in ["level_0002.mcap", "level_12345.mcap", "level.mcap"].iter().chain(&others) {
            fs::write(folder.path().join(name), "").unwrap();
        }
        assert_eq!(highest_number(&path), 12345);
        assert_eq!(highest_number(&folder.path().join("missing/level.mcap")), 0);
    }
}
