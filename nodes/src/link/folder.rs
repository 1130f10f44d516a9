//! The folder in which the link's program runs, with the files that it reads when it starts.

use std::fs::{self, DirBuilder};
use std::io;
use std::os::unix::fs::DirBuilderExt;
use std::path::{Path, PathBuf};

use isochrone_ipc::Domain;
use serde_json::json;

use super::Way;
use crate::failure::Failure;

/// The file in which iceoryx2 looks first.
const DOMAIN: &str = "config/iceoryx2.toml";
const ZENOH: &str = "zenoh.json5";
/// How long the other side may be silent before the link connects anew.
const LEASE_MS: u64 = 3000;
/// Between two attempts to connect, at first and at most.
const RETRY_MS: [u64; 2] = [200, 1000];

/// A folder in the domain's root path; removed when this is dropped.
pub(super) struct Folder(PathBuf);

impl Folder {
    /// Creates it, and removes those of programs that were killed.
    pub(super) fn create(domain: &Domain) -> Result<Self, Failure> {
        let stem = format!("{}isochrone.link.", domain.prefix());
        let root = domain.root_path();
        for entry in fs::read_dir(&root).into_iter().flatten().flatten() {
            let name = entry.file_name();
            let pid = name.to_str().and_then(|name| name.strip_prefix(&stem)?.parse::<u32>().ok());
            if pid.is_some_and(|pid| !Path::new(&format!("/proc/{pid}")).exists()) {
                let _ = fs::remove_dir_all(entry.path());
            }
        }
        Ok(Self(root.join(format!("{stem}{}", std::process::id()))))
    }

    pub(super) fn path(&self) -> &Path {
        &self.0
    }

    /// The file that says how the two links find each other.
    pub(super) fn zenoh_file(&self, way: &Way) -> PathBuf {
        match way {
            Way::File(file) => file.clone(),
            Way::Listen(_) | Way::Connect(_) => self.0.join(ZENOH),
        }
    }

    /// Writes what the link reads, each time before it starts.
    pub(super) fn write(&self, domain: &Domain, way: &Way) -> Result<(), Failure> {
        let unwritable = |cause: io::Error| {
            Failure::found(format!(
                "cannot write to {}: {cause}; see that there is room",
                self.0.display()
            ))
        };
        let settings = toml::to_string(domain.config()).map_err(Failure::found)?;
        let file = self.0.join(DOMAIN);
        let folder = file.parent().unwrap_or(&self.0);
        DirBuilder::new().recursive(true).mode(0o700).create(folder).map_err(unwritable)?;
        fs::write(&file, settings).map_err(unwritable)?;
        if let Some(configuration) = zenoh_configuration(way) {
            fs::write(self.zenoh_file(way), configuration).map_err(unwritable)?;
        }
        Ok(())
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// What zenoh is told; `None` where the user has a file for it. Nothing is scouted for: who the other
/// side is was said. A side that connects listens nowhere, where zenoh would listen on all addresses.
fn zenoh_configuration(way: &Way) -> Option<String> {
    let (listen, connect) = match way {
        Way::Listen(local) => (vec![format!("tcp/{local}")], Vec::new()),
        Way::Connect(host) => (Vec::new(), vec![format!("tcp/{host}")]),
        Way::File(_) => return None,
    };
    let [init_ms, max_ms] = RETRY_MS;
    let configuration = json!({
        "mode": "peer",
        "listen": {"endpoints": listen},
        "connect": {
            "endpoints": connect,
            "retry": {"period_init_ms": init_ms, "period_max_ms": max_ms, "period_increase_factor": 2},
        },
        "scouting": {"multicast": {"enabled": false}, "gossip": {"enabled": false}},
        "transport": {"link": {"tx": {"lease": LEASE_MS}}},
    });
    Some(configuration.to_string())
}
