"""What there is to do for an experiment, and what of it is left."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

from real_bench.experiments.spec import Cell, DrawnGoals, Play, Spec
from real_bench.experiments.state import State, not_of_this, refusal, state_of
from real_bench.experiments.tasks import PlayTask, ScoringTask, Task

_T = TypeVar("_T", PlayTask, ScoringTask)


@dataclass(frozen=True)
class Work:
    """The tasks that are left.

    Attributes:
        plays: intrinsic phases.
        scorings: tests, of which some wait for one of the plays.
    """

    plays: tuple[PlayTask, ...]
    scorings: tuple[ScoringTask, ...]

    @property
    def n_steps(self) -> int:
        """How many steps of simulation there are to do."""
        return sum(task.n_steps for task in (*self.plays, *self.scorings))

    def __len__(self) -> int:
        return len(self.plays) + len(self.scorings)


class Agenda:
    """All tasks of an experiment, and how far they have come; looks at each file once.

    Args:
        spec: the experiment.
        isolate: have every controller in a process of its own, within walls.
    """

    def __init__(self, spec: Spec, *, isolate: bool = False) -> None:
        self._spec = spec
        self._isolate = isolate
        self._states: dict[Path, State] = {}

    def state(self, task: Task) -> State:
        """How far a task had come when it was first asked for."""
        if task.out not in self._states:
            self._states[task.out] = state_of(task)
        return self._states[task.out]

    def scorings(self, cell: Cell, seed: int) -> list[ScoringTask]:
        """The tests that make one repeat of a cell, one a goal set."""
        spec, play = self._spec, self.play(cell, seed)
        return [
            ScoringTask(
                **self._told(f"{cell.name}-seed{seed}-{goals}", cell, cell.objects, seed, ".json"),
                trial_steps=spec.trial_steps,
                goals=spec.goal_file(goals, cell.objects),
                n_goals=self._goals[goals, cell.objects][0],
                goals_sha256=self._goals[goals, cell.objects][1],
                run=play.out if play else None,
                run_steps=play.steps if play else 0,
                play=play.name if play else None,
            )
            for goals in spec.goal_names(cell)
        ]

    def play(self, cell: Cell, seed: int) -> PlayTask | None:
        """What one repeat of a cell learns from; cells that share a play get the same task."""
        found = self._spec.play_of(cell)
        if found is None:
            return None
        name, play = found
        return PlayTask(
            **self._told(f"{name}-seed{seed}", play, cell.objects, seed, ".h5"),
            steps=self._spec.steps,
            images=play.images,
        )

    def check_settings(self) -> None:
        """Find out before any work is done whether settings are what their controllers take.

        Raises:
            ControllerError: they are not.
        """
        checked: list[tuple[str, dict[str, Any]]] = []
        for cell in self._spec.cells:
            seed = self._spec.seeds(cell)[0]
            for task in (*self.scorings(cell, seed), self.play(cell, seed)):
                if task is not None and task.settings:
                    if (task.controller, task.settings) not in checked:
                        task.settings_in_full()
                    checked.append((task.controller, task.settings))

    def left(self, *, go_on: bool = False, overwrite: bool = False) -> Work:
        """What is left to do: tests that are not done, and the plays that these need.

        Args:
            go_on: go on with recordings that were cut, instead of beginning them anew.
            overwrite: do again what is not as the experiment says.

        Raises:
            ExperimentError: files are not as the experiment says, and are not to be overwritten.
        """
        repeats = [(cell, seed) for cell in self._spec.cells for seed in self._spec.seeds(cell)]
        tests = [task for repeat in repeats for task in self.scorings(*repeat)]
        scorings = self._left(tests, overwrite)
        needed = {task.play for task in scorings}
        tasks = [self.play(*repeat) for repeat in repeats]
        plays = {task.name: task for task in tasks if task and task.name in needed}
        to_play = self._left(list(plays.values()), overwrite)
        return Work(
            tuple(task.model_copy(update={"go_on": go_on}) for task in to_play), tuple(scorings)
        )

    def draw_goals(self) -> Iterator[str]:
        """Draw the goal sets that are missing; tells the name of each before it is drawn."""
        from real_bench.goal_sets import generate_goal_set, save_goal_set
        from real_bench.simulation import load_scene

        spec = self._spec
        for name, objects in self._goals:
            source, path = spec.goals[name], spec.goal_file(name, objects)
            if isinstance(source, DrawnGoals) and not path.exists():
                yield path.name
                scene = load_scene(spec.scene_source)
                drawn = generate_goal_set(scene, objects, source.seed, counts=_counts(source))
                save_goal_set(drawn, path)

    def _told(
        self, name: str, who: Cell | Play, objects: int, seed: int, suffix: str
    ) -> dict[str, Any]:
        """What a play and a test are told alike."""
        return {
            "name": name,
            "controller": self._spec.controller(who.controller),
            "condition": who.condition,
            "objects": objects,
            "scene": self._spec.scene_source,
            "scene_name": self._scene_name,
            "seed": seed,
            "settings": who.settings,
            "out": self._spec.results_folder / f"{name}{suffix}",
            "isolate": self._isolate,
        }

    def _left(self, tasks: Sequence[_T], overwrite: bool) -> list[_T]:
        """What is not done yet, or not as it should be."""
        states = [(task, self.state(task)) for task in tasks]
        wrong = [not_of_this(task, state.misfits) for task, state in states if state.misfits]
        if wrong and not overwrite:
            raise refusal(wrong)
        return [task for task, state in states if state.misfits or state.reached != "done"]

    @cached_property
    def _goals(self) -> dict[tuple[str, int], tuple[int, str]]:
        """How many goals each set has, and its hash where it is there, by name and objects."""
        from real_bench.goal_sets import load_goal_set

        found: dict[tuple[str, int], tuple[int, str]] = {}
        for cell in self._spec.cells:
            for name in self._spec.goal_names(cell):
                source = self._spec.goals[name]
                path = self._spec.goal_file(name, cell.objects)
                if isinstance(source, DrawnGoals) and not path.exists():
                    found[name, cell.objects] = sum(_counts(source).values()), ""
                elif (name, cell.objects) not in found:
                    goal_set = load_goal_set(path)
                    found[name, cell.objects] = len(goal_set), goal_set.sha256
        return found

    @cached_property
    def _scene_name(self) -> str:
        from real_bench.simulation.scene import manifest_path, read_manifest

        return read_manifest(manifest_path(self._spec.scene_source)).name


def _counts(source: DrawnGoals) -> dict[str, int]:
    from real_bench.goal_sets.generator import OFFICIAL_COUNTS

    return {str(kind): number for kind, number in (source.counts or OFFICIAL_COUNTS).items()}
