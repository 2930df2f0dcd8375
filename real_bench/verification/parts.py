"""The verdict on a part of a bundle."""

from __future__ import annotations

from dataclasses import dataclass

HOLDS, IN_PART, FAILS = "holds", "in part", "FAILS"
UNDECIDED, NOT_CHECKED = "undecided", "not checked"
DISPUTED = "disputed"
"""It fails unless the submission plays the same again; no part keeps this verdict."""

PartOutcome = tuple[str, str]
"""A verdict, one of these, and why."""


@dataclass(frozen=True)
class Part:
    """Something of a bundle that was checked: what it is, the verdict, and why."""

    what: str
    verdict: str
    detail: str
