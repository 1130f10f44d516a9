//! The interface as its users meet it: installed, compiled against by C and C++, and beside real nodes.

mod header;
mod installed;
mod nodes;
mod page;
mod programs;
