//! From tokens to nodes. Operators that bind by precedence need no function for each level.

use alloc::borrow::ToOwned;
use alloc::format;
use alloc::vec::Vec;
use core::ops::Range;

use super::expression::{Expression, Name, Node, Part};
use super::functions::{Function, Inputs};
use super::operator::Operator;
use super::tokens::{Kind, Token, Tokens};
use super::types::Type;
use super::{MAX_DEPTH, MAX_STEPS, Mistake};
use crate::PinType;

/// Reads an expression.
///
/// # Errors
/// The first mistake in it.
pub fn parse(text: &str) -> Result<Expression, Mistake> {
    let mut tokens = Tokens::new(text);
    let token = tokens.take()?;
    let (last, depth) = (0..text.len(), 0);
    let (names, nodes, inputs) = (Vec::new(), Vec::new(), Vec::new());
    let mut parser = Parser { text, tokens, token, last, names, nodes, inputs, depth };
    if parser.token.kind == Kind::End {
        return Err(Mistake::new(0..text.len(), "there is no expression").help(
            "an expression is such as level.y - 1.6, level.y > 1.6 AND NOT stop, MAX(a, b)",
        ));
    }
    parser.expression(0)?;
    if parser.token.kind != Kind::End {
        return Err(parser.surplus());
    }
    let Parser { names, nodes, inputs, .. } = parser;
    Ok(Expression { text: text.to_owned(), names, nodes, inputs })
}

pub(super) struct Parser<'a> {
    text: &'a str,
    tokens: Tokens<'a>,
    token: Token<'a>,
    /// The token before.
    last: Range<usize>,
    names: Vec<Name>,
    nodes: Vec<Node>,
    inputs: Vec<usize>,
    /// Of parentheses and calls.
    depth: usize,
}

impl<'a> Parser<'a> {
    /// An expression of operators of at least this precedence.
    fn expression(&mut self, least: u8) -> Result<usize, Mistake> {
        let mut left = self.unary()?;
        while let Kind::Operator(operator) = self.token.kind {
            if operator.precedence() < least {
                break;
            }
            self.advance()?;
            let right = self.expression(operator.precedence() + 1)?;
            let span = self.span(left).start..self.span(right).end;
            left = self.push(Part::Binary { operator, left, right }, span)?;
        }
        Ok(left)
    }

    fn unary(&mut self) -> Result<usize, Mistake> {
        let sign = match self.token.kind {
            Kind::Operator(Operator::Subtract) => Some(true),
            Kind::Operator(Operator::Add) => Some(false),
            Kind::Not => None,
            _ => return self.primary(),
        };
        let start = self.advance()?.start;
        let is_sign = |it| it == Operator::Subtract || it == Operator::Add;
        if matches!(self.token.kind, Kind::Operator(it) if is_sign(it))
            || self.token.kind == Kind::Not
        {
            let [first, second] = [&self.last, &self.token.span].map(|span| self.shown(span));
            let message = format!("a second {second} stands behind {first}");
            return Err(Mistake::new(self.token.span.clone(), message)
                .help(format!("use parentheses: {first} ({second} …)")));
        }
        let is_literal = matches!(self.token.kind, Kind::Literal(_));
        let of = self.primary()?;
        let span = start..self.span(of).end;
        // A literal has its sign: -32768 is an INT, though 32768 is none.
        if let (true, Some(is_negative), Some(node)) = (is_literal, sign, self.nodes.last_mut())
            && let Part::Literal(literal) = &mut node.part
            && matches!(literal.of, Type::Whole | Type::Of(PinType::Lreal))
        {
            literal.value = match literal.of {
                _ if !is_negative => literal.value,
                // No whole number is a negative zero.
                Type::Whole => 0.0 - literal.value,
                Type::Of(_) => -literal.value,
            };
            node.span = span;
            return Ok(of);
        }
        let part = sign.map_or(Part::Not(of), |is_negative| Part::Sign { is_negative, of });
        self.push(part, span)
    }

    fn primary(&mut self) -> Result<usize, Mistake> {
        match self.token.kind {
            Kind::Literal(literal) => {
                let span = self.advance()?;
                self.push(Part::Literal(literal), span)
            }
            Kind::Word(name) if self.tokens.is_before("(") => self.call(name),
            Kind::Word(name) | Kind::Quoted(name) => {
                let span = self.advance()?;
                let known = self.names.iter().position(|known| known.name == name);
                let index = known.unwrap_or(self.names.len());
                if known.is_none() {
                    self.names.push(Name { name: name.to_owned(), span: span.clone() });
                }
                self.push(Part::Name(index), span)
            }
            Kind::Open => {
                let start = self.enter()?.start;
                let inner = self.expression(0)?;
                let end = self.leave(start)?;
                if let Some(node) = self.nodes.get_mut(inner) {
                    node.span = start..end;
                }
                Ok(inner)
            }
            _ => Err(self.missing_operand()),
        }
    }

    fn call(&mut self, name: &str) -> Result<usize, Mistake> {
        let Some(function) = Function::named(name) else {
            return Err(super::functions::unknown(name, self.token.span.clone()));
        };
        let start = self.advance()?.start;
        let open = self.enter()?.start;
        let mut given = Inputs::of(function);
        while self.token.kind != Kind::Close || given.is_any() {
            let span = self.token.span.clone();
            let formal = match self.token.kind {
                Kind::Word(formal) if self.tokens.is_before(":=") => {
                    self.advance()?;
                    self.advance()?;
                    Some(formal)
                }
                _ => None,
            };
            let node = self.expression(0)?;
            let span = span.start..self.span(node).end;
            given.give(formal, node, span)?;
            if self.token.kind != Kind::Comma {
                break;
            }
            self.advance()?;
        }
        let end = self.leave(open)?;
        let nodes = given.finish(start..end)?;
        let first = self.inputs.len();
        self.inputs.extend(nodes);
        let inputs = first..self.inputs.len();
        self.push(Part::Call { function, inputs }, start..end)
    }

    /// Takes an opening parenthesis.
    fn enter(&mut self) -> Result<Range<usize>, Mistake> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            let message = format!("there are more than {MAX_DEPTH} parentheses in each other");
            return Err(Mistake::new(self.token.span.clone(), message)
                .help("compute a part of it in an expression of its own"));
        }
        self.advance()
    }

    /// Takes the closing parenthesis for the one at `open`; its end.
    fn leave(&mut self, open: usize) -> Result<usize, Mistake> {
        match self.token.kind {
            Kind::Close => {
                self.depth -= 1;
                Ok(self.advance()?.end)
            }
            Kind::End => Err(Mistake::new(open..open + 1, "there is no ) for this (")),
            _ => Err(self.surplus()),
        }
    }

    /// Goes to the next token; the place of the one that was left.
    fn advance(&mut self) -> Result<Range<usize>, Mistake> {
        let next = self.tokens.take()?;
        self.last = core::mem::replace(&mut self.token, next).span;
        Ok(self.last.clone())
    }

    fn push(&mut self, part: Part, span: Range<usize>) -> Result<usize, Mistake> {
        if self.nodes.len() >= MAX_STEPS {
            return Err(too_long(span));
        }
        self.nodes.push(Node { part, span });
        Ok(self.nodes.len() - 1)
    }

    fn span(&self, node: usize) -> Range<usize> {
        self.nodes.get(node).map_or(0..0, |node| node.span.clone())
    }

    fn shown(&self, span: &Range<usize>) -> &'a str {
        self.text.get(span.clone()).unwrap_or_default()
    }

    fn missing_operand(&self) -> Mistake {
        let shown = self.shown(&self.token.span);
        let last = self.shown(&self.last);
        match self.token.kind {
            Kind::End => Mistake::new(self.last.clone(), format!("nothing stands behind {last}")),
            _ => Mistake::new(
                self.token.span.clone(),
                format!("a signal, a number or a function is missing before {shown}"),
            ),
        }
    }

    /// A token where the expression could end.
    fn surplus(&self) -> Mistake {
        let shown = self.shown(&self.token.span);
        let span = self.token.span.clone();
        let missing = || format!("an operator is missing before {shown}");
        match self.token.kind {
            Kind::Close => Mistake::new(span, "there is no ( for this )"),
            Kind::Comma => {
                Mistake::new(span, "a comma stands only between the inputs of a function")
                    .help("decimals have a point: 1.5")
            }
            Kind::Gives => {
                Mistake::new(span, ":= stands only behind the name of a function's input")
                    .help("equality is =")
            }
            Kind::Word(_) | Kind::Quoted(_) | Kind::Literal(_) if self.called().is_some() => {
                let function = self.called().map(|it| it.called_with(shown)).unwrap_or_default();
                let name = self.shown(&self.last);
                Mistake::new(
                    self.last.clone(),
                    format!("the input of {name} is not in parentheses"),
                )
                .help(format!("write {function}"))
            }
            Kind::Open => Mistake::new(span, missing()).help("a product is a * b"),
            Kind::Not => Mistake::new(span, missing()).help("write AND NOT, or a <> b"),
            _ if self.is_statement() => {
                Mistake::new(span, missing()).help("a choice is SEL(condition, if_false, if_true)")
            }
            _ => Mistake::new(span, missing())
                .help("operators are + - * / MOD ** < > <= >= = <> AND XOR OR"),
        }
    }

    /// The function whose name the last token is.
    fn called(&self) -> Option<&'static Function> {
        Function::named(self.shown(&self.last))
    }

    /// Whether this is where two words of a statement meet.
    fn is_statement(&self) -> bool {
        let is_word = |span| {
            let word = self.shown(span);
            ["IF", "THEN", "ELSE"].iter().any(|it| it.eq_ignore_ascii_case(word))
        };
        is_word(&self.last) || is_word(&self.token.span)
    }
}

pub(super) fn too_long(span: Range<usize>) -> Mistake {
    Mistake::new(span, format!("the expression has more than {MAX_STEPS} steps up to here"))
        .help("compute a part of it in an expression of its own")
}
