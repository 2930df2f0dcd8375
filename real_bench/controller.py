"""The contract between a controller and the benchmark, on one page.

A controller is a class of one of two kinds:

* derived from :class:`Controller`: it defines ``next_action`` (whole actions, which the benchmark
  executes in its fast loop) or ``step`` (one call per simulation step), and as many of the hooks
  below as it needs;
* derived from :class:`BasePolicy`, the official class API: it defines ``step``. Only the hooks
  marked with (*) are called; its other methods are its own. It sees observations as the
  official package makes them (``docs/official-api.md``).

Either way it is created with the two spaces, and called in this order::

    controller = YourClass(action_space, observation_space)                             (*)
    controller.seed(seed)
    # intrinsic phase
    controller.set_state(state)                   # only if a run is resumed,
    controller.resume_intrinsic_phase(experience) # with what was recorded before the cut
    controller.start_intrinsic_phase()                                                  (*)
    controller.step(...) or .next_action(...)     # until the phase's steps are over    (*)
    controller.end_intrinsic_phase(observation, reward, done)                           (*)
    controller.use_experience(experience)         # all of it: the time to learn
    state = controller.get_state()                # kept in the run file
    # extrinsic phase, perhaps in another process
    controller.set_state(state)
    controller.use_experience(experience)
    controller.start_extrinsic_phase()                                                  (*)
    for each goal:                                # each with a copy of the controller as it is here
        controller.seed(seed of the goal)
        controller.start_extrinsic_trial()                                              (*)
        controller.step(...) or .next_action(...)                                       (*)
        controller.end_extrinsic_trial(observation, reward, done)                       (*)
        controller.end_extrinsic_phase()                                                (*)

With ``learns_across_trials`` there is no copy: one controller meets all goals in order, and
``end_extrinsic_phase`` is called once, after the last. This is the default for the official class
API, which worked that way; a class may set it to false.

At play a controller may log numbers with ``self.log("loss", x)``; they are recorded.

A class with an attribute ``Settings`` (derived from :class:`real_bench.settings.Settings`) is
created with a third argument, a record of that class; users set its values by ``--set name=value``.
:class:`Controller` keeps it as ``self.settings``.

A controller sees observations and spaces, never the simulation, the goal file or the score.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, SupportsFloat

from real_bench.actions import Action
from real_bench.explanation import Explanation
from real_bench.logbook import add_entry
from real_bench.recording import ControllerState, Experience

if TYPE_CHECKING:
    from real_bench import settings

__all__ = ["Action", "BasePolicy", "Controller", "ControllerState", "Experience", "Explanation"]


class BasePolicy:
    """The official class API, one call per step; also importable as ``real_robots.policy``.

    Attributes:
        learns_across_trials: false if every goal gets a copy of the controller, as the intrinsic
            phase left it; then trials may be shared among processes.
        uses_images: true for a controller that learns from recorded images in every condition;
            they are then recorded even if it sees positions.
        Settings: the class of its settings, if it has any.
    """

    learns_across_trials = True
    uses_images = False
    Settings: ClassVar[type[settings.Settings] | None] = None

    def __init__(self, action_space: Any, observation_space: Any) -> None:
        self.action_space = action_space
        self.observation_space = observation_space

    def step(self, observation: Mapping[str, Any], reward: float, done: bool) -> Mapping[str, Any]:
        """The action dict for the next step.

        ``reward`` is always 0. The camera images of the next observation, even if it is passed to a
        hook, are zeros unless the action's ``render`` is true.
        """
        raise NotImplementedError(f"{type(self).__name__} has no step()")

    def start_intrinsic_phase(self) -> None:
        """Free play begins."""

    def end_intrinsic_phase(
        self, observation: Mapping[str, Any], reward: float, done: bool
    ) -> None:
        """Free play is over."""

    def start_extrinsic_phase(self) -> None:
        """The tests begin."""

    def end_extrinsic_phase(self) -> None:
        """The tests are over."""

    def start_extrinsic_trial(self) -> None:
        """A test begins: the next observation shows its goal."""

    def end_extrinsic_trial(
        self, observation: Mapping[str, Any], reward: float, done: bool
    ) -> None:
        """The test is over."""


class Controller(BasePolicy):
    """A controller with all the hooks of the benchmark; it defines ``next_action`` or ``step``.

    Attributes:
        learns_across_trials: true for a controller that keeps learning from one trial to the next.
            It is then tested in one process, goal after goal; any other controller meets every goal
            as the intrinsic phase left it.
        settings: the values of its ``Settings``; None without such a class.
    """

    learns_across_trials = False

    def __init__(self, action_space: Any, observation_space: Any, settings: Any = None) -> None:
        super().__init__(action_space, observation_space)
        self.settings = settings

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        """The next action; see :class:`real_bench.actions.Action` for how to make one.

        Values of the observation are computed only when read, so images cost nothing until then.
        """
        raise NotImplementedError(f"{type(self).__name__} has no next_action()")

    def seed(self, seed: int) -> None:
        """Seed the controller's randomness; the same seed must give the same play."""

    def resume_intrinsic_phase(self, experience: Experience) -> None:
        """Free play continues after an interruption, with everything recorded before it.

        So memories of what was seen need not be part of the state.
        """

    def get_state(self) -> ControllerState:
        """Everything needed to continue from here: generators, learned weights, counters."""
        return {}

    def set_state(self, state: ControllerState) -> None:
        """Continue from what :meth:`get_state` returned."""

    def use_experience(self, experience: Experience) -> None:
        """Learn from the triplets of the intrinsic phase, as far as the condition shows them.

        Called at the end of the phase, when what is learned is kept with the state, and again
        before the tests, after :meth:`set_state`: a controller that did not play learns then.
        """

    def explain(self) -> Explanation | None:
        """Why it chose the last action, for ``realbench extrinsic --explain``; None: no comment."""
        return None

    def log(self, name: str, value: SupportsFloat) -> None:
        """Log a number, e.g. a loss; at play it is kept in the recording.

        It is recorded with the numbers of steps and actions that had ended by then; what is logged
        within an action, or by ``use_experience`` at the end of the phase, counts at its end.
        ``realbench watch`` and ``realbench figures`` draw it. In trials it is ignored.

        Args:
            name: 1 to 64 printable bytes (UTF-8).
            value: any real number, also infinite or NaN.

        Raises:
            TypeError, ValueError: invalid name or number.
        """
        add_entry(self, name, value)
