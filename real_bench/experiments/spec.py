"""The parts of an experiment: plays, goal sets, and the cells of its table."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    Field,
    ValidationError,
    model_validator,
)

from real_bench.conditions import Condition
from real_bench.controller_code.manifest import find_submission
from real_bench.controller_code.source import ControllerSource
from real_bench.errors import ExperimentError, faults
from real_bench.fields import ConditionName, Name, Seed, SpecFile, Steps, TrialSteps
from real_bench.files.atomic import write_atomically
from real_bench.files.outputs import check_output
from real_bench.inputs.records import Record
from real_bench.inputs.yaml_files import read_mapping
from real_bench.lengths import INTRINSIC_STEPS, LARGEST, TRIAL_STEPS
from real_bench.text.naming import CONTROLLER_FILE
from real_bench.text.nearest import did_you_mean, unknown_name_hint

TEMPLATE = Path(__file__).with_name("template.yaml")

OWN, NONE, SHIPPED = "own", "none", "shipped"


class Published(Record):
    """A score as somebody published it.

    Attributes:
        mean: of the scores of its repetitions.
        standard_error: of that mean.
        repeats: how many repetitions there were.
    """

    mean: float
    standard_error: Annotated[float, Field(ge=0)] | None = None
    repeats: Annotated[int, Field(ge=1)] | None = None


class _PlayerSpec(Record):
    """Who plays, or is tested, and under which condition."""

    controller: str
    condition: ConditionName
    settings: dict[str, Any] = Field(default_factory=dict)


class Play(_PlayerSpec):
    """An intrinsic phase that several cells may share.

    Attributes:
        controller: name or file of the one that plays.
        condition: two letters: what it observes and commands.
        settings: of the controller, above its defaults.
        images: record images; None: as `realbench intrinsic` would.
    """

    images: bool | None = None


class DrawnGoals(Record):
    """Goals to draw.

    Attributes:
        seed: of the draw.
        counts: how many of each class; None: as many as the official sets have, 25, 15 and 10.
    """

    seed: Seed
    counts: dict[Literal["2D", "2.5D", "3D"], Annotated[int, Field(ge=0)]] | None = None


class Cell(_PlayerSpec):
    """One number of the table, from several repeats.

    Attributes:
        controller: name or file of the one that is tested.
        condition: two letters: what it observes and commands.
        settings: of the controller, above its defaults.
        objects: how many objects.
        name: unique; files begin with it.
        play: what is learned from: the name of a play, ``own``: the controller plays itself, or
            ``none``.
        goals: names of goal sets, all of which make one repeat; empty: all of the experiment.
        repeats: how many, each with another seed; None: as many as the experiment says.
        published: shown beside it.
        note: shown below the table.
    """

    objects: Annotated[int, Field(ge=1)] = 1
    name: Name = ""
    play: str = OWN
    goals: tuple[str, ...] = ()
    repeats: Annotated[int, Field(ge=1)] | None = None
    published: Published | None = None
    note: str = ""

    @model_validator(mode="before")
    @classmethod
    def _default_name(cls, values: Any) -> Any:
        if isinstance(values, dict) and "name" not in values:
            parts = [values.get("condition"), values.get("objects", 1)]
            plain = _short_name(str(values.get("controller")))
            return {**values, "name": "-".join([plain, *map(str, parts)])}
        return values

    @property
    def label(self) -> str:
        """The controller, and what else its name says, if one was given."""
        plain, ending = _short_name(self.controller), f"-{self.condition}-{self.objects}"
        return plain if self.name == plain + ending else self.name.removesuffix(ending)


def _shipped() -> dict[str, DrawnGoals | str]:
    return {SHIPPED: SHIPPED}


class Spec(SpecFile):
    """An experiment.

    Attributes:
        folder: of the file that describes it; paths in it are relative to this.
        title: shown above the table.
        results: folder of recordings and results.
        run: whether what is missing is run without --run.
        scene: name or manifest.
        steps: how long a play lasts.
        trial_steps: how long a trial lasts.
        repeats: how many, each with a seed of its own.
        seed: of the first repeat; those of the others follow.
        goals: goal sets by name: ``shipped``, a file, or goals to draw.
        plays: plays by name.
        cells: of the table, in its order.
    """

    run: bool = True
    scene: str = "official"
    steps: Steps = INTRINSIC_STEPS
    trial_steps: TrialSteps = TRIAL_STEPS
    repeats: Annotated[int, Field(ge=1)] = 1
    seed: Seed = 0
    goals: dict[Name, DrawnGoals | str] = Field(default_factory=_shipped, min_length=1)
    plays: dict[Name, Play] = Field(default_factory=dict)
    cells: Annotated[tuple[Cell, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _check_names(self) -> Spec:
        names = [cell.name for cell in self.cells]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise ValueError(f"two cells are named {', '.join(twice)}: give each a name")
        if taken := {OWN, NONE} & self.plays.keys():
            raise ValueError(
                f"a play cannot be named {min(taken)!r}, which cells say instead of one"
            )
        for cell in self.cells:
            if self.seeds(cell)[-1] > LARGEST:
                raise ValueError(f"cell {cell.name} has seeds of 2**63 or more")
            if cell.play not in (OWN, NONE, *self.plays):
                known = [OWN, NONE, *self.plays]
                raise ValueError(
                    f"cell {cell.name} learns from {cell.play!r}: use {', '.join(known)}"
                    f"{did_you_mean(cell.play, known)}"
                )
            if cell.play in self.plays:
                _check_compatible(cell, self.plays[cell.play])
            if twice := sorted({name for name in cell.goals if cell.goals.count(name) > 1}):
                raise ValueError(f"cell {cell.name} names goals {', '.join(twice)} twice")
            if unknown := [name for name in cell.goals if name not in self.goals]:
                raise ValueError(
                    f"cell {cell.name} has unknown goals {', '.join(unknown)}: use "
                    f"{', '.join(self.goals)}{did_you_mean(unknown[0], self.goals)}"
                )
        shared = {f"{cell.play}-{cell.objects}" for cell in self.cells if cell.play in self.plays}
        if taken := shared & {cell.name for cell in self.cells if cell.play == OWN}:
            raise ValueError(
                f"play and cell {', '.join(taken)} share a name, and so would their recordings"
            )
        return self

    @property
    def scene_source(self) -> str:
        """What the scene is found by, from anywhere."""
        return self.resolve_scene(self.scene)

    def seeds(self, cell: Cell) -> range:
        """The seed of each repeat of a cell."""
        return range(self.seed, self.seed + (cell.repeats or self.repeats))

    def goal_names(self, cell: Cell) -> tuple[str, ...]:
        """The goal sets of a cell."""
        return cell.goals or tuple(self.goals)

    def goal_file(self, name: str, objects: int) -> Path:
        """Where a goal set lies, or will lie once it is drawn."""
        from real_bench.goal_sets import shipped_goal_set

        source = self.goals[name]
        if isinstance(source, DrawnGoals):
            return self.results_folder / f"goals-{name}-{objects}.npy"
        if source != SHIPPED:
            return self.folder / source
        return shipped_goal_set(objects, self.scene)

    def play_of(self, cell: Cell) -> tuple[str, Play] | None:
        """The play that a cell learns from, and the prefix of its recordings' names."""
        if cell.play == NONE:
            return None
        if cell.play == OWN:
            played = Play(
                controller=cell.controller, condition=cell.condition, settings=cell.settings
            )
            return cell.name, played
        return f"{cell.play}-{cell.objects}", self.plays[cell.play]

    def controller(self, named: str) -> str:
        """A controller as found from anywhere: paths are relative to the spec."""
        if CONTROLLER_FILE.fullmatch(named) or find_submission(named, self.folder):
            return str(self.folder / named)
        return named

    def submission_name(self, cell: Cell) -> str:
        """The name of a cell's submission; empty if it is none, or the cell has its own name."""
        found = find_submission(cell.controller, self.folder)
        if found is None or cell.label != _short_name(cell.controller):
            return ""
        submission = ControllerSource.of(self.controller(cell.controller)).submission
        return "" if submission is None else submission.name


def read_spec(path: Path) -> Spec:
    """Read the file of an experiment; raises ExperimentError with every fault at once."""
    values = read_mapping(path, "the experiment", ExperimentError)
    defaults = {"title": path.stem, "results": path.stem}
    try:
        return Spec.model_validate({**defaults, **values, "folder": path.resolve().parent})
    except ValidationError as error:
        found = faults(error, unknown=unknown_name_hint(Spec, {"folder"}))
        raise ExperimentError(f"the experiment {path} is not valid: {found}") from error


def write_template(path: Path, *, overwrite: bool = False) -> None:
    """Write an experiment to start from, with every key explained.

    Raises:
        OutputError: the file exists, or cannot be written.
    """
    check_output(path, overwrite=overwrite, instead="another name")
    write_atomically(path, TEMPLATE.read_bytes())


def _check_compatible(cell: Cell, play: Play) -> None:
    """Raise ValueError if a play in one condition cannot be used in another."""
    learns, played = Condition.parse(cell.condition), Condition.parse(play.condition)
    link = f"cell {cell.name} learns from {cell.play!r}, which is played in {played.name}"
    if learns.control != played.control:
        raise ValueError(f"{link}: it needs a play in {learns.name}")
    if learns.sees_objects and not played.sees_objects:
        raise ValueError(f"{link} without seeing positions: it needs a play in {learns.name}")


def _short_name(controller: str) -> str:
    """What a controller may be called in a file's name."""
    target, _, kind = controller.partition(":")
    short = f"{Path(target).stem}-{kind}" if kind else Path(target).stem
    return re.sub(r"[^A-Za-z0-9_.+-]", "_", short)
