"""Answers that no honest child gives: each is refused by the parent, which trusts none of it."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any, cast

import numpy as np
import pytest

from real_bench.controller_code.source import ControllerSource
from real_bench.controls import MacroControl
from real_bench.errors import BrokenRuleError, ControllerError
from real_bench.observation import Observation
from real_bench.phases.proxy import Identity
from real_bench.sandbox.backend import _identity
from real_bench.sandbox.messages import HEAD, decode, encode
from real_bench.sandbox.proxy import SandboxProxy
from real_bench.sandbox.rpc_client import RpcClient

pytestmark = pytest.mark.attacks

IDENTITY = Identity(
    class_name="Forged",
    file="",
    code_sha256="",
    action_level=True,
    uses_images=False,
    learns_across_trials=False,
    learns_from_experience=False,
    takes_state=False,
    hands_over_state=False,
    settings={},
)
SEEN = Observation({})
ONE = np.array([1000])
NO = np.array([False])
MACRO = np.zeros((1, 4))


class Forger:
    """In place of a client: gives the same answer to whatever is asked."""

    known_world = -1

    def __init__(self, answer: Any) -> None:
        message = encode(answer)  # as it would arrive
        n_structure, _ = HEAD.unpack_from(message)
        split = HEAD.size + n_structure
        self.answer = decode(message[HEAD.size : split], message[split:])

    def ask(self, *question: Any, **options: Any) -> Any:
        return self.answer

    def fault(self, what: str, kind: type[ControllerError]) -> ControllerError:
        return kind(f"controller forged: {what}")


def toy(answer: Any) -> SandboxProxy:
    return SandboxProxy("forged", IDENTITY, MacroControl(), cast(RpcClient, Forger(answer)))


ACTIONS = {
    "nothing": None,
    "text": "left",
    "too little": [MACRO, ONE],
    "text in place of an array": ["left", ONE, NO],
    "not a number": [np.full((1, 4), [0, np.nan, 0, 0]), ONE, NO],
    "infinity": [np.full((1, 4), np.inf), ONE, NO],
    "too far": [np.full((1, 4), 1e300), ONE, NO],
    "no command": [np.zeros((0, 4)), np.zeros(0, int), np.zeros(0, bool)],
    "another size": [np.zeros((1, 9)), ONE, NO],
    "another shape": [np.zeros((1, 2, 2)), ONE, NO],
    "one number": [np.zeros(()), ONE, NO],
    "complex": [np.zeros((1, 4), complex) + 1j, ONE, NO],
    "no duration": [MACRO, np.array([0]), NO],
    "a negative duration": [MACRO, np.array([-1]), NO],
    "half a step": [MACRO, np.array([0.5]), NO],
    "a duration without end": [MACRO, np.array([2**62]), NO],
    "durations that overflow": [np.zeros((2, 4)), np.full(2, 2**62), np.zeros(2, bool)],
    "the largest duration": [MACRO, np.array([2**64 - 1], np.uint64), NO],
    "too many durations": [MACRO, np.array([1, 2]), NO],
    "a line": [MACRO, ONE, np.array([True])],
}
STEPS = {
    "nothing": None,
    "text": ["left", False],
    "no render": [np.zeros(4)],
    "a number for render": [np.zeros(4), 1],
    "not a number": [np.array([0, np.nan, 0, 0]), False],
    "infinity": [np.full(4, np.inf), False],
    "too far": [np.full(4, -1e300), False],
    "another size": [np.zeros(9), False],
    "no size": [np.zeros(0), False],
    "another shape": [np.zeros((2, 2)), False],
    "whole numbers": [np.zeros(4, int), False],
    "complex": [np.zeros(4, complex), False],
}
STATES = {
    "nothing": None,
    "no text": [1, []],
    "no list": ["{}", {}],
    "no JSON": ["{", []],
    "no dict": ["[]", []],
    "deep": ["[" * 100_000, []],
    "an array that is not there": ['{"a": {"__kept_as__": "array", "number": 3}}', []],
    "an array by name": ['{"a": {"__kept_as__": "array", "number": "x"}}', [np.zeros(1)]],
    "an array before the first": ['{"a": {"__kept_as__": "array", "number": -1}}', [np.zeros(1)]],
    "text for an array": ['{"a": {"__kept_as__": "bytes", "number": 0}}', ["x"]],
    "one array often": [
        '{"a": {"__kept_as__": "array", "number": 0}, "b": {"__kept_as__": "array", "number": 0}}',
        [np.zeros(1)],
    ],
    "a number of text": ['{"a": {"__kept_as__": "int", "value": []}}', []],
    "no mark": ['{"a": {"__kept_as__": []}}', []],
}
EXPLANATIONS = {
    "text": "because",
    "facts that are none": ["because", 3, [], None],
    "actions that are none": ["because", ["{}", []], ["push"], None],
    "positions that are text": ["because", ["{}", []], [], "here"],
    "positions of another shape": ["because", ["{}", []], [], np.zeros(3)],
    "positions that are not numbers": ["because", ["{}", []], [], np.full((1, 1, 2), np.nan)],
}


SETTINGS = {
    "no dict": [],
    "an array": {"a": np.zeros(3)},
    "not a number": {"a": [float("nan")]},
    "a name of bytes": {b"a": 1},
}


@pytest.mark.parametrize("name", ACTIONS)
def test_a_forged_action(name: str) -> None:
    with pytest.raises(ControllerError, match=r"controller forged: next_action\(\) returned a bad"):
        toy(ACTIONS[name]).next_action(SEEN)


@pytest.mark.parametrize("name", STEPS)
def test_a_forged_step(name: str) -> None:
    with pytest.raises(ControllerError, match=r"controller forged: step\(\) returned a bad action"):
        toy(STEPS[name]).step(SEEN)


@pytest.mark.parametrize("name", STATES)
def test_a_forged_state(name: str) -> None:
    with pytest.raises(
        ControllerError, match=r"controller forged: its process (hands|did not hand) over"
    ):
        toy(STATES[name]).get_state()


@pytest.mark.parametrize("name", EXPLANATIONS)
def test_a_forged_explanation(name: str) -> None:
    with pytest.raises(ControllerError, match=r"controller forged: (explain|its process)"):
        toy(EXPLANATIONS[name]).explain()


def identity_with(settings: Any) -> Identity:
    answer = {**asdict(IDENTITY), "settings": settings}
    del answer["code_sha256"]
    client = cast(RpcClient, Forger(answer))
    return _identity(client, ControllerSource.of("real_r"), {})


@pytest.mark.parametrize("name", SETTINGS)
def test_forged_settings(name: str) -> None:
    with pytest.raises(BrokenRuleError, match="controller forged: its process did not describe"):
        identity_with(SETTINGS[name])


def test_honest_answers_pass() -> None:
    """... so the forged ones are not refused for something else."""
    assert identity_with({"a": {"b": [1, 0.5, None]}}).settings == {"a": {"b": [1, 0.5, None]}}
    action = toy([MACRO, ONE, NO]).next_action(SEEN)
    assert action.duration == 1000
    command, render = toy([np.ones(4), True]).step(SEEN)
    assert command.tolist() == [1, 1, 1, 1]
    assert render
    assert toy(['{"a": {"__kept_as__": "array", "number": 0}}', [ONE]]).get_state()["a"] == ONE
    told = toy(["why", ['{"x": 1}', []], [[MACRO, ONE, NO]], np.zeros((1, 1, 2))]).explain()
    assert told is not None
    assert told.facts == {"x": 1}
