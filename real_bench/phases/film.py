"""Films of trials, in a format that every browser plays."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from fractions import Fraction
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from real_bench.errors import RealBenchError
from real_bench.files import write_whole
from real_bench.goal_sets import Goal
from real_bench.task import Task

CODEC: Final = "libx264"
STEPS_A_FRAME = 50
FRAMES_A_SECOND = 16  # four times as fast as the simulated robot


class Film:
    """An H.264 film: what the camera sees, and the goal beside it.

    Args:
        path: the .mp4 file; there once it is finished.
        goal_image: (height, width, 3) uint8.

    Raises:
        RealBenchError: it cannot be written.
    """

    def __init__(self, path: Path, goal_image: NDArray[np.uint8]) -> None:
        import av

        self._av, self._path, self._goal = av, path, goal_image
        height, width, _ = goal_image.shape
        # In memory, where a write cannot fail: FFmpeg may crash where one does. A few megabytes.
        self._film = io.BytesIO()
        with self._guard(), ExitStack() as held:
            self._container = av.open(self._film, "w", format="mp4")
            held.callback(self._container.close)
            self._stream = self._container.add_stream(CODEC, rate=Fraction(FRAMES_A_SECOND))
            self._stream.width, self._stream.height = 2 * width, height
            self._stream.pix_fmt = "yuv420p"
            self._stream.options = {"crf": "28", "preset": "veryfast"}
            self._held = held.pop_all()

    def add(self, image: NDArray[np.uint8]) -> None:
        """One more frame."""
        both = np.ascontiguousarray(np.hstack([image, self._goal]))
        frame = self._av.VideoFrame.from_ndarray(both, format="rgb24")
        with self._guard():
            self._container.mux(self._stream.encode(frame))

    def close(self) -> None:
        """Finish the film, and write the file."""
        with self._guard():
            with self._held:
                self._container.mux(self._stream.encode(None))
            self._path.parent.mkdir(parents=True, exist_ok=True)
            write_whole(self._path, self._film.getvalue())

    @contextmanager
    def _guard(self) -> Iterator[None]:
        try:
            yield
        except (OSError, ValueError, self._av.FFmpegError) as error:
            raise RealBenchError(f"cannot write the film {self._path}: {error}") from error


def check_films() -> None:
    """Raise RealBenchError where no film can be made, before there is one to be made."""
    import av

    try:
        av.Codec(CODEC, "w")
    except (ValueError, av.FFmpegError) as error:
        raise RealBenchError(
            f"no film can be made: the FFmpeg of PyAV has no {CODEC} (pip install av brings one)"
        ) from error


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
