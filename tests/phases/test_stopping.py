from __future__ import annotations

import os
import signal

import pytest

from real_bench.errors import ControllerStoppedError, Interrupted
from real_bench.phases.stopping import stop_requests


def lose_controller(*, alone: bool) -> None:
    with stop_requests():
        if not alone:
            os.kill(os.getpid(), signal.SIGTERM)
        raise ControllerStoppedError("gone")


def test_controller_that_is_stopped_with_us_has_not_failed() -> None:
    with pytest.raises(Interrupted, match="gone"):
        lose_controller(alone=False)


def test_controller_that_is_stopped_alone_has_failed() -> None:
    with pytest.raises(ControllerStoppedError):
        lose_controller(alone=True)
