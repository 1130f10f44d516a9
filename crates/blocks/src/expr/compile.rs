//! From nodes to steps: each part of an expression gets its type and a register.

use alloc::format;
use alloc::vec;
use alloc::vec::Vec;

use super::evaluate::{Real, Step};
use super::expression::{Expression, Node, Part};
use super::functions::{Conversion, Function, Meaning};
use super::operator::Operator;
use super::parse::too_long;
use super::program::Program;
use super::types::{Takes, Type};
use super::{MAX_STEPS, Mistake};
use crate::PinType;

impl Expression {
    /// The program for signals of these types, in the order of [`names`](Self::names).
    ///
    /// # Errors
    /// Types that do not stand together, or more steps than [`MAX_STEPS`].
    pub fn program(&self, types: &[PinType]) -> Result<Program, Mistake> {
        self.compile(types, None)
    }

    /// As [`program`](Self::program), for a result that is BOOL.
    ///
    /// # Errors
    /// As there, and a result of another type.
    pub fn condition(&self, types: &[PinType]) -> Result<Program, Mistake> {
        self.compile(types, Some(("a condition", PinType::Bool)))
    }

    fn compile(
        &self,
        types: &[PinType],
        must_be: Option<(&str, PinType)>,
    ) -> Result<Program, Mistake> {
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
        if let Some((what, of)) = must_be.filter(|(_, of)| result != *of) {
            return Err(compiler.not_taken(self.nodes.len() - 1, result, what, Takes::One(of)));
        }
        Ok(Program { steps: compiler.steps, result, register: last.register })
    }
}

/// A part of the expression that is computed.
#[derive(Clone, Copy)]
pub(super) struct Value {
    pub(super) of: Type,
    pub(super) register: u16,
    /// Of a literal.
    pub(super) literal: f64,
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

pub(super) struct Compiler<'a> {
    pub(super) expression: &'a Expression,
    types: &'a [PinType],
    steps: Vec<Step>,
    /// Of the nodes so far.
    pub(super) values: Vec<Value>,
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
                let step = match of {
                    PinType::Int => Step::NegateInt(a),
                    PinType::Time => Step::NegateTime(a),
                    _ => Step::Real(Real::Negate, a),
                };
                (of, step)
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
        match (operator, both.map(|node| self.of(node) == Type::Of(Time))) {
            (Multiply | Divide, [true, false]) => {
                let (of, [b]) = self.same([right], name, Takes::Numbers)?;
                let a = self.register(left);
                let step = match (operator, of) {
                    (Multiply, _) => Step::MultiplyTime(a, b),
                    (_, Int) => Step::DivideTimeByInt(a, b),
                    _ => Step::DivideTimeByReal(a, b),
                };
                return Ok((Time, step));
            }
            (Multiply, [false, true]) => {
                let [left_text, right_text] = both.map(|node| self.shown(node));
                let message = "in a product with a number, a TIME stands first";
                return Err(Mistake::new(self.span(right), message)
                    .help(format!("write {right_text} * {left_text}")));
            }
            (Divide, [true, true]) => {
                let [left_text, right_text] = both.map(|node| self.shown(node));
                let message = "a TIME is divided by a number, not by a TIME";
                return Err(Mistake::new(self.span(right), message).help(format!(
                    "write TIME_TO_LREAL({left_text}) / TIME_TO_LREAL({right_text})"
                )));
            }
            _ => {}
        }
        let is_ordered = |it| matches!(it, Less | Greater | AtMost | AtLeast);
        if let Some(Node { part: Part::Binary { operator: first, right: middle, .. }, .. }) =
            self.expression.nodes.get(left)
            && is_ordered(*first)
            && is_ordered(operator)
        {
            let [left_text, middle, right_text] =
                [left, *middle, right].map(|node| self.shown(node));
            let span = self.span(left).start..self.span(right).end;
            return Err(Mistake::new(span, "a comparison has two sides")
                .help(format!("write {left_text} AND {middle} {name} {right_text}")));
        }
        let takes = match operator {
            Or | Xor | And => Takes::Bits,
            Equal | NotEqual => Takes::Any,
            Less | Greater | AtMost | AtLeast => Takes::Ordered,
            Add | Subtract => Takes::Quantities,
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
            (Greater, _) => (Bool, Step::Greater(a, b)),
            (AtMost, _) => (Bool, Step::AtMost(a, b)),
            (AtLeast, _) => (Bool, Step::AtLeast(a, b)),
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
                let step = match by {
                    Conversion::Same => return Ok((to, a)),
                    Conversion::Round => Step::RoundTo(to, a),
                    Conversion::Truncate => Step::Truncate(a),
                    Conversion::Bits if to == Int => Step::WordToInt(a),
                    Conversion::Bits => Step::IntToWord(a),
                };
                (to, step)
            }
            (Meaning::Limit, &[least, of, most]) => {
                let (of, [least, a, most]) =
                    self.same([least, of, most], name, Takes::Quantities)?;
                let raised = self.step(Step::Max(least, a), node)?;
                (of, Step::Min(raised, most))
            }
            (Meaning::Sel, &[g, a, b]) => {
                let (_, [g]) = self.same([g], "G of SEL", Takes::One(Bool))?;
                let (of, [a, b]) = self.same([a, b], name, Takes::Any)?;
                (of, Step::Select(g, a, b))
            }
            (Meaning::Mux, &[k, ref row @ ..]) => {
                let (_, [k]) = self.same([k], "K of MUX", Takes::One(Int))?;
                let of = self.common(row, name, Takes::Any)?;
                for input in row {
                    self.step(Step::Copy(self.register(*input)), node)?;
                }
                (of, Step::Choose(k, row.len() as u16))
            }
            (_, row) => {
                let of = self.common(row, name, Takes::Quantities)?;
                let is_max = function.meaning == Meaning::Max;
                let mut last = row.first().map_or(0, |first| self.register(*first));
                for next in row.iter().skip(1) {
                    let next = self.register(*next);
                    let step = if is_max { Step::Max(last, next) } else { Step::Min(last, next) };
                    last = self.step(step, node)?;
                }
                return Ok((of, last));
            }
        };
        Ok((of, self.step(step, node)?))
    }

    fn step(&mut self, step: Step, node: &Node) -> Result<u16, Mistake> {
        if self.steps.len() >= MAX_STEPS {
            return Err(too_long(node.span.clone()));
        }
        self.steps.push(step);
        Ok((self.steps.len() - 1) as u16)
    }
}
