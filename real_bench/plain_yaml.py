"""YAML as plain data, from files that may come from strangers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

MAX_LETTERS = 50_000


class _Loader(yaml.SafeLoader):
    """Reads no aliases: with these, a hundred bytes describe more than any memory holds."""

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            raise yaml.YAMLError("aliases (*name) are not read: write it out")
        node: yaml.Node | None = super().compose_node(parent, index)
        return node


def read_text(path: Path) -> str:
    """The text of a file; raises OSError, or ValueError for one that is too long or no text."""
    with path.open(encoding="utf-8") as file:
        return file.read(MAX_LETTERS + 1)


def parse_yaml(text: str) -> Any:
    """The plain data that a text describes.

    Raises:
        ValueError: it is not YAML, or too long, or does not say all itself.
    """
    if len(text) > MAX_LETTERS:
        raise ValueError(f"more than {MAX_LETTERS} letters are not read")
    try:
        return yaml.load(text, _Loader)
    except (yaml.YAMLError, AttributeError, LookupError, RecursionError) as error:
        # some scalars, such as a date in month 13, break YAML's reader in its own ways
        raise ValueError(" ".join(str(error).split()) or type(error).__name__) from error
