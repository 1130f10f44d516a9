#!/usr/bin/env python3
"""Random expressions, and what they are worth by the rules of IEC 61131-3, edition 3.

    python3 crates/blocks/tests/oracles/expressions/expressions.py            writes expressions.txt beside this file
    python3 crates/blocks/tests/oracles/expressions/expressions.py --show N   prints the first N lines of it
    python3 crates/blocks/tests/oracles/expressions/expressions.py --check    says whether it is what it would write

A line is a text, and one or two runs of it: the values of its names in the order in which they first appear, and the
type and bits of the result, or ! and the status word. A text whose types do not fit has ? instead of runs.

Written from the standard's tables of operators, types and functions, and from the decisions in
docs/expressions.md where the standard leaves them to the implementer; not from the Rust. Python's own operators are
used for LREAL only (+ - * / of binary64), as its integer division, MOD and precedence are others.
"""

import math
import os
import random
import struct
import sys
from fractions import Fraction

SEED, TEXTS, WRONG = 611313, 2000, 250

LREAL, INT, BOOL, TIME, WORD, WHOLE = "LREAL", "INT", "BOOL", "TIME", "WORD", "WHOLE"
RANGE = {INT: (-32768, 32767), TIME: (-(2**31), 2**31 - 1), WORD: (0, 65535), BOOL: (0, 1)}
NAMES = {
    "x": LREAL, "y": LREAL, "tank.level": LREAL, "pump-1.y@prev": LREAL,
    "i": INT, "j": INT, "axis.0.n": INT,
    "p": BOOL, "q": BOOL, "AND": BOOL,
    "t": TIME, "_pause": TIME,
    "w": WORD, "state": WORD,
}

# Table of operators: what binds first has the higher number.
PRECEDENCE = {
    "OR": 1, "XOR": 2, "AND": 3, "&": 3, "=": 4, "<>": 4, "<": 5, ">": 5, "<=": 5, ">=": 5,
    "+": 6, "-": 6, "*": 7, "/": 7, "MOD": 7, "**": 8,
}
UNARY, PRIMARY = 9, 10

DIVISION, DOMAIN, CONVERSION, SELECTION, NOT_FINITE = 0x8210, 0x8211, 0x8212, 0x8213, 0x8F00


class WrongType(Exception):
    pass


class Error(Exception):
    """A value that does not exist, with its status word."""

    def __init__(self, status):
        self.status = status


class Unsure(Exception):
    """A value that this oracle cannot know to the last bit."""


# Types -------------------------------------------------------------------------------------------------------------

def literal_value(node):
    """The value of a whole literal with its sign."""
    if node[0] == "literal":
        return node[3]
    return literal_value(node[1]) * (-1 if node[0] == "neg" else 1)


def fits(of, value):
    low, high = RANGE[of]
    return low <= value <= high


def common(nodes, allowed):
    """The type that nodes have in common. A whole literal is what it meets; INT becomes LREAL."""
    types = [type_of(node) for node in nodes]
    typed = [of for of in types if of != WHOLE]
    wholes = [literal_value(node) for node, of in zip(nodes, types) if of == WHOLE]
    for of in typed:
        if of not in allowed:
            raise WrongType()
    if not typed:
        of = INT if all(fits(INT, value) for value in wholes) else LREAL
    elif len(set(typed)) == 1:
        of = typed[0]
    elif set(typed) == {INT, LREAL}:
        of = LREAL
    else:
        raise WrongType()
    if of not in allowed:
        raise WrongType()
    for value in wholes:
        if of in (BOOL, TIME) or (of in (INT, WORD) and not fits(of, value)):
            raise WrongType()
    return of


def takes(node, of):
    """That a node can stand where a type is needed."""
    found = type_of(node)
    if found == WHOLE:
        if of == LREAL or (of in (INT, WORD) and fits(of, literal_value(node))):
            return
        raise WrongType()
    if found != of and (found, of) != (INT, LREAL):
        raise WrongType()


CONVERSIONS = {
    "TRUNC": (LREAL, INT), "LREAL_TRUNC_INT": (LREAL, INT), "LREAL_TO_INT": (LREAL, INT),
    "LREAL_TO_TIME": (LREAL, TIME), "INT_TO_LREAL": (INT, LREAL), "INT_TO_TIME": (INT, TIME),
    "INT_TO_WORD": (INT, WORD), "WORD_TO_INT": (WORD, INT), "TIME_TO_LREAL": (TIME, LREAL),
    "TIME_TO_INT": (TIME, INT), "BOOL_TO_INT": (BOOL, INT), "BOOL_TO_LREAL": (BOOL, LREAL),
    "BOOL_TO_WORD": (BOOL, WORD),
}
QUANTITIES, NUMBERS, BITS = (LREAL, INT, TIME), (LREAL, INT), (BOOL, WORD)
ALL = (LREAL, INT, BOOL, TIME, WORD)


def type_of(node):
    kind = node[0]
    if kind == "literal":
        return node[2]
    if kind == "name":
        return NAMES[node[1]]
    if kind in ("neg", "pos"):
        # A sign right before a whole number is part of it.
        if node[1][0] == "literal" and node[1][2] == WHOLE:
            return WHOLE
        return common([node[1]], QUANTITIES)
    if kind == "not":
        return common([node[1]], BITS)
    if kind == "call":
        return type_of_call(node[1], node[2])
    _, operator, a, b = node
    if operator in ("AND", "&", "OR", "XOR"):
        return common([a, b], BITS)
    if operator in ("=", "<>"):
        common([a, b], ALL)
        return BOOL
    if operator in ("<", ">", "<=", ">="):
        common([a, b], QUANTITIES)
        return BOOL
    if operator in ("+", "-"):
        return common([a, b], QUANTITIES)
    if operator == "MOD":
        takes(a, INT), takes(b, INT)
        return INT
    if operator == "**":
        takes(a, LREAL), takes(b, LREAL)
        return LREAL
    if type_of(a) == TIME:
        common([b], NUMBERS)
        return TIME
    return common([a, b], NUMBERS)


def type_of_call(name, inputs):
    if name in CONVERSIONS:
        takes(inputs[0], CONVERSIONS[name][0])
        return CONVERSIONS[name][1]
    if name == "SQRT":
        takes(inputs[0], LREAL)
        return LREAL
    if name == "EXPT":
        takes(inputs[0], LREAL), takes(inputs[1], LREAL)
        return LREAL
    if name == "ABS":
        return common(inputs, NUMBERS)
    if name in ("MAX", "MIN", "LIMIT"):
        return common(inputs, QUANTITIES)
    takes(inputs[0], BOOL if name == "SEL" else INT)
    return common(inputs[1:], ALL)


# Values ------------------------------------------------------------------------------------------------------------

def finite(value):
    if math.isinf(value) or math.isnan(value):
        raise Error(NOT_FINITE)
    return value


def in_range(of, value):
    if not fits(of, value):
        raise Error(CONVERSION)
    return value


def wrap(value):
    return (value + 32768) % 65536 - 32768


def truncated(a, b):
    quotient = abs(a) // abs(b)
    return quotient if (a < 0) == (b < 0) else -quotient


def nearest(value, of):
    """To the nearest whole number, of two to the even one."""
    if math.isinf(value):
        raise Error(CONVERSION)
    return in_range(of, round(value))


def power(base, exponent):
    if base == 0 and exponent < 0:
        raise Error(DIVISION)
    if base < 0 and exponent != math.floor(exponent):
        raise Error(DOMAIN)
    if exponent == 0:
        return 1.0
    if base == 0 or abs(base) > 1000 or abs(exponent) > 10 or exponent != math.floor(exponent):
        raise Unsure()
    exact = Fraction(base) ** int(exponent)
    if Fraction(float(exact)) != exact:
        raise Unsure()
    return float(exact)


def value_of(node, of, values):
    """The value of a node as one of a type. Raises the first error of its operands, from left to right."""
    own = type_of(node)
    if own == WHOLE:
        return float(literal_value(node)) if of == LREAL else literal_value(node)
    value = own_value(node, own, values)
    return float(value) if own != LREAL and of == LREAL else value


def own_value(node, own, values):
    kind = node[0]
    if kind == "literal":
        return node[3]
    if kind == "name":
        value = values[node[1]]
        return finite(value) if own == LREAL else value
    if kind == "pos":
        return value_of(node[1], own, values)
    if kind == "neg":
        a = value_of(node[1], own, values)
        return {LREAL: lambda: -a, INT: lambda: wrap(-a), TIME: lambda: in_range(TIME, -a)}[own]()
    if kind == "not":
        a = value_of(node[1], own, values)
        return 1 - a if own == BOOL else 65535 - a
    if kind == "call":
        return call(node[1], node[2], own, values)
    _, operator, left, right = node
    if own == TIME and operator in ("*", "/"):
        a = value_of(left, TIME, values)
        by = common([right], NUMBERS)
        b = value_of(right, by, values)
        if operator == "*":
            return nearest(float(a) * b, TIME) if by == LREAL else in_range(TIME, a * b)
        if b == 0:
            raise Error(DIVISION)
        return nearest(float(a) / b, TIME) if by == LREAL else in_range(TIME, truncated(a, b))
    if operator == "MOD":
        of = INT
    elif operator == "**":
        of = LREAL
    else:
        of = common([left, right], ALL)
    a, b = value_of(left, of, values), value_of(right, of, values)
    if operator in ("=", "<>", "<", ">", "<=", ">="):
        return int({
            "=": a == b, "<>": a != b, "<": a < b, ">": a > b, "<=": a <= b, ">=": a >= b,
        }[operator])
    if operator in ("AND", "&"):
        return a & b
    if operator == "OR":
        return a | b
    if operator == "XOR":
        return a ^ b
    if operator == "**":
        return power(a, b)
    if operator == "MOD":
        return 0 if b == 0 else wrap(a - truncated(a, b) * b)
    if operator == "/":
        if b == 0:
            raise Error(DIVISION)
        return finite(a / b) if of == LREAL else wrap(truncated(a, b))
    result = {"+": lambda: a + b, "-": lambda: a - b, "*": lambda: a * b}[operator]()
    return {LREAL: lambda: finite(result), INT: lambda: wrap(result),
            TIME: lambda: in_range(TIME, result)}[of]()


def call(name, inputs, own, values):
    if name in CONVERSIONS:
        a = value_of(inputs[0], CONVERSIONS[name][0], values)
        if name in ("TRUNC", "LREAL_TRUNC_INT"):
            return in_range(INT, math.trunc(a))
        if name in ("LREAL_TO_INT", "LREAL_TO_TIME"):
            return nearest(a, own)
        if name == "TIME_TO_INT":
            return in_range(INT, a)
        if name == "INT_TO_WORD":
            return a % 65536
        if name == "WORD_TO_INT":
            return wrap(a)
        return float(a) if own == LREAL else a
    if name == "SEL":
        chosen = inputs[2] if value_of(inputs[0], BOOL, values) else inputs[1]
        return value_of(chosen, own, values)
    if name == "MUX":
        k = value_of(inputs[0], INT, values)
        if not 0 <= k < len(inputs) - 1:
            raise Error(SELECTION)
        return value_of(inputs[1 + k], own, values)
    of = LREAL if name in ("SQRT", "EXPT") else own
    given = [value_of(node, of, values) for node in inputs]
    if name == "SQRT":
        if given[0] < 0:
            raise Error(DOMAIN)
        return math.sqrt(given[0])
    if name == "EXPT":
        return power(*given)
    if name == "ABS":
        return abs(given[0]) if own == LREAL else wrap(abs(given[0]))
    larger = lambda a, b: b if b > a else a
    smaller = lambda a, b: b if b < a else a
    if name == "LIMIT":
        low, value, high = given
        return smaller(larger(low, value), high)
    result = given[0]
    for other in given[1:]:
        result = (larger if name == "MAX" else smaller)(result, other)
    return result


# Texts -------------------------------------------------------------------------------------------------------------

FORMAL = {"SQRT": ["IN"], "ABS": ["IN"], "EXPT": ["IN1", "IN2"], "LIMIT": ["MN", "IN", "MX"],
          "SEL": ["G", "IN0", "IN1"]}


def formal_names(name, count):
    if name in FORMAL:
        return FORMAL[name]
    if name == "MUX":
        return ["K"] + ["IN%d" % at for at in range(count - 1)]
    return ["IN"] if name in CONVERSIONS else ["IN%d" % (at + 1) for at in range(count)]


def in_any_case(word, draw):
    return draw.choice([word, word, word.lower(), word.capitalize()])


def written(node, draw):
    """The text of a node, and how strongly it binds."""
    kind = node[0]
    if kind == "literal":
        return node[1], PRIMARY
    if kind == "name":
        name = node[1]
        bare = all(c.isalnum() or c in "_." for c in name) and name != "AND"
        return (name if bare and draw.random() < 0.9 else '"%s"' % name), PRIMARY
    if kind in ("neg", "pos", "not"):
        sign = {"neg": "-", "pos": "+", "not": in_any_case("NOT", draw) + " "}[kind]
        return sign + at_least(node[1], PRIMARY, draw), UNARY
    if kind == "call":
        texts = [written(inner, draw)[0] for inner in node[2]]
        if draw.random() < 0.3:
            names = formal_names(node[1], len(texts))
            texts = ["%s := %s" % (in_any_case(it, draw), text) for it, text in zip(names, texts)]
            draw.shuffle(texts)
        comma = draw.choice([", ", ","])
        return "%s(%s)" % (in_any_case(node[1], draw), comma.join(texts)), PRIMARY
    _, operator, left, right = node
    own = PRECEDENCE[operator]
    # All operators group from the left.
    left, right = at_least(left, own, draw), at_least(right, own + 1, draw)
    is_word = operator.isalpha()
    space = " " if is_word or draw.random() < 0.7 else ""
    return left + space + (in_any_case(operator, draw) if is_word else operator) + space + right, own


def at_least(node, least, draw):
    text, binds = written(node, draw)
    is_literal = node[0] == "literal"
    needless = not is_literal and draw.random() < 0.08
    return "(%s)" % text if binds < least or needless else text


def names_in(node, found):
    if node[0] == "name" and node[1] not in found:
        found.append(node[1])
    for part in node[1:]:
        if isinstance(part, tuple):
            names_in(part, found)
        elif isinstance(part, list):
            for inner in part:
                names_in(inner, found)
    return found


def names_by_place(text, names):
    """Names in the order in which they stand in a text, as inputs with names may stand in any order."""
    found, at = [], 0
    while at < len(text):
        c = text[at]
        if c == '"':
            end = text.index('"', at + 1)
            word, at = text[at + 1:end], end + 1
        elif c.isalnum() or c == "_":
            end = at
            while end < len(text) and (text[end].isalnum() or text[end] in "_.#"):
                end += 1
            word, at = text[at:end], end
            rest = text[at:].lstrip()
            if rest.startswith((":=", "(")) or word in PRECEDENCE:
                continue
        else:
            at += 1
            continue
        if word in names and word not in found:
            found.append(word)
    return found


# Drawing -----------------------------------------------------------------------------------------------------------

def whole(draw):
    value = draw.choice([0, 1, 2, 3, 5, 7, 10, 100, 255, 1000, 32767, 40000, 33280])
    return ("literal", draw.choice(["%d" % value] * 4 + ["16#%X" % value, "2#%s" % bin(value)[2:]]),
            WHOLE, value)


def literal(of, draw):
    if of == INT and draw.random() < 0.8:
        return whole(draw)
    if of == INT:
        value = draw.choice([0, 1, 7, -5, 32767, -32768])
        return ("literal", "INT#%d" % value, INT, value)
    if of == LREAL:
        text = draw.choice(["0.0", "1.0", "0.5", "2.5", "3.0", "0.1", "1e-3", "1_0.25", "1e300", "LREAL#4", "7.0E2"])
        return ("literal", text, LREAL, float(text.replace("_", "").replace("LREAL#", "")))
    if of == BOOL:
        text, value = draw.choice([("TRUE", 1), ("false", 0), ("BOOL#1", 1), ("True", 1)])
        return ("literal", text, BOOL, value)
    if of == TIME:
        text, value = draw.choice([
            ("T#2s", 2000), ("T#1m30s", 90000), ("TIME#-1.5s", -1500), ("t#10ms", 10), ("500ms", 500),
            ("T#1d_2h", 93600000), ("T#24d20h31m23s647ms", 2**31 - 1), ("T#0s", 0),
        ])
        return ("literal", text, TIME, value)
    value = draw.choice([0, 1, 0x8200, 0xFFFF, 0x00FF, 0x7FFF])
    return ("literal", draw.choice(["WORD#16#%X" % value, "WORD#%d" % value]), WORD, value)


def drawn(of, depth, draw):
    """A node that is likely to be of a type."""
    again = lambda other=of: drawn(other, depth - 1, draw)
    if depth == 0 or draw.random() < 0.12:
        if draw.random() < 0.65:
            return ("name", draw.choice([name for name, type_ in NAMES.items() if type_ == of]))
        return literal(of, draw)
    number = lambda: again(draw.choice([LREAL, LREAL, INT]) if of == LREAL else of)
    choice = draw.random()
    if choice < 0.08:
        return ("call", "SEL", [again(BOOL), number(), number()])
    if choice < 0.13:
        k = draw.choice([again(INT), ("literal", "1", WHOLE, 1)])
        return ("call", "MUX", [k] + [number() for _ in range(draw.randint(2, 4))])
    if of in QUANTITIES and choice < 0.22:
        name, least, most = draw.choice([("MAX", 2, 4), ("MIN", 2, 4), ("LIMIT", 3, 3)])
        return ("call", name, [number() for _ in range(draw.randint(least, most))])
    if choice < 0.34:
        name = draw.choice([name for name, it in CONVERSIONS.items() if it[1] == of] or [None])
        if name:
            return ("call", name, [again(CONVERSIONS[name][0])])
    if of == BOOL:
        if choice < 0.45:
            return ("not", again())
        if choice < 0.7:
            return ("binary", draw.choice(["AND", "&", "OR", "XOR", "=", "<>"]), again(), again())
        other = draw.choice([LREAL, INT, TIME])
        operator = draw.choice(["<", ">", "<=", ">=", "=", "<>"])
        if draw.random() < 0.15:
            other, operator = WORD, draw.choice(["=", "<>"])
        return ("binary", operator, again(other), again(other))
    if of == WORD:
        if choice < 0.5:
            return ("not", again())
        return ("binary", draw.choice(["AND", "OR", "XOR"]), again(), again())
    if choice < 0.42:
        return (draw.choice(["neg", "neg", "pos"]), again())
    if of == TIME:
        if choice < 0.7:
            return ("binary", draw.choice(["+", "-"]), again(), again())
        return ("binary", draw.choice(["*", "/"]), again(), again(draw.choice([INT, LREAL])))
    if choice < 0.46:
        return ("call", "ABS", [again()])
    if of == LREAL and choice < 0.52:
        return ("call", "SQRT", [number()])
    if of == LREAL and choice < 0.58:
        base, exponent = draw.choice([whole(draw), again()]), draw.choice([whole(draw), again(INT)])
        return draw.choice([("call", "EXPT", [base, exponent]), ("binary", "**", base, exponent)])
    operators = ["+", "-", "*", "/"] + (["MOD"] if of == INT else [])
    return ("binary", draw.choice(operators), number(), number())


def value(of, draw):
    if of == LREAL:
        if draw.random() < 0.05:
            return draw.choice([float("nan"), float("inf"), float("-inf"), 1e308, -1e308, 5e-324, -0.0])
        return draw.choice([
            float(draw.randint(-5, 12)), draw.randint(-40, 40) / 2, draw.uniform(-100, 100), draw.uniform(0, 1),
        ])
    if of == INT:
        return draw.choice([draw.randint(-6, 12), draw.randint(-6, 12), draw.randint(-32768, 32767), -32768, 32767])
    if of == BOOL:
        return draw.randint(0, 1)
    if of == TIME:
        return draw.choice([draw.randint(-3000, 90000), draw.randint(0, 500), draw.randint(-(2**31), 2**31 - 1)])
    return draw.choice([0, 0x8200, 0x8F00, draw.randint(0, 65535), 0xFFFF])


def bits(number):
    return "%016x" % struct.unpack("<Q", struct.pack("<d", float(number)))[0]


def result_of(node, values):
    of = type_of(node)
    if of == WHOLE:
        of = INT if fits(INT, literal_value(node)) else LREAL
    try:
        return "%s %s" % (of, bits(value_of(node, of, values)))
    except Error as error:
        return "!%04X" % error.status


def lines():
    draw = random.Random(SEED)
    right, wrong, known = 0, 0, set()
    while right < TEXTS or wrong < WRONG:
        node = drawn(draw.choice(ALL), draw.randint(1, 4), draw)
        text = written(node, draw)[0]
        if len(text) > 120 or text in known or "|" in text:
            continue
        try:
            type_of(node)
        except WrongType:
            if wrong < WRONG:
                wrong += 1
                known.add(text)
                yield text + "|?"
            continue
        if right >= TEXTS:
            continue
        names = names_by_place(text, names_in(node, []))
        try:
            runs = []
            for _ in range(2 if names else 1):
                values = {name: value(NAMES[name], draw) for name in names}
                shown = " ".join(repr(values[name]) for name in names)
                runs.append("%s > %s" % (shown, result_of(node, values)))
        except Unsure:
            continue
        right += 1
        known.add(text)
        yield "|".join([text] + runs)


def main():
    if "--show" in sys.argv:
        for _, line in zip(range(int(sys.argv[-1])), lines()):
            print(line)
        return
    path = os.path.join(os.path.dirname(os.path.abspath(__file__)), "expressions.txt")
    made = "".join(line + "\n" for line in lines())
    if "--check" in sys.argv:
        with open(path, encoding="utf-8") as file:
            sys.exit(0 if file.read() == made else path + " is not what this oracle makes")
    with open(path, "w", encoding="utf-8", newline="\n") as file:
        file.write(made)


main()
