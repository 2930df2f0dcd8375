"""Pickles read as data: nothing that a pickle names is ever imported, called or changed.

A pickle is a program for a small stack machine. This machine knows only the instructions that
describe data. If a pickle asks to call something, the machine only notes the call
(:class:`PickledCall`) and leaves its interpretation to the reader; so there is nothing to abuse,
not even the attributes of an allowed class.
"""

from __future__ import annotations

import pickletools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from real_bench.errors import GoalSetError

MAX_INSTRUCTIONS = 1_000_000  # each may take some hundred bytes; official files have about 10,000


@dataclass(frozen=True)
class PickledName:
    """A class or function that a pickle names."""

    text: str


@dataclass(repr=False, eq=False)
class PickledCall:
    """A call that a pickle asked for, and the state that its result would get."""

    by: PickledName
    arguments: tuple[Any, ...]
    state: Any = None


@dataclass(eq=False)
class _Machine:
    """Stack and memo while a pickle is read."""

    allowed: frozenset[str]
    stack: list[Any] = field(default_factory=list)
    below_marks: list[list[Any]] = field(default_factory=list)
    memo: dict[int, Any] = field(default_factory=dict)

    def push(self, value: Any) -> None:
        self.stack.append(value)

    def mark(self, _: Any) -> None:
        self.below_marks.append(self.stack)
        self.stack = []

    def pop_to_mark(self) -> list[Any]:
        items, self.stack = self.stack, self.below_marks.pop()
        return items

    def remember(self, index: int) -> None:
        self.memo[index] = self.stack[-1]

    def memoize(self, _: Any) -> None:
        self.memo[len(self.memo)] = self.stack[-1]

    def recall(self, index: int) -> None:
        self.push(self.memo[index])

    def tuple_of(self, count: int) -> None:
        items = [self.stack.pop() for _ in range(count)]
        self.push(tuple(reversed(items)))

    def append(self, _: Any) -> None:
        self.extend([self.stack.pop()])

    def extend(self, items: list[Any]) -> None:
        _expect(self.stack[-1], list).extend(items)

    def set_item(self, _: Any) -> None:
        value, key = self.stack.pop(), self.stack.pop()
        self.update([key, value])

    def update(self, items: list[Any]) -> None:
        target = _expect(self.stack[-1], dict)
        for key, value in zip(items[::2], items[1::2], strict=True):
            # Only text: the hash of nested tuples takes a time that doubles with each level.
            target[_expect(key, str)] = value

    def name(self, text: str) -> None:
        if text not in self.allowed:
            raise GoalSetError(f"it asks for {text[:100]!r}, which no goal needs: refused")
        self.push(PickledName(text))

    def name_from_stack(self, _: Any) -> None:
        name, module = (_expect(self.stack.pop(), str) for _ in range(2))
        self.name(f"{module} {name}")

    def make(self, _: Any) -> None:
        arguments = _expect(self.stack.pop(), tuple)
        self.push(PickledCall(_expect(self.stack.pop(), PickledName), arguments))

    def build(self, _: Any) -> None:
        state = self.stack.pop()
        _expect(self.stack[-1], PickledCall).state = state


_INSTRUCTIONS: dict[str, Callable[[_Machine, Any], None]] = {
    "PROTO": lambda machine, _: None,
    "FRAME": lambda machine, _: None,
    "NONE": lambda machine, _: machine.push(None),
    "NEWTRUE": lambda machine, _: machine.push(True),
    "NEWFALSE": lambda machine, _: machine.push(False),
    **dict.fromkeys(("BININT", "BININT1", "BININT2"), _Machine.push),
    **dict.fromkeys(("BINUNICODE", "SHORT_BINUNICODE"), _Machine.push),
    **dict.fromkeys(("BINBYTES", "SHORT_BINBYTES"), _Machine.push),
    "MARK": _Machine.mark,
    **dict.fromkeys(("BINPUT", "LONG_BINPUT"), _Machine.remember),
    "MEMOIZE": _Machine.memoize,
    **dict.fromkeys(("BINGET", "LONG_BINGET"), _Machine.recall),
    "EMPTY_TUPLE": lambda machine, _: machine.push(()),
    "TUPLE1": lambda machine, _: machine.tuple_of(1),
    "TUPLE2": lambda machine, _: machine.tuple_of(2),
    "TUPLE3": lambda machine, _: machine.tuple_of(3),
    "TUPLE": lambda machine, _: machine.push(tuple(machine.pop_to_mark())),
    "EMPTY_LIST": lambda machine, _: machine.push([]),
    "APPEND": _Machine.append,
    "APPENDS": lambda machine, _: machine.extend(machine.pop_to_mark()),
    "EMPTY_DICT": lambda machine, _: machine.push({}),
    "SETITEM": _Machine.set_item,
    "SETITEMS": lambda machine, _: machine.update(machine.pop_to_mark()),
    "GLOBAL": _Machine.name,
    "STACK_GLOBAL": _Machine.name_from_stack,
    "REDUCE": _Machine.make,
    "NEWOBJ": _Machine.make,
    "BUILD": _Machine.build,
}


def read_pickle(data: bytes, allowed: frozenset[str]) -> object:
    """Read a pickle of protocols 2 to 4 into plain data, PickledName and PickledCall.

    Args:
        data: the pickle.
        allowed: the ``module name`` pairs that it may mention.

    Raises:
        GoalSetError: it mentions another name, is damaged, or does more than describe data.
    """
    machine = _Machine(allowed)
    try:
        for name, argument in _instructions(data):
            if name == "STOP":
                return machine.stack.pop()
            if name not in _INSTRUCTIONS:
                raise GoalSetError(f"it holds the pickle instruction {name}: refused")
            _INSTRUCTIONS[name](machine, argument)
    except (ValueError, IndexError, KeyError, OverflowError) as error:
        raise GoalSetError(f"its pickle is damaged ({type(error).__name__})") from error
    raise GoalSetError("its pickle has no end")


def _instructions(data: bytes) -> Iterator[tuple[str, Any]]:
    for count, (instruction, argument, _) in enumerate(pickletools.genops(data)):
        if count >= MAX_INSTRUCTIONS:
            raise GoalSetError(f"its pickle has more than {MAX_INSTRUCTIONS} instructions")
        yield instruction.name, argument


def _expect(value: Any, kind: type[Any]) -> Any:
    if type(value) is not kind:
        raise GoalSetError(f"its pickle has {type(value).__name__} instead of {kind.__name__}")
    return value
