//! The page of memory that two twins share. Its first word is the node's term: whose it is, writes.
//!
//! The page is a file in shared memory, made under the domain's lock and mapped before any cycle. Words are loaded and
//! stored as atomics; nothing here waits, and only [`TwinPage::open`] makes system calls.

use std::fs::{self, File};
use std::io;
use std::os::unix::fs::FileExt as _;
use std::path::{Path, PathBuf};
use std::ptr::NonNull;
use std::sync::atomic::{AtomicU64, Ordering};

use iceoryx2::config::Config;
use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};

use crate::domain::locked_file;
use crate::domain::segment::{self, FOLDER};
use crate::frames::layout::fnv1a;

/// Words of the page, 4096 bytes.
const WORDS: usize = 512;
/// "twinpag3": another layout has another number.
const MAGIC: u64 = u64::from_le_bytes(*b"twinpag3");
/// In the word of the term: nobody may take over, as no standby has all that the holder has acknowledged. Terms do not
/// have this bit.
const CLOSED: u64 = 2;
/// In the word of the configuration: the holder has not started, or is about to have another one.
const CHANGING: u64 = 0;
/// Words of each task, behind the first ones.
const TASK_WORDS: usize = 3;
const FIRST_TASK_WORD: usize = 32;
/// The most tasks that a node with a twin has.
pub const MAX_TWIN_TASKS: usize = (WORDS - FIRST_TASK_WORD) / TASK_WORDS;

/// The words before those of the tasks.
#[derive(Clone, Copy)]
enum Word {
    Magic,
    Term,
    Epoch,
    Configuration,
    HandOver,
    Kind,
    TakenUnixNs,
    Takeovers,
    TakenBefore,
    /// The process in the first seat.
    Process,
    SecondProcess,
    /// How many cycles of the first task the last takeover took.
    Gap,
    /// For how many of these the standby was not awake.
    Unmet,
}

/// The words of a task.
#[derive(Clone, Copy)]
enum TaskWord {
    Name,
    /// The cycle after the last one whose frames were claimed.
    Claimed,
    FirstCycle,
}

/// The last change of the holder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Takeover {
    /// When it was, in ns since 1970.
    pub unix_ns: u64,
    /// Whether the holder handed over, and was not found silent.
    pub was_asked: bool,
    /// How many there have been since the first of the twins started.
    pub count: u64,
    /// How long after the one before, in ns; `None`: it is the first.
    pub after_ns: Option<u64>,
    /// Cycles of the task that noticed it for which there is no frame.
    pub lost_cycles: u64,
    /// Releases of that task in which the standby itself was not awake, so that they did not count as silence.
    pub unmet_releases: u64,
}

/// The shared page. Dropping it unmaps it.
#[derive(Debug)]
pub struct TwinPage {
    words: NonNull<[AtomicU64; WORDS]>,
}

// SAFETY: the pointer is to shared memory that stays mapped until this is dropped, and all access is atomic.
#[allow(unsafe_code)]
unsafe impl Send for TwinPage {}
// SAFETY: as above.
#[allow(unsafe_code)]
unsafe impl Sync for TwinPage {}

impl TwinPage {
    /// Maps the page of a node, whose file is made if there is none; under the domain's lock.
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        let mut options = File::options();
        let options = options.create(true).truncate(false).read(true).write(true);
        let file =
            locked_file::open(path, std::os::unix::fs::OpenOptionsExt::mode(options, 0o600))?;
        if file.metadata()?.len() < (WORDS * 8) as u64 {
            // Written, as a page that is only promised ends the process at the first access where memory is full.
            file.write_all_at(&[0; WORDS * 8], 0)?;
        }
        let access = ProtFlags::READ | ProtFlags::WRITE;
        // SAFETY: a new mapping at an address that the kernel chooses, of a file that has these bytes; it is ours
        // (checked by `locked_file::open`), and nobody truncates it.
        #[allow(unsafe_code)]
        let mapped =
            unsafe { mmap(std::ptr::null_mut(), WORDS * 8, access, MapFlags::SHARED, &file, 0)? };
        let words = NonNull::new(mapped.cast()).ok_or(io::ErrorKind::InvalidData)?;
        let page = Self { words };
        let magic = page.word(Word::Magic);
        match magic.load(Ordering::Acquire) {
            0 => magic.store(MAGIC, Ordering::Release),
            MAGIC => {}
            _ => {
                let why =
                    "it is of another version of isochrone: end the twin of that version first";
                return Err(io::Error::new(io::ErrorKind::InvalidData, why));
            }
        }
        Ok(page)
    }

    fn words(&self) -> &[AtomicU64; WORDS] {
        // SAFETY: mapped and aligned to a page until this is dropped; other processes only access it atomically.
        #[allow(unsafe_code)]
        unsafe {
            self.words.as_ref()
        }
    }

    #[inline]
    fn word(&self, word: Word) -> &AtomicU64 {
        &self.words()[word as usize]
    }

    #[inline]
    fn task_word(&self, task: usize, word: TaskWord) -> &AtomicU64 {
        let index = FIRST_TASK_WORD + task.min(MAX_TWIN_TASKS - 1) * TASK_WORDS + word as usize;
        &self.words()[index]
    }

    /// The node's term: whoever holds it, writes.
    #[inline]
    pub fn term(&self) -> u64 {
        self.word(Word::Term).load(Ordering::Acquire) & !CLOSED
    }

    /// Whether the standby may take over from the holder of this term.
    #[inline]
    pub fn is_open(&self, term: u64) -> bool {
        self.word(Word::Term).load(Ordering::Acquire) == term
    }

    /// Lets the standby take over from the holder of this term.
    pub fn open_to_standby(&self, term: u64) {
        self.exchange(term | CLOSED, term);
    }

    /// Keeps the standby from taking over from the holder of this term, unless it has done so already.
    pub fn close_to_standby(&self, term: u64) {
        self.exchange(term, term | CLOSED);
    }

    fn exchange(&self, from: u64, to: u64) -> bool {
        let word = self.word(Word::Term);
        word.compare_exchange(from, to, Ordering::AcqRel, Ordering::Acquire).is_ok()
    }

    /// The seat of the twin that a term belongs to, 1 or 2.
    pub fn seat_of(term: u64) -> u64 {
        (term & 1) + 1
    }

    /// Takes the node over from whoever has this term, for this seat, if the holder is [open](Self::open_to_standby) to
    /// that; the new term, which is higher. Nobody may take over from that for now. For the cycle: one compare-and-swap.
    pub fn take_over(&self, from: u64, seat: u64, unix_ns: u64) -> Option<u64> {
        let new = next_term(from, seat, unix_ns);
        self.exchange(from, new | CLOSED).then_some(new)
    }

    /// Takes the node over to start it, from a holder that lives no more; the new term.
    pub(super) fn begin(&self, seat: u64, unix_ns: u64) -> Option<u64> {
        let found = self.word(Word::Term).load(Ordering::Acquire);
        let new = next_term(found & !CLOSED, seat, unix_ns);
        self.exchange(found, new | CLOSED).then_some(new)
    }

    /// Forgets the takeovers of a node that has ended.
    pub(super) fn forget_takeovers(&self) {
        for word in [Word::Takeovers, Word::TakenUnixNs, Word::TakenBefore, Word::Gap, Word::Unmet]
        {
            self.word(word).store(0, Ordering::Relaxed);
        }
    }

    /// As [`take_over`](Self::take_over) has been done: notes it for those who look at the node.
    pub fn note_takeover(&self, unix_ns: u64, was_asked: bool, lost_cycles: u64, unmet: u64) {
        let before = self.word(Word::TakenUnixNs).swap(unix_ns, Ordering::Relaxed);
        self.word(Word::TakenBefore).store(before, Ordering::Relaxed);
        self.word(Word::Kind).store(u64::from(was_asked), Ordering::Relaxed);
        self.word(Word::Gap).store(lost_cycles, Ordering::Relaxed);
        self.word(Word::Unmet).store(unmet, Ordering::Relaxed);
        self.word(Word::Takeovers).fetch_add(1, Ordering::Release);
    }

    /// The last takeover; `None`: there was none.
    pub fn last_takeover(&self) -> Option<Takeover> {
        let of = |word| self.word(word).load(Ordering::Relaxed);
        let count = self.word(Word::Takeovers).load(Ordering::Acquire);
        let (unix_ns, before) = (of(Word::TakenUnixNs), of(Word::TakenBefore));
        (count > 0).then(|| Takeover {
            unix_ns,
            was_asked: of(Word::Kind) == 1,
            count,
            after_ns: (before > 0).then(|| unix_ns.saturating_sub(before)),
            lost_cycles: of(Word::Gap),
            unmet_releases: of(Word::Unmet),
        })
    }

    /// Asks the standby to take over from the holder of this term, which goes on until then.
    pub fn ask_to_take_over(&self, term: u64) {
        self.word(Word::HandOver).store(term, Ordering::Release);
    }

    /// Whether the holder of this term has asked for that.
    pub fn is_asked_to_take_over(&self, term: u64) -> bool {
        self.word(Word::HandOver).load(Ordering::Acquire) == term
    }

    /// Claims the frames of a cycle of a task; `false`: the other twin has claimed them, or later ones, so they are not
    /// to be sent. For the cycle.
    #[inline]
    pub fn claim(&self, task: usize, cycle: u64) -> bool {
        let next = cycle.saturating_add(1);
        self.task_word(task, TaskWord::Claimed).fetch_max(next, Ordering::AcqRel) < next
    }

    /// The place of a task in the page, by its name. Under the domain's lock, or in the holder, whose tasks have theirs.
    pub(super) fn place_of(&self, name: &str) -> Option<usize> {
        let hash = fnv1a(name.bytes());
        let has = |task: &usize| {
            let found = self.task_word(*task, TaskWord::Name).load(Ordering::Acquire);
            found == hash || found == 0
        };
        let place = (0..MAX_TWIN_TASKS).find(has)?;
        self.task_word(place, TaskWord::Name).store(hash, Ordering::Release);
        Some(place)
    }

    /// Forgets the tasks of a node that has ended.
    pub(super) fn forget_tasks(&self) {
        for word in self.words().iter().skip(FIRST_TASK_WORD) {
            word.store(0, Ordering::Release);
        }
    }

    /// Sets the grid that the node has from now on: when it begins in ns of `CLOCK_MONOTONIC`, and by the tasks' places
    /// their first cycles.
    pub fn set_grid(&self, epoch_ns: u64, first_cycles: impl Iterator<Item = (usize, u64)>) {
        for (task, cycle) in first_cycles {
            self.task_word(task, TaskWord::FirstCycle).store(cycle, Ordering::Relaxed);
        }
        self.word(Word::Epoch).store(epoch_ns, Ordering::Release);
    }

    /// When the node's grid begins, in ns of `CLOCK_MONOTONIC`; `None`: the holder has not started.
    pub fn epoch_ns(&self) -> Option<u64> {
        Some(self.word(Word::Epoch).load(Ordering::Acquire)).filter(|epoch_ns| *epoch_ns > 0)
    }

    /// The first cycle of a task, by its place.
    pub fn first_cycle(&self, task: usize) -> u64 {
        self.task_word(task, TaskWord::FirstCycle).load(Ordering::Relaxed)
    }

    /// The first 16 digits of the SHA-256 of the holder's configuration; `None`: it is about to have one.
    pub fn configuration(&self) -> Option<u64> {
        let configuration = self.word(Word::Configuration).load(Ordering::SeqCst);
        Some(configuration).filter(|configuration| *configuration != CHANGING)
    }

    /// Sets that of the holder.
    pub fn set_configuration(&self, configuration: u64) {
        self.word(Word::Configuration).store(configuration, Ordering::SeqCst);
    }

    /// Hides it until it is set anew: whoever joins waits for that.
    pub fn hide_configuration(&self) {
        self.set_configuration(CHANGING);
    }

    /// The process in a seat; `None`: nobody ever sat there.
    pub fn process(&self, seat: u64) -> Option<u32> {
        let process = self.word(process_word(seat)).load(Ordering::Relaxed);
        u32::try_from(process).ok().filter(|process| *process > 0)
    }

    pub(super) fn sit(&self, seat: u64, process: u32) {
        self.word(process_word(seat)).store(u64::from(process), Ordering::Relaxed);
    }
}

impl Drop for TwinPage {
    fn drop(&mut self) {
        // SAFETY: mapped by `open` with this length, and no reference into it outlives this.
        #[allow(unsafe_code)]
        let _ = unsafe { munmap(self.words.as_ptr().cast(), WORDS * 8) };
    }
}

fn process_word(seat: u64) -> Word {
    if seat == 1 { Word::Process } else { Word::SecondProcess }
}

/// The term after another: higher, at least the time, with the seat in its lowest bit, and not [`CLOSED`].
fn next_term(from: u64, seat: u64, unix_ns: u64) -> u64 {
    unix_ns.max(from.saturating_add(1)).saturating_add(3) & !3 | (seat - 1)
}

/// The file of a node's page. A node's name may have any characters, so its hash names the file.
pub(super) fn path(config: &Config, node: &str) -> PathBuf {
    let prefix = &config.global.prefix;
    Path::new(FOLDER).join(format!("{prefix}isochrone.{:016x}.twins", fnv1a(node.bytes())))
}

/// Removes the pages of a domain that nobody uses any more, and their seats; those of a process that is about to join
/// again stay.
pub(crate) fn remove_all(config: &Config) {
    let start = format!("{}isochrone.", config.global.prefix);
    let name = |file: &PathBuf| file.file_name()?.to_str().map(str::to_owned);
    let node = |name: &str| {
        let (hash, _) = name.strip_prefix(&start)?.split_once(".twins")?;
        (hash.len() == 16).then(|| hash.to_owned())
    };
    let files = segment::files(config).into_iter();
    let files: Vec<_> = files.filter_map(|file| Some((node(&name(&file)?)?, file))).collect();
    let is_taken = |(_, file): &&(String, PathBuf)| {
        let is_page = file.extension().is_some_and(|extension| extension == "twins");
        !is_page && matches!(locked_file::try_lock(file), Ok(None))
    };
    let taken: Vec<_> = files.iter().filter(is_taken).map(|(node, _)| node.clone()).collect();
    for (_, file) in files.into_iter().filter(|(node, _)| !taken.contains(node)) {
        let _ = fs::remove_file(file);
    }
}

#[cfg(test)]
#[path = "page_tests.rs"]
mod tests;
