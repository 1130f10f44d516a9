//! The file of a retained state: always whole, with the one before it beside it.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use super::error::{DamagedState, StateError};
use super::node_state::{NodeState, PREFIX_BYTES};
use crate::keeping::output_file::{folder_of, open_output, output_target};

/// Opening a pipe does not wait for somebody at its other end.
const NONBLOCK: i32 = rustix::fs::OFlags::NONBLOCK.bits() as i32;
/// A state has the text of its configuration, which may be private.
const MODE: u32 = 0o600;

/// The file that a node's state is kept in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StateFile(PathBuf);

/// A state as it was found.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct StoredState {
    /// The newest state that is whole.
    pub state: NodeState,
    /// The damage of the newest file; `state` is the one before it then.
    pub damage: Option<DamagedState>,
}

impl StateFile {
    /// The file at this path, or where it leads to; it need not exist.
    pub fn at(path: impl Into<PathBuf>) -> Self {
        let path = path.into();
        Self(output_target(&path).unwrap_or(path))
    }

    /// The usual file of a node: `NODE.state` in the folder that systemd gives a service (`STATE_DIRECTORY`), else in
    /// `~/.local/state/isochrone`.
    ///
    /// # Errors
    /// There is neither.
    pub fn of(node: &str) -> Result<Self, StateError> {
        let is_set = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
        // systemd lists several folders with colons between them.
        let first = |folders: OsString| {
            let folders = folders.as_bytes().split(|byte| *byte == b':');
            let mut folders = folders.map(|folder| PathBuf::from(OsStr::from_bytes(folder)));
            folders.find(|folder| folder.is_absolute())
        };
        let home = || is_set("HOME").map(|home| Path::new(&home).join(".local/state/isochrone"));
        let home = || home().filter(|folder| folder.is_absolute());
        let folder = is_set("STATE_DIRECTORY").and_then(first).or_else(home);
        Ok(Self(folder.ok_or(StateError::NoFolder)?.join(format!("{node}.state"))))
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Whether a path leads to one of the files that a node writes here: the states, their lock, and what is put aside.
    pub fn owns(&self, path: &Path) -> bool {
        let path = output_target(path).unwrap_or_else(|_| path.to_owned());
        let folder = |path: &Path| {
            let folder = folder_of(path);
            folder.canonicalize().unwrap_or_else(|_| folder.to_owned())
        };
        let name =
            |path: &Path| path.file_name().map_or_else(Vec::new, |it| it.as_bytes().to_vec());
        let (name, own) = (name(&path), name(&self.0));
        let is_own = match name.strip_prefix(&*own) {
            Some(b"" | b".1" | b".new" | b".lock" | b".damaged") => true,
            Some(ending) => ending.starts_with(b".cold"),
            None => false,
        };
        is_own && folder(&path) == folder(&self.0)
    }

    /// Reads the newest state that is whole; `None`: there is none.
    ///
    /// # Errors
    /// There are states, and none is whole; one is of a version that this program does not read; or the system refuses
    /// to read one.
    pub fn read(&self) -> Result<Option<StoredState>, StateError> {
        let damage = match self.read_from(&self.0)? {
            Some(Ok(state)) => return Ok(Some(StoredState { state, damage: None })),
            Some(Err(damage)) => Some(damage),
            // A node that was killed between the two renames of a write leaves the one before only.
            None => None,
        };
        match (self.read_from(&self.beside("1"))?, damage) {
            (Some(Ok(state)), damage) => Ok(Some(StoredState { state, damage })),
            (None, None) => Ok(None),
            (None, Some(damage)) | (Some(Err(_)), Some(damage)) | (Some(Err(damage)), None) => {
                Err(StateError::Damaged { path: self.0.clone(), damage })
            }
        }
    }

    fn read_from(
        &self,
        path: &Path,
    ) -> Result<Option<Result<NodeState, DamagedState>>, StateError> {
        let refused = |source| StateError::Read { path: path.to_owned(), source };
        let mut file = match open_output(path, OpenOptions::new().read(true), NONBLOCK) {
            Ok(file) => file,
            Err(source) if source.kind() == ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(refused(source)),
        };
        let found = file.metadata().map_err(refused)?;
        if !found.is_file() {
            return Err(StateError::NoFile { path: path.to_owned() });
        }
        // Nothing else is read as a whole, however large.
        let mut bytes = Vec::new();
        (&mut file).take(PREFIX_BYTES as u64).read_to_end(&mut bytes).map_err(refused)?;
        match NodeState::length_of(&bytes) {
            Err(DamagedState::Version { found, known }) => {
                return Err(StateError::Version { path: path.to_owned(), found, known });
            }
            Err(damage) => return Ok(Some(Err(damage))),
            Ok(length) if length != found.len() => return Ok(Some(Err(DamagedState::Truncated))),
            Ok(_) => {}
        }
        file.read_to_end(&mut bytes).map_err(refused)?;
        Ok(Some(NodeState::of_bytes(&bytes)))
    }

    /// Replaces the state; the one before stays beside it. After a crash at any moment, and a loss of power, the
    /// newer or the older one is there, whole.
    ///
    /// # Errors
    /// The system refuses it; the state that was there stays.
    pub fn write(&self, state: &NodeState) -> Result<(), StateError> {
        self.write_if(state, || true)
    }

    /// As [`write`](Self::write), as long as this process may, which is asked before each step.
    ///
    /// # Errors
    /// As `write`.
    pub(super) fn write_if(
        &self,
        state: &NodeState,
        may_write: impl Fn() -> bool,
    ) -> Result<(), StateError> {
        let written = self.try_write(&state.to_bytes(), may_write);
        written.map_err(|source| StateError::Write { path: self.0.clone(), source })
    }

    fn try_write(&self, bytes: &[u8], may_write: impl Fn() -> bool) -> io::Result<()> {
        let folder = folder_of(&self.0);
        if !may_write() {
            return Ok(());
        }
        let new = self.beside("new");
        let mut file = open_own(&new)?;
        file.set_len(0)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        if !may_write() {
            return Ok(());
        }
        ignore_absent(fs::rename(&self.0, self.beside("1")))?;
        fs::rename(&new, &self.0)?;
        File::open(folder)?.sync_all()
    }

    /// Makes sure that it can be written, and that no other process does; until the result is dropped. Creates its
    /// folder.
    ///
    /// # Errors
    /// It cannot, or another one does.
    pub(super) fn claim(&self) -> Result<File, StateError> {
        let refused = |source| StateError::Write { path: self.0.clone(), source };
        fs::create_dir_all(folder_of(&self.0)).map_err(refused)?;
        let lock = open_own(&self.beside("lock")).map_err(refused)?;
        match lock.try_lock() {
            Ok(()) => Ok(lock),
            Err(TryLockError::WouldBlock) => Err(StateError::InUse { path: self.0.clone() }),
            Err(TryLockError::Error(source)) => Err(refused(source)),
        }
    }

    /// Keeps a damaged newest state as `FILE.damaged`, so that the next one does not take the place of the whole one
    /// before it.
    ///
    /// # Errors
    /// The system refuses it.
    pub(super) fn put_aside_damaged(&self) -> Result<(), StateError> {
        let moved = fs::rename(&self.0, self.beside("damaged"));
        moved.map_err(|source| StateError::Write { path: self.0.clone(), source })
    }

    /// Where the state goes that is put aside: `FILE.cold`, or `FILE.cold2` and so on where that is taken.
    pub(super) fn cold_path(&self) -> PathBuf {
        let numbered = (2..).map(|number| format!("cold{number}"));
        let endings = std::iter::once("cold".to_owned()).chain(numbered);
        let mut paths = endings.map(|ending| self.beside(&ending));
        let first = self.beside("cold");
        paths.find(|path| fs::symlink_metadata(path).is_err()).unwrap_or(first)
    }

    /// Puts the state aside, and the one before it beside that, so that the next start finds none.
    ///
    /// # Errors
    /// The system refuses it.
    pub(super) fn put_aside(&self, cold: &Path) -> Result<(), StateError> {
        let moved = ignore_absent(fs::rename(&self.0, cold));
        let before = Self(cold.to_owned()).beside("1");
        let moved = moved.and_then(|()| ignore_absent(fs::rename(self.beside("1"), before)));
        moved.map_err(|source| StateError::Write { path: self.0.clone(), source })
    }

    /// Its path with another ending.
    fn beside(&self, ending: &str) -> PathBuf {
        let mut name = self.0.file_name().map_or_else(OsString::new, OsString::from);
        name.push(".");
        name.push(ending);
        self.0.with_file_name(name)
    }
}

/// Opens a file to write it, which only its user may read; creates it.
fn open_own(path: &Path) -> io::Result<File> {
    open_output(path, OpenOptions::new().write(true).create(true).mode(MODE), NONBLOCK)
}

fn ignore_absent(done: io::Result<()>) -> io::Result<()> {
    match done {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        done => done,
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    fn state(unix_ns: u64) -> NodeState {
        NodeState {
            node: "level".to_owned(),
            unix_ns,
            is_final: false,
            term: None,
            file: "level.toml".to_owned(),
            configuration: String::new(),
            tuned: Vec::new(),
            alarms: Vec::new(),
            tasks: Vec::new(),
        }
    }

    #[test]
    fn the_files_that_a_node_writes_are_its_own_by_whatever_path() {
        let folder = tempfile::tempdir().unwrap();
        let file = StateFile::at(folder.path().join("level.state"));
        std::os::unix::fs::symlink("level.state.1", folder.path().join("link")).unwrap();
        for (name, is_own) in [
            ("level.state", true),
            ("../level.state", false),
            ("level.state.1", true),
            ("./level.state.lock", true),
            ("level.state.cold2", true),
            ("link", true),
            ("level.state.mcap", false),
            ("level.mcap", false),
        ] {
            assert_eq!(file.owns(&folder.path().join(name)), is_own, "{name}");
        }
    }

    fn read(file: &StateFile) -> (u64, Option<DamagedState>) {
        let StoredState { state, damage } = file.read().unwrap().unwrap();
        (state.unix_ns, damage)
    }

    #[test]
    fn the_newest_is_read_and_the_one_before_where_that_is_damaged_or_gone() {
        let folder = tempfile::tempdir().unwrap();
        let file = StateFile::at(folder.path().join("level.state"));
        assert_eq!(file.read().unwrap(), None);
        for unix_ns in 1..=3 {
            file.write(&state(unix_ns)).unwrap();
        }
        assert_eq!(read(&file), (3, None));
        fs::write(file.path(), "ISOSTATE").unwrap();
        assert_eq!(read(&file), (2, Some(DamagedState::Truncated)));
        fs::remove_file(file.path()).unwrap();
        assert_eq!(read(&file), (2, None));
        file.write(&state(4)).unwrap();
        assert_eq!(read(&file), (4, None));
        let mode = fs::metadata(file.path()).unwrap().permissions().mode();
        assert_eq!(mode & 0o077, 0, "only its user reads it");
    }

    #[test]
    fn two_damaged_states_are_an_error_with_the_way_out() {
        let folder = tempfile::tempdir().unwrap();
        let file = StateFile::at(folder.path().join("level.state"));
        (1..=2).for_each(|unix_ns| file.write(&state(unix_ns)).unwrap());
        for path in [file.path().to_owned(), file.beside("1")] {
            fs::write(path, "nonsense").unwrap();
        }
        let refused = file.read().unwrap_err().to_string();
        assert!(refused.contains("run --cold"), "{refused}");
        for ending in ["cold", "cold2"] {
            let cold = file.cold_path();
            assert_eq!(cold, file.beside(ending));
            file.put_aside(&cold).unwrap();
            assert_eq!(file.read().unwrap(), None);
            assert_eq!(fs::read(file.beside("cold")).unwrap(), b"nonsense");
            file.write(&state(3)).unwrap();
        }
    }

    #[test]
    fn a_state_that_cannot_be_written_leaves_the_one_that_is_there() {
        let folder = tempfile::tempdir().unwrap();
        let file = StateFile::at(folder.path().join("level.state"));
        file.write(&state(1)).unwrap();
        fs::create_dir(file.beside("new")).unwrap();
        file.write(&state(2)).unwrap_err();
        assert_eq!(read(&file), (1, None));
    }
}
