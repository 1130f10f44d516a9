//! The reference of the configuration file, made of the keys that the parser knows: for people a page, for editors a
//! JSON Schema.

mod schema;

pub use schema::schema;

use crate::keys::{Absent, Form, Key, TABLES, TableKeys};

/// A complete configuration, with a comment on each part.
pub const EXAMPLE: &str = include_str!("reference/example.toml");

const INTRODUCTION: &str = include_str!("reference/introduction.md");
const RULES: &str = include_str!("reference/rules.md");

/// The page, in Markdown.
pub fn page() -> String {
    let tables: String = TABLES.iter().map(|table| section(table)).collect();
    format!("{INTRODUCTION}\n{tables}\n## A complete example\n\n```toml\n{EXAMPLE}```\n\n{RULES}")
}

fn section(table: &TableKeys) -> String {
    let title =
        if table.title.starts_with('[') { format!("`{}`", table.title) } else { "The file".into() };
    let mut text = format!("\n## {title}\n\n{}\n", table.doc());
    if table.keys.is_empty() {
        return text;
    }
    text += "\n| key | type | unit | if left out | range | meaning | since |\n|---|---|---|---|---|---|---|\n";
    for key in table.keys {
        let cells = [
            format!("`{}`", key.name),
            kind(key).into(),
            unit(key).into(),
            absent(key),
            key.range(),
            key.doc().into(),
            key.since.into(),
        ];
        text += &format!("| {} |\n", cells.join(" | "));
    }
    text
}

fn kind(key: &Key) -> &'static str {
    match key.form {
        Form::Name(_) => "name",
        Form::Text | Form::Line(_) => "text",
        Form::Texts => "array of texts",
        Form::Word(_) => "word",
        Form::WordOrTable(..) => "word or table",
        Form::WordOrInteger(..) => "word or whole number",
        Form::Truth => "`true` or `false`",
        Form::Integer(_) => "whole number",
        Form::Number(_) => "number with decimals",
        Form::Duration(_) => "duration",
        Form::Value => {
            "number; `true` or `false` for BOOL, also a time such as `\"T#100ms\"` for TIME, or `\"16#64\"` for INT and WORD"
        }
        Form::Bounds => "array of two numbers",
        Form::Table => "table",
        Form::Tables => "array of tables",
    }
}

fn unit(key: &Key) -> &'static str {
    match key.form {
        Form::Duration(_) => "in the text: ns, us, ms, s, min, h",
        Form::Value | Form::Bounds => "ms for TIME",
        _ => key.unit,
    }
}

fn absent(key: &Key) -> String {
    match key.absent {
        Absent::Required(_) => "error".into(),
        Absent::Default(value) => format!("`{value}`"),
        Absent::Means(what) => what.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Plan, Rules, Source};

    #[test]
    fn the_example_is_valid_and_raises_no_warning() {
        let plan = Plan::new(Source::new("example.toml", EXAMPLE), &Rules::default()).unwrap();
        assert!(plan.warnings.is_empty(), "{:?}", plan.warnings);
    }

    /// The page says how a key with a default is written, next to the key.
    #[test]
    fn the_example_shows_every_key_that_has_no_default_unless_it_excludes_one_that_it_shows() {
        let shown = |key: &Key| {
            let mut lines = EXAMPLE.lines().map(|line| line.trim_start_matches(['#', ' ', '[']));
            lines.any(|line| line.starts_with(key.name))
                || EXAMPLE.contains(&format!(" {} =", key.name))
        };
        for table in TABLES {
            for key in table.keys {
                assert!(
                    shown(key) || matches!(key.absent, Absent::Default(_)),
                    "reference/example.toml does not show {} {}",
                    table.title,
                    key.name
                );
            }
        }
    }

    #[test]
    fn every_default_can_be_written_as_the_page_says() {
        const TABLES_WITH_DEFAULTS: &str = "\
            [node]\nname = \"n\"\nretain = true\n\
            [[task]]\nname = \"t\"\nperiod = \"1ms\"\nwake = \"hybrid\"\n\
            [[input]]\nname = \"i\"\n\
            [[variable]]\nname = \"v\"\ninitial = 0\n\
            [[block]]\nname = \"b\"\ntype = \"LimRateOfChangeCI\"\n\
            [[alarm]]\nname = \"a\"\nwhen = \"i > 1.0\"\n\
            [[output]]\nservice = \"s\"\nsignals = [\"i\"]\n";
        for table in TABLES {
            for key in table.keys {
                let Absent::Default(value) = key.absent else { continue };
                let (title, name) = (table.title, key.name);
                let (before, after) = TABLES_WITH_DEFAULTS
                    .split_once(&format!("{title}\n"))
                    .unwrap_or_else(|| panic!("write {title} in this test"));
                let after = after.replace(&format!("{name} = true\n"), "");
                let text = format!("{before}{title}\n{name} = {value}\n{after}");
                let made = Plan::new(Source::new("n.toml", text), &Rules::default());
                if let Err(found) = made {
                    panic!("{title} {name} = {value}: {found}");
                }
            }
        }
    }

    #[test]
    fn every_key_has_a_sentence_a_version_and_one_place() {
        for table in TABLES {
            assert!(table.doc().ends_with(['.', '`']), "{}", table.title);
            let mut names = std::collections::HashSet::new();
            for key in table.keys {
                assert!(names.insert(key.name), "{} has {} twice", table.title, key.name);
                assert!(key.doc().ends_with(['.']), "{} {}", table.title, key.name);
                assert!(!key.since.is_empty());
            }
        }
    }
}
