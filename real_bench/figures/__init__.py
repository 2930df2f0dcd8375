"""The paper's figures (section Results), from recordings and results.

A figure has a file: what was recorded goes in, a drawing with its numbers comes out.
``registry.FIGURES`` names them all; only ``saving`` writes files.
"""

from real_bench.figures.data import FigureData
from real_bench.figures.drawing import Drawing, Numbers
from real_bench.figures.facts import facts
from real_bench.figures.played import FigureOptions, Play, play_labels, read_play
from real_bench.figures.reading import read_figure_data
from real_bench.figures.registry import FIGURES, FigureKind, draw_all
from real_bench.figures.tested import Tested, check_same_goals, read_tested

__all__ = [
    "FIGURES",
    "Drawing",
    "FigureData",
    "FigureKind",
    "FigureOptions",
    "Numbers",
    "Play",
    "Tested",
    "check_same_goals",
    "draw_all",
    "facts",
    "play_labels",
    "read_figure_data",
    "read_play",
    "read_tested",
]
