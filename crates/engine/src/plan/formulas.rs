//! The types of `Expr` blocks: their outputs, and what each reads.

use std::collections::HashMap;
use std::sync::{LazyLock, Mutex, PoisonError};

use isochrone_blocks::expr::{Mistake, Program};
use isochrone_blocks::formulas::STATUS;
use isochrone_blocks::{BlockType, OutputProgram, Pin, PinType};
use toml::Spanned;

use super::names::{Entry, Names};
use super::wires::{INSTANCE, PREVIOUS};
use crate::Diagnostic;
use crate::config::{self, Config};
use crate::diagnostic::Problem;

/// The types that an expression may have which depends on its own result, in the order in which they are tried.
const TRIED: [PinType; 5] =
    [PinType::Lreal, PinType::Bool, PinType::Int, PinType::Time, PinType::Word];
/// How many loops of expressions that go through each other are tried together.
const MOST_NESTED: usize = 4;

impl Names<'_> {
    /// The type of a signal, all `Expr` having theirs.
    pub(super) fn type_of(&self, signal: &str) -> Option<PinType> {
        match known(self, &HashMap::new(), signal) {
            Known::Type(of) => Some(of),
            Known::Of(_) | Known::Nothing => None,
        }
    }

    /// Gives each `Expr` its type. One of which an expression is wrong has none.
    pub(super) fn add_formulas(&mut self, config: &Config, diagnostics: &mut Vec<Diagnostic>) {
        let mut typing = Typing::new(config, self);
        typing.run();
        let mut results = typing.nodes.into_iter().map(|node| node.result);
        let exprs: HashMap<&str, &[config::Formula]> = config
            .blocks
            .iter()
            .zip(&self.entries)
            .filter(|(_, entry)| is_expr(entry))
            .map(|(block, entry)| (entry.name, &block.formulas[..]))
            .collect();
        for (block, entry) in config.blocks.iter().zip(&mut self.entries) {
            if !is_expr(entry) {
                continue;
            }
            let mut programs = Vec::new();
            for (formula, result) in block.formulas.iter().zip(&mut results) {
                match (result, &formula.text) {
                    (Some(Ok(program)), _) => programs.push(program),
                    (Some(Err(mistake)), Some(text)) => {
                        diagnostics.push(text.diagnostic(formula.name.get_ref(), mistake));
                    }
                    _ => {}
                }
            }
            let is_whole = !programs.is_empty() && programs.len() == block.formulas.len();
            entry.block_type = is_whole.then(|| interned(&block.formulas, programs));
        }
        // Of a block without a type nobody else says which pins it does not have.
        let is_without_type = |entry: &&Entry<'_>| entry.block_type.is_none();
        let without_type = self.entries.iter().filter(is_without_type).map(|entry| entry.name);
        let without_type: HashMap<_, _> =
            without_type.filter_map(|name| Some((name, *exprs.get(name)?))).collect();
        let readers = exprs.values().flat_map(|formulas| formulas.iter());
        for name in readers.flat_map(|formula| &formula.names) {
            diagnostics.extend(no_such_output(name, &without_type));
        }
    }
}

/// What is wrong with a name that is none of an `Expr`'s outputs.
fn no_such_output(
    signal: &Spanned<String>,
    exprs: &HashMap<&str, &[config::Formula]>,
) -> Option<Diagnostic> {
    let text = signal.get_ref();
    let text = text.strip_suffix(PREVIOUS).unwrap_or(text);
    let (owner, rest) = text.split_once('.').unwrap_or((text, ""));
    let outputs = exprs.get(owner)?.iter().map(|formula| formula.name.get_ref().as_str());
    let outputs: Vec<&str> = outputs.chain([STATUS.name]).collect();
    let (instance, pin) = rest.rsplit_once('.').unwrap_or(("", rest));
    if outputs.contains(&pin) {
        return None;
    }
    let message = if pin.is_empty() {
        format!("\"{owner}\" is a block, not a signal")
    } else {
        format!("block \"{owner}\" (Expr) has no output pin \"{pin}\"")
    };
    let instance = if instance.is_empty() { String::new() } else { format!("{instance}.") };
    let known: Vec<_> = outputs.iter().map(|it| format!("{owner}.{instance}{it}")).collect();
    let diagnostic = Diagnostic::new(Problem::UnknownPin, signal.span(), message);
    Some(diagnostic.did_you_mean(text, known.iter().map(String::as_str)))
}

fn is_expr(entry: &Entry<'_>) -> bool {
    entry.block_type.is_some_and(|known| known.formulas().is_some())
}

/// The type with these expressions. It stays for the life of the process, as types do: a node that changes its
/// configuration again and again has each of its expressions once.
fn interned(formulas: &[config::Formula], programs: Vec<Typed>) -> BlockType {
    /// By the outputs with their texts, and the types of what they read.
    type Types = HashMap<Vec<(String, String, Vec<PinType>)>, BlockType>;
    static TYPES: LazyLock<Mutex<Types>> = LazyLock::new(Mutex::default);
    let text = |formula: &config::Formula| {
        formula.text.as_ref().map_or("", |text| text.as_str()).trim().to_owned()
    };
    let named = formulas.iter().zip(&programs);
    let key = named
        .map(|(formula, typed)| {
            (formula.name.get_ref().clone(), text(formula), typed.names.clone())
        })
        .collect();
    let mut types = TYPES.lock().unwrap_or_else(PoisonError::into_inner);
    *types.entry(key).or_insert_with(|| {
        let (mut inputs, mut outputs, mut made) = (Vec::new(), Vec::new(), Vec::new());
        for (formula, Typed { program, names }) in formulas.iter().zip(programs) {
            let name: &str = formula.name.get_ref().clone().leak();
            let pin = |pin_type, raw_doc| Pin { name, pin_type, raw_doc, ..STATUS };
            let signals = formula.names.iter().zip(&names);
            inputs.extend(signals.map(|(it, of)| pin(*of, it.get_ref().clone().leak())));
            outputs.push(pin(program.result(), text(formula).leak()));
            made.push(OutputProgram { inputs: names.len(), program });
        }
        outputs.push(STATUS);
        BlockType::of_formulas(inputs.leak(), outputs.leak(), made.leak())
    })
}

/// A program, and the types of the names that it was made for.
#[derive(Debug)]
struct Typed {
    program: Program,
    names: Vec<PinType>,
}

/// An expression on the way to its type.
struct Node<'a> {
    config: &'a config::Formula,
    names: Vec<Known>,
    /// The expressions that name its output.
    readers: Vec<usize>,
    state: State,
    /// What became of it; `None` while nothing did, and for one that cannot be read or names what does not exist.
    result: Option<Result<Typed, Mistake>>,
}

/// What is known of the type of a name.
#[derive(Clone, Copy)]
enum Known {
    Type(PinType),
    /// It is that of an expression.
    Of(usize),
    /// There is no such signal, which is another diagnostic.
    Nothing,
}

#[derive(Clone, Copy, PartialEq)]
enum State {
    /// The type of a name is still unknown.
    Waits,
    Has(PinType),
    /// It depends on something that is wrong.
    Wrong,
}

/// All expressions of a file, in its order.
struct Typing<'a> {
    nodes: Vec<Node<'a>>,
    /// The expressions that are no longer as they were, to go back.
    changed: Vec<usize>,
}

impl<'a> Typing<'a> {
    fn new(config: &'a Config, names: &Names<'_>) -> Self {
        let (mut outputs, mut next) = (HashMap::new(), 0);
        let exprs = || config.blocks.iter().zip(&names.entries).filter(|(_, entry)| is_expr(entry));
        for (block, entry) in exprs() {
            for formula in &block.formulas {
                // A name that two blocks have is another diagnostic.
                outputs.entry((entry.name, formula.name.get_ref().as_str())).or_insert(next);
                next += 1;
            }
        }
        let mut nodes: Vec<Node<'_>> = Vec::new();
        for formula in exprs().flat_map(|(block, _)| &block.formulas) {
            let known = |name: &Spanned<String>| known(names, &outputs, name.get_ref());
            let names: Vec<Known> = formula.names.iter().map(known).collect();
            nodes.push(Node {
                config: formula,
                names,
                readers: Vec::new(),
                state: State::Waits,
                result: None,
            });
        }
        for reader in 0..nodes.len() {
            for name in nodes[reader].names.clone() {
                if let Known::Of(read) = name {
                    nodes[read].readers.push(reader);
                }
            }
        }
        Self { nodes, changed: Vec::new() }
    }

    fn run(&mut self) {
        self.settle((0..self.nodes.len()).rev().collect());
        let mut first = 0;
        while let Some(on_loop) = self.on_loop(&mut first) {
            self.changed.clear();
            let Err((wrong, mistake)) = self.guess(on_loop, 0) else { continue };
            self.nodes[on_loop].state = State::Wrong;
            self.nodes[wrong].result = Some(Err(mistake));
            self.settle(self.nodes[on_loop].readers.clone());
        }
    }

    /// Gives expressions their types, and then those that name them.
    fn settle(&mut self, mut open: Vec<usize>) {
        while let Some(index) = open.pop() {
            let node = &self.nodes[index];
            if node.result.is_some() || node.state == State::Wrong {
                continue;
            }
            let types = node.names.iter().map(|name| match *name {
                Known::Type(of) => State::Has(of),
                Known::Of(read) => self.nodes[read].state,
                Known::Nothing => State::Wrong,
            });
            let types: Vec<State> = types.collect();
            let is_waiting = types.contains(&State::Waits);
            let (state, result) = match &node.config.expression {
                Some(_) if types.contains(&State::Wrong) => (State::Wrong, None),
                None => (State::Wrong, None),
                Some(_) if is_waiting => continue,
                Some(expression) => {
                    let has = |state: &State| match state {
                        State::Has(of) => Some(*of),
                        _ => None,
                    };
                    let names: Vec<PinType> = types.iter().filter_map(has).collect();
                    let result = expression.program(&names).and_then(|program| match node.state {
                        State::Has(of) if of != program.result() => {
                            Err(other_type(node.config, program.result()))
                        }
                        _ => Ok(Typed { program, names }),
                    });
                    let state = result
                        .as_ref()
                        .map_or(State::Wrong, |typed| State::Has(typed.program.result()));
                    (state, Some(result))
                }
            };
            let node = &mut self.nodes[index];
            let is_new = node.state != state;
            (node.state, node.result) = (state, result);
            self.changed.push(index);
            if is_new {
                open.extend_from_slice(&self.nodes[index].readers);
            }
        }
    }

    /// Tries types for an expression that depends on its own result. If none is right, returns a mistake with the first
    /// of them, and the expression that has it.
    fn guess(&mut self, index: usize, depth: usize) -> Result<(), (usize, Mistake)> {
        let mut first = None;
        for tried in TRIED {
            let before = self.changed.len();
            self.nodes[index].state = State::Has(tried);
            self.changed.push(index);
            self.settle(self.nodes[index].readers.clone());
            let mut inner = None;
            while self.nodes[index].result.is_none() && inner.is_none() {
                // Another loop goes through this one.
                inner = match self.waits_for(index) {
                    Some(next) if depth < MOST_NESTED => self.guess(next, depth + 1).err(),
                    _ => break,
                };
            }
            if matches!(self.nodes[index].result, Some(Ok(_))) {
                return Ok(());
            }
            let changed = self.changed.get(before..).unwrap_or_default();
            let wrong = changed.iter().find_map(|at| match &self.nodes[*at].result {
                Some(Err(mistake)) => Some((*at, mistake.clone())),
                _ => None,
            });
            if first.is_none()
                && let Some((at, mistake)) = wrong.or(inner)
            {
                let name = self.nodes[index].config.name.get_ref();
                let message = format!(
                    "{} (with {name}, on which it depends, of type {tried})",
                    mistake.message
                );
                first = Some((at, Mistake { message, ..mistake }));
            }
            for at in self.changed.drain(before..) {
                (self.nodes[at].state, self.nodes[at].result) = (State::Waits, None);
            }
        }
        Err(first.unwrap_or_else(|| (index, undecided(self.nodes[index].config))))
    }

    /// An expression on a loop of those that wait; `first` is the first that may.
    fn on_loop(&self, first: &mut usize) -> Option<usize> {
        while self.nodes.get(*first)?.state != State::Waits {
            *first += 1;
        }
        self.waits_for(*first)
    }

    /// An expression on the loop that one without a result waits for.
    fn waits_for(&self, from: usize) -> Option<usize> {
        let mut seen = std::collections::HashSet::new();
        let mut at = from;
        loop {
            let next = self.nodes[at].names.iter().find_map(|name| match *name {
                Known::Of(read) if self.nodes[read].state == State::Waits => Some(read),
                _ => None,
            });
            match next {
                Some(next) if seen.insert(next) => at = next,
                next => return next,
            }
        }
    }
}

/// What is known of the type of a signal before the expressions have theirs.
fn known(names: &Names<'_>, outputs: &HashMap<(&str, &str), usize>, signal: &str) -> Known {
    let signal = signal.strip_suffix(PREVIOUS).unwrap_or(signal).replace(INSTANCE, "0");
    let of = |known: Option<PinType>| known.map_or(Known::Nothing, Known::Type);
    if let Some((input, part)) = names.input_part(&signal) {
        return of(input.value_type.map(|value_type| part.pin_type(value_type)));
    }
    if let Some(variable) = names.variables.get(&*signal) {
        return of(variable.value_type);
    }
    let (Some((owner, _)), Some((_, pin))) = (signal.split_once('.'), signal.rsplit_once('.'))
    else {
        return Known::Nothing;
    };
    if let Some(output) = outputs.get(&(owner, pin)) {
        return Known::Of(*output);
    }
    let entry = names.blocks.get(owner).and_then(|block| names.entries.get(*block));
    let Some(known) = entry.and_then(|entry| entry.block_type) else { return Known::Nothing };
    of(known.outputs.iter().find(|output| output.name == pin).map(|output| output.pin_type))
}

/// An expression that depends on itself and has another type than was tried.
fn other_type(of: &config::Formula, found: PinType) -> Mistake {
    mistake(of, format!("it is of type {found}"))
}

fn undecided(of: &config::Formula) -> Mistake {
    mistake(of, "its type depends on itself in too many ways".to_owned())
}

fn mistake(of: &config::Formula, message: String) -> Mistake {
    let len = of.text.as_ref().map_or(0, |text| text.as_str().len());
    let help = "give it a type that does not depend on itself, with a conversion such as LREAL_TO_INT(\u{2026})";
    Mistake { span: 0..len, message, help: Some(help.to_owned()) }
}
