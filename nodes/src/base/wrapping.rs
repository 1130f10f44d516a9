//! Text in lines of a given width.

use textwrap::{Options, WordSeparator, WordSplitter, WrapAlgorithm};

/// Lines of at most so many columns, divided at spaces only: what has a hyphen, such as a path or an
/// option, stays whole where a line has room for it.
pub(crate) fn at_spaces<'a>(columns: usize) -> Options<'a> {
    Options::new(columns)
        .word_separator(WordSeparator::AsciiSpace)
        .word_splitter(WordSplitter::NoHyphenation)
        .wrap_algorithm(WrapAlgorithm::FirstFit)
}
