"""A recording as arrays for figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from real_bench.analysis import count_by_period, planar
from real_bench.conditions import Condition
from real_bench.errors import RecordingError, SceneError
from real_bench.figures.labels import make_distinct
from real_bench.figures.latent_codes import LatentCodes, encode_recording, sight_settings
from real_bench.files.hashing import file_sha256
from real_bench.inputs.whole import keep_whole
from real_bench.lengths import LARGEST
from real_bench.real_x import DynamicAbstraction, Triplets
from real_bench.real_x.home import plannable
from real_bench.recording import Experience, Header, Recording
from real_bench.simulation.manifest import GoalRegion
from real_bench.simulation.scene import manifest_path, read_manifest
from real_bench.text.naming import display_name


@dataclass(frozen=True)
class FigureOptions:
    """The user's choices.

    Attributes:
        settings: values for how REAL-LD sees and abstracts; the rest are defaults.
        seed: of learning to see, and of the pairs whose distances are compared.
        run_steps: how many of each recording's first steps count; None: all.

    Raises:
        RealBenchError: one of them is not valid.
    """

    settings: Mapping[str, Any] = field(default_factory=dict)
    seed: int = 0
    run_steps: int | None = None

    def __post_init__(self) -> None:
        if self.settings:
            sight_settings(self.settings)
        keep_whole(self, "seed", 0, LARGEST, RecordingError)
        if self.run_steps is not None:
            keep_whole(self, "run_steps", 1, error=RecordingError)


@dataclass(frozen=True, eq=False)
class Play:
    """One recording, or its first steps; n actions, of which k can be planned with.

    Attributes:
        label: its name in figures.
        file, sha256: the recording's name, and hash.
        header: of the recording.
        ended_at: after how many steps each action ended, (n,).
        displacements: how far each action moved each object, (n, n_objects) metres.
        raised: how much higher each action left each object, (n, n_objects) metres.
        positions: of the objects in every state, (m, n_objects, 3) metres.
        logged: what its controller logged (see ``Recording.logged``).
        places: x, y of the objects before and after the k actions: what REAL-D plans with.
        sight: what REAL-LD makes of the images; None without images, or if they cannot be learned.
        levels: of abstraction.
        region: where goals are drawn in its scene; None if its manifest is not available.
    """

    label: str
    file: str
    sha256: str
    header: Header
    ended_at: NDArray[np.int64]
    displacements: NDArray[np.float64]
    raised: NDArray[np.float64]
    positions: NDArray[np.float64]
    logged: NDArray[Any]
    places: Triplets
    sight: LatentCodes | None
    levels: int
    region: GoalRegion | None

    def periods(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """After how many steps each period of actions ended, and how many actions it has.

        The last period may be shorter than the others.
        """
        n = len(self.displacements)
        sizes = count_by_period(np.ones((n, 1), bool))
        return self.ended_at[sizes.cumsum() - 1], sizes

    def abstraction(self, triplets: Triplets) -> DynamicAbstraction:
        """The levels of abstraction of its places, or codes."""
        return DynamicAbstraction.learn(triplets, self.levels)


def play_labels(paths: Sequence[Path]) -> list[str]:
    """Names of recordings: who played and how, and more details where needed."""
    headers = []
    for path in paths:
        with Recording(path) as recording:
            headers.append(recording.header)
    return make_distinct(
        [_name(header) for header in headers],
        [f", seed {header.seed}" for header in headers],
        [f" ({path.stem})" for path in paths],
        [f" ({path})" for path in paths],
    )


def read_play(path: Path, label: str, options: FigureOptions) -> Play:
    """Read a recording; learns to see if it has images but no weights that fit.

    Raises:
        RecordingError: it cannot be read, or has fewer steps than asked for.
        RealBenchError: it cannot be learned from.
    """
    with Recording(path) as recording:
        if options.run_steps is not None and options.run_steps > recording.n_steps:
            raise RecordingError(
                f"{path} has {recording.n_steps:,} steps, {options.run_steps:,} were asked for"
            )
        header = recording.header
        condition = Condition("I", Condition.parse(header.condition).control)
        experience = Experience(path, condition, options.run_steps)
        rows, kept = recording.transitions[: len(experience)], plannable(experience)
        positions = recording.object_poses[: experience.n_states, :, :3]
        ended_at = rows["first_step"] + rows["n_steps"]
        logged = recording.logged
        before, after = experience.preconditions[kept], experience.outcomes[kept]
        return Play(
            label=label,
            file=path.name,
            sha256=file_sha256(path),
            header=header,
            ended_at=ended_at,
            displacements=recording.displacements()[: len(experience)],
            raised=positions[rows["outcome"], :, 2] - positions[rows["precondition"], :, 2],
            positions=positions,
            logged=logged[logged["step"] <= (ended_at[-1] if len(ended_at) else 0)],
            places=planar(positions, before, after),
            sight=encode_recording(
                recording, experience, kept, positions, options.settings, options.seed
            ),
            levels=sight_settings(options.settings).abstraction.levels,
            region=_region(header),
        )


def _name(header: Header) -> str:
    objects = "" if header.objects == 1 else f", {header.objects} objects"
    return f"{display_name(header.controller)} {header.condition}{objects}"


def _region(header: Header) -> GoalRegion | None:
    try:
        return read_manifest(manifest_path(header.scene_source)).goals
    except SceneError:
        return None
