"""Hooks of the documentation's build: pages in the navigation, and tables made from the code."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from real_bench.cli import cli

HOW_TO = "How to"
LIMITS = {
    "gt": "above",
    "ge": "at least",
    "lt": "below",
    "le": "at most",
    "min_length": "length at least",
    "max_length": "length at most",
}
NOT_GIVEN = frozenset({"folder"})
"""Fields that no user gives."""
HELP = "<!-- help of every command -->"
TABLE = re.compile(r"<!-- keys of ([\w.]+) -->")


def on_config(config: Any) -> Any:
    """Put pages that the navigation does not name at the end of the how-to pages."""
    folder = Path(config.docs_dir)
    named = set(_pages(config.nav))
    more = sorted(page.name for page in folder.glob("*.md") if page.name not in named)
    for section in config.nav:
        if HOW_TO in section:
            section[HOW_TO] += more
    return config


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Write the keys of a record, and the help of every command, where a page asks for them."""
    made = TABLE.sub(lambda asked: keys_of(_record(asked[1])), markdown)
    return made.replace(HELP, "\n".join(_help(cli, _context())))


def on_page_content(html: str, **_: Any) -> str:
    """Take the marks of reStructuredText out of what docstrings say."""
    return re.sub(r":(?:class|meth|func|mod|attr):(?=<)", "", html).replace("<p>::</p>", "")


def _context() -> click.Context:
    return click.Context(cli, info_name="realbench", **cli.context_settings)


def _help(command: click.Command, context: click.Context) -> Iterator[str]:
    """What ``--help`` prints, of a command and those below it, each below a heading."""
    yield f"## {context.command_path}\n\n```text\n{command.get_help(context)}\n```\n"
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            below = command.get_command(context, name)
            assert below is not None
            yield from _help(below, click.Context(below, info_name=name, parent=context))


def keys_of(record: type[BaseModel]) -> str:
    """A table of all that can be set in a record and those within it, dotted."""
    rows = ["| key | what it may be | by default | what it is |", "|---|---|---|---|"]
    for name, field, meaning in _fields(record):
        default = (
            "" if field.is_required() else _plain(field.get_default(call_default_factory=True))
        )
        kind = f"`{_kind(field)}`".replace("|", "or")
        rows.append(f"| `{name}` | {kind} | {f'`{default}`' if default else ''} | {meaning} |")
    return "\n".join(rows)


def _fields(record: type[BaseModel], prefix: str = "") -> Iterator[tuple[str, FieldInfo, str]]:
    meanings = dict(_meanings(record))
    for name, field in record.model_fields.items():
        if name in NOT_GIVEN and field.annotation is Path:
            continue
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            yield from _fields(field.annotation, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", field, meanings.get(name, "")


def _meanings(record: type[BaseModel]) -> Iterator[tuple[str, str]]:
    """What docstrings say of attributes; ``a, b: text`` is of both."""
    for each in reversed(record.__mro__):
        _, _, told = inspect.cleandoc(each.__doc__ or "").partition("Attributes:\n")
        for names, text in re.findall(r"^    ([\w, ]+): (.*(?:\n      .*)*)", told, re.MULTILINE):
            for name in names.split(", "):
                yield name, " ".join(text.split()).replace("|", "or")


def _kind(field: FieldInfo) -> str:
    """A field's type and limits, as a user may read them."""
    annotation = field.annotation
    kind = annotation.__name__ if isinstance(annotation, type) else str(annotation)
    kind = re.sub(r"\b[A-Za-z_][\w.]*\.(?=[A-Za-z])", "", kind)
    kind = re.sub(r"Annotated\[(\w+), FieldInfo\(.*?\)\]\)\]", r"\1", kind)
    told = [(name, getattr(limit, name, None)) for limit in field.metadata for name in LIMITS]
    limits = [f"{LIMITS[name]} {value}" for name, value in told if value not in (None, 2**63)]
    return ", ".join([kind, *limits])


def _plain(value: Any) -> str:
    return "" if value in ("", None) else str(value)


def _record(name: str) -> type[BaseModel]:
    module, _, record = name.rpartition(".")
    found: type[BaseModel] = getattr(__import__(module, fromlist=[record]), record)
    return found


def _pages(nav: Any) -> list[str]:
    """Every page that a part of the navigation names."""
    if isinstance(nav, str):
        return [nav]
    parts = nav.values() if isinstance(nav, dict) else nav
    return [page for part in parts for page in _pages(part)]
