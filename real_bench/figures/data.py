"""The data of figures."""

from __future__ import annotations

from dataclasses import dataclass

from real_bench.figures.played import Play
from real_bench.figures.tested import Series, Tested, series
from real_bench.text.naming import explores_at_random


@dataclass(frozen=True)
class FigureData:
    """Recordings and results; the results are complete, and on the same goals."""

    plays: tuple[Play, ...] = ()
    tested: tuple[Tested, ...] = ()

    @property
    def series(self) -> list[Series]:
        """The results, grouped into repetitions of one test."""
        explorers = {
            play.sha256: play.header.controller
            for play in self.plays
            if not explores_at_random(play.header.controller)
        }
        return series(self.tested, explorers)
