"""Formulas as MathML, which browsers show by themselves: no script, no font, nothing from another server.

A hook of mkdocs. It reads the LaTeX between $ or $$ that the docstrings and pages use; what it does not know stops the
build.
"""
# ruff: noqa: RUF001

import re
import unicodedata
from typing import Any
from xml.etree import ElementTree

from markdown import Markdown
from markdown.extensions import Extension
from markdown.inlinepatterns import InlineProcessor
from mkdocs.plugins import event_priority

_TOKEN = re.compile(r"\\[a-zA-Z]+\*?|\\.|[0-9]+(?:\.[0-9]+)?|[^\s]", re.DOTALL)
_LETTERS = """
alpha beta gamma delta epsilon zeta eta theta kappa lambda mu nu xi pi rho sigma tau phi chi psi omega
Omega Phi Delta Lambda Sigma
"""
_GREEK = dict(zip(_LETTERS.split(), "αβγδϵζηθκλμνξπρστϕχψωΩΦΔΛΣ", strict=True))
_SIGNS = {
    "sum": "∑",
    "int": "∫",
    "oint": "∮",
    "propto": "∝",
    "times": "×",
    "dots": "…",
    "cdot": "·",
    "pm": "±",
    "le": "≤",
    "ge": "≥",
    "perp": "⊥",
    "to": "→",
    "leftarrow": "←",
    "top": "⊤",
    "in": "∈",
    "partial": "∂",
    "ell": "ℓ",
    "|": "‖",
    "{": "{",
    "}": "}",
}
_ACCENTS = {"dot": ".", "ddot": "..", "hat": "^", "bar": "¯", "tilde": "~", "overline": "¯"}
_SPACES = {"quad": "1em", ",": "0.17em", ";": "0.28em", " ": "0.25em", "!": "0em"}
_FUNCTIONS = {"det", "exp", "sin", "cos", "arcsin", "arctan", "cot", "ln", "max", "min", "tan", "tanh"}


class _Reader:
    """Reads one formula."""

    def __init__(self, latex: str):
        self.tokens, self.at, self.latex = _TOKEN.findall(latex), 0, latex

    def peek(self) -> str:
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def take(self) -> str:
        self.at += 1
        return self.tokens[self.at - 1]

    def row(self, *ends: str) -> ElementTree.Element:
        """What comes before one of `ends`, which is not taken."""
        row = ElementTree.Element("mrow")
        while self.peek() and self.peek() not in ends:
            row.append(self.scripted())
        return row

    def scripted(self) -> ElementTree.Element:
        """One thing and what hangs on it."""
        base = ElementTree.Element("mrow") if self.peek() in ("^", "_") else self.thing()
        scripts = {}
        while self.peek() in ("^", "_", "'"):
            mark = self.take()
            scripts["^" if mark == "'" else mark] = _leaf("mo", "′") if mark == "'" else self.thing()
        if not scripts:
            return base
        tag = "msubsup" if len(scripts) == 2 else "msub" if "_" in scripts else "msup"
        element = ElementTree.Element(tag)
        element.extend([base, *(scripts[mark] for mark in "_^" if mark in scripts)])
        return element

    def thing(self) -> ElementTree.Element:
        """A letter, a number, a sign, a group, or a command with what it takes."""
        token = self.take()
        if token == "{":
            row = self.row("}")
            self.take()
            return row
        if not token.startswith("\\"):
            kind = "mn" if token[0].isdigit() else "mi" if token.isalpha() else "mo"
            return _leaf(kind, {"-": "−", "*": "∗"}.get(token, token))
        return self.command(token[1:])

    def command(self, name: str) -> ElementTree.Element:
        if name in _GREEK:
            return _leaf("mi", _GREEK[name])
        if name in _SIGNS:
            return _leaf("mo", _SIGNS[name])
        if name in _FUNCTIONS:
            return _leaf("mi", name)
        if name in _SPACES:
            return ElementTree.Element("mspace", width=_SPACES[name])
        if name in _ACCENTS:
            over = ElementTree.Element("mover")
            over.extend([self.thing(), _leaf("mo", _ACCENTS[name], stretchy="false")])
            return over
        if name in ("frac", "tfrac"):
            fraction = ElementTree.Element("mfrac")
            fraction.extend([self.thing(), self.thing()])
            return fraction
        if name == "sqrt":
            root = ElementTree.Element("msqrt")
            root.append(self.thing())
            return root
        if name in ("mathcal", "mathrm", "text"):
            inner = "".join(self.thing().itertext())
            if name == "mathcal":
                return _leaf("mi", unicodedata.lookup(f"SCRIPT CAPITAL {inner}"))
            return _leaf("mi", inner, mathvariant="normal")
        if name in ("left", "right"):
            return _leaf("mo", self.take().removeprefix("\\"))
        if name == "begin":
            return self.matrix()
        raise ValueError(f"formula {self.latex!r}: \\{name} is not known; see docs/formulas.py")

    def matrix(self) -> ElementTree.Element:
        kind = "".join(self.thing().itertext())
        table = ElementTree.Element("mtable")
        while True:
            line = ElementTree.SubElement(table, "mtr")
            while True:
                ElementTree.SubElement(line, "mtd").append(self.row("&", "\\\\", "\\end"))
                if self.peek() != "&":
                    break
                self.take()
            if self.take() == "\\end":
                self.thing()
                break
        row = ElementTree.Element("mrow")
        opening, closing = {"bmatrix": "[]", "pmatrix": "()"}[kind]
        row.extend([_leaf("mo", opening), table, _leaf("mo", closing)])
        return row


def _leaf(tag: str, text: str, **attributes: str) -> ElementTree.Element:
    element = ElementTree.Element(tag, attributes)
    element.text = text
    return element


def mathml(latex: str, block: bool = False) -> ElementTree.Element:
    """MathML of a formula. Raises ValueError for a command that is not known here."""
    math = ElementTree.Element("math", {"display": "block"} if block else {})
    math.append(_Reader(latex).row())
    return math


class _Formula(InlineProcessor):
    def handleMatch(self, m: re.Match[str], data: str) -> tuple[ElementTree.Element, int, int]:
        """Replace a formula."""
        return mathml(m[1] or m[2], block=m[1] is not None), m.start(0), m.end(0)


class Formulas(Extension):
    """Markdown with formulas between $ or $$."""

    def extendMarkdown(self, md: Markdown) -> None:
        """Look for formulas after code and before anything else."""
        pattern = r"\$\$(.+?)\$\$|(?<![\\\w$])\$(?!\s)([^$]+?)(?<!\s)\$(?!\w)"
        formula = _Formula(pattern, md)
        formula.compiled_re = re.compile(pattern, re.DOTALL)
        md.inlinePatterns.register(formula, "formula", 185)


@event_priority(100)
def on_config(config: Any) -> Any:
    """Add formulas to all pages and docstrings."""
    config["markdown_extensions"].append(Formulas())
    return config
