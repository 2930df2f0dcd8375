"""Where objects have been between actions, on the table and on the shelf: not in the paper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from real_bench import palette
from real_bench.analysis import Coverage, coverage
from real_bench.figures import style
from real_bench.figures.drawing import Column, Drawing, Numbers

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Normalize
    from matplotlib.image import AxesImage

    from real_bench.figures.data import FigureData
    from real_bench.figures.played import Play

MAP_WIDTH_CM, TEXT_HEIGHT_CM, BAR_HEIGHT_CM = 7.2, 2.1, 1.6

Corner = tuple[float, float]


@dataclass(frozen=True)
class Region:
    """A part of the scene where goals are drawn: its corners, x and y in metres."""

    low: Corner
    high: Corner


@dataclass(frozen=True)
class ObjectCoverage:
    """Where one object of a recording has been.

    Attributes:
        recording: the recording's label.
        name: of the object.
        covered: of the grid.
        table, shelf: where goals are drawn.
    """

    recording: str
    name: str
    covered: Coverage
    table: Region
    shelf: Region

    @property
    def on_table(self) -> float:
        """The share of the table's cells where it has been."""
        return self.covered.share_visited(self.table.low, self.table.high)

    @property
    def on_shelf(self) -> float:
        """The share of the shelf's cells where it has been."""
        return self.covered.share_visited(self.shelf.low, self.shelf.high)


def object_coverage(play: Play) -> list[ObjectCoverage]:
    """Where each object has been between actions; empty if the scene is not available."""
    region = play.region
    if region is None or len(play.positions) == 0:
        return []
    (x_low, y_low), (_, y_high) = region.table_low, region.table_high
    edge = region.shelf_drop_from_x
    table, shelf = (
        Region((x_low, y_low), (edge, y_high)),
        Region((edge, y_low), (region.shelf_x_high, y_high)),
    )
    return [
        ObjectCoverage(
            play.label, name, coverage(play.positions[:, i], table.low, shelf.high), table, shelf
        )
        for i, name in enumerate(play.header.object_names)
    ]


def draw(data: FigureData) -> Drawing | None:
    """A heat map per object and recording, from above: the robot is below, the shelf above."""
    from matplotlib.colors import LogNorm

    found = [one for play in data.plays for one in object_coverage(play)]
    if not found:
        return None
    norm = LogNorm(1, max(10, *(int(one.covered.counts.max()) for one in found)))
    with style.in_style():
        n_lines = max(_title(one).count("\n") for one in found) + 1
        height = MAP_WIDTH_CM * _max_aspect_ratio(found) + TEXT_HEIGHT_CM
        figure, axes = style.panels(len(found), height + (n_lines - 2) * style.LINE_CM)
        figure.set_figheight(figure.get_figheight() + BAR_HEIGHT_CM * style.CM)
        for panel, one in zip(axes, found, strict=True):
            image = _draw(panel, one, norm)
        height_cm = figure.get_figheight() / style.CM
        size = {"fraction": 0.3 / height_cm, "pad": 0.4 / height_cm, "aspect": 40}
        style.add_colour_bar(
            figure, image, ax=axes, label="states between actions", location="bottom", **size
        )
    return Drawing(figure, Numbers.stacked([_rows(one) for one in found]))


def _max_aspect_ratio(found: list[ObjectCoverage]) -> float:
    """The largest ratio of height to width of a map."""
    return max(float(np.ptp(one.covered.x_edges) / np.ptp(one.covered.y_edges)) for one in found)


def _draw(panel: Axes, one: ObjectCoverage, norm: Normalize) -> AxesImage:
    counts = np.ma.masked_equal(one.covered.counts, 0)
    y, x = 100 * one.covered.y_edges, 100 * one.covered.x_edges
    corners = (y[0], y[-1], x[0], x[-1])
    image = panel.imshow(counts, style.HEAT, norm, origin="lower", extent=corners)
    for region, line in ((one.table, "-"), (one.shelf, "--")):
        _outline(panel, region, line)
    panel.invert_xaxis()
    panel.set_title(_title(one))
    panel.set_xlabel("y (cm)")
    panel.set_ylabel("x (cm)")
    return image


def _title(one: ObjectCoverage) -> str:
    visited = f"visited: table {one.on_table:.0%}, shelf (dashed) {one.on_shelf:.0%}"
    return style.title(f"{one.recording}, {one.name}\n{visited}")


def _outline(panel: Axes, region: Region, line: str) -> None:
    (x_low, y_low), (x_high, y_high) = region.low, region.high
    y = np.array([y_low, y_high, y_high, y_low, y_low])
    x = np.array([x_low, x_low, x_high, x_high, x_low])
    panel.plot(100 * y, 100 * x, line, color=palette.ORANGE, linewidth=1)


def _rows(one: ObjectCoverage) -> tuple[dict[str, str], dict[str, Column]]:
    """The cells where it has been."""
    i, j = np.nonzero(one.covered.counts)
    columns: dict[str, Column] = {
        "x_cm_from": 100 * one.covered.x_edges[i],
        "x_cm_to": 100 * one.covered.x_edges[i + 1],
        "y_cm_from": 100 * one.covered.y_edges[j],
        "y_cm_to": 100 * one.covered.y_edges[j + 1],
        "states": one.covered.counts[i, j],
    }
    return {"recording": one.recording, "object": one.name}, columns
