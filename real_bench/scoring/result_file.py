"""The JSON of a result file, read without trusting it, and the seals over its content."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from real_bench.errors import ResultError
from real_bench.files.kinds import RESULT
from real_bench.text.quoting import quoted

FORMAT = RESULT.holds.decode()
VERSION = 3
"""Version of written files. 1 and 2 also had a summary; 1 had no commands and no seal."""

MAX_FILE_BYTES = 2**28
"""Bytes; fifty trials in which each step had another command take some 50 million."""

SEAL, TIMING = "seal", "timing"

Content = dict[str, Any]


class ForeignFileError(ResultError):
    """A whole JSON file that is something else than a result."""


def sealed(content: Content) -> Content:
    """A file's content with its seal, a sha256.

    The seal covers everything but ``timing``, so it is the same when a test is repeated; a second
    one, in ``timing``, covers the times and the first. They cover the values, not their layout.
    They reveal accidental changes; somebody who alters a file on purpose can make new ones. Raises
    ValueError for what JSON cannot hold.
    """
    facts = {key: value for key, value in content.items() if key not in (SEAL, TIMING)}
    timing = {key: value for key, value in content.get(TIMING, {}).items() if key != SEAL}
    seal = _sha256(facts)
    return {**facts, SEAL: seal, TIMING: {**timing, SEAL: _sha256([timing, seal])}}


def is_sealed(content: Content) -> bool:
    """Whether the file is unaltered since it was sealed, if it ever was."""
    return content["version"] == 1 or content == sealed(content)


def read_content(path: Path) -> Content:
    """The content of a result file, not yet checked.

    Raises:
        ResultError: it does not exist, is not a result (ForeignFileError), or was written by a
            newer version.
    """
    try:
        with path.open("rb") as file:
            text = file.read(MAX_FILE_BYTES + 1)
        if len(text) > MAX_FILE_BYTES:
            raise ValueError(f"it is larger than {MAX_FILE_BYTES:,} bytes")
        content = json.loads(text, object_pairs_hook=_unique_names)
        if not isinstance(content, dict) or content.get("format") != FORMAT:
            raise ForeignFileError(f"{path} is not a result of realbench")
        if content.get("version") not in range(1, VERSION + 1):
            raise ResultError(
                f"{path} has version {quoted(str(content.get('version')))}, this realbench reads "
                f"1 to {VERSION}: install a newer one"
            )
        _sha256(content)  # can all of it be written again?
    except FileNotFoundError as error:
        raise ResultError(f"result not found: {path}") from error
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise ResultError(
            f"{path} cannot be read: not a result, or damaged ({quoted(str(error), 200)})"
        ) from error
    except (OSError, ValueError, RecursionError) as error:
        reason = getattr(error, "strerror", None) or quoted(str(error), 200)
        raise ResultError(f"{path} cannot be read: {reason}") from error
    return content


def check_writable(path: Path, text: bytes) -> None:
    """Raise ResultError if a file could not be read again."""
    if len(text) > MAX_FILE_BYTES:
        raise ResultError(
            f"{path} would be larger than {MAX_FILE_BYTES:,} bytes: test fewer goals at once; "
            "earlier trials are kept"
        )


def _sha256(value: Any) -> str:
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def _unique_names(pairs: list[tuple[str, Any]]) -> Content:
    """A JSON object; a name given twice could show one value and hold another."""
    content = dict(pairs)
    if len(content) < len(pairs):
        raise ValueError("a name is given twice")
    return content
