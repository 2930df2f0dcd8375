"""Columns of a printed table: only those in which somebody has something."""

from __future__ import annotations

from collections.abc import Collection, Sequence

ABSENT = "-"
"""What stands where there is no number."""


def filled(
    headings: Sequence[str], rows: Sequence[Sequence[str]], always: Collection[str] = ()
) -> tuple[list[str], list[list[str]]]:
    """Headings and rows without the columns that have nothing in any row.

    Args:
        headings: of the columns.
        rows: the cells, a sequence a row.
        always: headings of columns that stay all the same.
    """
    kept = [
        number
        for number, heading in enumerate(headings)
        if heading in always or any(row[number] != ABSENT for row in rows)
    ]
    return [headings[number] for number in kept], [[row[number] for number in kept] for row in rows]
