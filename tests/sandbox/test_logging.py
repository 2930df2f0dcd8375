"""What an isolated controller logs is recorded as it would be without isolation, and checked."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from real_bench.errors import ControllerError
from real_bench.recording import Recording
from real_bench.sandbox import SandboxBackend
from real_bench.sandbox.proxy import SandboxProxy
from tests.phases.conftest import toy
from tests.sandbox.conftest import Play

LOGS = toy("logs:Logs")


def test_isolated_controller_logs_the_same(play: Play, isolated: SandboxBackend) -> None:
    inside, outside = (
        play(LOGS, out=f"{name}.h5", backend=backend)
        for name, backend in (("inside", isolated), ("outside", None))
    )
    for path, backend in ((inside, isolated), (outside, None)):
        play(LOGS, 2000, out=path.name, backend=backend, resume=True)
    with Recording(inside) as one, Recording(outside) as other:
        assert len(one.logged) == 1 + 2 + 1 + 2 * 3 + 1
        np.testing.assert_array_equal(one.logged, other.logged)


class Liar:
    def __init__(self, answer: Any) -> None:
        self.answer = answer

    def ask(self, *_: Any, **__: Any) -> Any:
        return self.answer


@pytest.mark.attacks
@pytest.mark.parametrize(
    "answer",
    [
        None,
        {"x": 1.0},
        [["x"]],
        [["x", 1.0, 2.0]],
        [["x", "y"]],
        [[1.0, 1.0]],
        [["", 1.0]],
        [["\x1b[2J", 1.0]],
        [["x" * 65, 1.0]],
        [["x", 1.0]] * 10_001,
        [["x", np.zeros(3)]],
    ],
    ids=lambda answer: repr(answer)[:20],
)
def test_process_that_lies_about_its_log_is_refused(answer: Any) -> None:
    proxy = SandboxProxy("mine.py", None, None, Liar(answer))  # type: ignore[arg-type]
    with pytest.raises(ControllerError, match=r"mine\.py: it"):
        proxy.take_logged()


@pytest.mark.attacks
def test_isolated_controller_that_logs_on_and_on_is_stopped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("real_bench.sandbox.proxy.MAX_ENTRIES_OF_STRANGERS", 20_000)
    answer = [["x", 1.0]] * 10_000
    proxy = SandboxProxy("mine.py", None, None, Liar(answer))  # type: ignore[arg-type]
    assert len(proxy.take_logged() + proxy.take_logged()) == 20_000
    with pytest.raises(ControllerError, match="it logged more than 20,000 numbers"):
        proxy.take_logged()
