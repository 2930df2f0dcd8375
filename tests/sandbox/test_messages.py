"""Messages: what is sent arrives, and whatever else arrives is refused."""

from __future__ import annotations

import socket
import struct
import threading
import time
from contextlib import suppress
from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from real_bench.sandbox import channel
from real_bench.sandbox.channel import Channel, ChannelClosed, DeadlineExceeded, SpinWait
from real_bench.sandbox.messages import (
    ARRAY_KINDS,
    HEAD,
    MessageError,
    Size,
    check_plain,
    decode,
    encode,
)

SMALL = Size(structure=1000, numbers=1000)
ANY = Size(structure=1 << 28, numbers=1 << 36)
ANY_ARRAY = arrays.arrays(
    st.sampled_from(ARRAY_KINDS), arrays.array_shapes(min_dims=0, max_dims=4, min_side=0)
)
PLAIN = (
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats()
    | st.text()
    | ANY_ARRAY
)
VALUES = st.recursive(
    PLAIN, lambda part: st.lists(part) | st.dictionaries(st.text(), part), max_leaves=20
)


def parts(message: bytes) -> tuple[bytes, bytes]:
    n_structure, n_numbers = HEAD.unpack_from(message)
    structure, numbers = message[HEAD.size :][:n_structure], message[HEAD.size + n_structure :]
    assert len(numbers) == n_numbers
    return structure, numbers


def same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray):
        return bool(a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes())
    if isinstance(a, list):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    return type(a) is type(b) and (a == b or a != a)


@given(VALUES)
def test_sent_values_arrive_unchanged(value: Any) -> None:
    assert same(value, decode(*parts(encode(value))))


def test_received_arrays_are_writable_copies() -> None:
    content = bytearray(b"".join(parts(encode([np.arange(3), np.arange(3)]))))
    structure = bytes(content[:-48])
    one, other = decode(structure, content[-48:])
    one[:] = 7
    np.testing.assert_array_equal(other, [0, 1, 2])
    assert one.flags.writeable
    assert one.flags.owndata


def test_order_and_byte_order_do_not_matter() -> None:
    array = np.arange(6, dtype=">i4").reshape(2, 3)[:, ::-1]
    arrived = decode(*parts(encode(array)))
    np.testing.assert_array_equal(arrived, array)
    assert arrived.dtype == np.dtype("<i4")


def test_received_bools_are_zero_or_one() -> None:
    structure, _ = parts(encode(np.array([True, False, True])))
    assert decode(structure, b"\2\0\377").tobytes() == b"\1\0\1"


class Number(int):
    """A number with opinions."""


@pytest.mark.parametrize(
    "value",
    [
        object(),
        Number(3),
        {1, 2},
        2**70,
        np.float64(1),
        np.array([object()]),
        np.array(["a"]),
        np.zeros(2, [("a", "f8")]),
        np.zeros(1, np.longdouble),
    ],
    ids=lambda value: type(value).__name__,
)
def test_only_plain_data_can_be_sent(value: Any) -> None:
    with pytest.raises(MessageError):
        encode([value])


def described(kind: int, *shape: int, n_dimensions: int | None = None) -> bytes:
    n = len(shape) if n_dimensions is None else n_dimensions
    content = struct.pack("<BB", kind, n) + struct.pack(f"<{len(shape)}Q", *shape)
    return bytes(msgpack.packb(msgpack.ExtType(1, content)))


HOSTILE = {
    "huge": (described(11, 2**40), b""),
    "overflowing": (described(11, 2**32, 2**32, 2**32), b""),
    "huge beside zero": (described(11, 2**63, 2**63, 0), b""),
    "more than sent": (described(11, 3), bytes(16)),
    "less than sent": (described(11, 1), bytes(16)),
    "unknown kind": (described(99, 1), bytes(8)),
    "too many dimensions": (described(2, *[1] * 17), b"\0"),
    "shape cut short": (described(2, n_dimensions=1), b"\0"),
    "no description": (bytes(msgpack.packb(msgpack.ExtType(1, b""))), b""),
    "other extension": (bytes(msgpack.packb(msgpack.ExtType(5, b"x"))), b""),
    "time stamp": (bytes(msgpack.packb(msgpack.Timestamp(0))), b""),
    "bytes": (b"\xc4\x01x", b""),
    "not text": (b"\xa2\xff\xfe", b""),
    "key that is a list": (b"\x81\x90\xc0", b""),
    "cut short": (b"\x92\xc0", b""),
    "two values": (b"\xc0\xc0", b""),
    "nothing": (b"", b""),
    "nested": (b"\x91" * 5000 + b"\xc0", b""),
    "array without end": (b"\xdd\xff\xff\xff\xff", b""),
    "text without end": (b"\xdb\xff\xff\xff\xff", b""),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_malformed_messages_are_refused(name: str) -> None:
    with pytest.raises(MessageError):
        check_plain(decode(*HOSTILE[name]))


@given(st.binary(), st.binary())
def test_random_bytes_raise_only_message_errors(structure: bytes, numbers: bytes) -> None:
    with suppress(MessageError):
        check_plain(decode(structure, numbers))


def test_nesting_has_a_limit() -> None:
    value: Any = 1
    for _ in range(40):
        value = [value]
    with pytest.raises(MessageError, match="nested"):
        check_plain(value)


@pytest.fixture
def ends() -> Any:
    one, other = socket.socketpair()
    with one, other:
        yield one, other


def test_oversized_messages_are_refused_before_they_are_read(ends: Any) -> None:
    for n_structure, n_numbers in ((1001, 0), (0, 2**60), (2**32 - 1, 2**64 - 1)):
        ends[0].sendall(HEAD.pack(n_structure, n_numbers))
        with pytest.raises(MessageError, match="declares"):
            Channel(ends[1].dup()).receive(SMALL)


def test_consecutive_messages_stay_separate(ends: Any) -> None:
    Channel(ends[0]).send("one")
    ends[0].sendall(encode([np.zeros(3)]) + encode(None))
    channel = Channel(ends[1])
    assert channel.receive(SMALL) == "one"
    assert channel.receive(SMALL)[0].shape == (3,)
    assert channel.receive(SMALL) is None


def test_incomplete_message_raises_late_or_closed(ends: Any) -> None:
    ends[0].sendall(HEAD.pack(10, 0) + b"abc")
    channel = Channel(ends[1])
    with pytest.raises(DeadlineExceeded):
        channel.receive(SMALL, time.monotonic() + 0.05)
    ends[0].close()
    with pytest.raises(ChannelClosed):
        channel.receive(SMALL, time.monotonic() + 60)


def test_send_without_a_listener_raises_late(ends: Any) -> None:
    with pytest.raises(DeadlineExceeded):
        Channel(ends[0]).send(np.zeros(10**6), time.monotonic() + 0.05)


@given(values=st.lists(VALUES, min_size=1, max_size=3), vain=st.integers(0, 2))
def test_spinning_receiver_gets_the_same_values(values: list[Any], vain: int) -> None:
    """Whether the messages were there, come while it is awake, or once it has gone to sleep."""
    ours, theirs = socket.socketpair()
    with ours, theirs:
        sender, receiver = Channel(ours), Channel(theirs, SpinWait())
        for _ in range(vain):
            with pytest.raises(DeadlineExceeded):
                receiver.receive(ANY, time.monotonic() + 0.002)
        thread = threading.Thread(target=lambda: list(map(sender.send, values)))
        thread.start()
        assert all(same(receiver.receive(ANY), value) for value in values)
        thread.join()


def test_receiver_that_spins_in_vain_goes_to_sleep() -> None:
    """The processor is needed elsewhere: a hundred waits cost hardly any of its time."""
    ours, theirs = socket.socketpair()
    with ours, theirs:
        receiver = Channel(theirs, SpinWait())
        began = time.thread_time()
        for _ in range(SpinWait.REST):
            with pytest.raises(DeadlineExceeded):
                receiver.receive(ANY, time.monotonic() + 0.001)
        assert time.thread_time() - began < SpinWait.REST * SpinWait.SECONDS / 2


def test_spinning_receiver_notices_a_closed_channel() -> None:
    ours, theirs = socket.socketpair()
    ours.close()
    with theirs, pytest.raises(ChannelClosed):
        Channel(theirs, SpinWait()).receive(ANY)


def test_a_deadline_far_away_is_no_deadline_near(monkeypatch: pytest.MonkeyPatch) -> None:
    """The system takes no timeout of more than some weeks: it is waited for in parts."""
    monkeypatch.setattr(channel, "LONGEST_WAIT_S", 0.01)
    ours, theirs = socket.socketpair()
    with ours, theirs:
        answer = threading.Timer(0.1, Channel(ours).send, [[1, 2]])
        answer.start()
        assert Channel(theirs).receive(ANY, time.monotonic() + 4_294_968) == [1, 2]
        answer.join()
