//! From TOML to [`Config`].

mod alarm;
mod connection;
mod cut;
mod formulas;
mod input;
mod integer;
mod limits;
pub(crate) mod line;
mod node;
mod places;
mod scalar;
mod section;
mod suggestions;
mod syntax;
pub(crate) mod task;
mod variable;

use isochrone_blocks::{BlockType, EXPR};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use self::connection::connection;
pub(crate) use self::section::Section;
use self::section::{Errors, is_instance};

use crate::config::{BlockEntry, Config, Output, Pins, Task};
use crate::diagnostic::Problem;
use crate::keys;
use crate::{Diagnostic, Source, TaskSettings};

/// Reads a configuration. Whatever could be read is in the [`Config`], the rest in the diagnostics.
pub(crate) fn parse(source: &Source, catalogue: &[BlockType]) -> (Config, Vec<Diagnostic>) {
    let (document, syntax_errors) = DeTable::parse_recoverable(&source.text);
    if !syntax_errors.is_empty() {
        // What a broken file seems to say would only add errors that are none. So would what follows a
        // comment that swallows the end of a table.
        let errors = syntax_errors.iter().map(|e| (e.span().unwrap_or_default(), e.message()));
        let stumbles: Vec<usize> = errors.clone().map(|(span, _)| span.start).collect();
        let cut = cut::first_in_broken(&source.text, &stumbles);
        let end = cut.as_ref().map_or(usize::MAX, |cut| cut.span.start);
        let errors = errors.filter(|(span, _)| span.start < end).collect();
        return (
            Config::default(),
            syntax::diagnostics(&source.text, errors).into_iter().chain(cut).collect(),
        );
    }
    let errors = Errors::default();
    let file = Section::new(&keys::file::TABLE, document.get_ref(), 0..0, &errors);
    let tables = |key, table| file.tables(key, table).into_iter();
    let node = node::node(&file);
    let config = Config {
        node: node.name,
        control: node.control,
        retain: node.retain,
        protected: tables(&keys::file::PROTECT, &keys::protect::TABLE)
            .flat_map(|section| texts(&section, &keys::protect::NAMES, "name at least one signal"))
            .collect(),
        limits: limits::limits(&file),
        tasks: tables(&keys::file::TASK, &keys::task::TABLE).map(cyclic_task).collect(),
        inputs: tables(&keys::file::INPUT, &keys::input::TABLE).map(input::input).collect(),
        variables: tables(&keys::file::VARIABLE, &keys::variable::TABLE)
            .map(variable::variable)
            .collect(),
        blocks: tables(&keys::file::BLOCK, &keys::block::TABLE)
            .map(|section| block(section, catalogue, &source.text))
            .collect(),
        alarms: tables(&keys::file::ALARM, &keys::alarm::TABLE)
            .map(|section| alarm::alarm(section, &source.text))
            .collect(),
        outputs: tables(&keys::file::OUTPUT, &keys::output::TABLE).map(output).collect(),
    };
    let tasks = file.get(&keys::file::TASK);
    let no_task = |tasks: &Spanned<DeValue<'_>>| {
        tasks.get_ref().as_array().is_some_and(|tasks| tasks.is_empty())
    };
    if tasks.is_none_or(no_task) {
        let diagnostic = Diagnostic::new(Problem::MissingKey, 0..0, "the file has no [[task]]");
        file.report(diagnostic.help(
            "a task gives the blocks their period: [[task]] name = \"main\", period = \"1ms\"",
        ));
    }
    let mut diagnostics = cut::diagnostics(&source.text, document.get_ref());
    // What the rest of a number seems to be is no mistake of its own.
    let is_cut = |diagnostic: &Diagnostic| {
        diagnostics.iter().any(|cut| cut.span.start == diagnostic.span.start)
    };
    let others: Vec<_> =
        errors.into_diagnostics().into_iter().filter(|diagnostic| !is_cut(diagnostic)).collect();
    diagnostics.extend(others);
    (config, diagnostics)
}

fn cyclic_task(section: Section<'_>) -> Task {
    Task {
        name: section.name(&keys::task::NAME),
        ob_span: section.get(&keys::task::OB).map_or(0..0, Spanned::span),
        settings: TaskSettings::read(&section),
    }
}

fn block(section: Section<'_>, catalogue: &[BlockType], file: &str) -> BlockEntry {
    let pins = section.table(&keys::block::IN, &keys::pins::TABLE);
    let (pins, instances) = pins.map_or_else(Default::default, |section| {
        let instances = section.tables_by_number(&keys::pins::TABLE).into_iter();
        let instances = instances.map(|(number, section)| (number, self::pins(&section)));
        (self::pins(&section), instances.collect())
    });
    let count = section.integer(&keys::block::COUNT);
    let block_type = section.string(&keys::block::TYPE);
    let known = block_type.as_ref().and_then(|name| known_type(name.get_ref(), catalogue));
    let is_expr = known.is_some_and(|known| known.formulas().is_some());
    let misplaced_pins = section.misplaced(|key| {
        let known = known.filter(|known| known.inputs.iter().any(|pin| pin.name == key))?;
        Some(format!("{key} is a pin of {}; write it in [block.in]", known.name))
    });
    BlockEntry {
        name: section.name(&keys::block::NAME),
        block_type,
        misplaced_pins,
        task: section.string(&keys::block::TASK),
        count_is_wrong: count.is_none() && section.get(&keys::block::COUNT).is_some(),
        count,
        unit: section.line(&keys::block::UNIT),
        units: section.units(),
        comment: section.comment(&keys::block::COMMENT),
        pins,
        instances,
        formulas: formulas::formulas(&section, is_expr, file),
    }
}

/// The block type of a name: of the catalogue, or an `Expr`, which is of none.
pub(crate) fn known_type<'a>(name: &str, catalogue: &'a [BlockType]) -> Option<&'a BlockType> {
    catalogue.iter().chain([&EXPR]).find(|known| known.name == name)
}

/// The pins of a table, without the tables in it that are for single instances.
fn pins(section: &Section<'_>) -> Pins {
    let entries = section.entries().filter(|(key, value)| !is_instance(key.get_ref(), value));
    let pin = |(pin, value): (Spanned<String>, &Spanned<DeValue<'_>>)| {
        let connection = connection(value.get_ref());
        if connection.is_none() {
            let message = format!(
                "pin \"{}\" takes a number, true or false, or a wire, not {}",
                pin.get_ref(),
                value.get_ref().type_str()
            );
            section.report(Diagnostic::new(Problem::WrongType, value.span(), message));
        }
        (pin, connection.map(|connection| Spanned::new(value.span(), connection)))
    };
    entries.map(pin).collect()
}

fn output(section: Section<'_>) -> Output {
    Output {
        service: section.string(&keys::output::SERVICE),
        task: section.string(&keys::output::TASK),
        signals: texts(&section, &keys::output::SIGNALS, "name at least one \"block.pin\""),
        unit: section.line(&keys::output::UNIT),
        readers: section.integer(&keys::output::READERS).map(Spanned::into_inner),
        comment: section.comment(&keys::output::COMMENT),
    }
}

/// An array of texts that is not empty.
fn texts(section: &Section<'_>, key: &'static keys::Key, help: &str) -> Vec<Spanned<String>> {
    let read = |value: &DeValue<'_>| {
        let array = value.as_array().ok_or(None)?;
        if array.is_empty() {
            let message = format!("{} {} is empty", section.title(), key.name);
            return Err(Some(Diagnostic::new(Problem::OutOfRange, 0..0, message).help(help)));
        }
        let text = |item: &Spanned<DeValue<'_>>| match item.get_ref().as_str() {
            Some(text) => Ok(Spanned::new(item.span(), text.to_owned())),
            None => Err(None),
        };
        array.iter().map(text).collect()
    };
    section.read(key, read).map_or_else(Vec::new, Spanned::into_inner)
}
