//! Recordings: written, read, and damaged.

mod damage;
mod files;
mod hostile;
mod node;
mod ros;
