"""Find out in a second, before hours of play, whether a controller works."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from real_bench.actions import Action
from real_bench.conditions import Condition
from real_bench.errors import ControllerDeclinedError, Interrupted, RealBenchError
from real_bench.files.locks import temporary_folder
from real_bench.lengths import TRIAL_STEPS
from real_bench.phases.extrinsic import ExtrinsicPhase
from real_bench.phases.intrinsic import NEVER_TAKEN, IntrinsicPhase, without_hints
from real_bench.phases.plans import plan_test_after
from real_bench.phases.player import make_player
from real_bench.phases.proxy import (
    ControllerBackend,
    ControllerProxy,
    Identity,
    close_on_error,
)
from real_bench.recording.state import (
    ControllerState,
    is_same_state,
    restore_state,
    strip_state,
)
from real_bench.simulation.scene import Scene
from real_bench.task import Task

N_STEPS = 20
"""Steps to try; before a goal is tested, the first action is tried whole."""

N_TIMES = 3
"""How often as long the play lasts from which a tested goal may be learned."""

SEED = 0
LOSES_ALL = (
    "what it learns at play is lost, since another process tests it: define get_state() and "
    "set_state(), or use_experience()"
)
SURVIVES = "survives set_state(get_state())"
CHANGES = "set_state(get_state()) gives another state"


@dataclass(frozen=True)
class Finding:
    """The outcome of one check.

    Attributes:
        what: what was checked.
        good: whether it passed.
        detail: the outcome in a few words.
    """

    what: str
    good: bool
    detail: str


@dataclass(frozen=True)
class ControllerCheck:
    """A controller to be checked.

    Attributes:
        controller: name, ``module:Class`` or file.
        condition, scene, objects: what it is made for.
        settings: values for its settings.
        backend: where it runs.
        is_tested_elsewhere: whether it is tested in another process than it played in, to which it
            must hand over what it learned.
        tests_a_goal: whether to play, learn and test a goal in small, too; scene and objects need a
            shipped goal set.
    """

    controller: str
    condition: Condition
    scene: Scene
    objects: int
    settings: Mapping[str, Any]
    backend: ControllerBackend
    is_tested_elsewhere: bool = False
    tests_a_goal: bool = False

    def findings(self) -> Iterator[Finding]:
        """Run one check after the other, up to the first that fails."""
        try:
            identity = self.backend.identity(self.controller, self.settings)
            yield Finding("loads", True, f"{identity}, {_level(identity)}")
            if identity.misspelt:
                yield Finding("hooks", True, f"unknown here: {', '.join(identity.misspelt)}")
            with closing(Task(self.scene, self.condition, self.objects)) as task:
                yield from self._check_play(task, identity)
        except RealBenchError as error:
            yield Finding("fails", False, str(error))
        except Interrupted as stop:  # nothing of a check is kept
            raise Interrupted("stopped") from stop

    def _check_play(self, task: Task, identity: Identity) -> Iterator[Finding]:
        with self._proxy(task) as proxy:
            yield Finding("is made", True, f"for {self.condition.name}")
            proxy.seed(SEED)
            task.begin()
            proxy.call("start_intrinsic_phase")
            whole = identity.action_level and self.tests_a_goal
            tried = TRIAL_STEPS if whole else N_STEPS
            first = make_player(proxy, task).play(tried)
            yield Finding("plays", True, f"{first.duration:,} steps{_beyond(first, task)}")
            if identity.learns_across_trials:
                yield Finding("copies", True, "not needed: one controller meets all goals in order")
            else:
                proxy.copy().close()
                yield Finding("copies", True, "each goal gets its own copy")
            state = self._state(task, proxy, identity)
            yield state
        if self.tests_a_goal and state.good:
            yield from self._test(task, identity, first.duration)

    def _state(self, task: Task, proxy: ControllerProxy, identity: Identity) -> Finding:
        if not identity.hands_over_state and identity.learns_from_experience:
            return Finding("state", True, "learns from the recording")
        if not identity.hands_over_state and self.is_tested_elsewhere:
            return Finding("state", False, LOSES_ALL)
        if not identity.hands_over_state:
            return Finding("state", True, "has none to hand over")
        if not identity.takes_state:
            return Finding("state", False, NEVER_TAKEN)
        same = self._survives(task, proxy.get_state())
        return Finding("state", same, f"{SURVIVES if same else CHANGES} (after its first action)")

    def _survives(self, task: Task, state: ControllerState) -> bool:
        """Whether a controller that is given a state hands over the same."""
        structure, arrays = strip_state(state)
        with self._proxy(task) as other:
            other.seed(SEED)
            other.set_state(restore_state(structure, lambda number: arrays[number]))
            return is_same_state(state, other.get_state())

    def _test(self, task: Task, identity: Identity, n_steps: int) -> Iterator[Finding]:
        """Play, learn and test a goal for ``n_steps`` as the commands do."""
        with temporary_folder("realbench-check-") as folder:
            play = IntrinsicPhase(
                self.controller,
                self.condition,
                self.objects,
                self.scene,
                N_TIMES * n_steps,
                SEED,
                folder / "run.h5",
                settings=self.settings,
                backend=self.backend,
            )
            with without_hints():
                proxy: ControllerProxy | None = play.run(lambda _: None)
            if proxy and identity.hands_over_state:
                with close_on_error(proxy):
                    same = self._survives(task, proxy.get_state())
                yield Finding("state", same, f"{SURVIVES if same else CHANGES} (after its play)")
                if not same:
                    proxy.close()
                    return
            if proxy and (identity.hands_over_state or identity.learns_from_experience):
                proxy.close()
                proxy = None  # another process would test it
            plan = plan_test_after(play, None, n_steps)
            test = ExtrinsicPhase(plan, 1, folder / "score.json")
            try:
                test.run(lambda _: None, proxy=proxy)
            except ControllerDeclinedError as error:  # it may need a longer play
                said = f"not tried: it declines after {play.steps:,} steps of play ({error})"
                yield Finding("tests", True, said)
                return
        yield Finding("tests", True, f"a goal, after {play.steps:,} steps of play")

    def _proxy(self, task: Task) -> closing[ControllerProxy]:
        return closing(self.backend.proxy(self.controller, self.settings, task))


def _beyond(action: Action, task: Task) -> str:
    """A remark where an action goes beyond the action space, as centimetres for metres would."""
    boxes = task.action_space.spaces
    keys = task.control.keys
    low, high = (
        np.concatenate([np.ravel(getattr(boxes[key], end)) for key in keys])
        for end in ("low", "high")
    )
    if not ((action.commands < low) | (action.commands > high)).any():
        return ""
    return f", beyond the action space (from {_rounded(low)} to {_rounded(high)}): is that meant?"


def _rounded(numbers: NDArray[np.float64]) -> str:
    return f"[{', '.join(f'{number:.3g}' for number in numbers)}]"


def _level(identity: Identity) -> str:
    return "whole actions" if identity.action_level else "one call per step"
