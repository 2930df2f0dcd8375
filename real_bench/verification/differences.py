"""What differs between the recorded and the replayed, to the last bit, and by how much."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class Difference:
    """One thing that is not as recorded.

    Attributes:
        what: what it is; a whole sentence where there is no number.
        by: how far apart the two are, the largest number of several.
        unit: of ``by``; empty where it has none.
    """

    what: str
    by: float | None = None
    unit: str = ""

    def __str__(self) -> str:
        if self.by is None:
            return self.what
        return f"{self.what} differs by {self.by:.3g}{' ' if self.unit else ''}{self.unit}"

    def to_json(self) -> dict[str, Any]:
        """Its fields."""
        return asdict(self)


def numbers_differ(
    what: str, recorded: ArrayLike, replayed: ArrayLike, unit: str = ""
) -> Iterator[Difference]:
    """Compare numbers of equal shape by their bits."""
    a, b = np.asarray(recorded, "<f8"), np.asarray(replayed, "<f8")
    if a.tobytes() != b.tobytes():
        yield Difference(what, float(np.abs(a - b).max()), unit)


def poses_differ(
    recorded: NDArray[np.float64], replayed: NDArray[np.float64], names: Sequence[str]
) -> Iterator[Difference]:
    """Compare the objects' poses, (n_objects, 7) each, by their bits.

    Positions differ by their distance in metres, quaternions by the component that differs most.
    """
    for name, a, b in zip(names, recorded, replayed, strict=True):
        if a[:3].tobytes() != b[:3].tobytes():
            yield Difference(f"position of {name}", float(np.linalg.norm(a[:3] - b[:3])), "m")
        yield from numbers_differ(f"quaternion of {name}", a[3:], b[3:])
