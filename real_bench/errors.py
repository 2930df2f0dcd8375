"""What can go wrong, as one family: every message is fit to be shown to a user as it stands."""


class RealBenchError(Exception):
    """Root of every error that the user can do something about."""


class SceneError(RealBenchError):
    """A scene that is unknown, not installed, or wrongly described."""


class ActionError(RealBenchError):
    """An action outside the action space: wrong key, shape, type or value."""


class PhysicsError(RealBenchError):
    """The simulated world left the realm of numbers (NaN or infinite poses)."""


class ControllerError(RealBenchError):
    """A controller that cannot be found, loaded or run."""


class RecordingError(RealBenchError):
    """A recording that cannot be read, written or continued."""


class GoalSetError(RealBenchError):
    """A goal set that cannot be read, or does not fit the run."""


class ResultError(RealBenchError):
    """A result file that cannot be read, written or continued."""


class Interrupted(RealBenchError):  # noqa: N818  a wish, not a fault
    """The user asked to stop; everything up to here is kept."""
