"""Strangers' text, made safe for one-line messages, terminals and Markdown.

A controller, its name and its errors, settings, results, recordings and experiments may all come
from strangers. HTML is escaped by its template, XML by its library.
"""

from __future__ import annotations

import re

MAX_LENGTH = 80

_MARKS = re.compile(
    r"([\\`*\[\]<>&|~#!@$^{}]|(?<![a-z0-9])_|_(?![a-z0-9]))|(?<=[:/])(?=/)|(?<=www)(?=\.)",
    re.IGNORECASE,
)
"""What begins markup, a table cell, an address or a name that GitHub notifies. An underscore
within a word is harmless, and so are round brackets without square ones."""
_BEGINNINGS = re.compile(r"^(\d*)(?=[-+.)](?:\s|$)|[-=]+\s*$)")
"""What makes a line a list item, or the line above it a heading."""


def quoted(text: str, longest: int = MAX_LENGTH) -> str:
    """A text as one short line, without control characters."""
    short = text if len(text) <= longest else text[: longest - 3] + "..."
    return printable(short).replace("\n", "?").replace("\t", "?")


def printable(text: str) -> str:
    """A text without control characters, except newlines and tabs."""
    if text.isprintable():
        return text
    return "".join(letter if letter.isprintable() or letter in "\n\t" else "?" for letter in text)


def encodable(text: str) -> str:
    """A text in which what is not UTF-8 is a question mark."""
    return text.encode(errors="replace").decode()


def one_line(value: object) -> str:
    """A text, or that of an error, on one line."""
    return " ".join(str(value).split())


def markdown(text: str) -> str:
    """A text as one line that Markdown shows literally."""
    line = printable(one_line(text))
    return _BEGINNINGS.sub(r"\1\\", _MARKS.sub(lambda mark: "\\" + mark[0], line))
