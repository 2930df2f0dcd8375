"""Columns of a printed table, without empty ones."""

from __future__ import annotations

from collections.abc import Collection, Sequence

ABSENT = "-"
"""Printed where there is no number."""


def drop_empty_columns(
    headings: Sequence[str], rows: Sequence[Sequence[str]], always: Collection[str] = ()
) -> tuple[list[str], list[list[str]]]:
    """Headings and rows without the columns that are empty in every row.

    Args:
        headings: of the columns.
        rows: the cells, one sequence per row.
        always: headings of columns that are always kept.
    """
    kept = [
        number
        for number, heading in enumerate(headings)
        if heading in always or any(row[number] != ABSENT for row in rows)
    ]
    return [headings[number] for number in kept], [[row[number] for number in kept] for row in rows]
