//! The reference page docs/blocks.md.

use isochrone_blocks::{BlockType, Pin};

use super::text::{default, document, families, follows_lgf, meaning, source, word_meaning};

const INTRODUCTION: &str = "\
# Function blocks

<!-- The output of `isochrone blocks --format page`. -->

The formulas are exact: every number is computed in IEEE-754 binary64, in the order written, without
fused multiply-add. Status words from 16#8000 are errors; `error` is TRUE for exactly these, and a node
counts such steps as block errors.

A pin takes a number, true or false, or a wire: `\"input\"` or `\"block.pin\"`. A TIME is a whole number of
milliseconds, `100`, or text: `\"100ms\"`, `\"T#100ms\"`, `\"T#1m30s\"`. An INT or WORD can also be written with a
base, in quotes: `\"16#64\"`. `callOB` takes an OB number or the name of a task, which needs no number.

A lamp for a level that has been above 1.6 for two seconds is a TON behind an expression. `wait.Q` becomes TRUE in
the first cycle in which `is.high` has been TRUE for `PT`, and FALSE as soon as `is.high` is. With `level.ok` in it,
the lamp also goes out when the sensor dies:

```toml
[[input]]
name = \"level\"
service = \"plant/level\"
max_age = \"500ms\"

[[block]]
name = \"is\"
type = \"Expr\"
out = { high = \"level > 1.6 AND level.ok\" }

[[block]]
name = \"wait\"
type = \"TON\"
[block.in]
IN = \"is.high\"
PT = \"2s\"

[[output]]
service = \"lamp/out\"
signals = [\"wait.Q\"]
```
";

const OF_LGF: &str = "
Blocks that name an LGF page follow the manual of Siemens' Library of General Functions (LGF) for the TIA
Portal: their names, types, defaults, modes and status words are those of LGF. Where that page is silent,
a table lists what isochrone does.
";

/// The page of these blocks.
pub(super) fn page(types: &[&BlockType]) -> String {
    let of_lgf = types.iter().any(|known| follows_lgf(known)).then(|| OF_LGF.to_owned());
    let blocks = types.iter().map(|known| block(known));
    [INTRODUCTION.to_owned(), contents(types)].into_iter().chain(of_lgf).chain(blocks).collect()
}

/// The blocks by family, each with a link to its section.
fn contents(types: &[&BlockType]) -> String {
    let mut text = "\n| follows | blocks |\n|---|---|\n".to_owned();
    for (family, members) in families(types) {
        let links = members
            .iter()
            .map(|known| format!("[{0}](#{1})", known.name, known.name.to_lowercase()));
        text += &row([family, &links.collect::<Vec<_>>().join(", ")]);
    }
    text
}

fn block(known: &BlockType) -> String {
    let mut text = format!("\n## {}\n\n{}\n\n", known.name, known.doc());
    text += &source(known).map_or_else(String::new, |source| format!("{source}\n\n"));
    for sentence in known.computes {
        text += &format!("- {sentence}\n");
    }
    if !known.inputs.is_empty() {
        text += "\n| input | type | default | unit | meaning |\n|---|---|---|---|---|\n";
    }
    for pin in known.inputs {
        text += &row([
            &pin_name(pin),
            pin.pin_type.as_str(),
            &default(pin),
            pin.unit,
            &meaning(known, pin),
        ]);
    }
    text += "\n| output | type | unit | meaning |\n|---|---|---|---|\n";
    for pin in known.outputs {
        text += &row([&pin_name(pin), pin.pin_type.as_str(), pin.unit, &meaning(known, pin)]);
    }
    if !known.status.is_empty() {
        text += "\n| status | name | meaning |\n|---|---|---|\n";
    }
    for word in known.status {
        text += &row([
            &format!("16#{:04X}", word.code),
            &format!("`{}`", word.name),
            &word_meaning(known, word),
        ]);
    }
    if !known.decisions.is_empty() {
        let silent = document(known).map(|name| format!("not specified by {name}"));
        let head = silent.as_deref().unwrap_or("not specified");
        text += &format!("\n| {head} | isochrone |\n|---|---|\n");
    }
    for decision in known.decisions {
        text += &row([decision.silent_on, decision.chosen]);
    }
    text
}

fn pin_name(pin: &Pin) -> String {
    format!("`{}`", pin.name)
}

fn row<const CELLS: usize>(cells: [&str; CELLS]) -> String {
    format!("| {} |\n", cells.join(" | "))
}
