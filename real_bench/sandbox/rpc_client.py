"""Requests to an isolated controller, answered in time or not at all."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from real_bench.errors import (
    BrokenRuleError,
    ControllerError,
    ControllerFailedError,
    OutOfTimeError,
)
from real_bench.sandbox.channel import ChannelClosed, DeadlineExceeded
from real_bench.sandbox.faults import fault_of_kind
from real_bench.sandbox.limits import Limits
from real_bench.sandbox.messages import MessageError, Size, check_plain
from real_bench.sandbox.process import Process
from real_bench.sandbox.support import SandboxSupport
from real_bench.sandbox.visible_files import VisibleFiles
from real_bench.text.quoting import one_line, printable

ANSWER = Size(structure=1 << 16, numbers=1 << 24)
EXPLANATION = Size(structure=1 << 20, numbers=1 << 24)
LOGGED = Size(structure=1 << 20, numbers=0)
STATE = Size(structure=1 << 24, numbers=1 << 31)
MAX_FAULT_CHARACTERS = 2000
MAX_TRACEBACK_CHARACTERS = 5_000


class _ChildTraceback(Exception):  # noqa: N818  what another process says of an error there
    """The traceback in the child, as text."""

    def __str__(self) -> str:
        return f"in the controller's process:\n{self.args[0]}"


class RpcClient:
    """Requests to one child, and its answers.

    While it chooses an action, the child asks back for what it wants to see.

    Args:
        spec: how the user names the controller, for messages.
        visible: what it sees of the file system.

    Attributes:
        known_world: the number of the last world that it knows.
        limits: what it may use.
    """

    def __init__(
        self, spec: str, visible: VisibleFiles, limits: Limits, support: SandboxSupport
    ) -> None:
        self.spec = spec
        self.known_world = -1
        self.limits, self._time_left = limits, limits.total_s
        self._process = Process(support, visible, limits)
        self._error: ControllerError | None = None
        self._n_files = 0

    def ask(
        self,
        question: str,
        *arguments: Any,
        size: Size = ANSWER,
        observation: Mapping[str, Any] | None = None,
    ) -> Any:
        """The answer to a request; after a ControllerError no more requests are possible.

        Args:
            question: the name of the request.
            *arguments: its arguments.
            size: the largest answer.
            observation: what the child may ask back for.
        """
        if self._error is not None:
            raise self._error
        began = time.monotonic()
        allowed = min(self.limits.call_s, self._time_left)
        try:
            return self._answer(question, arguments, size, observation or {}, began + allowed)
        except DeadlineExceeded:
            why = f"{_describe_request(question, arguments)} {self._timeout_message(allowed)}"
            raise self._fail(OutOfTimeError, why) from None
        except MessageError as error:
            why = f"a message from its process was refused: {error}"
            raise self._fail(BrokenRuleError, why) from error
        except ChannelClosed:
            kind, how = self._process.exit_reason()
            raise self._fail(kind, f"{how} in {_describe_request(question, arguments)}") from None
        except ControllerError as error:
            self._error = error  # the reason for all later failures
            self.close()
            raise
        except BaseException:
            self.close()  # interrupted between question and answer: out of step
            raise
        finally:
            self._time_left -= time.monotonic() - began

    def new_file(self) -> Path:
        """The path of a new file for the child to read."""
        self._n_files += 1
        return self._process.inbox / f"experience-{self._n_files}.h5"

    def fault(
        self, what: str, kind: type[ControllerError] = ControllerFailedError
    ) -> ControllerError:
        """An error that names the controller."""
        return kind(f"controller {self.spec}: {what}")

    def close(self) -> None:
        """End the child."""
        self._error = self._error or self.fault("its process was ended")
        self._process.close()

    @property
    def is_over(self) -> bool:
        """Whether no more can be asked."""
        return self._error is not None

    def _answer(
        self,
        question: str,
        arguments: tuple[Any, ...],
        size: Size,
        observation: Mapping[str, Any],
        deadline: float,
    ) -> Any:
        channel = self._process.channel
        channel.send([question, *arguments], deadline)
        while True:
            match channel.receive(size, deadline):
                case ["answer", answer]:
                    check_plain(answer)
                    return answer
                case ["sense", str(key)] if key in observation:
                    channel.send(observation[key], deadline)
                case ["fault", str(kind), str(text), str(trace)]:
                    fault = one_line(printable(text[:MAX_FAULT_CHARACTERS]))
                    raise fault_of_kind(kind, fault) from _ChildTraceback(
                        trace[-MAX_TRACEBACK_CHARACTERS:]
                    )
                case _:
                    raise MessageError("it answered a question that was not asked")

    def _fail(self, kind: type[ControllerError], what: str) -> ControllerError:
        self._error = self.fault(what, kind)
        self.close()
        return self._error

    def _timeout_message(self, allowed: float) -> str:
        if allowed < self.limits.call_s:
            return f"did not end within the {self.limits.total_s:g} s of --total-limit (total_s)"
        return f"did not end within the {self.limits.call_s:g} s of --call-limit (call_s)"


def _describe_request(question: str, arguments: tuple[Any, ...]) -> str:
    """What the controller was doing, in its author's terms."""
    if question == "call":
        return f"{arguments[1]}()"
    names = {"identity": "its import", "make": "its creation", "copy": "its copying"}
    return names.get(question, f"{question}()")
