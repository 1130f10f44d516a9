//! The state that the threads of the page share.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};

use super::access::Access;
use super::curves::Curves;
use super::jitter::Jitter;
use super::pages::Pages;
use super::plant::{Plant, Text};
use super::silence::Silence;
use super::threads::locked;
use super::writes::Writer;
use crate::base::session::News;

/// The state that the threads share.
pub(super) struct View {
    pub(super) port: u16,
    pub(super) access: Access,
    pub(super) pages: Pages,
    pub(super) plant: Mutex<Plant>,
    pub(super) curves: Mutex<Curves>,
    pub(super) jitter: Mutex<Jitter>,
    /// Why signals have no curve, by name.
    pub(super) refused: Mutex<Text>,
    pub(super) writer: Option<Writer>,
    pub(super) is_over: Arc<AtomicBool>,
    pub(super) silence: Silence,
}

impl View {
    /// Takes in what the node says.
    pub(super) fn take(&self, news: News) {
        if !matches!(news, News::Lost { .. } | News::Refused { .. }) {
            self.silence.end();
        }
        if let News::Timing(samples) = &news {
            // Of tasks that no trace shows every cycle of.
            let mut jitter = locked(&self.jitter);
            for sample in samples {
                jitter.add_shown(&sample.task, sample.cycle, sample.release_jitter_ns);
            }
            return;
        }
        if locked(&self.plant).take(news) {
            locked(&self.jitter).forget();
        }
    }
}
