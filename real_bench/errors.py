"""All errors, as one family: every message can be shown to a user as it stands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, ClassVar

from real_bench.text.quoting import quoted

if TYPE_CHECKING:
    from pydantic import ValidationError


class RealBenchError(Exception):
    """Root of every error that the user can do something about.

    Attributes:
        exit_code: of a command that ends with it. 1: the job is broken; 3: the submission is bad;
            4: the controller failed.
    """

    exit_code: ClassVar[int] = 1


class SceneError(RealBenchError):
    """A scene that is unknown, not installed, or invalid."""


class ActionError(RealBenchError):
    """An action outside the action space: wrong key, shape, type or value."""


class PhysicsError(RealBenchError):
    """The simulated world exploded (NaN or infinite poses)."""


class ControllerError(RealBenchError):
    """A controller that cannot be found or used as asked, or that failed."""


class SubmissionError(ControllerError):
    """A submission, or any controller's code, that cannot be run."""

    exit_code = 3


class ControllerFailedError(ControllerError):
    """A controller that failed while it ran: it raised an error, or its process died."""

    exit_code = 4


class ControllerDeclinedError(ControllerFailedError):
    """A controller that says itself, by an error of this family, why it cannot go on."""


class StateError(ControllerFailedError):
    """A controller's state that cannot be stored."""


class OutOfTimeError(ControllerFailedError):
    """A controller that took longer than it may."""


class OutOfMemoryError(ControllerFailedError):
    """A controller that took more memory than it may."""


class ControllerStoppedError(ControllerFailedError):
    """A controller whose process ended by a signal that asks to stop; anybody may have sent it."""


class BrokenRuleError(ControllerFailedError):
    """A controller that did something forbidden."""


class RecordingError(RealBenchError):
    """A recording that cannot be read, written or continued."""


class GoalSetError(RealBenchError):
    """A goal set that cannot be read, or does not fit the run."""


class ResultError(RealBenchError):
    """A result file that cannot be read, written or continued."""


class ExperimentError(RealBenchError):
    """An experiment that is invalid, or whose files belong to something else."""


class Interrupted(KeyboardInterrupt):
    """The user asked to stop; everything up to here is kept.

    It is no :class:`RealBenchError`, so that whoever catches those and goes on does not go on here.

    Attributes:
        can_resume: whether ``resume`` continues.
    """

    def __init__(self, message: str, *, can_resume: bool = False) -> None:
        super().__init__(message)
        self.can_resume = can_resume


def in_short(reasons: Sequence[str], most: int = 3) -> str:
    """The first few reasons, and how many more there are."""
    more = f" (and {len(reasons) - most} more)" if len(reasons) > most else ""
    return f"{'. '.join(reasons[:most])}{more}"


def faults(
    error: ValidationError,
    most: int | None = None,
    unknown: Callable[[tuple[int | str, ...]], str] | None = None,
) -> str:
    """What is wrong with a record that did not pass its own checks, in one line.

    Args:
        error: what its check found.
        most: how many faults to report; None: all.
        unknown: given the place of an unknown name, lists the valid ones.
    """
    lines = []
    found = error.errors()
    places = [fault["loc"] for fault in found]
    for fault in found[:most]:
        length = len(fault["loc"])
        if fault["type"] == "too_short" and any(
            place[:length] == fault["loc"] and len(place) > length for place in places
        ):
            continue  # only because its content is wrong
        what = quoted(fault["msg"].removeprefix("Value error, "), 200)
        if fault["type"] in ("list_type", "tuple_type"):
            what = "a list is expected, as in [0, 0.5]"
        if unknown is not None and fault["type"] == "extra_forbidden":
            what = f"unknown name{unknown(fault['loc'])}"
        place = quoted(".".join(map(str, fault["loc"])))
        lines.append(f"{place}: {what}" if place else what)
    return "; ".join(lines)
