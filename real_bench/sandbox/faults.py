"""The kind of a failure in the child, as reported to the parent.

The child may report anything: the kind only decides how its failure is named.
"""

from __future__ import annotations

from real_bench.errors import (
    ControllerDeclinedError,
    ControllerError,
    ControllerFailedError,
    OutOfMemoryError,
    SubmissionError,
)

KINDS: dict[str, type[ControllerError]] = {
    "crashed": ControllerFailedError,
    "memory": OutOfMemoryError,
    "declined": ControllerDeclinedError,
    "unfit": SubmissionError,
    "asked": ControllerError,
}
"""The errors that a child may report; others are found by the parent itself."""

NO_MEMORY = ("MemoryError", "bad_alloc", "can't allocate memory", "Cannot allocate memory")
MAX_CHAIN_LENGTH = 20


def fault_kind(error: BaseException) -> str:
    """The kind of an error, by its name in :data:`KINDS`."""
    link: BaseException | None = error
    for _ in range(MAX_CHAIN_LENGTH):
        if link is None:
            break
        if isinstance(link, MemoryError) or is_out_of_memory(f"{type(link).__name__}: {link}"):
            return "memory"
        link = link.__cause__
    for name, kind in KINDS.items():
        if type(error) is kind:
            return name
    return "crashed"


def fault_of_kind(kind: str, message: str) -> ControllerError:
    """The error for what a child reports."""
    return KINDS.get(kind, ControllerFailedError)(message)


def is_out_of_memory(text: str) -> bool:
    """Whether a text says that memory ran out."""
    return any(sign in text for sign in NO_MEMORY)
