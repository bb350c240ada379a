"""Finds places in C sources where a small mistake could be, and writes a source that holds many of
them at once, each behind a number: `shd_mutant(N)` is true where the program runs as mutant N.

A mistake is made in an expression (a comparison, a sign, a constant, a margin, min for max, a
condition turned) or is a statement left out. A mutant's name is its file, its line's text, what
becomes what, and which of the equal ones it is: it outlives moved lines.
"""

import hashlib
import re
from dataclasses import dataclass, field

TOKEN = re.compile(r"""
    (?P<space>\s+|/\*.*?\*/|//[^\n]*|(?<![^\n])[ \t]*\#(?:\\\n|/\*.*?\*/|[^\n])*)
  | (?P<text>"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*')
  | (?P<number>(?:0[xX][\da-fA-F.]+(?:[pP][+-]?\d+)?|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)[uUlLfF]*)
  | (?P<name>[A-Za-z_]\w*)
  | (?P<sign><<=|>>=|\.\.\.|->|\+\+|--|<<|>>|<=|>=|==|!=|&&|\|\||[-+*/%&|^]=|.)
""", re.X | re.S)
# A margin by its name: a constant of floats, as headers define or declare it.
MARGIN = re.compile(r"(?:#define|static const (?:double|float)) +([A-Z][A-Z_0-9]+) *=? *\(?[-\d.]")

SWAPS = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "&&": "||",
         "||": "&&"}
NAMES = {"true": "false", "false": "true", "fmax": "fmin", "fmin": "fmax", "fabs": "",
         "shd_larger": "shd_smaller", "shd_smaller": "shd_larger", "sin": "cos", "cos": "sin",
         "floor": "ceil", "ceil": "floor", "sqrt": "0.7 * sqrt", "fmaxf": "fminf",
         "shd_cosine_less": "shd_cosine_more", "shd_cosine_more": "shd_cosine_less"}
KEYWORDS = {"return", "if", "else", "for", "while", "do", "switch", "case", "default", "break",
            "continue", "goto", "static", "typedef", "struct", "enum", "const", "union", "sizeof",
            "_Static_assert", "_Alignas", "va_list", "va_start", "va_end", "extern", "register"}
OPEN, CLOSE = {"(": ")", "[": "]", "{": "}"}, {")", "]", "}"}


@dataclass
class Mutant:
    file: str
    line: str
    change: str
    offset: int  # of the region in the source
    end: int
    text: str | None  # the region as it becomes; None: a statement that is left out
    same: int = 0
    number: int = 0
    lines: tuple = field(default=(0, 0))

    @property
    def name(self):
        return f"{self.file} | {self.line} | {self.change}" + (f" | {self.same}" if self.same else "")

    @property
    def rank(self):
        """A fixed shuffle of all mutants."""
        return hashlib.sha256(self.name.encode()).hexdigest()


class Source:
    def __init__(self, file, text, margins):
        self.file, self.text, self.margins = file, text, margins
        self.tokens = [(m.lastgroup, m.group(), m.start(), m.end())
                       for m in TOKEN.finditer(text) if m.lastgroup != "space"]
        self.mutants = []

    def word(self, i):
        return self.tokens[i][1] if 0 <= i < len(self.tokens) else ""

    def closing(self, i):
        """The token that closes the bracket at token i."""
        depth = 0
        for k in range(i, len(self.tokens)):
            word = self.word(k)
            depth += (word in OPEN) - (word in CLOSE)
            if depth == 0:
                return k
        return len(self.tokens) - 1

    def end_of(self, i, ends):
        """The first token from i on that ends an expression: one of `ends`, or a bracket that was
        not opened in it."""
        depth = 0
        for k in range(i, len(self.tokens)):
            word = self.word(k)
            if depth == 0 and (word in ends or word in CLOSE):
                return k
            depth += (word in OPEN) - (word in CLOSE)
        return len(self.tokens)

    def add(self, first, end, text, change, at):
        start = self.tokens[at][2]
        begin = self.text.rfind("\n", 0, start) + 1
        line = self.text[begin:self.text.find("\n", start)].strip()
        self.mutants.append(Mutant(self.file, line, change, self.tokens[first][2],
                                   self.tokens[end - 1][3], text))

    def changes(self, k):
        """What may become of token k."""
        kind, word = self.tokens[k][:2]
        before, after = self.tokens[k - 1], self.word(k + 1)
        operand = before[0] in ("name", "number") and before[1] not in KEYWORDS
        binary = operand or before[1] in ")]"
        if kind == "sign":
            if word in SWAPS:
                yield SWAPS[word]
            elif word in "+-" and binary and after != ")":
                yield "-" if word == "+" else "+"
            elif word == "*" and (operand or before[1] == "]"):
                yield "/"
            elif word == "/":
                yield "*"
            elif word == "!":
                yield ""
        elif kind == "number" and re.fullmatch(r"\d+[uU]?", word):
            yield str(int(word.rstrip("uU")) + 1)
            if int(word.rstrip("uU")) > 1:
                yield str(int(word.rstrip("uU")) - 1)
        elif kind == "number":
            yield f"({word} * 0.99)"
            yield f"({word} * 2)"
        elif word in NAMES and (after == "(" or word in ("true", "false")):
            yield NAMES[word]
        elif word in self.margins:
            yield f"({word} * 0.1)"
            yield f"({word} * 10)"

    def expression(self, first, end):
        if first >= end or any(self.word(k) in ("{", "_Generic") for k in range(first, end)):
            return
        begin, stop = self.tokens[first][2], self.tokens[end - 1][3]
        for k in range(first, end):
            if self.word(k - 1) in ("sizeof", ".", "->"):
                continue
            for other in self.changes(k):
                at, to = self.tokens[k][2:]
                text = self.text[begin:at] + other + self.text[to:stop]
                self.add(first, end, text, f"{self.word(k)} -> {other or 'nothing'}", k)

    def statement(self, i):
        """A call or an assignment that begins at token i may be left out."""
        word, after = self.word(i), self.word(i + 1)
        assigns = ("(", "=", "[", ".", "->", "++", "--", "+=", "-=", "*=", "/=", "|=", "&=", "^=")
        if self.tokens[i][0] != "name" and word not in ("*", "++", "--"):
            return
        if word in KEYWORDS or self.tokens[i][0] == "name" and after not in assigns:
            return
        end = self.end_of(i, {";"})
        words = [self.word(k) for k in range(i, end)]
        if self.word(end) != ";" or "{" in words or word == "*" and "=" not in words:
            return
        self.add(i, end + 1, None, "left out", i)

    def body(self, i):
        """Walks the function body that opens at token i."""
        end = self.closing(i)
        k = i + 1
        starts = {";", "{", "}", "else"}
        heads = set()  # tokens that close the head of an if, a for or a while
        while k < end:
            word, before = self.word(k), self.word(k - 1)
            if word in ("static", "_Static_assert"):
                k = self.end_of(k, {";"})
            elif word == "enum":
                k += 1
                if self.word(k) != "{":
                    k += 1
                if self.word(k) == "{":
                    k = self.closing(k)
            elif word in ("if", "while", "switch") and self.word(k + 1) == "(":
                close = self.closing(k + 1)
                heads.add(close)
                if word != "switch":
                    self.expression(k + 2, close)
            elif word == "for":
                close = self.closing(k + 1)
                heads.add(close)
                first = self.end_of(k + 2, {";"})
                self.expression(first + 1, self.end_of(first + 1, {";"}))
            elif word == "return":
                self.expression(k + 1, self.end_of(k + 1, {";"}))
            elif word == "=":
                self.expression(k + 1, self.end_of(k + 1, {";", ","}))
            if before in starts or k - 1 in heads:
                if not any(self.word(h) == "for" for h in (k - 2, k - 1)):
                    self.statement(k)
            k += 1
        return end

    def find(self):
        depth, k = 0, 0
        while k < len(self.tokens):
            word = self.word(k)
            if word == "{" and depth == 0 and self.word(k - 1) == ")":
                k = self.body(k)
            elif word == "{":
                k = self.closing(k)
            k += 1
        seen = {}
        for mutant in self.mutants:
            key = mutant.name
            mutant.same = seen.get(key, 0)
            seen[key] = mutant.same + 1
            mutant.lines = (self.text.count("\n", 0, mutant.offset) + 1,
                            self.text.count("\n", 0, mutant.end) + 1)
        return self.mutants


def margins_of(texts):
    return {name for text in texts for name in MARGIN.findall(text)}


def mutants_of(file, text, margins):
    return Source(file, text, margins).find()


def rewritten(text, mutants):
    """The source with all of these mutants in it, on the same lines."""
    inserts = []  # (offset, order, text)
    regions = {}
    for mutant in mutants:
        if mutant.text is None:
            inserts.append((mutant.offset, 0, f"{{ if (!shd_mutant({mutant.number})) {{ "))
            inserts.append((mutant.end, 2, " } }"))
        else:
            regions.setdefault((mutant.offset, mutant.end), []).append(mutant)
    for (offset, end), group in regions.items():
        ways = "".join(f"shd_mutant({m.number}) ? ({' '.join(m.text.split())}) : "
                       for m in group)
        inserts.append((offset, 1, f"({ways}("))
        inserts.append((end, 1, "))"))
    for offset, _, piece in sorted(inserts, key=lambda p: (-p[0], -p[1])):
        text = text[:offset] + piece + text[offset:]
    return text
