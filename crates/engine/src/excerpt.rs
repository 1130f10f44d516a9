//! The part of a file that a diagnostic is shown in. A renderer must not get the whole file: a line may have millions of
//! characters, and some may be commands to the terminal.

use std::borrow::Cow;
use std::ops::Range;

use miette::{LabeledSpan, MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents};

use crate::Source;
use isochrone_model::{escaped, escaped_lines};

/// The longest line that is shown as a whole, and how much is shown of a longer one, in characters.
const LINE_CHARS: usize = 160;
/// How much of a longer line is shown before the place that matters, in characters.
const CHARS_BEFORE: usize = 60;
/// Most lines that are shown of a long place.
const PLACE_LINES: usize = 5;
/// Stands for the rest of a line.
const ELLIPSIS: char = '…';
/// A gap between two parts, so that no span reaches from one into the other.
const GAP: usize = 2;

/// The lines around one place of a file or two, shortened.
#[derive(Clone, Debug)]
pub(crate) struct Excerpt {
    name: String,
    parts: Vec<Part>,
    marks: Vec<Mark>,
}

/// Lines that follow each other.
#[derive(Clone, Debug)]
struct Part {
    text: String,
    /// The first line's number, from 0.
    line: usize,
    /// Where the text begins in the renderer's view of the source.
    offset: usize,
}

/// A place of the file.
#[derive(Clone, Debug)]
struct Mark {
    /// In the renderer's view of the source.
    span: Range<usize>,
    /// In the file, both from 1.
    line: usize,
    column: usize,
}

impl Excerpt {
    /// Shows a place of a file, in bytes, and `other` as well if there is one.
    pub(crate) fn new(source: &Source, place: &Range<usize>, other: Option<&Range<usize>>) -> Self {
        let mut excerpt =
            Self { name: escaped(&source.name).into_owned(), parts: vec![], marks: vec![] };
        let place = within(&source.text, place);
        let lines = Lines::around(&source.text, &place);
        let Some(other) = other.map(|other| within(&source.text, other)) else {
            excerpt.add(source, &lines, &[place]);
            return excerpt;
        };
        let other_lines = Lines::around(&source.text, &other);
        match lines.joined(&other_lines).filter(|lines| lines.are_whole(&source.text)) {
            Some(lines) => excerpt.add(source, &lines, &[place, other]),
            None => {
                excerpt.add(source, &lines, &[place]);
                excerpt.add(source, &other_lines, &[other]);
            }
        }
        excerpt
    }

    /// The places as labels: the one that matters, and the other one with a word.
    pub(crate) fn labels(&self, other: &str) -> impl Iterator<Item = LabeledSpan> {
        self.marks.iter().enumerate().map(move |(index, mark)| match index {
            0 => LabeledSpan::new_primary_with_span(None, mark.span.clone()),
            _ => LabeledSpan::new_with_span(Some(other.into()), mark.span.clone()),
        })
    }

    /// Adds lines with places in them.
    fn add(&mut self, source: &Source, lines: &Lines, places: &[Range<usize>]) {
        let offset = self.parts.last().map_or(0, |part| part.offset + part.text.len() + GAP);
        let mut text = String::new();
        // Where a byte of the file is in the text, ascending in both.
        let mut places_of_bytes = Vec::new();
        for line in &lines.bytes {
            let focus = places
                .iter()
                .map(|place| place.start)
                .find(|start| line.contains(start) || *start == line.end);
            let window = window(&source.text, line, focus.unwrap_or(line.start));
            if window.start > line.start {
                text.push(ELLIPSIS);
            }
            for (byte, c) in source.text[window.clone()].char_indices() {
                places_of_bytes.push((window.start + byte, text.len()));
                text.push_str(&shown(c, &mut [0; 4]));
            }
            places_of_bytes.push((window.end, text.len()));
            if window.end < line.end {
                text.push(ELLIPSIS);
            }
            if line.end < source.text.len() {
                text.push('\n');
            }
        }
        let shown_at = |byte: usize| {
            let after = places_of_bytes.partition_point(|(of_file, _)| *of_file <= byte);
            let known = after.checked_sub(1).and_then(|index| places_of_bytes.get(index));
            offset + known.map_or(0, |(_, of_text)| *of_text)
        };
        self.marks.extend(places.iter().map(|place| {
            let (line, column) = source.position(place.start);
            Mark { span: shown_at(place.start)..shown_at(place.end), line, column }
        }));
        self.parts.push(Part { text, line: lines.first, offset });
    }
}

impl SourceCode for Excerpt {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        lines_before: usize,
        lines_after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let part = self.parts.iter().rev().find(|part| part.offset <= span.offset());
        let part = part.ok_or(MietteError::OutOfBounds)?;
        let span_of_part = SourceSpan::new((span.offset() - part.offset).into(), span.len());
        let contents = part.text.read_span(&span_of_part, lines_before, lines_after)?;
        // Without lines around it, the contents begin at the span, and are asked for its place.
        let mark =
            self.marks.iter().find(|mark| lines_before == 0 && mark.span.start == span.offset());
        let (line, column) = match mark {
            Some(mark) => (mark.line - 1, mark.column - 1),
            None => (part.line + contents.line(), contents.column()),
        };
        let start = part.offset + contents.span().offset();
        Ok(Box::new(
            MietteSpanContents::new_named(
                self.name.clone(),
                contents.data(),
                SourceSpan::new(start.into(), contents.span().len()),
                line,
                column,
                contents.line_count(),
            )
            .with_language("toml"),
        ))
    }
}

/// Lines of a file that follow each other.
struct Lines {
    /// The first one's number, from 0.
    first: usize,
    /// Where each stands in the file, without its end.
    bytes: Vec<Range<usize>>,
}

impl Lines {
    /// The lines of a place, the first few if it is long, and one before and after it.
    fn around(text: &str, place: &Range<usize>) -> Self {
        let mut start = line_start(text, place.start);
        let mut first = text[..start].matches('\n').count();
        let mut bytes = Vec::new();
        if let Some(end) = start.checked_sub(1) {
            bytes.push(line_at(text, line_start(text, end)).0);
            first -= 1;
        }
        let mut rest = PLACE_LINES;
        loop {
            let (line, next) = line_at(text, start);
            bytes.push(line);
            rest -= 1;
            match next {
                Some(next) if next < text.len() => start = next,
                _ => break,
            }
            if place.end <= start {
                bytes.push(line_at(text, start).0);
                break;
            }
            if rest == 0 {
                break;
            }
        }
        Self { first, bytes }
    }

    /// Both, if no line between them is missing.
    fn joined(&self, other: &Self) -> Option<Self> {
        let (a, b) = if self.first <= other.first { (self, other) } else { (other, self) };
        let known = (a.first + a.bytes.len()).checked_sub(b.first)?;
        let more = b.bytes.get(known..).unwrap_or_default();
        Some(Self { first: a.first, bytes: [&a.bytes, more].concat() })
    }

    /// Whether all of them are shown whole.
    fn are_whole(&self, text: &str) -> bool {
        self.bytes.iter().all(|line| window(text, line, line.start) == *line)
    }
}

/// A span that lies within the text, between characters.
fn within(text: &str, span: &Range<usize>) -> Range<usize> {
    let floor = |byte: usize| {
        let mut byte = byte.min(text.len());
        while !text.is_char_boundary(byte) {
            byte -= 1;
        }
        byte
    };
    let start = floor(span.start);
    start..floor(span.end).max(start)
}

/// Where the line of a byte begins.
fn line_start(text: &str, byte: usize) -> usize {
    text[..byte].rfind('\n').map_or(0, |end| end + 1)
}

/// The line that begins at a byte, without its end, and where the next one begins.
fn line_at(text: &str, start: usize) -> (Range<usize>, Option<usize>) {
    let rest = &text[start..];
    let (line, next) = match rest.split_once('\n') {
        Some((line, _)) => (line, Some(start + line.len() + 1)),
        None => (rest, None),
    };
    let line = line.strip_suffix('\r').unwrap_or(line);
    (start..start + line.len(), next)
}

/// The part of a line that is shown: all of it, or some of it around a byte.
fn window(text: &str, line: &Range<usize>, focus: usize) -> Range<usize> {
    let from = |start: usize| start + fitting(text[start..line.end].chars(), LINE_CHARS);
    if from(line.start) == line.end {
        return line.clone();
    }
    let start = focus - fitting(text[line.start..focus].chars().rev(), CHARS_BEFORE);
    start..from(start)
}

/// How many bytes of a text fit, as it is shown.
fn fitting(text: impl Iterator<Item = char>, mut room: usize) -> usize {
    let mut bytes = 0;
    for c in text {
        match room.checked_sub(shown(c, &mut [0; 4]).chars().count()) {
            Some(rest) => room = rest,
            None => break,
        }
        bytes += c.len_utf8();
    }
    bytes
}

/// A character as it is shown. The renderer knows how wide a tab is.
fn shown(c: char, buffer: &mut [u8; 4]) -> Cow<'_, str> {
    escaped_lines(c.encode_utf8(buffer))
}

#[cfg(test)]
#[path = "excerpt_tests.rs"]
mod tests;
