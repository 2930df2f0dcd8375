from __future__ import annotations

import base64
import tracemalloc
import zlib
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from real_bench.actions import Action
from real_bench.errors import ResultError
from real_bench.lengths import MAX_TRIAL_STEPS
from real_bench.scoring.commands import Commands, row_type

NUMBERS = st.floats(-1e6, 1e6)


@st.composite
def actions(draw: st.DrawFn, size: int) -> Action:
    """Any action: with absent commands, with lines, with -0.0 and the smallest numbers."""
    k = draw(st.integers(1, 5))
    vector = st.one_of(st.lists(NUMBERS, min_size=size, max_size=size), st.just([np.nan] * size))
    commands = draw(st.lists(vector, min_size=k, max_size=k))
    durations = draw(st.lists(st.integers(1, 1000), min_size=k, max_size=k))
    lines = draw(st.lists(st.booleans(), min_size=k, max_size=k))
    return Action(np.array(commands), np.array(durations), np.array(lines))


def parts(action: Action) -> tuple[bytes, bytes, bytes]:
    return action.commands.tobytes(), action.n_steps.tobytes(), action.line.tobytes()


@given(st.sampled_from([4, 9]).flatmap(lambda size: st.lists(actions(size), min_size=1)))
def test_actions_survive_to_the_last_bit(given: list[Action]) -> None:
    commands = Commands.of(given)
    again = Commands.model_validate_json(commands.model_dump_json())
    assert again == commands
    assert [parts(action) for action in again.actions] == [parts(action) for action in given]
    assert again.n_steps == sum(action.duration for action in given)


@given(st.lists(actions(4), min_size=1, max_size=4), st.data())
def test_hash_covers_every_command_duration_and_line(
    given: list[Action], data: st.DataObject
) -> None:
    number = data.draw(st.integers(0, len(given) - 1))
    action = given[number]
    row = data.draw(st.integers(0, len(action.commands) - 1))
    commands, n_steps, line = action.commands.copy(), action.n_steps.copy(), action.line.copy()
    match data.draw(st.sampled_from(["command", "duration", "line"])):
        case "command":
            commands[row] = np.nextafter(np.nan_to_num(commands[row]), 9)
        case "duration":
            n_steps[row] += 1
        case "line":
            line[row] ^= True
    others = [*given[:number], Action(commands, n_steps, line), *given[number + 1 :]]
    assert Commands.of(others).sha256 != Commands.of(given).sha256


def test_hash_covers_where_actions_begin() -> None:
    one, two = Action.rest(4), Action.macro([[0.1, 0.2], [0.3, 0.4]])
    whole = Action(
        np.vstack([one.commands, two.commands]),
        np.append(one.n_steps, two.n_steps),
        np.append(one.line, two.line),
    )
    assert Commands.of([one, two]).sha256 != Commands.of([whole]).sha256


def test_ten_macros_take_less_than_a_kilobyte() -> None:
    random = np.random.default_rng(0)
    macros = [Action.macro(random.uniform(-0.5, 0.5, (2, 2))) for _ in range(10)]
    assert len(Commands.of(macros).model_dump_json()) < 1000


def packed(size: int, **columns: Any) -> dict[str, Any]:
    rows = np.zeros(3, row_type(size))
    rows["n_steps"], rows["begins"][0] = 10, 1
    for name, (row, value) in columns.items():
        rows[name][row] = value
    return declared(size, len(rows), zlib.compress(rows.tobytes()))


def declared(size: int, rows: int, content: bytes) -> dict[str, Any]:
    return {"size": size, "rows": rows, "data": base64.b64encode(content).decode()}


HONEST = packed(4)
RAW = zlib.decompress(base64.b64decode(HONEST["data"]))


def test_hand_packed_commands_are_read() -> None:
    assert Commands.model_validate(HONEST).n_steps == 30


@pytest.mark.parametrize(
    "content",
    [
        {**HONEST, "size": 3},
        {**HONEST, "size": 0},
        {**HONEST, "size": -4},
        {**HONEST, "size": 10**9},
        {**HONEST, "rows": 2},
        {**HONEST, "rows": 4},
        {**HONEST, "rows": 0},
        {**HONEST, "rows": MAX_TRIAL_STEPS + 1},
        {**HONEST, "data": ""},
        {**HONEST, "data": "no base64!"},
        {**HONEST, "data": HONEST["data"][:-4]},
        {**HONEST, "data": HONEST["data"] + "\n"},
        {**HONEST, "data": "ü" * 40},
        {**HONEST, "data": 7},
        {**HONEST, "dtype": "object"},
        declared(4, 3, RAW),
        declared(4, 3, zlib.compress(RAW) + b"more"),
        declared(4, 3, zlib.compress(RAW)[:-4]),
        declared(4, 3, zlib.compress(RAW + b"\0")),
        packed(4, command=(1, [np.nan, 0, 0, 0])),
        packed(4, command=(1, [np.inf] * 4)),
        packed(4, command=(1, [1e300, 0, 0, 0])),
        packed(4, n_steps=(1, 0)),
        packed(4, n_steps=(1, -5)),
        packed(4, n_steps=(1, 2**62)),
        packed(4, n_steps=(1, MAX_TRIAL_STEPS)),
        packed(4, line=(1, 2)),
        packed(4, begins=(1, 255)),
        packed(4, begins=(0, 0)),
    ],
    ids=lambda content: str({**content, "data": str(content["data"])[:12]}),
)
def test_malformed_commands_are_refused(content: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        Commands.model_validate(content)


def test_compression_bomb_is_never_unpacked() -> None:
    bomb = declared(9, MAX_TRIAL_STEPS, zlib.compress(bytes(2**26), 9))
    tracemalloc.start()
    with pytest.raises(ValueError, match="do not unpack"):
        Commands.model_validate(bomb)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 3 * MAX_TRIAL_STEPS * row_type(9).itemsize < 2**26


def test_too_long_trial_is_refused() -> None:
    with pytest.raises(ResultError, match="100,000 steps"):
        Commands.of([Action.rest(4, MAX_TRIAL_STEPS), Action.rest(4, 1)])
