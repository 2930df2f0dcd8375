"""Pictures and films as text that a page can hold."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from real_bench.errors import RealBenchError
from real_bench.goal_sets.picture import Box, thumbnail
from real_bench.scoring.result import Result
from real_bench.simulation import Image, Scene, Simulation
from real_bench.text.naming import trial_name

QUALITY = 80


def data_uri(content: bytes, kind: str) -> str:
    """Content as an address that holds it, such as ``data:image/webp;base64,...``."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


def picture(image: NDArray[np.uint8], box: Box) -> str:
    """A part of a camera image, (height, width, 3) uint8, in small."""
    stream = io.BytesIO()
    thumbnail(image, box).save(stream, "webp", quality=QUALITY)
    return data_uri(stream.getvalue(), "image/webp")


def render_ends(result: Result, scene: Scene) -> Iterator[Image]:
    """How each trial ended: the objects where they came to rest, the arm back home."""
    simulation = Simulation(scene, result.setting.objects)
    try:
        for trial in result.trials:
            simulation.reset(np.array(trial.final_poses))
            yield simulation.image()
    finally:
        simulation.close()


def films(folder: Path | None, goals: Sequence[int]) -> list[str | None]:
    """The film of each trial, if there is one; raises RealBenchError if there is none at all."""
    if folder is None:
        return [None] * len(goals)
    paths = [folder / f"{trial_name(goal)}.mp4" for goal in goals]
    if not any(path.exists() for path in paths):
        raise RealBenchError(
            f"{folder} holds no film of these trials (trial-00.mp4 ...): make them with "
            f"`realbench extrinsic --video {folder}`"
        )
    return [data_uri(path.read_bytes(), "video/mp4") if path.exists() else None for path in paths]
