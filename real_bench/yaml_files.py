"""YAML as plain data, from files that may come from strangers, with every fault in one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from real_bench.errors import RealBenchError

MAX_LETTERS = 50_000


class _Loader(yaml.SafeLoader):
    """Reads no aliases: with these, a hundred bytes describe more than any memory holds."""

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            raise yaml.YAMLError("aliases (*name) are not read: write it out")
        node: yaml.Node | None = super().compose_node(parent, index)
        return node


def read_mapping(file: Path, what: str, fault: type[RealBenchError]) -> dict[str, Any]:
    """The names and values in a file; an empty one has none.

    Args:
        file: where they are.
        what: what the file is, for messages.
        fault: raised where it cannot be read.
    """
    try:
        with file.open(encoding="utf-8") as opened:
            text = opened.read(MAX_LETTERS + 1)
    except FileNotFoundError as error:
        raise fault(f"{what} {file} does not exist") from error
    except (OSError, UnicodeDecodeError) as error:
        raise fault(f"{what} {file} cannot be read: {error}") from error
    values = parse(text, f"{what} {file}", fault)
    if values is None:  # an empty file, or nothing but comments
        return {}
    if not isinstance(values, dict):
        raise fault(f"{what} {file} must hold names and values")
    return values


def parse(text: str, source: str, fault: type[RealBenchError]) -> Any:
    """The value that a text stands for; raises ``fault``."""
    if len(text) > MAX_LETTERS:
        raise fault(f"{source}: more than {MAX_LETTERS} letters are not read")
    try:
        return yaml.load(text, _Loader)
    except (yaml.YAMLError, ValueError, AttributeError, LookupError, RecursionError) as error:
        # some scalars, such as a date in month 13, break YAML's reader in its own ways
        told = " ".join(str(error).split()) or type(error).__name__
        raise fault(f"{source}: {told}") from error
