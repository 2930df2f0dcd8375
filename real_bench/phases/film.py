"""Films of trials, recorded as they run, in a format that every browser plays."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from fractions import Fraction
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from real_bench.errors import RealBenchError
from real_bench.files.atomic import write_atomically
from real_bench.goal_sets import Goal, captioned
from real_bench.scoring.metric import goal_score
from real_bench.task import Task

CODEC: Final = "libx264"
STEPS_PER_FRAME = 50
FRAMES_PER_SECOND = 16  # four times as fast as the simulated robot


class Film:
    """An H.264 film.

    Args:
        path: the .mp4 file; it appears when the film is finished.

    Raises:
        RealBenchError: it cannot be written.
    """

    def __init__(self, path: Path) -> None:
        import av

        self._av, self._path = av, path
        # In memory (a few megabytes): FFmpeg may crash when a write fails.
        self._film = io.BytesIO()
        with self._guard(), ExitStack() as resources:
            self._container = av.open(self._film, "w", format="mp4")
            resources.callback(self._container.close)
            self._stream = self._container.add_stream(CODEC, rate=Fraction(FRAMES_PER_SECOND))
            self._stream.pix_fmt = "yuv420p"
            self._stream.options = {"crf": "28", "preset": "veryfast"}
            self._resources = resources.pop_all()

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Add a frame, (height, width, 3) uint8; all must have the same size."""
        height, width = (size - size % 2 for size in picture.shape[:2])  # H.264 needs even numbers
        if not self._stream.codec_context.is_open:
            self._stream.width, self._stream.height = width, height
        even = np.ascontiguousarray(picture[:height, :width])
        frame = self._av.VideoFrame.from_ndarray(even, format="rgb24")
        with self._guard():
            self._container.mux(self._stream.encode(frame))

    def close(self) -> None:
        """Finish the film, and write the file."""
        with self._guard():
            with self._resources:
                self._container.mux(self._stream.encode(None))
            self._path.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(self._path, self._film.getvalue())

    @contextmanager
    def _guard(self) -> Iterator[None]:
        try:
            yield
        except (OSError, ValueError, self._av.FFmpegError) as error:
            raise RealBenchError(f"cannot write the film {self._path}: {error}") from error


def check_films() -> None:
    """Raise RealBenchError before any work if films cannot be made."""
    import av

    try:
        av.Codec(CODEC, "w")
    except (ValueError, av.FFmpegError) as error:
        raise RealBenchError(
            f"cannot make films: PyAV's FFmpeg has no {CODEC}: reinstall it with pip install av"
        ) from error


@contextmanager
def film_trial(task: Task, goal: Goal, path: Path | None, number: int) -> Iterator[None]:
    """Film a trial if a path is given. Filming does not affect the trial.

    The goal is shown beside the camera image; above them the condition, the step, the goal's number
    and class, and the score at this moment.
    """
    if path is None:
        yield
        return
    film = Film(path)
    wanted = goal.final_poses[:, :3]

    def shoot() -> None:
        positions = task.simulation.object_poses()[:, :3]
        judged = f"goal {number} ({goal.challenge}), score {goal_score(positions, wanted):.3f}"
        here = f"{task.condition.name}, step {task.n_steps:,}"
        film.add(captioned([task.simulation.image().retina, goal.retina], [here, judged]))

    with closing(film), filming(task, shoot):
        yield


@contextmanager
def filming(task: Task, shoot: Callable[[], None]) -> Iterator[None]:
    """Shoot now and then every 50 steps."""
    task.watch(shoot, STEPS_PER_FRAME)
    try:
        shoot()
        yield
    finally:
        task.watch(None, 0)
