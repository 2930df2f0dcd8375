"""A figure together with the numbers that it shows."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from real_bench.errors import RealBenchError
from real_bench.figures.style import CM, in_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Column = Sequence[Any] | NDArray[Any]


@dataclass(frozen=True)
class Numbers:
    """A table: columns by name, with their unit in it, all equally long."""

    columns: Mapping[str, Column]

    def __post_init__(self) -> None:
        plain = {name: np.asarray(values).tolist() for name, values in self.columns.items()}
        object.__setattr__(self, "columns", plain)
        if len({len(values) for values in plain.values()}) != 1:
            lengths = ", ".join(f"{name} {len(values)}" for name, values in plain.items())
            raise RealBenchError(f"columns must be equally long: {lengths or 'there are none'}")

    @classmethod
    def stacked(cls, parts: Sequence[tuple[Mapping[str, Any], Mapping[str, Column]]]) -> Numbers:
        """Tables with the same columns, stacked.

        Args:
            parts: for each table the values shared by all its rows, and its columns.
        """
        names = [*parts[0][0], *parts[0][1]]
        columns: dict[str, list[Any]] = {name: [] for name in names}
        for same, rows in parts:
            length = len(next(iter(rows.values())))
            for name, value in same.items():
                columns[name] += [value] * length
            for name, values in rows.items():
                columns[name] += np.asarray(values).tolist()
        return cls(columns)

    def csv(self) -> bytes:
        """As a CSV file: a line of names, then one row per line; numbers to 12 digits."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.columns)
        for row in zip(*self.columns.values(), strict=True):
            writer.writerow(f"{cell:.12g}" if isinstance(cell, float) else cell for cell in row)
        return text.getvalue().encode()


@dataclass(frozen=True)
class Drawing:
    """A figure and its numbers.

    Attributes:
        figure: laid out, not written anywhere.
        numbers: what it shows.
    """

    figure: Figure
    numbers: Numbers

    def __post_init__(self) -> None:
        with in_style():  # laid out once: matplotlib would shift things slightly each time
            self.figure.draw_without_rendering()
            self.figure.set_layout_engine("none")

    @property
    def width_cm(self) -> float:
        """Its width in print."""
        return float(self.figure.get_figwidth()) / CM

    def png(self) -> bytes:
        """As a PNG file; the same drawing always gives the same bytes."""
        return self._render("png", {"Software": None})

    def svg(self) -> bytes:
        """As an SVG file; the same drawing always gives the same bytes."""
        return self._render("svg", {"Date": None})

    def _render(self, form: str, metadata: Mapping[str, None]) -> bytes:
        stream = io.BytesIO()
        with in_style():
            self.figure.savefig(stream, format=form, metadata=metadata)
        return stream.getvalue()
