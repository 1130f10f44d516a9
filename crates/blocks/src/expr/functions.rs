//! The functions by name, and the inputs of a call.

use alloc::borrow::Cow;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::ops::Range;

use super::evaluate::Real;
use super::{MAX_STEPS, Mistake};
use crate::PinType::{self, Bool, Int, Lreal, Time, Word};

#[derive(Debug)]
pub(super) struct Function {
    pub(super) name: &'static str,
    inputs: &'static [&'static str],
    /// The last two inputs are the first ones of a row that goes on.
    goes_on: bool,
    pub(super) meaning: Meaning,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    /// LREAL of one LREAL.
    Real(Real),
    Power,
    Atan2,
    Abs,
    Min,
    Max,
    Limit,
    Sel,
    Mux,
    Convert {
        from: PinType,
        to: PinType,
        by: Conversion,
    },
}

/// What becomes of the value in its slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Conversion {
    /// It is the same number.
    Same,
    /// To the nearest whole number, of two to the even one.
    Round,
    /// Its decimals are dropped.
    Truncate,
    /// The same sixteen bits are another number.
    Bits,
}

const fn function(
    name: &'static str,
    inputs: &'static [&'static str],
    meaning: Meaning,
) -> Function {
    Function { name, inputs, goes_on: false, meaning }
}

const fn row(name: &'static str, inputs: &'static [&'static str], meaning: Meaning) -> Function {
    Function { name, inputs, goes_on: true, meaning }
}

const fn convert(name: &'static str, from: PinType, to: PinType, by: Conversion) -> Function {
    function(name, &["IN"], Meaning::Convert { from, to, by })
}

static FUNCTIONS: [Function; 31] = [
    function("ABS", &["IN"], Meaning::Abs),
    function("SQRT", &["IN"], Meaning::Real(Real::Sqrt)),
    function("LN", &["IN"], Meaning::Real(Real::Ln)),
    function("LOG", &["IN"], Meaning::Real(Real::Log)),
    function("EXP", &["IN"], Meaning::Real(Real::Exp)),
    function("SIN", &["IN"], Meaning::Real(Real::Sin)),
    function("COS", &["IN"], Meaning::Real(Real::Cos)),
    function("TAN", &["IN"], Meaning::Real(Real::Tan)),
    function("ASIN", &["IN"], Meaning::Real(Real::Asin)),
    function("ACOS", &["IN"], Meaning::Real(Real::Acos)),
    function("ATAN", &["IN"], Meaning::Real(Real::Atan)),
    function("ATAN2", &["Y", "X"], Meaning::Atan2),
    function("EXPT", &["IN1", "IN2"], Meaning::Power),
    row("MAX", &["IN1", "IN2"], Meaning::Max),
    row("MIN", &["IN1", "IN2"], Meaning::Min),
    function("LIMIT", &["MN", "IN", "MX"], Meaning::Limit),
    function("SEL", &["G", "IN0", "IN1"], Meaning::Sel),
    row("MUX", &["K", "IN0", "IN1"], Meaning::Mux),
    convert("TRUNC", Lreal, Int, Conversion::Truncate),
    convert("LREAL_TRUNC_INT", Lreal, Int, Conversion::Truncate),
    convert("LREAL_TO_INT", Lreal, Int, Conversion::Round),
    convert("LREAL_TO_TIME", Lreal, Time, Conversion::Round),
    convert("INT_TO_LREAL", Int, Lreal, Conversion::Same),
    convert("INT_TO_TIME", Int, Time, Conversion::Same),
    convert("INT_TO_WORD", Int, Word, Conversion::Bits),
    convert("WORD_TO_INT", Word, Int, Conversion::Bits),
    convert("TIME_TO_LREAL", Time, Lreal, Conversion::Same),
    convert("TIME_TO_INT", Time, Int, Conversion::Round),
    convert("BOOL_TO_INT", Bool, Int, Conversion::Same),
    convert("BOOL_TO_LREAL", Bool, Lreal, Conversion::Same),
    convert("BOOL_TO_WORD", Bool, Word, Conversion::Same),
];

impl Function {
    /// The function with this name, in any case.
    pub(super) fn named(name: &str) -> Option<&'static Self> {
        FUNCTIONS.iter().find(|it| it.name.eq_ignore_ascii_case(name))
    }

    /// The number of inputs, or of the fewest.
    fn least(&self) -> usize {
        self.inputs.len()
    }

    /// The position of an input.
    fn position(&self, name: &str) -> Option<usize> {
        // A row ends at the bound on steps.
        let most = if self.goes_on { MAX_STEPS } else { self.least() };
        (0..most).find(|position| self.input(*position).eq_ignore_ascii_case(name))
    }

    /// The name of an input.
    fn input(&self, position: usize) -> Cow<'static, str> {
        match self.inputs.get(position) {
            Some(name) => Cow::Borrowed(name),
            None if self.meaning == Meaning::Mux => Cow::Owned(format!("IN{}", position - 1)),
            None => Cow::Owned(format!("IN{}", position + 1)),
        }
    }

    /// A call with this as its input, if it has no more.
    pub(super) fn called_with(&self, input: &str) -> String {
        if self.least() == 1 { format!("{}({input})", self.name) } else { self.form() }
    }

    /// The name with its inputs, as a call of it is written.
    fn form(&self) -> String {
        let row = if self.goes_on { ", …" } else { "" };
        format!("{}({}{row})", self.name, self.inputs.join(", "))
    }
}

/// The inputs of a call, as they are given one after another.
pub(super) struct Inputs {
    function: &'static Function,
    /// Whether the first one was given with its name; then all are.
    is_formal: Option<bool>,
    nodes: Vec<Option<usize>>,
}

impl Inputs {
    pub(super) fn of(function: &'static Function) -> Self {
        Self { function, is_formal: None, nodes: Vec::new() }
    }

    pub(super) fn is_any(&self) -> bool {
        self.is_formal.is_some()
    }

    /// Takes the next one, with its name if it has one.
    pub(super) fn give(
        &mut self,
        name: Option<&str>,
        node: usize,
        span: Range<usize>,
    ) -> Result<(), Mistake> {
        let Function { name: called, goes_on, .. } = self.function;
        if *self.is_formal.get_or_insert(name.is_some()) != name.is_some() {
            let message = format!("of the inputs of {called}, either all have names or none");
            return Err(Mistake::new(span, message).help(self.named_form()));
        }
        let position = match name {
            Some(name) => self.function.position(name).ok_or_else(|| {
                let message = format!("{called} has no input {name}");
                Mistake::new(span.clone(), message).help(self.named_form())
            })?,
            None => self.nodes.len(),
        };
        if position >= self.function.least() && !goes_on {
            let (least, s) = (self.function.least(), self.plural());
            let message = format!("{called} has {least} input{s}, and this is one more");
            return Err(Mistake::new(span, message).help(format!("write {}", self.function.form())));
        }
        if position >= self.nodes.len() {
            self.nodes.resize(position + 1, None);
        }
        match self.nodes.get_mut(position) {
            Some(free @ None) => *free = Some(node),
            _ => {
                let input = self.function.input(position);
                return Err(Mistake::new(span, format!("{input} is given a second time")));
            }
        }
        Ok(())
    }

    /// Their nodes in the order of the function's inputs, for a call at this place.
    pub(super) fn finish(mut self, span: Range<usize>) -> Result<Vec<usize>, Mistake> {
        let given = self.nodes.iter().flatten().count();
        let wanted = self.nodes.len().max(self.function.least());
        self.nodes.resize(wanted, None);
        let missing = self.nodes.iter().position(Option::is_none);
        let Some(missing) = missing else { return Ok(self.nodes.into_iter().flatten().collect()) };
        let Function { name, goes_on, .. } = self.function;
        let message = if self.is_formal == Some(true) {
            format!("{name} misses its input {}", self.function.input(missing))
        } else {
            let least = if *goes_on { "at least " } else { "" };
            let wanted = self.function.least();
            format!("{name} has {least}{wanted} input{}, and {given} of them here", self.plural())
        };
        Err(Mistake::new(span, message).help(format!("write {}", self.function.form())))
    }

    fn plural(&self) -> &'static str {
        if self.function.least() == 1 { "" } else { "s" }
    }

    /// A call with names: `SEL(G := …, IN0 := …, IN1 := …)`.
    fn named_form(&self) -> String {
        let inputs: Vec<_> = self.function.inputs.iter().map(|it| format!("{it} := …")).collect();
        let row = if self.function.goes_on { ", …" } else { "" };
        format!("write {}({}{row})", self.function.name, inputs.join(", "))
    }
}

/// What others call what is another thing here.
const FOREIGN: [(&str, &str); 23] = [
    ("ADD", "write a + b"),
    ("SUB", "write a - b"),
    ("MUL", "write a * b"),
    ("DIV", "write a / b"),
    ("GT", "write a > b"),
    ("GE", "write a >= b"),
    ("EQ", "write a = b"),
    ("NE", "write a <> b"),
    ("LE", "write a <= b"),
    ("LT", "write a < b"),
    ("POW", "write a ** b"),
    ("SQR", "write a ** 2"),
    ("MOVE", "write its input alone"),
    ("IF", "write SEL(condition, if_false, if_true)"),
    ("CLAMP", "write LIMIT(MN, IN, MX)"),
    ("FABS", "write ABS(IN)"),
    ("LOG10", "write LOG(IN)"),
    ("FLOOR", "TRUNC drops the decimals, LREAL_TO_INT rounds"),
    ("CEIL", "TRUNC drops the decimals, LREAL_TO_INT rounds"),
    ("ROUND", "write LREAL_TO_INT(IN)"),
    ("INT_TO_BOOL", "compare it: i <> 0"),
    ("LREAL_TO_BOOL", "compare it: x <> 0.0"),
    ("WORD_TO_BOOL", "compare it: w <> 16#0000"),
];

/// No function has this name.
pub(super) fn unknown(name: &str, span: Range<usize>) -> Mistake {
    let mistake = Mistake::new(span, format!("there is no function {name}"));
    let upper = name.to_ascii_uppercase();
    if let Some((_, help)) = FOREIGN.into_iter().find(|it| it.0 == upper) {
        return mistake.help(help);
    }
    if let Some(help) = conversion(&upper) {
        return mistake.help(help);
    }
    let far = |name: &str| {
        let is_part = upper.len() > 2 && (name.starts_with(&*upper) || name.ends_with(&*upper));
        if is_part { 1 } else { edits(&upper, name) }
    };
    let nearest = FUNCTIONS.iter().map(|it| (far(it.name), it)).min_by_key(|it| it.0);
    let nearest = nearest.filter(|it| it.0 <= upper.len() / 2);
    match nearest {
        Some((_, function)) => mistake.help(format!("did you mean {}?", function.form())),
        None => {
            let names: Vec<_> = FUNCTIONS.iter().map(|it| it.name).collect();
            mistake.help(format!("there are {}", names.join(", ")))
        }
    }
}

/// What a conversion is called here that has another name in the standard: `TO_INT`, `WORD_TO_DINT`, `WORD_TO_LREAL`.
fn conversion(name: &str) -> Option<String> {
    let functions = |wanted| FUNCTIONS.iter().filter(move |it| it.converts().1 == Some(wanted));
    let Some((from, to)) = name.split_once("_TO_") else {
        let (to, _) = type_named(name.strip_prefix("TO_")?)?;
        let names: Vec<_> = functions(to).map(Function::form).collect();
        let help = format!("the name has the type that is converted, too: {}", names.join(", "));
        return (!names.is_empty()).then_some(help);
    };
    let ((from, knows_from), (to, knows_to)) = (type_named(from)?, type_named(to)?);
    let one = |from, to| functions(to).find(|it| it.converts().0 == Some(from));
    let two = || {
        let mut first = FUNCTIONS.iter().filter(|it| it.converts().0 == Some(from));
        first.find_map(|first| Some((first, one(first.converts().1?, to)?)))
    };
    let way = if from == to {
        "write its input alone".into()
    } else if let Some(function) = one(from, to) {
        format!("write {}", function.form())
    } else {
        let (first, then) = two()?;
        format!("write {}({})", then.name, first.form())
    };
    let types = "types are BOOL, INT, WORD, TIME and LREAL";
    Some(if knows_from && knows_to { way } else { format!("{types}: {way}") })
}

impl Function {
    /// The types from which and to which it converts, if its name says both; TRUNC's does not.
    fn converts(&self) -> (Option<PinType>, Option<PinType>) {
        match self.meaning {
            Meaning::Convert { from, to, .. } if self.name.contains("_TO_") => {
                (Some(from), Some(to))
            }
            _ => (None, None),
        }
    }
}

/// The type that has this name in the standard or stands for it here, and whether it has it here.
fn type_named(name: &str) -> Option<(PinType, bool)> {
    Some(match name {
        "BOOL" => (Bool, true),
        "INT" => (Int, true),
        "WORD" => (Word, true),
        "TIME" => (Time, true),
        "LREAL" => (Lreal, true),
        "SINT" | "USINT" | "UINT" | "DINT" | "UDINT" | "LINT" | "ULINT" => (Int, false),
        "BYTE" | "DWORD" | "LWORD" => (Word, false),
        "LTIME" => (Time, false),
        "REAL" => (Lreal, false),
        _ => return None,
    })
}

/// How many letters are put in, left out or changed between two words.
fn edits(a: &str, b: &str) -> usize {
    // No function's name is longer.
    if a.len() > 50 {
        return a.len();
    }
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.bytes().enumerate() {
        let mut before = i;
        let mut left = i + 1;
        for (cell, y) in row.iter_mut().skip(1).zip(b.bytes()) {
            let least = (before + usize::from(x != y)).min(*cell + 1).min(left + 1);
            before = core::mem::replace(cell, least);
            left = least;
        }
        if let Some(first) = row.first_mut() {
            *first = i + 1;
        }
    }
    row.last().copied().unwrap_or_default()
}
