"""Messages over a socket, each with a size limit and a deadline."""

from __future__ import annotations

import socket
import time
from contextlib import suppress
from typing import Any

from real_bench.sandbox.messages import HEAD, MessageError, Size, decode, encode

_PIECE, _SPARE = 1 << 20, 1 << 12


class ChannelClosed(Exception):  # noqa: N818  a fact: the other end may close at any time
    """The other process is gone."""


class DeadlineExceeded(Exception):  # noqa: N818  a fact, reported with what took so long
    """The other process did not answer, or did not listen, in time."""


class SpinWait:
    """Busy-waits briefly for a message, since waking up takes longer than that.

    If the other end takes longer, or needs the busy processor, waiting is in vain: then the next
    messages are waited for asleep.
    """

    SECONDS = 500e-6  # a step of the simulation and its observation, with some to spare
    REST = 100

    def __init__(self) -> None:
        self._left_to_sleep = 0

    def take(self, end: socket.socket, n_bytes: int) -> bytes | None:
        """What arrives in the meantime, at most ``n_bytes``; None: nothing did."""
        if self._left_to_sleep:
            self._left_to_sleep -= 1
            return None
        until = time.perf_counter() + self.SECONDS
        while time.perf_counter() < until:
            with suppress(BlockingIOError):
                return end.recv(n_bytes, socket.MSG_DONTWAIT)
        self._left_to_sleep = self.REST
        return None


LONGEST_WAIT_S = 86_400.0
"""The system counts milliseconds in 32 bits."""


class Channel:
    """One end of a pair of sockets.

    Args:
        end: of the pair.
        spin_wait: busy-waiting, to receive with less delay.
    """

    def __init__(self, end: socket.socket, spin_wait: SpinWait | None = None) -> None:
        self._socket = end
        self._spin_wait = spin_wait
        self._received = bytearray()

    def send(self, value: Any, deadline: float | None = None) -> None:
        """Send a message; raises MessageError, ChannelClosed, or DeadlineExceeded."""
        message = encode(value)
        self._wait_until(deadline)
        try:
            self._socket.sendall(message)
        except TimeoutError as error:
            raise DeadlineExceeded from error
        except OSError as error:
            raise ChannelClosed from error

    def receive(self, largest: Size, deadline: float | None = None) -> Any:
        """The next message; raises MessageError, ChannelClosed, DeadlineExceeded."""
        self._fill(HEAD.size, deadline)
        n_structure, n_numbers = HEAD.unpack_from(self._received)
        if n_structure > largest.structure or n_numbers > largest.numbers:
            raise MessageError(
                f"it declares {n_structure} + {n_numbers} bytes, more than "
                f"{largest.structure} + {largest.numbers}"
            )
        split = HEAD.size + n_structure
        end = split + n_numbers
        self._fill(end, deadline)
        structure, numbers = bytes(self._received[HEAD.size : split]), self._received[split:end]
        del self._received[:end]
        return decode(structure, numbers)

    def close(self) -> None:
        """Close this end."""
        self._socket.close()

    def _fill(self, n_bytes: int, deadline: float | None) -> None:
        """Receive until ``n_bytes`` are here; memory is taken only as they come."""
        while len(self._received) < n_bytes:
            try:
                piece = self._piece(min(n_bytes - len(self._received) + _SPARE, _PIECE), deadline)
            except TimeoutError as error:
                if deadline is None or time.monotonic() < deadline:  # only the longest wait
                    continue
                raise DeadlineExceeded from error
            except OSError as error:
                raise ChannelClosed from error
            if not piece:
                raise ChannelClosed
            self._received += piece

    def _piece(self, n_bytes: int, deadline: float | None) -> bytes:
        if self._spin_wait and (piece := self._spin_wait.take(self._socket, n_bytes)) is not None:
            return piece
        self._wait_until(deadline)
        return self._socket.recv(n_bytes)

    def _wait_until(self, deadline: float | None) -> None:
        if deadline is None:
            if self._socket.gettimeout() is not None:  # of an earlier message
                self._socket.settimeout(None)
            return
        left = deadline - time.monotonic()
        if left <= 0:
            raise DeadlineExceeded
        self._socket.settimeout(min(left, LONGEST_WAIT_S))
