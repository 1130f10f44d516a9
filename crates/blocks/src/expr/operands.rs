//! The operands of a step: their common type, and what is said where they have none.

use alloc::format;
use alloc::string::String;
use core::ops::Range;

use super::Mistake;
use super::compile::Compiler;
use super::types::{Takes, Type, help_between};
use crate::PinType;

impl Compiler<'_> {
    /// The type that operands have in common, and their registers. A value that becomes an LREAL keeps its slot.
    pub(super) fn same<const N: usize>(
        &self,
        operands: [usize; N],
        name: &str,
        takes: Takes,
    ) -> Result<(PinType, [u16; N]), Mistake> {
        let of = self.common(&operands, name, takes)?;
        Ok((of, operands.map(|operand| self.register(operand))))
    }

    /// The type that operands have in common: that of an LREAL among INTs, and of whatever a whole literal meets.
    pub(super) fn common(
        &self,
        operands: &[usize],
        name: &str,
        takes: Takes,
    ) -> Result<PinType, Mistake> {
        let mut common: Option<(PinType, usize)> = None;
        for operand in operands.iter().copied() {
            let Type::Of(of) = self.of(operand) else { continue };
            if !takes.takes(of) {
                return Err(self.not_taken(operand, of, name, takes));
            }
            common = match common {
                None => Some((of, operand)),
                Some((before, _)) if of.feeds(before) => common,
                Some((before, _)) if before.feeds(of) => Some((of, operand)),
                Some((before, first)) => {
                    let shown = [first, operand].map(|it| self.shown(it));
                    let [left, right] = &shown;
                    let message = format!(
                        "{left} is {before} and {right} is {of}, and {name} takes values of one type"
                    );
                    let mistake = Mistake::new(self.span(operand), message);
                    return Err(Mistake {
                        help: help_between(before, of, [left, right]),
                        ..mistake
                    });
                }
            };
        }
        let whole = || operands.iter().copied().filter(|it| self.of(*it) == Type::Whole);
        let literal = |it: usize| self.values.get(it).map_or(0.0, |value| value.literal);
        let of = match (common, takes) {
            (_, Takes::One(of)) => of,
            (Some((of, _)), _) => of,
            (None, _) if whole().all(|it| PinType::Int.holds(literal(it))) => PinType::Int,
            (None, _) => PinType::Lreal,
        };
        for operand in whole() {
            self.fits(operand, literal(operand), of, common.map(|it| it.1), name, takes)?;
        }
        Ok(of)
    }

    pub(super) fn of(&self, node: usize) -> Type {
        self.values.get(node).map_or(Type::Whole, |value| value.of)
    }

    pub(super) fn register(&self, node: usize) -> u16 {
        self.values.get(node).map_or(0, |value| value.register)
    }

    pub(super) fn span(&self, node: usize) -> Range<usize> {
        self.expression.nodes.get(node).map_or(0..0, |node| node.span.clone())
    }

    /// The text of a part, shortened.
    pub(super) fn shown(&self, node: usize) -> String {
        const LONGEST: usize = 40;
        let text = self.expression.text.get(self.span(node)).unwrap_or_default();
        match text.char_indices().nth(LONGEST) {
            Some((end, _)) => format!("{}…", text.get(..end).unwrap_or_default()),
            None => text.into(),
        }
    }

    pub(super) fn not_taken(
        &self,
        operand: usize,
        of: PinType,
        name: &str,
        takes: Takes,
    ) -> Mistake {
        let shown = self.shown(operand);
        let message = format!("{shown} is {of}, and {name} takes {}", takes.as_str());
        let help = takes.help(of, &shown).map(|help| match help.strip_prefix("compare it: ") {
            // It would bind before the comparison.
            Some(comparison) if name == "NOT" => format!("compare it: NOT ({comparison})"),
            _ => help,
        });
        Mistake { help, ..Mistake::new(self.span(operand), message) }
    }

    /// Whether a whole literal can be of a type.
    fn fits(
        &self,
        operand: usize,
        literal: f64,
        of: PinType,
        beside: Option<usize>,
        name: &str,
        takes: Takes,
    ) -> Result<(), Mistake> {
        let shown = self.shown(operand);
        let (what, help) = match of {
            PinType::Lreal if takes.takes(of) => return Ok(()),
            PinType::Int | PinType::Word if takes.takes(of) && of.holds(literal) => return Ok(()),
            PinType::Int if takes.takes(of) => {
                let wider = format!("{literal:.1} would be an LREAL, and so would be the result");
                let help = beside.map_or(String::new(), |_| wider);
                ("does not fit INT (-32768 to 32767)", help)
            }
            PinType::Word => ("does not fit WORD (0 to 65535)", String::new()),
            PinType::Bool => ("is a number", "a BOOL is TRUE or FALSE".into()),
            PinType::Time => ("is a number", "a TIME is written T#2s or T#500ms".into()),
            PinType::Int | PinType::Lreal => {
                ("is a number", format!("a WORD is written WORD#{shown}; a number is compared"))
            }
        };
        let because = match beside {
            Some(beside) => format!("{} is {of}", self.shown(beside)),
            None => format!("{name} takes {}", takes.as_str()),
        };
        let mistake = Mistake::new(self.span(operand), format!("{shown} {what}, and {because}"));
        Err(Mistake { help: Some(help).filter(|help| !help.is_empty()), ..mistake })
    }
}
