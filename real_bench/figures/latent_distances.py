"""Latent against real distance (paper, fig. LatentDistances and LatentDistancesFocus)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from real_bench.analysis import NEAR_M, Floats, PairDistances
from real_bench.figures import style
from real_bench.figures.drawing import Column, Drawing, Numbers

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh

    from real_bench.figures.data import FigureData

PANEL_HEIGHT_CM = 6.8
N_BINS = 60


def of_all(data: FigureData) -> Drawing | None:
    """Over all pairs."""
    return _draw_panels(_pairs(data))


def of_near(data: FigureData) -> Drawing | None:
    """Over pairs of states whose objects are 1 to 20 cm apart."""
    near = [(label, pairs.within(*NEAR_M)) for label, pairs in _pairs(data)]
    return _draw_panels([(label, pairs) for label, pairs in near if len(pairs.real)])


def _pairs(data: FigureData) -> list[tuple[str, PairDistances]]:
    return [(play.label, play.sight.pairs) for play in data.plays if play.sight is not None]


def _draw_panels(parts: list[tuple[str, PairDistances]]) -> Drawing | None:
    if not parts:
        return None
    tables = []
    with style.in_style():
        figure, axes = style.panels(len(parts), PANEL_HEIGHT_CM)
        for panel, (label, pairs) in zip(axes, parts, strict=True):
            counts, real, latent = np.histogram2d(100 * pairs.real, pairs.latent, N_BINS)
            style.add_colour_bar(
                figure, _draw(panel, counts, real, latent), ax=panel, label="pairs"
            )
            spearman, pearson = map(_format_correlation, (pairs.spearman, pairs.pearson))
            panel.set_title(style.title(f"{label}\nSpearman {spearman}, Pearson {pearson}"))
            tables.append(({"recording": label}, _rows(counts, real, latent)))
    return Drawing(figure, Numbers.stacked(tables))


def _draw(panel: Axes, counts: Floats, real: Floats, latent: Floats) -> QuadMesh:
    """A heat map, white where there is no pair."""
    from matplotlib.colors import LogNorm

    panel.set_xlabel("distance of objects (cm)")
    panel.set_ylabel("distance of codes")
    return panel.pcolormesh(
        real,
        latent,
        np.ma.masked_equal(counts.T, 0),
        norm=LogNorm(1, max(counts.max(), 10)),
        cmap=style.HEAT,
        rasterized=True,
    )


def _format_correlation(correlation: float) -> str:
    return "undefined" if math.isnan(correlation) else f"{correlation:.2f}"


def _rows(counts: Floats, real: Floats, latent: Floats) -> dict[str, Column]:
    """The bins that have pairs."""
    i, j = np.nonzero(counts)
    return {
        "real_cm_from": real[i],
        "real_cm_to": real[i + 1],
        "latent_from": latent[j],
        "latent_to": latent[j + 1],
        "pairs": counts[i, j].astype(int),
    }
