"""The style of all figures: sizes for print, and line styles that differ without colour."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from real_bench.palette import AMBER, BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CM = 1 / 2.54
COLUMN_CM, PAGE_CM = 8.5, 17.5
"""Width of a column and of a page of print."""

DOTS_PER_INCH = 200

MILLION = 1_000_000
"""Steps are counted in millions on axes."""

GREY = "#767676"
HEAT = "viridis"
"""A colour map of increasing lightness, for the colour-blind and for grey print."""

ROOM_FOR_LETTERS = 20
"""Longest text of which two fit side by side in a legend as wide as a column."""

TITLE_LETTERS = 44
"""Longest line above a panel as wide as a column."""

LINE_CM, LEGEND_ROW_CM, X_LABEL_CM = 0.36, 0.48, 0.9
TITLE_PAD = 6.0
"""Between a panel and its title, in points."""

_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, AMBER, BLACK)
_LINES = ("-", "--", ":", "-.")
_MARKERS = ("o", "s", "^", "D", "v", "P", "X")

_SETTINGS: dict[Any, Any] = {
    "figure.dpi": DOTS_PER_INCH,
    "savefig.dpi": "figure",
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 8,
    "figure.titlesize": 9,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 1.2,
    "lines.markersize": 3.5,
    "legend.frameon": False,
    "legend.handlelength": 2.6,
    "legend.columnspacing": 1.2,
    "figure.constrained_layout.h_pad": 0.04,
    "figure.constrained_layout.w_pad": 0.04,
    "text.parse_math": False,  # a file name may hold anything
    "svg.hashsalt": "realbench",
}


@dataclass(frozen=True)
class LineStyle:
    """How one of several lines is drawn."""

    colour: str
    line: str
    marker: str


def line_style(number: int) -> LineStyle:
    """The sign of the number-th line; no two of the first 28 are the same."""
    return LineStyle(
        _COLOURS[number % len(_COLOURS)],
        _LINES[number % len(_LINES)],
        _MARKERS[number % len(_MARKERS)],
    )


@contextmanager
def in_style() -> Iterator[None]:
    """Draw in our style, whatever the user's matplotlib settings, and leave those unchanged."""
    import matplotlib as mpl

    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_SETTINGS)
        yield


def panels(count: int, height_cm: float, **options: Any) -> tuple[Figure, list[Axes]]:
    """A figure of ``count`` panels: one fits a column of print; more fill a page, two per row.

    Args:
        count: of panels.
        height_cm: of a panel.
        options: of ``Figure.subplots``.
    """
    from matplotlib.figure import Figure

    n_columns = min(count, 2)
    n_rows = math.ceil(count / n_columns)
    width = COLUMN_CM if count == 1 else PAGE_CM
    figure = Figure(figsize=(width * CM, n_rows * height_cm * CM), layout="constrained")
    axes = figure.subplots(n_rows, n_columns, squeeze=False, **options).ravel().tolist()
    for spare in axes[count:]:
        spare.set_axis_off()
    return figure, axes[:count]


def title(text: str) -> str:
    """A title above a panel as wide as a column, in as many lines as it needs."""
    return "\n".join(textwrap.fill(line, TITLE_LETTERS) for line in text.split("\n"))


def show_steps_on_x(panel: Axes) -> None:
    """Let the x axis show steps of play in millions, from 0, few enough to be read."""
    panel.set_xlabel("step of the intrinsic phase (millions)")
    panel.set_xlim(left=0)
    panel.locator_params(axis="x", nbins=5)
    panel.xaxis.set_major_formatter("{x:g}")


def show_counts_on_y(panel: Axes) -> None:
    """Let the y axis show whole numbers, from 0."""
    panel.set_ylim(bottom=0)
    panel.locator_params(axis="y", integer=True)
    panel.yaxis.set_major_formatter("{x:,.0f}")


def add_legend_below(figure: Figure, handles: Sequence[Any]) -> None:
    """One legend for all panels; the figure grows to hold it."""
    room = ROOM_FOR_LETTERS
    n_columns = 2 if figure.get_figwidth() < PAGE_CM * CM else 4
    longest = max(len(str(handle.get_label())) for handle in handles)
    while longest > room and n_columns > 1:
        n_columns, room = n_columns // 2, room * 2
    labels = [textwrap.fill(str(handle.get_label()), room) for handle in handles]
    n_lines = max(label.count("\n") + 1 for label in labels)
    n_rows = math.ceil(len(handles) / n_columns) * n_lines
    figure.set_figheight(figure.get_figheight() + n_rows * LEGEND_ROW_CM * CM)
    figure.legend(handles=handles, labels=labels, loc="outside lower center", ncols=n_columns)


def add_colour_bar(figure: Figure, drawn: Any, **options: Any) -> None:
    """A colour bar for counts; ``options`` are those of ``Figure.colorbar``.

    Its numbers are written out: exponents would be too small to read in print.
    """
    from matplotlib.ticker import NullFormatter

    bar = figure.colorbar(drawn, format="{x:,.0f}", **options)
    bar.ax.yaxis.set_minor_formatter(NullFormatter())
    bar.ax.xaxis.set_minor_formatter(NullFormatter())


def rows(count: int, height_cm: float) -> tuple[Figure, list[Axes]]:
    """A figure of ``count`` panels, one below the other, as wide as a page, with one x axis."""
    from matplotlib.figure import Figure

    size = (PAGE_CM * CM, (count * height_cm + X_LABEL_CM) * CM)
    figure = Figure(figsize=size, layout="constrained")
    return figure, figure.subplots(count, 1, squeeze=False, sharex=True).ravel().tolist()
