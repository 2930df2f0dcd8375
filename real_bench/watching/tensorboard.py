"""A play as TensorBoard event files, written by TensorBoard's own library."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType

import numpy as np

from real_bench.extras import extra
from real_bench.files.atomic import OutputError
from real_bench.files.outputs import check_folder
from real_bench.watching.following import Moment

FLOAT32 = (float(np.finfo(np.float32).min), float(np.finfo(np.float32).max))
"""What event files can hold besides infinity."""

ACTIONS_PER_POINT = 100
"""Actions per point of the share that moved an object."""


class EventFiles:
    """Writes what is new in each moment; use it as a context manager.

    Args:
        folder: for the event files; created if needed.
        overwrite: remove earlier ones.

    Raises:
        MissingExtraError: TensorBoard is not installed.
        OutputError: the folder cannot be written, or already has event files.
    """

    def __init__(self, folder: Path, *, overwrite: bool = False) -> None:
        summary = extra("tensorboard.summary", "tensorboard")
        check_folder(folder, make=True)
        before = sorted(folder.glob("events.out.tfevents.*"))
        if before and not overwrite:
            raise OutputError(
                f"{folder} already has event files: use --overwrite, or another --tensorboard"
            )
        for file in before:
            file.unlink()
        self._writer = summary.Writer(str(folder))
        self._n_actions = self._n_logged = 0

    def add(self, moment: Moment) -> None:
        """Write what is new."""
        status = moment.status
        if moment.speed is not None:
            self._scalar("play/steps a second", moment.speed, status.n_steps)
        while self._n_actions + ACTIONS_PER_POINT <= status.n_actions:
            end = self._n_actions + ACTIONS_PER_POINT
            share = float(status.moved[self._n_actions : end].mean())
            step = int(status.ended_at[end - 1])
            self._scalar("play/share of actions that moved an object", share, step)
            self._n_actions = end
        for row in status.logged[self._n_logged :]:
            self._scalar(f"logged/{row['name']}", float(row["value"]), int(row["step"]))
        self._n_logged = max(self._n_logged, len(status.logged))
        self._writer.flush()

    def __enter__(self) -> EventFiles:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._writer.close()

    def _scalar(self, tag: str, value: float, step: int) -> None:
        self._writer.add_scalar(tag, float(np.clip(value, *FLOAT32)), step)
