//! From nodes to steps: each part of an expression gets its type and a register.

use alloc::format;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;

use super::evaluate::{Real, Step, status};
use super::functions::{Conversion, Function, Meaning};
use super::operator::Operator;
use super::parse::{Node, Part, too_long};
use super::types::{Takes, Type, help_between};
use super::{Expression, MAX_STEPS, Mistake};
use crate::PinType;

/// An expression whose names have types, ready to be evaluated.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    steps: Vec<Step>,
    result: PinType,
    /// The register of the result.
    register: u16,
}

impl Program {
    /// The type of the result.
    pub fn result(&self) -> PinType {
        self.result
    }

    /// The number of steps, which its time is proportional to; at most [`MAX_STEPS`].
    pub fn steps(&self) -> usize {
        self.steps.len()
    }

    /// The number of registers that [`evaluate`](Self::evaluate) takes.
    pub fn registers(&self) -> usize {
        self.steps.len()
    }

    /// Computes the result from the slots of the signals, in the order of the expression's names. What `registers` held
    /// does not matter.
    ///
    /// # Errors
    /// The status word of the first error that reached the result.
    #[inline]
    pub fn evaluate(&self, inputs: &[f64], registers: &mut [f64]) -> Result<f64, u16> {
        for (index, step) in self.steps.iter().enumerate() {
            let Some((before, rest)) = registers.split_at_mut_checked(index) else { break };
            if let Some(register) = rest.first_mut() {
                *register = step.result(inputs, before);
            }
        }
        let result = registers.get(usize::from(self.register)).copied().unwrap_or(f64::NAN);
        if result.is_nan() { Err(status(result)) } else { Ok(result) }
    }
}

impl Expression {
    /// The program for signals of these types, in the order of [`names`](Self::names).
    ///
    /// # Errors
    /// Types that do not stand together, or more steps than [`MAX_STEPS`].
    pub fn program(&self, types: &[PinType]) -> Result<Program, Mistake> {
        let mut compiler = Compiler {
            expression: self,
            types,
            steps: Vec::new(),
            values: Vec::new(),
            loaded: vec![None; self.names.len()],
        };
        for node in &self.nodes {
            let value = compiler.value(node)?;
            compiler.values.push(value);
        }
        let last = compiler.values.last().copied().ok_or_else(|| too_long(0..self.text.len()))?;
        let result = last.alone();
        Ok(Program { steps: compiler.steps, result, register: last.register })
    }
}

/// A part of the expression that is computed.
#[derive(Clone, Copy)]
pub(super) struct Value {
    pub(super) of: Type,
    pub(super) register: u16,
    /// Of a literal.
    literal: f64,
}

impl Value {
    /// Its type where nothing says which.
    fn alone(self) -> PinType {
        match self.of {
            Type::Of(of) => of,
            Type::Whole if PinType::Int.holds(self.literal) => PinType::Int,
            Type::Whole => PinType::Lreal,
        }
    }
}

struct Compiler<'a> {
    expression: &'a Expression,
    types: &'a [PinType],
    steps: Vec<Step>,
    /// Of the nodes so far.
    values: Vec<Value>,
    /// The registers of names that were read.
    loaded: Vec<Option<u16>>,
}

impl Compiler<'_> {
    fn value(&mut self, node: &Node) -> Result<Value, Mistake> {
        let typed = |of, register| Value { of: Type::Of(of), register, literal: 0.0 };
        let (of, step) = match node.part {
            Part::Literal(literal) => {
                let register = self.step(Step::Constant(literal.value), node)?;
                return Ok(Value { of: literal.of, register, literal: literal.value });
            }
            Part::Name(name) => {
                let of = self.types.get(name).copied().ok_or_else(|| {
                    Mistake::new(node.span.clone(), "the type of this signal is not given")
                })?;
                if let Some(register) = self.loaded.get(name).copied().flatten() {
                    return Ok(typed(of, register));
                }
                let register = self.step(Step::Input(of, name as u16), node)?;
                if let Some(loaded) = self.loaded.get_mut(name) {
                    *loaded = Some(register);
                }
                return Ok(typed(of, register));
            }
            Part::Sign { is_negative, of } => {
                let sign = if is_negative { "-" } else { "+" };
                let (of, [a]) = self.same([of], sign, Takes::Quantities)?;
                if !is_negative {
                    return Ok(typed(of, a));
                }
                (
                    of,
                    match of {
                        PinType::Int => Step::NegateInt(a),
                        PinType::Time => Step::NegateTime(a),
                        _ => Step::Real(Real::Negate, a),
                    },
                )
            }
            Part::Not(of) => {
                let (of, [a]) = self.same([of], "NOT", Takes::Bits)?;
                (of, if of == PinType::Bool { Step::NotBool(a) } else { Step::NotWord(a) })
            }
            Part::Binary { operator, left, right } => self.binary(operator, left, right)?,
            Part::Call { function, ref inputs } => {
                let inputs = self.expression.inputs.get(inputs.clone()).unwrap_or_default();
                return self.call(node, function, inputs).map(|(of, register)| typed(of, register));
            }
        };
        Ok(typed(of, self.step(step, node)?))
    }

    fn binary(
        &mut self,
        operator: Operator,
        left: usize,
        right: usize,
    ) -> Result<(PinType, Step), Mistake> {
        use Operator::{
            Add, And, AtLeast, AtMost, Divide, Equal, Greater, Less, Modulo, Multiply, NotEqual,
            Or, Power, Subtract, Xor,
        };
        use PinType::{Bool, Int, Lreal, Time};
        let name = operator.as_str();
        let both = [left, right];
        // A TIME is multiplied and divided by a number.
        if matches!(operator, Multiply | Divide) && self.of(left) == Type::Of(Time) {
            let (of, [b]) = self.same([right], name, Takes::Numbers)?;
            let a = self.register(left);
            return Ok((
                Time,
                match (operator, of) {
                    (Multiply, _) => Step::MultiplyTime(a, b),
                    (_, Int) => Step::DivideTimeByInt(a, b),
                    _ => Step::DivideTimeByReal(a, b),
                },
            ));
        }
        if operator == Multiply && self.of(right) == Type::Of(Time) {
            let [left, right] = both.map(|node| self.shown(node));
            let message = format!("in a product with a number, a TIME stands first");
            return Err(
                Mistake::new(self.span(both[1]), message).help(format!("write {right} * {left}"))
            );
        }
        let takes = match operator {
            Or | Xor | And => Takes::Bits,
            Equal | NotEqual => Takes::Any,
            Less | Greater | AtMost | AtLeast | Add | Subtract => Takes::Quantities,
            Multiply | Divide => Takes::Numbers,
            Modulo => Takes::One(Int),
            Power => Takes::One(Lreal),
        };
        let (of, [a, b]) = self.same(both, name, takes)?;
        Ok(match (operator, of) {
            (Or, _) => (of, Step::Or(a, b)),
            (Xor, _) => (of, Step::Xor(a, b)),
            (And, _) => (of, Step::And(a, b)),
            (Equal, _) => (Bool, Step::Equal(a, b)),
            (NotEqual, _) => (Bool, Step::NotEqual(a, b)),
            (Less, _) => (Bool, Step::Less(a, b)),
            (Greater, _) => (Bool, Step::Less(b, a)),
            (AtMost, _) => (Bool, Step::AtMost(a, b)),
            (AtLeast, _) => (Bool, Step::AtMost(b, a)),
            (Add, Int) => (of, Step::AddInt(a, b)),
            (Add, Time) => (of, Step::AddTime(a, b)),
            (Add, _) => (of, Step::Add(a, b)),
            (Subtract, Int) => (of, Step::SubtractInt(a, b)),
            (Subtract, Time) => (of, Step::SubtractTime(a, b)),
            (Subtract, _) => (of, Step::Subtract(a, b)),
            (Multiply, Int) => (of, Step::MultiplyInt(a, b)),
            (Multiply, _) => (of, Step::Multiply(a, b)),
            (Divide, Int) => (of, Step::DivideInt(a, b)),
            (Divide, _) => (of, Step::Divide(a, b)),
            (Modulo, _) => (Int, Step::ModuloInt(a, b)),
            (Power, _) => (Lreal, Step::Power(a, b)),
        })
    }

    fn call(
        &mut self,
        node: &Node,
        function: &'static Function,
        inputs: &[usize],
    ) -> Result<(PinType, u16), Mistake> {
        use PinType::{Bool, Int, Lreal};
        let name = function.name;
        let (of, step) = match (function.meaning, inputs) {
            (Meaning::Real(real), &[a]) => {
                (Lreal, Step::Real(real, self.same([a], name, Takes::One(Lreal))?.1[0]))
            }
            (Meaning::Power | Meaning::Atan2, &[a, b]) => {
                let (_, [a, b]) = self.same([a, b], name, Takes::One(Lreal))?;
                let is_power = function.meaning == Meaning::Power;
                (Lreal, if is_power { Step::Power(a, b) } else { Step::Atan2(a, b) })
            }
            (Meaning::Abs, &[a]) => match self.same([a], name, Takes::Numbers)? {
                (Int, [a]) => (Int, Step::AbsInt(a)),
                (of, [a]) => (of, Step::Real(Real::Abs, a)),
            },
            (Meaning::Convert { from, to, by }, &[a]) => {
                let (_, [a]) = self.same([a], name, Takes::One(from))?;
                (
                    to,
                    match by {
                        Conversion::Same => return Ok((to, a)),
                        Conversion::Round => Step::RoundTo(to, a),
                        Conversion::Truncate => Step::Truncate(a),
                        Conversion::Bits if to == Int => Step::WordToInt(a),
                        Conversion::Bits => Step::IntToWord(a),
                    },
                )
            }
            (Meaning::Limit, &[least, of, most]) => {
                let (of, [least, a, most]) =
                    self.same([least, of, most], name, Takes::Quantities)?;
                let raised = self.step(Step::Max(least, a), node)?;
                (of, Step::Min(raised, most))
            }
            (Meaning::Sel, &[g, a, b]) => {
                let (_, [g]) = self.same([g], name, Takes::One(Bool))?;
                let (of, [a, b]) = self.same([a, b], name, Takes::Any)?;
                (of, Step::Select(g, a, b))
            }
            (Meaning::Mux, &[k, ref row @ ..]) => {
                let (_, [k]) = self.same([k], name, Takes::One(Int))?;
                let of = self.common(row, name, Takes::Any)?;
                for input in row {
                    self.step(Step::Copy(self.register(*input)), node)?;
                }
                (of, Step::Choose(k, row.len() as u16))
            }
            (_, row) => {
                let of = self.common(row, name, Takes::Quantities)?;
                let is_max = function.meaning == Meaning::Max;
                let mut rest =
                    row.iter().map(|input| self.register(*input)).collect::<Vec<_>>().into_iter();
                let mut last = rest.next().unwrap_or_default();
                for next in rest {
                    let step = if is_max { Step::Max(last, next) } else { Step::Min(last, next) };
                    last = self.step(step, node)?;
                }
                return Ok((of, last));
            }
        };
        Ok((of, self.step(step, node)?))
    }

    /// The type that operands have in common, and their registers. A value that becomes an LREAL keeps its slot.
    fn same<const N: usize>(
        &self,
        operands: [usize; N],
        name: &str,
        takes: Takes,
    ) -> Result<(PinType, [u16; N]), Mistake> {
        let of = self.common(&operands, name, takes)?;
        Ok((of, operands.map(|operand| self.register(operand))))
    }

    fn common(&self, operands: &[usize], name: &str, takes: Takes) -> Result<PinType, Mistake> {
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
            (Some((of, _)), _) => of,
            (None, Takes::One(of)) => of,
            (None, _) if whole().all(|it| PinType::Int.holds(literal(it))) => PinType::Int,
            (None, _) => PinType::Lreal,
        };
        for operand in whole() {
            self.fits(operand, literal(operand), of, common.map(|it| it.1), name, takes)?;
        }
        Ok(of)
    }

    fn of(&self, node: usize) -> Type {
        self.values.get(node).map_or(Type::Whole, |value| value.of)
    }

    fn register(&self, node: usize) -> u16 {
        self.values.get(node).map_or(0, |value| value.register)
    }

    fn span(&self, node: usize) -> Range<usize> {
        self.expression.nodes.get(node).map_or(0..0, |node| node.span.clone())
    }

    fn step(&mut self, step: Step, node: &Node) -> Result<u16, Mistake> {
        if self.steps.len() >= MAX_STEPS {
            return Err(too_long(node.span.clone()));
        }
        self.steps.push(step);
        Ok((self.steps.len() - 1) as u16)
    }

    /// The text of a part, shortened.
    fn shown(&self, node: usize) -> String {
        const LONGEST: usize = 40;
        let text = self.expression.text.get(self.span(node)).unwrap_or_default();
        match text.char_indices().nth(LONGEST) {
            Some((end, _)) => format!("{}…", text.get(..end).unwrap_or_default()),
            None => text.into(),
        }
    }

    fn not_taken(&self, operand: usize, of: PinType, name: &str, takes: Takes) -> Mistake {
        let shown = self.shown(operand);
        let message = format!("{shown} is {of}, and {name} takes {}", takes.as_str());
        Mistake { help: takes.help(of, &shown), ..Mistake::new(self.span(operand), message) }
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
        let mistake = |message| Err(Mistake::new(self.span(operand), message));
        let because = match beside {
            Some(beside) => format!("{} is {of}", self.shown(beside)),
            None => format!("{name} takes {}", takes.as_str()),
        };
        match of {
            PinType::Lreal => Ok(()),
            PinType::Int | PinType::Word if takes.takes(of) && of.holds(literal) => Ok(()),
            PinType::Int if takes == Takes::Bits => {
                mistake(format!("{shown} is a number, and {because}"))
                    .map_err(|it| it.help(format!("a WORD is written WORD#{shown}")))
            }
            PinType::Int => {
                mistake(format!("{shown} does not fit INT (-32768 to 32767), and {because}"))
                    .map_err(|it| it.help("a number with a point is LREAL: 40000.0"))
            }
            PinType::Word => {
                mistake(format!("{shown} does not fit WORD (0 to 65535), and {because}"))
            }
            PinType::Bool => mistake(format!("{shown} is a number, and {because}"))
                .map_err(|it| it.help("a BOOL is TRUE or FALSE; a number is compared: x > 0")),
            PinType::Time => mistake(format!("{shown} is a number, and {because}"))
                .map_err(|it| it.help("a TIME is written T#2s or T#500ms")),
        }
    }
}
