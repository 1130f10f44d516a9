//! What is said of a text that is no expression.

use isochrone_blocks::PinType::{self, Bool, Int, Lreal, Time, Word};
use isochrone_blocks::expr::{MAX_DEPTH, MAX_STEPS, Mistake, parse};

const SIGNALS: [(&str, PinType); 9] = [
    ("level", Lreal),
    ("pump", Lreal),
    ("a", Lreal),
    ("b", Lreal),
    ("c", Lreal),
    ("i", Int),
    ("on", Bool),
    ("pause", Time),
    ("state", Word),
];

/// The mistake in a text.
fn mistake(text: &str) -> Mistake {
    let expression = match parse(text) {
        Ok(expression) => expression,
        Err(mistake) => return mistake,
    };
    let of = |name: &str| SIGNALS.iter().find(|it| it.0 == name).map_or(Lreal, |it| it.1);
    let types: Vec<_> = expression.names().iter().map(|it| of(&it.name)).collect();
    expression.program(&types).expect_err(text)
}

/// A text with marks around its mistake, what is said, and how the help begins.
const MISTAKES: [(&str, &str, &str); 143] = [
    (
        "«»",
        "there is no expression",
        "an expression is such as level.y - 1.6, level.y > 1.6 AND NOT stop, MAX(a, b)",
    ),
    (
        "«  »",
        "there is no expression",
        "an expression is such as level.y - 1.6, level.y > 1.6 AND NOT stop, MAX(a, b)",
    ),
    ("level «>»", "nothing stands behind >", ""),
    ("level «+» ", "nothing stands behind +", ""),
    ("level «==» 3", "== is not of this language", "equality is ="),
    ("level «!=» 3", "!= is not of this language", "inequality is <>"),
    ("on «&&» on", "&& is not of this language", "write AND"),
    ("on «||» on", "|| is not of this language", "write OR"),
    ("«!»on", "! is not of this language", "write NOT"),
    ("level «%» 2", "% is not of this language", "the remainder of a division of INTs is a MOD b"),
    ("level «^» 2", "^ is not of this language", "a power is a ** b"),
    ("level «=<» 3", "=< is not of this language", "at most is <="),
    ("level «=>» 3", "=> is not of this language", "at least is >="),
    ("level «≥» 3", "≥ is not of this language", "at least is >="),
    ("«a < b < c»", "a comparison has two sides", "write a < b AND b < c"),
    ("«a + b < c >= level»", "a comparison has two sides", "write a + b < c AND c >= level"),
    ("«level» AND on", "level is LREAL, and AND takes BOOL or WORD", "compare it: level > 0"),
    ("«on» + 1", "on is BOOL, and + takes LREAL, INT or TIME", "BOOL_TO_INT(on) is 0 or 1"),
    ("1 + «on»", "on is BOOL, and + takes LREAL, INT or TIME", "BOOL_TO_INT(on) is 0 or 1"),
    (
        "level > «on»",
        "on is BOOL, and > takes LREAL, INT, TIME or WORD",
        "BOOL is compared by = and <>; BOOL_TO_INT(on) is 0 or 1",
    ),
    ("on = «1»", "1 is a number, and on is BOOL", "a BOOL is TRUE or FALSE"),
    (
        "«on» > TRUE",
        "on is BOOL, and > takes LREAL, INT, TIME or WORD",
        "BOOL is compared by = and <>; BOOL_TO_INT(on) is 0 or 1",
    ),
    (
        "state = «level»",
        "state is WORD and level is LREAL, and = takes values of one type",
        "WORD_TO_INT(state) has the same bits",
    ),
    ("state = «70000»", "70000 does not fit WORD (0 to 65535), and state is WORD", ""),
    ("pause > «2»", "2 is a number, and pause is TIME", "a TIME is written T#2s or T#500ms"),
    (
        "pause > «level»",
        "pause is TIME and level is LREAL, and > takes values of one type",
        "TIME_TO_LREAL(pause) is its milliseconds",
    ),
    (
        "level > «T#2s»",
        "level is LREAL and T#2s is TIME, and > takes values of one type",
        "TIME_TO_LREAL(T#2s) is its milliseconds",
    ),
    ("pause + «1»", "1 is a number, and pause is TIME", "a TIME is written T#2s or T#500ms"),
    ("2 * «pause»", "in a product with a number, a TIME stands first", "write pause * 2"),
    (
        "pause / «pause»",
        "a TIME is divided by a number, not by a TIME",
        "write TIME_TO_LREAL(pause) / TIME_TO_LREAL(pause)",
    ),
    (
        "«pause» ** 2",
        "pause is TIME, and ** takes LREAL",
        "TIME_TO_LREAL(pause) is its milliseconds",
    ),
    (
        "i + «40000»",
        "40000 does not fit INT (-32768 to 32767), and i is INT",
        "40000.0 would be an LREAL, and so would be the result",
    ),
    ("«i» AND 3", "i is INT, and AND takes BOOL or WORD", "compare it: i > 0"),
    (
        "«3» AND 5",
        "3 is a number, and AND takes BOOL or WORD",
        "a WORD is written WORD#3; a number is compared",
    ),
    (
        "«level» MOD 2",
        "level is LREAL, and MOD takes INT",
        "LREAL_TO_INT(level) rounds, TRUNC(level) drops the decimals",
    ),
    (
        "«2.5» MOD 2",
        "2.5 is LREAL, and MOD takes INT",
        "LREAL_TO_INT(2.5) rounds, TRUNC(2.5) drops the decimals",
    ),
    ("NOT «level»", "level is LREAL, and NOT takes BOOL or WORD", "compare it: NOT (level > 0)"),
    (
        "NOT «5»",
        "5 is a number, and NOT takes BOOL or WORD",
        "a WORD is written WORD#5; a number is compared",
    ),
    ("NOT «NOT» on", "a second NOT stands behind NOT", "use parentheses: NOT (NOT …)"),
    ("- «-»level", "a second - stands behind -", "use parentheses: - (- …)"),
    ("-«on»", "on is BOOL, and - takes LREAL, INT or TIME", "BOOL_TO_INT(on) is 0 or 1"),
    ("pump«-1.y» > 3", "a name with - stands in double quotes", "write \"pump-1.y\""),
    ("pump-x.y«@»prev > 3", "a name with @ stands in double quotes", "write \"pump-x.y@prev\""),
    ("level«@»prev > 3", "a name with @ stands in double quotes", "write \"level@prev\""),
    ("«\"pump-1.y > 3»", "the double quote that begins this name has no other one", ""),
    ("«\"\"»", "there is no name between the quotes", ""),
    ("gr«ö»ße > 1", "a name with ö stands in double quotes", "write \"größe\""),
    ("level > gr«ö»ße", "a name with ö stands in double quotes", "write \"größe\""),
    ("«16#zz»", "16#zz: after 16# come digits of base 16, such as 16#8F00", ""),
    ("«10#5»", "10#5: a base is 2, 8 or 16", ""),
    ("«1.2.3»", "1.2.3: this is no number", ""),
    ("«1e400»", "1e400: LREAL holds numbers up to 1.8e308", ""),
    ("«0x8F»", "0x8F: this is no number", "write 16#8F"),
    ("«.5»", ".5: this is no number", "write 0.5"),
    ("«5.»", "5.: this is no number", "write 5.0"),
    ("«1__0»", "1__0: this is no number", ""),
    ("«T#5»", "T#5: the unit is missing: \"5ms\"?", ""),
    ("«T#1.5ms»", "T#1.5ms: there are fractions of a millisecond", ""),
    ("«5kg»", "5kg: there is no unit \"kg\"; units are d, h, m, s, ms", ""),
    (
        "«DINT#5»",
        "DINT#5: there are no literals of type DINT",
        "types of literals are INT#, LREAL#, BOOL#, WORD# and TIME# or T#",
    ),
    ("«INT#40000»", "INT#40000: 40000 is no value of INT", ""),
    ("«INT#1.5»", "INT#1.5: 1.5 is no value of INT", ""),
    ("«WORD#-1»", "WORD#-1: -1 is no value of WORD", ""),
    ("«BOOL#2»", "BOOL#2: 2 is no value of BOOL", ""),
    (
        "«S5T#1s»",
        "S5T#1s: there are no literals of type S5T",
        "types of literals are INT#, LREAL#, BOOL#, WORD# and TIME# or T#",
    ),
    ("1«,»5", "a comma stands only between the inputs of a function", "decimals have a point: 1.5"),
    (
        "level > 1«,»5",
        "a comma stands only between the inputs of a function",
        "decimals have a point: 1.5",
    ),
    ("«(»a", "there is no ) for this (", ""),
    ("«(»a > b", "there is no ) for this (", ""),
    ("a«)»", "there is no ( for this )", ""),
    ("«(»(a)", "there is no ) for this (", ""),
    (
        "a «b»",
        "an operator is missing before b",
        "operators are + - * / MOD ** < > <= >= = <> AND XOR OR",
    ),
    (
        "a «5»",
        "an operator is missing before 5",
        "operators are + - * / MOD ** < > <= >= = <> AND XOR OR",
    ),
    ("«a» (b)", "there is no function a", "there are ABS, SQRT, "),
    ("2 «(»b)", "an operator is missing before (", "a product is a * b"),
    ("2«(»b)", "an operator is missing before (", "a product is a * b"),
    ("\"a\"«(»b)", "an operator is missing before (", "a product is a * b"),
    ("a «NOT» b", "an operator is missing before NOT", "write AND NOT, or a <> b"),
    ("x «:=» 3", ":= stands only behind the name of a function's input", "equality is ="),
    ("a «:=» 3", ":= stands only behind the name of a function's input", "equality is ="),
    (
        "IF «a» THEN b",
        "an operator is missing before a",
        "a choice is SEL(condition, if_false, if_true)",
    ),
    ("a «?» b : c", "? is not of this language", "a choice is SEL(condition, if_false, if_true)"),
    ("level > 1«;»", "; is not of this language", "an expression ends without ;"),
    (
        "«'»a' > 3",
        "' is not of this language",
        "a name with other characters than letters, digits, _ and . stands in double quotes",
    ),
    ("a«[»1]", "[ is not of this language", "parentheses are ( and )"),
    ("«MAXX»(a, b)", "there is no function MAXX", "did you mean MAX(IN1, IN2, …)?"),
    ("«LIM»(1, 2, 3)", "there is no function LIM", "did you mean LIMIT(MN, IN, MX)?"),
    ("«ADD»(a,b)", "there is no function ADD", "write a + b"),
    ("«FLOOR»(a)", "there is no function FLOOR", "TRUNC drops the decimals, LREAL_TO_INT rounds"),
    ("«foo»(a)", "there is no function foo", "there are ABS, SQRT, "),
    (
        "«TO_INT»(a)",
        "there is no function TO_INT",
        "the name has the type that is converted, too: LREAL_TO_INT(IN), WORD_TO_INT(IN), ",
    ),
    (
        "«REAL_TO_INT»(a)",
        "there is no function REAL_TO_INT",
        "types are BOOL, INT, WORD, TIME and LREAL: write LREAL_TO_INT(IN)",
    ),
    (
        "«WORD_TO_DINT»(state)",
        "there is no function WORD_TO_DINT",
        "types are BOOL, INT, WORD, TIME and LREAL: write WORD_TO_INT(IN)",
    ),
    (
        "«int_to_dint»(i)",
        "there is no function int_to_dint",
        "types are BOOL, INT, WORD, TIME and LREAL: write its input alone",
    ),
    (
        "«WORD_TO_LREAL»(state)",
        "there is no function WORD_TO_LREAL",
        "write INT_TO_LREAL(WORD_TO_INT(IN))",
    ),
    (
        "«LREAL_TO_WORD»(a)",
        "there is no function LREAL_TO_WORD",
        "write INT_TO_WORD(LREAL_TO_INT(IN))",
    ),
    ("«SIN» a", "the input of SIN is not in parentheses", "write SIN(a)"),
    ("1 + «sqrt» 2.0", "the input of sqrt is not in parentheses", "write SQRT(2.0)"),
    ("«LIMIT» 0, a, 10", "the input of LIMIT is not in parentheses", "write LIMIT(MN, IN, MX)"),
    (
        "a «(*» of (* the *) tank",
        "the comment that begins here has no *)",
        "comments may stand in each other, and each ends with its own *)",
    ),
    (
        "MAX «/*» a, b)",
        "the comment that begins here has no */",
        "comments may stand in each other, and each ends with its own */",
    ),
    ("a (* b *) «c»", "an operator is missing before c", "operators are "),
    ("«MAX(a)»", "MAX has at least 2 inputs, and 1 of them here", "write MAX(IN1, IN2, …)"),
    ("«MAX()»", "MAX has at least 2 inputs, and 0 of them here", "write MAX(IN1, IN2, …)"),
    ("«SQRT()»", "SQRT has 1 input, and 0 of them here", "write SQRT(IN)"),
    ("SQRT(a, «b»)", "SQRT has 1 input, and this is one more", "write SQRT(IN)"),
    ("«SEL(on, a)»", "SEL has 3 inputs, and 2 of them here", "write SEL(G, IN0, IN1)"),
    ("SEL(on, a, b, «c»)", "SEL has 3 inputs, and this is one more", "write SEL(G, IN0, IN1)"),
    ("SEL(«a», b, c)", "a is LREAL, and G of SEL takes BOOL", "compare it: a > 0"),
    (
        "SEL(G := on, «a», b)",
        "of the inputs of SEL, either all have names or none",
        "write SEL(G := …, IN0 := …, IN1 := …)",
    ),
    (
        "SEL(G := on, IN0 := a, «IN2 := b»)",
        "SEL has no input IN2",
        "write SEL(G := …, IN0 := …, IN1 := …)",
    ),
    ("«SEL(G := on, IN0 := a)»", "SEL misses its input IN1", "write SEL(G, IN0, IN1)"),
    ("LIMIT(MN := 0, «MN := 1»)", "MN is given a second time", ""),
    (
        "MUX(«a», 1, 2)",
        "a is LREAL, and K of MUX takes INT",
        "LREAL_TO_INT(a) rounds, TRUNC(a) drops the decimals",
    ),
    ("«MUX(K := 1, IN0 := 1, IN2 := 3)»", "MUX misses its input IN1", "write MUX(K, IN0, IN1, …)"),
    (
        "MUX(K:=1, «IN9999999999999 := 1»)",
        "MUX has no input IN9999999999999",
        "write MUX(K := …, IN0 := …, IN1 := …, …)",
    ),
    ("MAX(«on», on)", "on is BOOL, and MAX takes LREAL, INT or TIME", "BOOL_TO_INT(on) is 0 or 1"),
    ("MAX(«1», pause)", "1 is a number, and pause is TIME", "a TIME is written T#2s or T#500ms"),
    (
        "SEL(on, a, «pause»)",
        "a is LREAL and pause is TIME, and SEL takes values of one type",
        "TIME_TO_LREAL(pause) is its milliseconds",
    ),
    ("SQRT(«on»)", "on is BOOL, and SQRT takes LREAL", "BOOL_TO_INT(on) is 0 or 1"),
    (
        "SQRT(«pause»)",
        "pause is TIME, and SQRT takes LREAL",
        "TIME_TO_LREAL(pause) is its milliseconds",
    ),
    (
        "INT_TO_LREAL(«a»)",
        "a is LREAL, and INT_TO_LREAL takes INT",
        "LREAL_TO_INT(a) rounds, TRUNC(a) drops the decimals",
    ),
    (
        "INT_TO_WORD(«70000»)",
        "70000 does not fit INT (-32768 to 32767), and INT_TO_WORD takes INT",
        "",
    ),
    ("MAX(a,«)»", "a signal, a number or a function is missing before )", ""),
    (
        "MAX(a «b»)",
        "an operator is missing before b",
        "operators are + - * / MOD ** < > <= >= = <> AND XOR OR",
    ),
    ("MAX(«,»a)", "a signal, a number or a function is missing before ,", ""),
    ("MAX«(»a", "there is no ) for this (", ""),
    ("a «>» ", "nothing stands behind >", ""),
    ("«>» a", "a signal, a number or a function is missing before >", ""),
    ("(«)»", "a signal, a number or a function is missing before )", ""),
    ("a + «)»", "a signal, a number or a function is missing before )", ""),
    ("a & «&» b", "a signal, a number or a function is missing before &", ""),
    ("«AND» on", "a signal, a number or a function is missing before AND", ""),
    ("a «MOD»", "nothing stands behind MOD", ""),
    (
        "TRUE «FALSE»",
        "an operator is missing before FALSE",
        "operators are + - * / MOD ** < > <= >= = <> AND XOR OR",
    ),
    ("on «OR»", "nothing stands behind OR", ""),
    ("a **«*» b", "a signal, a number or a function is missing before *", ""),
    ("level «:»", ": is not of this language", "an input of a function is given by :="),
    ("«#»", "# is not of this language", "a literal has its base or type before #: 16#8200, T#2s"),
    ("«€»", "€ is not of this language", ""),
    ("a «€»", "€ is not of this language", ""),
    ("if «a»", "an operator is missing before a", "a choice is SEL(condition, if_false, if_true)"),
    ("2«(»a)", "an operator is missing before (", "a product is a * b"),
];

#[test]
fn a_mistake_has_its_place_what_is_wrong_and_the_way_out() {
    for (marked, message, help) in MISTAKES {
        let text = marked.replace(['«', '»'], "");
        let start = marked.find('«').unwrap();
        let end = marked.find('»').unwrap() - '«'.len_utf8();
        let found = mistake(&text);
        assert_eq!((found.span, &*found.message), (start..end, message), "{text}");
        let found = found.help.unwrap_or_default();
        assert!(found.starts_with(help) && found.is_empty() == help.is_empty(), "{text}: {found}");
    }
}

#[test]
fn the_steps_of_a_program_and_the_depth_of_parentheses_have_a_bound() {
    let sum = |terms: usize| ["a"; 1000][..terms].join("+");
    // Each + is a step, and a is read once. But a text has no more parts than a program has steps.
    let terms = MAX_STEPS / 2;
    let program = parse(&sum(terms)).unwrap().program(&[Lreal]).unwrap();
    assert_eq!((program.steps(), program.result()), (terms, Lreal));
    let found = mistake(&sum(terms + 1));
    assert!(found.message.contains("more than 256 steps"), "{found:?}");
    assert!(found.help.unwrap().contains("an expression of its own"));
    // The copies of MUX count too.
    let inputs = "1, ".repeat(MAX_STEPS / 2);
    let found = mistake(&format!("MUX(i, {inputs}1)"));
    assert!(found.message.contains("more than 256 steps"), "{found:?}");

    let nested = |depth| format!("{}a{}", "(".repeat(depth), ")".repeat(depth));
    assert!(parse(&nested(MAX_DEPTH)).is_ok());
    for text in [nested(MAX_DEPTH + 1), nested(1_000_000), "ABS(".repeat(1_000_000)] {
        let found = mistake(&text);
        assert!(found.message.contains("more than 64 parentheses"), "{found:?}");
        assert_eq!(&text[found.span.clone()], "(", "{found:?}");
    }
    for sign in ["-", "NOT "] {
        let found = mistake(&format!("{}a", sign.repeat(1_000_000)));
        assert!(found.message.contains("a second"), "{found:?}");
    }
}

#[test]
fn the_deepest_text_takes_little_of_a_stack() {
    // Each parenthesis stands behind operators that wait for it, from the weakest to the strongest.
    let level = "on OR on XOR on AND on = 1 < 1 + 1 * 1 ** (";
    let text = format!("{}on", level.repeat(MAX_DEPTH));
    let deep = format!("{}a{}", "ABS(-(".repeat(MAX_DEPTH / 2), "))".repeat(MAX_DEPTH / 2));
    let run = move || {
        assert!(mistake(&text).message.contains("more than 256 steps"));
        assert_eq!(parse(&deep).unwrap().program(&[Lreal]).unwrap().result(), Lreal);
    };
    let thread = std::thread::Builder::new().stack_size(512 * 1024).spawn(run).unwrap();
    thread.join().unwrap();
}

#[test]
fn a_type_that_is_not_given_is_a_mistake() {
    let found = parse("a + b").unwrap().program(&[Lreal]).unwrap_err();
    assert_eq!((found.span, &*found.message), (4..5, "the type of this signal is not given"));
}
