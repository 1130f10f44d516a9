//! A shell's brace notation for long lists of similar words.
//!
//! `ramp.{0..999}.{y,done} level` stands for 2001 words: `ramp.0.y`, `ramp.0.done`, `ramp.1.y` …
//! as in `echo ramp.{0..999}.{y,done} level`. Besides, `word*3` is that word (or group) three
//! times, and `-` is the empty word. iceoryx2 gives a service two kilobytes for attributes, and
//! a thousand names of a control node are mostly such series.

/// More words than any frame has; keeps a hostile description from filling the memory.
const MAX_WORDS: usize = 1 << 20;

/// Longest group of words that is looked for; a block has fewer pins.
const MAX_GROUP: usize = 64;

/// Whether the notation can carry `word`.
pub(crate) fn is_word(word: &str) -> bool {
    word != "-" && word.bytes().all(|b| b.is_ascii_graphic() && !b"{},*".contains(&b))
}

/// Writes a list word by word; [`read`] understands this too.
pub(crate) fn plain<'a>(words: impl Iterator<Item = &'a str>) -> String {
    let words = words.map(|word| if word.is_empty() { "-" } else { word });
    words.collect::<Vec<_>>().join(" ")
}

/// Writes `words` as briefly as simple rules can; all must satisfy [`is_word`].
pub(crate) fn write<'a>(words: impl Iterator<Item = &'a str>) -> String {
    let words: Vec<&str> = words.map(|w| if w.is_empty() { "-" } else { w }).collect();
    let mut rest = words.as_slice();
    let mut text = String::new();
    while let Some(first) = rest.first() {
        let mut best = Group { text: (*first).to_owned(), words: 1, saved: 0 };
        for length in 1..=MAX_GROUP.min(rest.len()) {
            let (group, rest) = rest.split_at(length);
            for found in [one_group(group), repeated(group, rest), numbered(group, rest)] {
                if let Some(found) = found.filter(|found| found.saved > best.saved) {
                    best = found;
                }
            }
        }
        if !text.is_empty() {
            text.push(' ');
        }
        text.push_str(&best.text);
        rest = rest.get(best.words..).unwrap_or_default();
    }
    text
}

/// Reads what [`write`] wrote. On failure returns the part that cannot be read.
pub(crate) fn read(text: &str) -> Result<Vec<String>, String> {
    let mut words = Vec::new();
    for group in text.split(' ').filter(|group| !group.is_empty()) {
        let unreadable = || group.to_owned();
        let (body, times) = match group.rsplit_once('*') {
            Some((body, times)) => (body, times.parse().map_err(|_| unreadable())?),
            None => (group, 1),
        };
        let once = expand(body).ok_or_else(unreadable)?;
        let total = once.len().saturating_mul(times).saturating_add(words.len());
        if total > MAX_WORDS {
            return Err(unreadable());
        }
        for _ in 0..times {
            words.extend(once.iter().map(|w| if w == "-" { String::new() } else { w.clone() }));
        }
    }
    Ok(words)
}

fn expand(body: &str) -> Option<Vec<String>> {
    let Some((stem, rest)) = body.split_once('{') else {
        return (!body.contains('}')).then(|| vec![body.to_owned()]);
    };
    let (choice, rest) = rest.split_once('}')?;
    let middles: Vec<String> = if choice.contains(',') {
        choice.split(',').map(str::to_owned).collect()
    } else {
        let (first, last) = choice.split_once("..")?;
        let (first, last): (usize, usize) = (first.parse().ok()?, last.parse().ok()?);
        if last.checked_sub(first)? >= MAX_WORDS {
            return None;
        }
        (first..=last).map(|number| number.to_string()).collect()
    };
    let tails = expand(rest)?;
    if middles.len().checked_mul(tails.len())? > MAX_WORDS {
        return None;
    }
    let word = |middle, tail| format!("{stem}{middle}{tail}");
    Some(
        middles
            .iter()
            .flat_map(|middle| tails.iter().map(move |tail| word(middle, tail)))
            .collect(),
    )
}

/// A way to write the next words.
struct Group {
    text: String,
    words: usize,
    /// Bytes by which it is shorter than the words themselves.
    saved: usize,
}

impl Group {
    fn new<'a>(text: String, words: impl Iterator<Item = &'a str>) -> Self {
        let (count, plain) = words.fold((0, 0), |(n, sum), word| (n + 1, sum + word.len() + 1));
        Self { saved: plain.saturating_sub(text.len() + 1), words: count, text }
    }
}

/// `stem{a,b,c}`: the group itself, once.
fn one_group(group: &[&str]) -> Option<Group> {
    Some(Group::new(choice(group), group.iter().copied()))
}

/// `word*n`: the group again and again.
fn repeated(group: &[&str], rest: &[&str]) -> Option<Group> {
    let more = rest.chunks_exact(group.len()).take_while(|next| *next == group).count();
    let text = format!("{}*{}", choice(group), more + 1);
    let words = group.iter().chain(rest.iter().take(more * group.len()));
    (more > 0).then(|| Group::new(text, words.copied()))
}

/// `stem{4..9}{a,b}`: the group again and again with a number that counts up.
fn numbered(group: &[&str], rest: &[&str]) -> Option<Group> {
    let (first, next) = (group.first()?, rest.first()?);
    let (stem, start) = numbers(first).find(|(stem, number)| {
        let tail = first.get(stem.len() + digits(*number)..);
        tail.is_some() && after(next, stem, number + 1) == tail
    })?;
    let tails: Vec<&str> =
        group.iter().map(|word| after(word, stem, start)).collect::<Option<_>>()?;
    let more = rest
        .chunks_exact(group.len())
        .zip(start + 1..)
        .take_while(|(next, number)| {
            let counted = next.iter().map(|word| after(word, stem, *number));
            counted.eq(tails.iter().map(|tail| Some(*tail)))
        })
        .count();
    let text = format!("{stem}{{{start}..{}}}{}", start + more, choice(&tails));
    let words = group.iter().chain(rest.iter().take(more * group.len()));
    (more > 0).then(|| Group::new(text, words.copied()))
}

/// The numbers in `word`, each with what stands before it. Numbers with leading zeros do not
/// count: `{007..009}` would lose them.
fn numbers(word: &str) -> impl Iterator<Item = (&str, usize)> {
    let starts = word.char_indices().filter_map(|(at, c)| {
        let before = word.get(..at)?;
        let begins = c.is_ascii_digit() && !before.ends_with(|c: char| c.is_ascii_digit());
        begins.then_some(before)
    });
    starts.filter_map(|stem| {
        let tail = word.get(stem.len()..)?;
        let end = tail.find(|c: char| !c.is_ascii_digit()).unwrap_or(tail.len());
        let number: usize = tail.get(..end)?.parse().ok()?;
        (digits(number) == end && number < MAX_WORDS).then_some((stem, number))
    })
}

fn digits(number: usize) -> usize {
    number.to_string().len()
}

/// What follows `stem` and `number` in `word`.
fn after<'a>(word: &'a str, stem: &str, number: usize) -> Option<&'a str> {
    word.strip_prefix(stem)?.strip_prefix(number.to_string().as_str())
}

/// `stem{a,b}` with the longest stem that all share; one word stands without braces.
fn choice(words: &[&str]) -> String {
    let Some((first, others)) = words.split_first() else {
        return String::new();
    };
    if others.is_empty() {
        return (*first).to_owned();
    }
    let shared = others.iter().fold(first.len(), |shared, word| {
        let same = first.bytes().zip(word.bytes());
        same.take_while(|(a, b)| a == b).count().min(shared)
    });
    let tails: Vec<&str> = words.iter().filter_map(|word| word.get(shared..)).collect();
    format!("{}{{{}}}", first.get(..shared).unwrap_or_default(), tails.join(","))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(n: usize, word: impl Fn(usize) -> String) -> Vec<String> {
        (0..n).map(word).collect()
    }

    fn written(words: &[String]) -> String {
        let text = write(words.iter().map(String::as_str));
        assert_eq!(read(&text).as_deref(), Ok(words), "{text}");
        text
    }

    #[test]
    fn a_series_is_written_as_a_range() {
        assert_eq!(written(&words(1000, |i| format!("ramp.{i}.y"))), "ramp.{0..999}.y");
    }

    #[test]
    fn pins_of_instances_are_written_as_a_range_of_groups() {
        let pins = ["value", "setChangeRate", "delayedValue"];
        let all = words(3000, |i| format!("ramp.{}.{}", i / 3, pins[i % 3]));
        assert_eq!(written(&all), "ramp.{0..999}.{value,setChangeRate,delayedValue}");
    }

    #[test]
    fn equal_words_are_counted() {
        let types = ["LREAL", "BOOL"];
        assert_eq!(written(&words(64, |_| "LREAL".to_owned())), "LREAL*64");
        assert_eq!(written(&words(64, |i| types[i % 2].to_owned())), "{LREAL,BOOL}*32");
        assert_eq!(written(&words(300, |_| String::new())), "-*300");
    }

    #[test]
    fn words_with_nothing_in_common_stand_as_they_are() {
        let all = ["level", "7", "", "x-1", "a..b", "007", "008"].map(str::to_owned);
        assert_eq!(written(&all), "level 7 - x-1 a..b 007 008");
    }

    #[test]
    fn any_mixture_comes_back_as_it_was() {
        // A small generator of nasty neighbours; deterministic, so a failure can be repeated.
        let parts = ["", "a", "1", "9", "10", "01", ".", "-", "..", "x.2"];
        let mut seed = 1_u32;
        let mut next = |n: usize| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            seed as usize / 65_536 % n
        };
        for _ in 0..300 {
            let length = next(40);
            let all = words(length, |_| String::new());
            let all: Vec<String> = all
                .iter()
                .map(|_| (0..next(4)).map(|_| parts[next(parts.len())]).collect())
                .map(|word: String| if word == "-" { "b".to_owned() } else { word })
                .collect();
            written(&all);
        }
    }

    #[test]
    fn a_shell_expands_it_the_same_way() {
        let all = words(40, |i| format!("b{}.{}", i / 4, ["p", "q", "r2", ""][i % 4]));
        let text = written(&all);
        let shell =
            std::process::Command::new("bash").args(["-c", &format!("echo {text}")]).output();
        // Machines without bash cannot say; the notation does not depend on it.
        if let Ok(shell) = shell {
            assert_eq!(String::from_utf8_lossy(&shell.stdout).trim_end(), all.join(" "));
        }
    }

    #[test]
    fn what_is_no_notation_is_refused_and_named() {
        for bad in
            ["a{", "a}", "{a}", "{3..1}", "x*y", "x*99999999", "{0..9999999}", "{0..2000}{0..2000}"]
        {
            assert_eq!(read(&format!("ok {bad}")), Err(bad.to_owned()));
        }
    }
}
