"""YAML as people write it, with every fault in one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from real_bench.errors import RealBenchError


def read_mapping(file: Path, what: str, fault: type[RealBenchError]) -> dict[str, Any]:
    """The names and values in a file; an empty one has none.

    Args:
        file: where they are.
        what: what the file is, for messages.
        fault: raised where it cannot be read.
    """
    try:
        text = file.read_text(encoding="utf-8")
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
    try:
        return yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, AttributeError, LookupError, RecursionError) as error:
        # some scalars, such as a date in month 13, break YAML's reader in its own ways
        raise fault(f"{source}: {' '.join(str(error).split())}") from error
