"""Labels of recordings and results in figures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence


def make_distinct(labels: Sequence[str], *details: Sequence[str]) -> list[str]:
    """Labels made unique by adding details one by one where needed.

    Args:
        labels: of n things.
        details: each with one text for each of the n things.
    """
    for detail in details:
        count = Counter(labels)
        labels = [
            f"{label}{more}" if count[label] > 1 else label
            for label, more in zip(labels, detail, strict=True)
        ]
    return list(labels)
