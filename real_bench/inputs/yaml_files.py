"""YAML as plain data, from files that may come from strangers, with every fault in one line.

Scalars are read by the core schema of YAML 1.2, as people expect: 010 is ten, 1e-3 a number;
12:30:00, 2026-01-01 and yes are text. A name that is given twice is refused.
"""

from __future__ import annotations

import json
import re
from collections.abc import Hashable
from pathlib import Path
from typing import Any, ClassVar

import yaml

from real_bench.errors import RealBenchError
from real_bench.text.quoting import encodable, one_line

MAX_CHARACTERS = 50_000

_BASES = {"0o": 8, "0x": 16}


class _Loader(yaml.SafeLoader):
    """The core schema of YAML 1.2, each name once, and no aliases.

    With aliases, a hundred bytes could describe more than fits in any memory.
    """

    yaml_implicit_resolvers = {}  # noqa: RUF012
    yaml_constructors: ClassVar[dict[str | None, Any]] = {}

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            raise yaml.YAMLError("aliases (*name) are not allowed: write the value out")
        node: yaml.Node | None = super().compose_node(parent, index)
        return node

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        values: dict[Hashable, Any] = {}
        for key_node, value_node in node.value:
            key = self.construct_object(key_node, deep=True)
            where = key_node.start_mark
            if not isinstance(key, Hashable):
                raise yaml.constructor.ConstructorError(None, None, "a name is not text", where)
            if key in values:
                raise yaml.constructor.ConstructorError(
                    None, None, f"{key} is given twice, the second time", where
                )
            values[key] = self.construct_object(value_node, deep=deep)
        return values

    def construct_map(self, node: yaml.MappingNode) -> dict[Hashable, Any]:
        return self.construct_mapping(node, deep=True)

    def construct_list(self, node: yaml.SequenceNode) -> list[Any]:
        return self.construct_sequence(node, deep=True)

    def construct_int(self, node: yaml.ScalarNode) -> int:
        text = str(self.construct_scalar(node))
        base = _BASES.get(text[:2], 10)
        return int(text if base == 10 else text[2:], base)

    def construct_float(self, node: yaml.ScalarNode) -> float:
        return float(re.sub(r"\.(?=inf|nan)", "", str(self.construct_scalar(node)).lower()))


_SCALARS = {
    "null": (r"~|null|Null|NULL|", "~nN"),
    "bool": (r"true|True|TRUE|false|False|FALSE", "tTfF"),
    "int": (r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+", "-+0123456789"),
    "float": (
        r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?"
        r"|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
        "-+.0123456789",
    ),
}
"""How each kind is written, and what it may begin with; the first match counts."""

for _name, (_written, _first) in _SCALARS.items():
    _Loader.add_implicit_resolver(
        f"tag:yaml.org,2002:{_name}", re.compile(f"^(?:{_written})$"), [*_first, ""]
    )
_Loader.yaml_constructors |= {
    "tag:yaml.org,2002:null": _Loader.construct_yaml_null,
    "tag:yaml.org,2002:bool": _Loader.construct_yaml_bool,
    "tag:yaml.org,2002:int": _Loader.construct_int,
    "tag:yaml.org,2002:float": _Loader.construct_float,
    "tag:yaml.org,2002:str": _Loader.construct_yaml_str,
    "tag:yaml.org,2002:seq": _Loader.construct_list,
    "tag:yaml.org,2002:map": _Loader.construct_map,
    None: _Loader.construct_undefined,
}


def as_yaml(value: Any, indent: int | None = None) -> str:
    """Plain data as JSON, which is YAML; what is not UTF-8 becomes a question mark.

    Nothing is escaped that need not be: YAML does not join the two halves of an escaped emoji.
    """
    return encodable(json.dumps(value, indent=indent, ensure_ascii=False))


def read_mapping(file: Path, what: str, fault: type[RealBenchError]) -> dict[str, Any]:
    """The names and values in a file; an empty one has none.

    Args:
        file: where they are.
        what: what the file is, for messages.
        fault: raised if it cannot be read.
    """
    try:
        with file.open(encoding="utf-8-sig") as opened:
            text = opened.read(MAX_CHARACTERS + 1)
    except FileNotFoundError as error:
        raise fault(f"{what} was not found: {file}") from error
    except (OSError, ValueError) as error:
        raise fault(f"{what} {file} cannot be read: {error}") from error
    values = parse(text, f"{what} {file}", fault)
    if values is None:  # an empty file, or nothing but comments
        return {}
    if not isinstance(values, dict):
        raise fault(f"{what} {file} must hold names and values")
    return values


def parse(text: str, source: str, fault: type[RealBenchError]) -> Any:
    """The value of a text; raises ``fault``."""
    if len(text) > MAX_CHARACTERS:
        raise fault(f"{source}: longer than {MAX_CHARACTERS} characters")
    try:
        return yaml.load(text, _Loader)
    except (yaml.YAMLError, ValueError, AttributeError, LookupError, RecursionError) as error:
        reason = one_line(str(error).replace('in "<unicode string>", ', "in "))
        reason = reason or type(error).__name__
        raise fault(f"{source}: {reason}") from error
