//! What can go wrong during set-up: each error names the thing, the place and the way out.

use thiserror::Error;

/// Most bytes of root path and prefix. iceoryx2's paths end at 255, and its own names take the rest;
/// it panics beyond.
pub(crate) const MAX_DOMAIN_BYTES: usize = 120;

/// Most bytes of a service's name. iceoryx2 takes 255; the rest is for the names of services that
/// belong to one of frames, such as `isochrone/layout/<service>`.
pub(crate) const MAX_SERVICE_NAME_BYTES: usize = 238;

/// Why there is no [`Domain`](crate::Domain).
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum DomainError {
    /// There is no file at the path that was given.
    #[error(
        "iceoryx2 configuration {path}: no such file; give an existing file, or none for the defaults"
    )]
    NotFound {
        /// The path as given.
        path: String,
    },
    /// The path is not ASCII, is empty or is longer than iceoryx2 can hold (255 bytes).
    #[error(
        "iceoryx2 configuration {path}: not a usable file path; use an ASCII path of at most 255 bytes"
    )]
    UnusablePath {
        /// The path as given.
        path: String,
    },
    /// The names of iceoryx2's files would be longer than it can hold.
    #[error(
        "root-path {root_path} and prefix {prefix} are too long for iceoryx2; together at most {MAX_DOMAIN_BYTES} bytes"
    )]
    TooLong {
        /// The root path.
        root_path: String,
        /// The prefix.
        prefix: String,
    },
    /// The folder of an isolated domain cannot be made.
    #[error(
        "cannot create a folder in {place} for a domain: {cause}; set TMPDIR to a writable folder"
    )]
    NoFolder {
        /// Where the folder was to be.
        place: String,
        /// What the system says.
        cause: String,
    },
    /// The file exists but cannot be read.
    #[error("iceoryx2 configuration {path}: cannot be read; check its permissions")]
    Unreadable {
        /// The path of the file.
        path: String,
    },
    /// It is a directory, a pipe or a device, or larger than 1 MiB.
    #[error(
        "iceoryx2 configuration {path}: not an ordinary file of at most 1 MiB; give one, or none for the defaults"
    )]
    NoFile {
        /// The path as given.
        path: String,
    },
    /// The file says nothing: iceoryx2 would take its defaults for all of it.
    #[error(
        "iceoryx2 configuration {path}: empty; write [global] with a root-path and a prefix, or give no file for the defaults"
    )]
    Empty {
        /// The path of the file.
        path: String,
    },
    /// The file is not TOML or has a value that iceoryx2 does not take.
    #[error(
        "iceoryx2 configuration {path}:{line}:{column}: not a valid iceoryx2 0.10 configuration: {cause}; compare it with `iox2 config show`"
    )]
    Malformed {
        /// The path of the file.
        path: String,
        /// From 1.
        line: usize,
        /// From 1, in characters.
        column: usize,
        /// What is wrong there.
        cause: String,
    },
    /// The file has a key that iceoryx2 does not know, and would ignore.
    #[error("iceoryx2 configuration {path}:{line}:{column}: {table} has no key {key:?}; {remedy}")]
    UnknownKey {
        /// The path of the file.
        path: String,
        /// From 1.
        line: usize,
        /// From 1, in characters.
        column: usize,
        /// The table that it stands in, such as `[global]`.
        table: String,
        /// The key as it is written.
        key: String,
        /// What would be right.
        remedy: String,
    },
    /// The root path would be another place for each process that is started elsewhere.
    #[error(
        "iceoryx2 configuration {path}:{line}:{column}: root-path {root_path:?} is relative, so each folder would have a domain of its own; begin it with /"
    )]
    RelativeRootPath {
        /// The path of the file.
        path: String,
        /// From 1.
        line: usize,
        /// From 1, in characters.
        column: usize,
        /// The root path.
        root_path: String,
    },
}

/// Why [`Participant::join`](crate::Participant::join) failed.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum JoinError {
    /// The name is longer than 128 bytes or is not ASCII.
    #[error("node name {name:?}: iceoryx2 takes at most 128 ASCII characters")]
    Name {
        /// The name as given.
        name: String,
    },
    /// The domain belongs to another user or cannot be written.
    #[error(
        "cannot join the iceoryx2 domain {domain}: no permission; all its processes must run as one user, or choose another root-path and prefix"
    )]
    Permission {
        /// Root path and prefix.
        domain: String,
    },
    /// Something in the domain belongs to another user.
    #[error(
        "cannot join the iceoryx2 domain {domain}: {path} belongs to {owner}, and this process runs as {ours}; run as the owner, have the owner remove it when no process uses the domain, or choose another root-path and prefix"
    )]
    OtherUser {
        /// Root path and prefix.
        domain: String,
        /// The folder, file or segment.
        path: String,
        /// Name and number of its owner.
        owner: String,
        /// Name and number of the process's user.
        ours: String,
    },
    /// The domain could not be locked, or not before the process was asked to end.
    #[error("cannot join the iceoryx2 domain {domain}: {cause}")]
    Locked {
        /// Root path and prefix.
        domain: String,
        /// The file that cannot be locked, or the process that was waited for.
        cause: String,
    },
    /// There is no room for what every process of a domain needs.
    #[error(
        "cannot join the iceoryx2 domain {domain}: /dev/shm has {free_bytes} bytes free, and {needed_bytes} are needed; remove what nobody uses there, or enlarge it: mount -o remount,size=256M /dev/shm"
    )]
    SharedMemoryFull {
        /// Root path and prefix.
        domain: String,
        /// About how much is needed.
        needed_bytes: u64,
        /// How much there is.
        free_bytes: u64,
    },
    /// iceoryx2 kept failing although it was tried for most of a second.
    #[error("cannot join the iceoryx2 domain {domain}: {cause}")]
    Failed {
        /// Root path and prefix.
        domain: String,
        /// What has run out or cannot be written, what iceoryx2 said last, and what to do.
        cause: String,
    },
}

/// Why [`check_service_name`](crate::check_service_name) refuses a name.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ServiceNameError {
    /// The name is empty.
    #[error(
        "the service name is empty; give 1 to {MAX_SERVICE_NAME_BYTES} printable ASCII characters, such as \"plant/level\""
    )]
    Empty,
    /// The name begins or ends with a blank, or has nothing else.
    #[error(
        "service name {name:?} begins or ends with a blank, which nobody sees; leave it out, as in \"plant/level\""
    )]
    Blank {
        /// The name as given.
        name: String,
    },
    /// The name is longer than 238 bytes.
    #[error(
        "service name {name:?} is {length} bytes long; at most {MAX_SERVICE_NAME_BYTES} are possible"
    )]
    TooLong {
        /// The name as given.
        name: String,
        /// Its length in bytes.
        length: usize,
    },
    /// The name has a control or a non-ASCII character.
    #[error(
        "service name {name:?} contains {character:?}; only printable ASCII characters are possible"
    )]
    Character {
        /// The name as given.
        name: String,
        /// The first character that does not fit.
        character: char,
    },
    /// The name is one of those under which layouts are announced.
    #[error(
        "service name {name:?} begins with \"isochrone/layout/\", where layouts are announced; choose another beginning"
    )]
    OfLayouts {
        /// The name as given.
        name: String,
    },
    /// The name begins with `iox2://`, which iceoryx2 keeps for itself.
    #[error(
        "service name {name:?} begins with \"iox2://\", which iceoryx2 keeps for itself; choose another beginning"
    )]
    Reserved {
        /// The name as given.
        name: String,
    },
}

/// Why a [`FrameLayout`](crate::FrameLayout) cannot be announced.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum LayoutError {
    /// A frame needs at least one signal.
    #[error("the frame has no signal; give it at least one")]
    Empty,
    /// A signal's name, type or unit has a control character.
    #[error(
        "channel {channel}: {word:?} cannot be announced; a name has no control characters, which could do anything to a terminal"
    )]
    Word {
        /// Index of the signal.
        channel: usize,
        /// Its name, type or unit.
        word: String,
    },
    /// There are more signals than a frame may have.
    #[error("there are {signals} signals; a frame has at most 65536")]
    TooMany {
        /// Number of signals.
        signals: usize,
    },
    /// A signal's name, type or unit is longer than 255 bytes.
    #[error("channel {channel}: a name, type or unit of {bytes} bytes; at most 255 are possible")]
    LongWord {
        /// Index of the signal.
        channel: usize,
        /// Length of the word.
        bytes: usize,
    },
}

/// Why the message of a service of layouts is no [`Announcement`](crate::Announcement).
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum AnnouncementError {
    /// It is not JSON of this form.
    #[error("it is not the JSON of a layout: {cause}")]
    Json {
        /// Where and why.
        cause: String,
    },
    /// It is longer than any layout needs.
    #[error("it has {bytes} bytes, which is more than any layout needs")]
    TooLong {
        /// Length of the message.
        bytes: usize,
    },
    /// What it describes can be no layout.
    #[error(transparent)]
    Layout(LayoutError),
    /// `layout` is not a number of 16 hexadecimal digits, or is 0.
    #[error("its \"layout\" is {text:?}; 16 hexadecimal digits that are not all 0 are needed")]
    Number {
        /// What stands there.
        text: String,
    },
}

/// What a frame does not have for a reader, see [`FrameLayout::find`](crate::FrameLayout::find).
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum LayoutConflict {
    /// The frames have too few channels.
    #[error("its frames have {available} channel{}, {needed} {} needed", plural(*available), is_or_are(*needed))]
    TooFewChannels {
        /// Channels of the frames.
        available: usize,
        /// Channels that are needed.
        needed: usize,
    },
    /// No channel has the name.
    #[error("its frames have no signal {needed:?}; there is: {available}")]
    NoSignal {
        /// The name that is needed.
        needed: String,
        /// The names that there are.
        available: String,
    },
    /// A channel carries another type.
    #[error(
        "channel {channel} ({name}) carries {available}, {needed} is needed{}",
        type_remedy(available, needed)
    )]
    ValueType {
        /// Index of the channel.
        channel: usize,
        /// The signal's name, or `-` when nobody gave one.
        name: String,
        /// Type on the wire.
        available: String,
        /// Type that is needed.
        needed: String,
    },
}

/// Why a [`FramePublisher`](crate::FramePublisher) or [`FrameSubscriber`](crate::FrameSubscriber)
/// could not be opened.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum OpenError {
    /// The service name is not possible.
    #[error(transparent)]
    ServiceName(#[from] ServiceNameError),
    /// The layout cannot be announced.
    #[error("service {service:?}: {source}")]
    Layout {
        /// Name of the service.
        service: String,
        /// What is wrong with the layout.
        source: LayoutError,
    },
    /// The service carries other messages than frames, frames of another version, or its layouts'
    /// service other messages than layouts.
    #[error(
        "service {service:?} carries {carries}, but {needs}; use another service name, or end all processes of the service and start again"
    )]
    OtherTypes {
        /// Name of the service.
        service: String,
        /// Its types and sizes.
        carries: String,
        /// What is needed, with types and sizes: `frames are …`.
        needs: String,
    },
    /// The service was made by another version of iceoryx2.
    #[error(
        "service {service:?} was created by another version of iceoryx2, this process has {ours}; run the same version everywhere, or separate the domains by prefix and root path"
    )]
    OtherVersion {
        /// Name of the service.
        service: String,
        /// Version of this process.
        ours: String,
    },
    /// Somebody writes the service already.
    #[error(
        "service {service:?} is written by {other} already; a service has one writer: end that one, or use another service name"
    )]
    SecondPublisher {
        /// Name of the service.
        service: String,
        /// Node name, executable and process id of the other publisher.
        other: String,
    },
    /// All places that the service's creator provided for are taken.
    #[error(
        "service {service:?} has no place for another {what} (its creator provided {limit}); end one, or end all of them and let a node of isochrone create the service"
    )]
    Full {
        /// Name of the service.
        service: String,
        /// `publisher`, `subscriber` or `node`.
        what: &'static str,
        /// How many there can be.
        limit: usize,
    },
    /// The domain could not be locked, or not before the process was asked to end.
    #[error("service {service:?} in {domain} cannot be opened: {cause}")]
    Locked {
        /// Name of the service.
        service: String,
        /// Root path and prefix.
        domain: String,
        /// The file that cannot be locked, or the process that was waited for.
        cause: String,
    },
    /// The service belongs to another user.
    #[error(
        "service {service:?} in {domain}: no permission; all its processes must run as one user"
    )]
    Permission {
        /// Name of the service.
        service: String,
        /// Root path and prefix.
        domain: String,
    },
    /// There is no room for the frames.
    #[error(
        "service {service:?}: /dev/shm has {free_bytes} bytes free, and its publisher needs {needed_bytes}; remove what nobody uses there, or enlarge it: mount -o remount,size=256M /dev/shm"
    )]
    SharedMemoryFull {
        /// Name of the service.
        service: String,
        /// About how much is needed.
        needed_bytes: u64,
        /// How much there is.
        free_bytes: u64,
    },
    /// The service's files are damaged or were removed while it lived.
    #[error(
        "service {service:?} in {domain} is damaged; end all its processes, then remove its files in that place"
    )]
    Corrupted {
        /// Name of the service.
        service: String,
        /// Root path and prefix.
        domain: String,
    },
    /// iceoryx2 kept failing although it was tried for most of a second.
    #[error("service {service:?} in {domain} cannot be opened: {cause}")]
    Failed {
        /// Name of the service.
        service: String,
        /// Root path and prefix.
        domain: String,
        /// What has run out or cannot be written, what iceoryx2 said last, and what to do.
        cause: String,
    },
}

fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

fn is_or_are(count: usize) -> &'static str {
    if count == 1 { "is" } else { "are" }
}

/// What an input of a configuration says where a writer's INT should feed an LREAL: only a wire
/// converts.
fn type_remedy(available: &str, needed: &str) -> &'static str {
    if (available, needed) == ("INT", "LREAL") {
        "; write type = \"INT\" at the input: a wire from it feeds LREAL pins all the same"
    } else {
        ""
    }
}
