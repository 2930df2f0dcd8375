"""What differs between the recorded and the replayed, and by how much."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

ROUNDING = 1e-12
"""How much a derived number may differ from the one derived here: the last bit of an exponential
or a sum depends on the processor and on how a library was compiled."""

TOLERANCE_M = 1e-3
"""How much poses (metres; parts of a quaternion) and joints (radians) may differ from the recorded
ones and still count as equal under different physics, where bits cannot agree."""


@dataclass(frozen=True)
class Difference:
    """One difference from the recording.

    Attributes:
        what: what differs; a whole sentence if there is no number.
        by: how far apart the two are, the largest number of several.
        unit: of ``by``; empty if it has none.
        of_physics: whether different physics may be the reason.
    """

    what: str
    by: float | None = None
    unit: str = ""
    of_physics: bool = False

    def __str__(self) -> str:
        if self.by is None:
            return self.what
        return f"{self.what} differs by {self.by:.3g}{' ' if self.unit else ''}{self.unit}"


def numbers_differ(
    what: str, recorded: ArrayLike, replayed: ArrayLike, unit: str = "", *, within: float = 0.0
) -> Iterator[Difference]:
    """Compare numbers of equal shape: by their bits, or up to ``within``."""
    a, b = np.asarray(recorded, "<f8"), np.asarray(replayed, "<f8")
    if a.tobytes() != b.tobytes():
        by = float(np.abs(a - b).max())
        if not 0 <= by <= within or not within:
            yield Difference(what, by, unit)


def poses_differ(
    recorded: NDArray[np.float64],
    replayed: NDArray[np.float64],
    names: Sequence[str],
    *,
    within: float = 0.0,
) -> Iterator[Difference]:
    """Compare the objects' poses, (n_objects, 7) each: by their bits, or up to ``within``.

    Positions differ by their distance in metres, quaternions by the component that differs most.
    """
    for name, a, b in zip(names, recorded, replayed, strict=True):
        away = float(np.linalg.norm(a[:3] - b[:3]))
        if a[:3].tobytes() != b[:3].tobytes() and not (within and away <= within):
            yield Difference(f"position of {name}", away, "m")
        yield from numbers_differ(f"quaternion of {name}", a[3:], b[3:], within=within)


def attribute_to_physics(differences: Iterator[Difference]) -> Iterator[Difference]:
    """The same differences, marked as possibly due to different physics."""
    for difference in differences:
        yield replace(difference, of_physics=True)
