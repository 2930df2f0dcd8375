"""What users' files share: kinds of values, and how paths are resolved."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, Field

from real_bench.conditions import Condition
from real_bench.errors import RealBenchError
from real_bench.inputs.records import Record
from real_bench.inputs.spelling import spelled
from real_bench.lengths import LARGEST, MAX_TRIAL_STEPS

Seed = Annotated[int, Field(ge=0, le=LARGEST)]
Steps = Annotated[int, Field(ge=1, le=LARGEST)]
TrialSteps = Annotated[int, Field(ge=1, le=MAX_TRIAL_STEPS)]
Name = Annotated[
    str,
    spelled(
        "[A-Za-z0-9_][A-Za-z0-9_.,+-]*",
        "a name has no spaces: letters, digits and _ . , + - only, and none of . , + - first",
    ),
]
"""A name that becomes part of file names."""


def _condition(name: str) -> str:
    try:
        return Condition.parse(name).name
    except RealBenchError as error:
        raise ValueError(str(error)) from error


ConditionName = Annotated[str, AfterValidator(_condition)]


class SpecFile(Record):
    """A whole file, which says what to run, and where results go.

    Attributes:
        folder: of the file; paths in it are relative to this.
        title: shown above the results.
        results: folder of all results.
    """

    folder: Path
    title: str
    results: Path

    @property
    def results_folder(self) -> Path:
        """The folder of all results."""
        return self.folder / self.results

    def resolve_scene(self, scene: str) -> str:
        """A scene, by name or manifest, as found from any folder."""
        from real_bench.simulation.scene import shipped_scenes

        path = self.folder / scene
        is_path = path.suffix in (".yaml", ".yml") or path.is_dir()
        return str(path) if is_path and scene not in shipped_scenes() else scene
