"""Read the data of figures."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from pathlib import Path

from real_bench.figures.data import FigureData
from real_bench.figures.played import FigureOptions, Play, play_labels, read_play
from real_bench.figures.tested import (
    Tested,
    check_given_once,
    check_same_goals,
    read_tested,
)

Progress = Callable[[int, str], None]
"""Called with the number of files read, and the name of the next."""

log = logging.getLogger(__name__)


def read_figure_data(
    recordings: Sequence[Path],
    results: Sequence[Path],
    options: FigureOptions,
    progress: Progress = lambda done, name: None,
) -> FigureData:
    """The data of figures; raises RealBenchError.

    Args:
        recordings: files of intrinsic phases.
        results: files of extrinsic phases on the same goals; unfinished ones are not used.
        options: how to see, and how much of the recordings to use.
        progress: called before each recording.
    """
    tested = _finished_only([read_tested(file) for file in results])
    plays: list[Play] = []
    for file, label in zip(recordings, play_labels(recordings), strict=True):
        progress(len(plays), file.name)
        part = f", first {options.run_steps:,} steps" if options.run_steps else ""
        plays.append(read_play(file, label + part, options))
    return FigureData(tuple(plays), tested)


def _finished_only(tested: Sequence[Tested]) -> tuple[Tested, ...]:
    for one in tested:
        if not one.result.is_finished:
            done = f"{len(one.result.trials)} of {len(one.result.setting.goal_numbers)} trials"
            log.info("%s is in no figure: its test is not finished (%s)", one.file, done)
    finished = tuple(one for one in tested if one.result.is_finished)
    check_same_goals(finished)
    check_given_once(finished)
    return finished
