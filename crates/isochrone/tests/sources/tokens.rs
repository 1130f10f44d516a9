//! Rust, as far as it takes to see which names a file uses.

/// A word, `::` or another sign, and the line that it stands in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Token<'t> {
    pub(super) text: &'t str,
    pub(super) line: usize,
}

impl Token<'_> {
    pub(super) fn is_word(&self) -> bool {
        self.text.starts_with(is_of_word)
    }
}

fn is_of_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// What a file consists of, without comments, literals, attributes, and what is only for tests.
pub(super) fn tokens(text: &str) -> Vec<Token<'_>> {
    let (mut tokens, mut rest, mut line) = (Vec::new(), text, 1);
    while !rest.is_empty() {
        let (token, tail) = rest.split_at(length(rest));
        let is_name = token.starts_with(is_of_word) || token == "::";
        if is_name || (token.len() == 1 && !token.starts_with(['"', '\'', ' ', '\n'])) {
            tokens.push(Token { text: token, line });
        }
        line += token.matches('\n').count();
        rest = tail;
    }
    without_attributes(&tokens)
}

/// The length of what a text begins with.
fn length(text: &str) -> usize {
    let up_to = |end: &str, from: usize| {
        text[from..].find(end).map_or(text.len(), |place| from + place + end.len())
    };
    let hashes = text.trim_start_matches(['b', 'r']).bytes().take_while(|b| *b == b'#').count();
    let raw = text.find('r').map_or(0, |r| r + 1);
    match text.as_bytes() {
        [b'/', b'/', ..] => up_to("\n", 0) - 1,
        [b'/', b'*', ..] => up_to("*/", 0),
        [b'r', ..] | [b'b', b'r', ..] if text[raw + hashes..].starts_with('"') => {
            up_to(&format!("\"{}", "#".repeat(hashes)), raw + hashes + 1)
        }
        [b'"', ..] => {
            let mut is_escaped = false;
            let is_end = |c: char| {
                let is_end = c == '"' && !is_escaped;
                is_escaped = c == '\\' && !is_escaped;
                is_end
            };
            text[1..].find(is_end).map_or(text.len(), |place| place + 2)
        }
        [b'\'', b'\\', ..] => up_to("'", 3),
        // A lifetime has no end.
        [b'\'', ..] => match text.chars().nth(2) {
            Some('\'') => up_to("'", 1),
            _ => 1 + text[1..].find(|c| !is_of_word(c)).unwrap_or(0),
        },
        [b':', b':', ..] => 2,
        _ if text.starts_with(is_of_word) => text.find(|c| !is_of_word(c)).unwrap_or(text.len()),
        _ => text.chars().next().map_or(0, char::len_utf8),
    }
}

/// Leaves out attributes, and the items that they keep for tests.
fn without_attributes<'t>(tokens: &[Token<'t>]) -> Vec<Token<'t>> {
    let (mut left, mut at) = (Vec::new(), 0);
    while let Some(token) = tokens.get(at) {
        let begin = match tokens[at..] {
            [Token { text: "#", .. }, Token { text: "[", .. }, ..] => at + 1,
            [Token { text: "#", .. }, Token { text: "!", .. }, ..] => at + 2,
            _ => {
                left.push(*token);
                at += 1;
                continue;
            }
        };
        let end = begin + closing(&tokens[begin..]);
        let words: Vec<_> = tokens[at..end].iter().map(|token| token.text).collect();
        at = end + 1;
        if words.ends_with(&["[", "test"]) || words.ends_with(&["cfg", "(", "test", ")"]) {
            while tokens[at].text == "#" {
                at += 2 + closing(&tokens[at + 1..]);
            }
            at += item(&tokens[at..]);
        }
    }
    left
}

/// The number of tokens of the item that they begin with: up to a semicolon or the end of its braces.
fn item(tokens: &[Token<'_>]) -> usize {
    let end = tokens.iter().position(|token| [";", "{"].contains(&token.text));
    let end = end.unwrap_or(tokens.len() - 1);
    // What a `use` has in braces is followed by a semicolon.
    match tokens[end].text {
        "{" => {
            let end = end + closing(&tokens[end..]);
            let has_semicolon = tokens.get(end + 1).is_some_and(|next| next.text == ";");
            end + 1 + usize::from(has_semicolon)
        }
        _ => end + 1,
    }
}

/// The place of the bracket that closes the one that the tokens begin with.
fn closing(tokens: &[Token<'_>]) -> usize {
    let mut depth = 0;
    let is_closed = |token: &Token<'_>| {
        match token.text {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" | "}" => depth -= 1,
            _ => {}
        }
        depth == 0
    };
    tokens.iter().position(is_closed).unwrap()
}
