"""Films of trials, in a format that every browser plays."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from real_bench.errors import RealBenchError
from real_bench.goal_sets import Goal
from real_bench.task import Task

STEPS_A_FRAME = 50
FRAMES_A_SECOND = 16  # four times as fast as the simulated robot


class Film:
    """An H.264 film: what the camera sees, and the goal beside it.

    Args:
        path: the .mp4 file, written as frames come.
        goal_image: (height, width, 3) uint8.
    """

    def __init__(self, path: Path, goal_image: NDArray[np.uint8]) -> None:
        import av

        self._av, self._path, self._goal = av, path, goal_image
        height, width, _ = goal_image.shape
        with self._guard():
            path.parent.mkdir(parents=True, exist_ok=True)
            self._container = av.open(str(path), "w", options={"movflags": "faststart"})
        self._stream = self._container.add_stream("libx264", rate=Fraction(FRAMES_A_SECOND))
        self._stream.width, self._stream.height = 2 * width, height
        self._stream.pix_fmt = "yuv420p"
        self._stream.options = {"crf": "28", "preset": "veryfast"}

    def add(self, image: NDArray[np.uint8]) -> None:
        """One more frame."""
        both = np.ascontiguousarray(np.hstack([image, self._goal]))
        frame = self._av.VideoFrame.from_ndarray(both, format="rgb24")
        with self._guard():
            self._container.mux(self._stream.encode(frame))

    def close(self) -> None:
        """Finish the file."""
        with self._guard():
            self._container.mux(self._stream.encode(None))
            self._container.close()

    @contextmanager
    def _guard(self) -> Iterator[None]:
        try:
            yield
        except (OSError, self._av.FFmpegError) as error:
            raise RealBenchError(f"cannot write the film {self._path}: {error}") from error


@contextmanager
def filmed(task: Task, goal: Goal, folder: Path | None, name: str) -> Iterator[None]:
    """Film what happens in a task, where a folder is given. Filming changes nothing in it."""
    if folder is None:
        yield
        return
    film = Film(folder / f"{name}.mp4", goal.retina)

    def shoot() -> None:
        film.add(task.simulation.image().retina)

    task.watch(shoot, STEPS_A_FRAME)
    try:
        shoot()
        yield
    finally:
        task.watch(None, 0)
        film.close()
