//! Two pipes, one for each way. They have names, so that both processes find them; to the kernel they
//! are as any other.

use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use isochrone_ipc::ForRealTime;
use rustix::fs::{CWD, FileType, Mode, OFlags, fcntl_getfl, fcntl_setfl, mknodat};

use crate::latency::arm::Transport;
use crate::latency::end::{End, EndError, Opening, Rendezvous, Side, without_ports};
use crate::latency::pace::Wait;
use crate::latency::stream::Stream;

pub(super) struct Pipe;

impl Transport for Pipe {
    fn name(&self) -> &'static str {
        "pipe"
    }

    fn help(&self) -> &'static str {
        "Pipe"
    }

    fn can_block(&self) -> bool {
        true
    }

    fn open(&self, place: &Rendezvous<'_>) -> Result<ForRealTime<Opening>, EndError> {
        let failed = EndError::system("open a pipe");
        let (wait, values) = (place.wait, place.values);
        let [forth, back] = ["pipe-forth", "pipe-back"].map(|name| place.folder.join(name));
        let (incoming, outgoing): (PathBuf, PathBuf) = match place.side {
            Side::Measuring => {
                for pipe in [&forth, &back] {
                    let own = Mode::RUSR | Mode::WUSR;
                    mknodat(CWD, pipe, FileType::Fifo, own, 0).map_err(|e| failed(e.into()))?;
                }
                (back, forth)
            }
            Side::Peer => (forth, back),
        };
        // A reader opens without a writer, a writer only when there is a reader: so all read first.
        let reader = open_now(&incoming, OpenOptions::new().read(true)).map_err(&failed)?;
        Ok(without_ports(Box::new(move || {
            let writer = open_now(&outgoing, OpenOptions::new().write(true)).map_err(&failed)?;
            if wait == Wait::Block {
                for pipe in [&reader, &writer] {
                    let flags = fcntl_getfl(pipe).map_err(|e| failed(e.into()))?;
                    fcntl_setfl(pipe, flags - OFlags::NONBLOCK).map_err(|e| failed(e.into()))?;
                }
            }
            Ok(Box::new(Stream::new(reader, writer, values)) as Box<dyn End>)
        })))
    }
}

fn open_now(path: &Path, options: &mut OpenOptions) -> io::Result<File> {
    options.custom_flags(OFlags::NONBLOCK.bits().cast_signed()).open(path)
}
