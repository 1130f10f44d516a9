//! The files of a crate, and which of them a path leads to.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::slice;

use crate::tokens::{Token, tokens};

/// What keywords declare an item.
const ITEMS: [&str; 10] =
    ["struct", "enum", "union", "trait", "type", "fn", "const", "static", "mod", "macro_rules"];
/// A path that goes through so many `use`s has no end.
const MOST_STEPS: usize = 20;

/// A module with a file of its own.
#[derive(Default)]
pub(super) struct Module {
    pub(super) path: PathBuf,
    /// Modules in it that have files.
    pub(super) children: BTreeSet<String>,
    /// What it declares.
    items: BTreeSet<String>,
    pub(super) imports: Vec<Import>,
    /// The paths outside of its `use`s, single words among them, and their lines.
    pub(super) paths: Vec<(Vec<String>, usize)>,
}

/// A name that a `use` brings in; `*` for all.
pub(super) struct Import {
    pub(super) name: String,
    pub(super) path: Vec<String>,
    pub(super) line: usize,
    /// It is there for others.
    pub(super) is_public: bool,
}

/// The modules of a crate by their paths.
pub(super) struct Crate(pub(super) BTreeMap<Vec<String>, Module>);

impl Crate {
    /// All modules below the file of the crate; `read` returns the text of a file, if there is one.
    pub(super) fn read(root: &Path, read: &impl Fn(&Path) -> Option<String>) -> Self {
        let mut modules = BTreeMap::new();
        let mut files = vec![(Vec::new(), root.to_owned())];
        while let Some((name, path)) = files.pop() {
            let module = Module::of(&path, &read(&path).unwrap());
            let is_folder = ["lib.rs", "main.rs", "mod.rs"].iter().any(|file| path.ends_with(file));
            let folder =
                if is_folder { path.parent().unwrap().to_owned() } else { path.with_extension("") };
            for child in &module.children {
                let files_of_child = [format!("{child}.rs"), format!("{child}/mod.rs")];
                let file = files_of_child.map(|file| folder.join(file));
                let file = file.into_iter().find(|file| read(file).is_some());
                let file = file.unwrap_or_else(|| panic!("{}: mod {child};", path.display()));
                files.push(([&name[..], slice::from_ref(child)].concat(), file));
            }
            modules.insert(name, module);
        }
        Self(modules)
    }

    /// The module whose file declares what a path in `module` leads to; `None` for what is of another crate,
    /// and for a module as such.
    pub(super) fn declaring(&self, module: &[String], path: &[String]) -> Option<Vec<String>> {
        self.declaring_within(module, path, MOST_STEPS)
    }

    fn declaring_within(
        &self,
        module: &[String],
        path: &[String],
        steps: usize,
    ) -> Option<Vec<String>> {
        let mut place = module.to_vec();
        let steps = steps.checked_sub(1)?;
        for (index, name) in path.iter().enumerate() {
            let found = &self.0[&place];
            match name.as_str() {
                "crate" => place.clear(),
                "self" => {}
                "super" => drop(place.pop()),
                _ if found.children.contains(name) => place.push(name.clone()),
                _ if found.items.contains(name) => return Some(place),
                _ => {
                    let named = found.imports.iter().find(|import| import.name == *name);
                    if let Some(import) = named {
                        let path = [&import.path[..], &path[index + 1..]].concat();
                        return self.declaring_within(&place, &path, steps);
                    }
                    let all = found.imports.iter().find(|import| import.name == "*");
                    if let Some(import) = all.filter(|_| index > 0) {
                        let path = [&import.path[..], &path[index..]].concat();
                        return self.declaring_within(&place, &path, steps);
                    }
                    // A macro may have declared it.
                    return (index > 0).then_some(place);
                }
            }
        }
        None
    }
}

impl Module {
    fn of(path: &Path, text: &str) -> Self {
        let tokens = tokens(text);
        let mut module = Self { path: path.to_owned(), ..Self::default() };
        let (mut at, mut depth) = (0, 0);
        while let Some(token) = tokens.get(at) {
            let next = |ahead: usize| tokens.get(at + ahead).map_or("", |token| token.text);
            let is_item = ITEMS.contains(&token.text) && depth == 0;
            match token.text {
                "use" if !["<", "$"].contains(&next(1)) => {
                    let is_public = is_public(&tokens[..at]);
                    at += 1;
                    module.import(&tokens, &mut at, &[], is_public);
                    continue;
                }
                "mod" if next(2) == ";" => drop(module.children.insert(next(1).to_owned())),
                "macro_rules" if is_item => drop(module.items.insert(next(2).to_owned())),
                _ if is_item => drop(module.items.insert(next(1).to_owned())),
                "{" => depth += 1,
                "}" => depth -= 1,
                _ => {}
            }
            let before = at.checked_sub(1).map_or("", |before| tokens[before].text);
            let is_begin = token.is_word() && ![".", "::", "$", "fn", "mod"].contains(&before);
            at += 1;
            if is_begin {
                let mut path = vec![token.text.to_owned()];
                while let [sign, name, ..] = &tokens[at..]
                    && (sign.text == "::" && name.is_word())
                {
                    path.push(name.text.to_owned());
                    at += 2;
                }
                module.paths.push((path, token.line));
            }
        }
        module
    }

    /// Reads what a `use` says behind `prefix`.
    fn import(&mut self, tokens: &[Token<'_>], at: &mut usize, prefix: &[String], is_public: bool) {
        let mut path = prefix.to_vec();
        loop {
            let token = tokens[*at];
            *at += 1;
            match token.text {
                "::" => {}
                "{" => {
                    while tokens[*at].text != "}" {
                        self.import(tokens, at, &path, is_public);
                        *at += usize::from(tokens[*at].text == ",");
                    }
                    *at += 1;
                    return;
                }
                name => {
                    let is_last = tokens[*at].text != "::";
                    // `{self}` stands for the module itself.
                    if !["self", "*"].contains(&name) || path.is_empty() {
                        path.push(name.to_owned());
                    }
                    if !is_last {
                        continue;
                    }
                    let is_renamed = tokens[*at].text == "as";
                    let name = match name {
                        _ if is_renamed => tokens[*at + 1].text,
                        "*" => "*",
                        _ => path.last().unwrap(),
                    };
                    let (name, line) = (name.to_owned(), token.line);
                    *at += 2 * usize::from(is_renamed);
                    self.imports.push(Import { name, path, line, is_public });
                    return;
                }
            }
        }
    }
}

/// Whether the tokens end with `pub` or `pub(…)`.
fn is_public(tokens: &[Token<'_>]) -> bool {
    let begin = tokens.iter().rposition(|token| token.text == "pub");
    begin.is_some_and(|begin| match &tokens[begin + 1..] {
        [] => true,
        [first, .., last] => {
            let within = &tokens[begin + 1..];
            let ends = within.iter().filter(|token| [")", ";", "}"].contains(&token.text)).count();
            first.text == "(" && last.text == ")" && ends == 1
        }
        _ => false,
    })
}
