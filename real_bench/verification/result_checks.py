"""Check what a result claims besides its trials."""

from __future__ import annotations

from pathlib import Path

from real_bench.conditions import Condition
from real_bench.controller_code.source import ControllerSource, has_code_hash
from real_bench.errors import ControllerError
from real_bench.files.hashing import file_sha256
from real_bench.goal_sets import GoalSet, goals_in_proportion
from real_bench.lengths import TRIAL_STEPS
from real_bench.recording import Recording
from real_bench.scoring.result import Result
from real_bench.scoring.result_file import Content, is_sealed
from real_bench.simulation.scene import Scene
from real_bench.text.counting import counted
from real_bench.text.quoting import quoted
from real_bench.verification.versions import versions_differ


class ResultChecks:
    """The claims of a result, checked one by one.

    Args:
        content: what the file says.
        result: what was read from it.
        scene, goal_set: of the hashes that it names.

    Attributes:
        faults: what does not hold.
        notes: what could not be checked, or should be known.
    """

    def __init__(self, content: Content, result: Result, scene: Scene, goal_set: GoalSet) -> None:
        self._content, self._result, self._setting = content, result, result.setting
        self._scene, self._goal_set = scene, goal_set
        self.faults: list[str] = []
        self.notes: list[str] = []

    def check(self, run: Path | None, controller: str | None) -> None:
        """Check all of them; recording and controller only if given.

        Raises:
            ControllerError: the controller that is given cannot be found.
            RecordingError: the recording that is given cannot be read.
        """
        if not is_sealed(self._content):
            self.faults.append("the file was altered: its seal does not match its content")
        self.notes += versions_differ(self._setting.versions)
        self._check_names()
        self._check_goals()
        self._check_lengths()
        self._check_run(run)
        self._check_controller(controller)

    def _check_names(self) -> None:
        scene, names = self._scene.name, self._goal_set.object_names
        if (self._setting.scene, self._setting.object_names) != (scene, names):
            scene_named = f"{self._setting.scene} with {', '.join(self._setting.object_names)}"
            self.faults.append(
                f"it names scene {quoted(scene_named)}, these are {scene} with {', '.join(names)}"
            )

    def _check_goals(self) -> None:
        """The goals of a part follow a rule, so that nobody picks the easy ones."""
        numbers, size = self._setting.goal_numbers, len(self._goal_set)
        if self._setting.n_goals is None:  # of an older version
            chosen = tuple(range(len(numbers)))
        else:
            chosen = goals_in_proportion(self._goal_set.classes, len(numbers))
        if numbers != chosen:
            self.faults.append(
                f"its goals ({len(numbers)}) are not those that a test of as many goals takes"
            )
        if len(numbers) < size:
            self.notes.append(f"only {len(numbers)} of {counted(size, 'goal')} were asked for")

    def _check_lengths(self) -> None:
        if self._setting.trial_steps != TRIAL_STEPS:
            self.notes.append(
                f"trials have {self._setting.trial_steps:,} steps, not {TRIAL_STEPS:,}"
            )

    def _check_run(self, run: Path | None) -> None:
        setting = self._setting
        if run is None:
            if setting.run_sha256 or setting.run_steps:
                self.notes.append(
                    "the recording it learned from was not checked (give it with --run)"
                )
            return
        with Recording(run) as recording:
            condition = Condition.parse(setting.condition)
            mismatches = recording.header.mismatches(
                condition, setting.objects, setting.scene_sha256
            )
            n_steps = recording.n_steps
        if file_sha256(run) != setting.run_sha256:
            mismatches.append("its hash differs")
        if not 1 <= setting.run_steps <= n_steps:
            mismatches.append(f"it has {n_steps:,} steps, not {setting.run_steps:,}")
        self.faults += [
            f"{run} is not the recording it learned from: {mismatch}" for mismatch in mismatches
        ]

    def _check_controller(self, controller: str | None) -> None:
        named = self._setting.controller if controller is None else controller
        try:
            is_tested_code = has_code_hash(
                ControllerSource.of(named), self._setting.controller_sha256
            )
        except ControllerError:
            if controller is not None:
                raise
            self.notes.append(
                f"controller {quoted(named)} not found, so its hash was not checked: name it with "
                "--controller"
            )
            return
        if not is_tested_code:
            where = self.notes if controller is None else self.faults
            where.append(
                f"controller {quoted(named)}, as it is here, is not the one that was tested "
                "(all code in its folder and below counts)"
            )
