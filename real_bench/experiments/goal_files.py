"""The goal sets of an experiment: which are there, whether they fit it, and those to draw."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from real_bench.errors import ExperimentError, SceneError
from real_bench.experiments.job_state import mismatch_error, mismatch_message
from real_bench.experiments.spec import DrawnGoals, Spec

if TYPE_CHECKING:
    from real_bench.goal_sets import GoalSet


@dataclass(frozen=True)
class GoalFile:
    """A goal set of an experiment.

    Attributes:
        path: where it lies, or will lie once it is drawn.
        n_goals: how many goals it has, or will have.
        sha256: hash of its content; empty while it is not drawn yet.
        mismatches: what in it is not as the experiment says that it is drawn.
    """

    path: Path
    n_goals: int
    sha256: str = ""
    mismatches: tuple[str, ...] = ()


class GoalFiles:
    """All goal sets of an experiment, by name and number of objects; reads each file once."""

    def __init__(self, spec: Spec) -> None:
        self._spec = spec

    def __getitem__(self, key: tuple[str, int]) -> GoalFile:
        """The set of this name for so many objects."""
        return self._files[key]

    def check(self) -> None:
        """Check that drawn sets are as the experiment says, and that no cell has one twice.

        Raises:
            ExperimentError: they are not.
        """
        wrong = [
            mismatch_message(file.path, file.mismatches)
            for file in self._files.values()
            if file.mismatches
        ]
        if wrong:
            raise mismatch_error(wrong)
        for cell in self._spec.cells:
            names: dict[str, str] = {}
            for name in self._spec.goal_names(cell):
                sha256 = self[name, cell.objects].sha256
                if sha256 and names.setdefault(sha256, name) != name:
                    raise ExperimentError(
                        f"goals {names[sha256]} and {name} of cell {cell.name} are the same: "
                        "leave one of them out"
                    )

    def draw(self, *, overwrite: bool = False) -> Iterator[str]:
        """Draw what is missing; yields the name of each file before it is drawn.

        Args:
            overwrite: draw those anew, too, that are not as the experiment says.

        Raises:
            ExperimentError: some are not, and must not be overwritten.
        """
        from real_bench.goal_sets import generate_goal_set, save_goal_set
        from real_bench.simulation import load_scene

        if not overwrite:
            self.check()
        for (name, objects), file in list(self._files.items()):
            source = self._spec.goals[name]
            if isinstance(source, DrawnGoals) and (file.mismatches or not file.sha256):
                yield file.path.name
                scene = load_scene(self._spec.scene_source)
                drawn = generate_goal_set(scene, objects, source.seed, counts=_counts(source))
                save_goal_set(drawn, file.path)
                self._files[name, objects] = GoalFile(file.path, len(drawn), drawn.sha256)

    @cached_property
    def _files(self) -> dict[tuple[str, int], GoalFile]:
        wanted = {
            (name, cell.objects): None
            for cell in self._spec.cells
            for name in self._spec.goal_names(cell)
        }
        return {key: self._file(*key) for key in wanted}

    def _file(self, name: str, objects: int) -> GoalFile:
        from real_bench.goal_sets import load_goal_set

        source, path = self._spec.goals[name], self._spec.goal_file(name, objects)
        if not isinstance(source, DrawnGoals):
            found = load_goal_set(path)
            return GoalFile(path, len(found), found.sha256)
        if not path.exists():
            return GoalFile(path, sum(_counts(source).values()))
        found = load_goal_set(path)
        return GoalFile(path, len(found), found.sha256, tuple(self._mismatches(source, found)))

    def _mismatches(self, source: DrawnGoals, found: GoalSet) -> Iterator[str]:
        from real_bench.simulation import load_scene
        from real_bench.simulation.scene import manifest_path, read_manifest

        if found.seed != source.seed:
            yield f"seed {found.seed}, not {source.seed}"
        if found.counts != _counts(source):
            yield f"{_told(found.counts)}, not {_told(_counts(source))}"
        name = read_manifest(manifest_path(self._spec.scene_source)).name
        if found.scene != name:
            yield f"scene {found.scene}, not {name}"
            return
        with suppress(SceneError):  # a table may be printed where the scene is not installed
            if found.scene_sha256 != load_scene(self._spec.scene_source).sha256:
                yield f"scene {name} has changed since"


def _counts(source: DrawnGoals) -> dict[str, int]:
    """How many goals of each class, all of them named."""
    from real_bench.goal_sets.generator import OFFICIAL_COUNTS
    from real_bench.goal_sets.goal import CHALLENGES

    wanted = {str(kind): number for kind, number in (source.counts or OFFICIAL_COUNTS).items()}
    return {kind: wanted.get(kind, 0) for kind in CHALLENGES}


def _told(counts: dict[str, int]) -> str:
    """``2 of 2D, 1 of 3D``."""
    return ", ".join(f"{number} of {kind}" for kind, number in counts.items() if number)
