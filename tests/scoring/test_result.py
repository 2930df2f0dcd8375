from __future__ import annotations

import base64
import contextlib
import functools
import json
import operator
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from real_bench.actions import Action
from real_bench.errors import ResultError
from real_bench.files import OutputError
from real_bench.scoring import result_file
from real_bench.scoring.commands import Commands
from real_bench.scoring.metric import object_scores
from real_bench.scoring.result import Result, Setting, TrialResult, load_result
from real_bench.scoring.result_file import sealed

NUMBERS = st.floats(-5, 5)
COMMANDS = Commands.of([Action.rest(4, 10_000)])
RESULTS = Path(__file__).parents[2] / "evaluation" / "results"
BOMB = base64.b64encode(zlib.compress(bytes(2**24), 9)).decode()
Content = dict[str, Any]


@st.composite
def trials(draw: st.DrawFn) -> list[TrialResult]:
    goals = draw(st.lists(st.integers(0, 3), unique=True))
    return [draw(trial(goal)) for goal in goals]


@st.composite
def trial(draw: st.DrawFn, goal: int) -> TrialResult:
    away = draw(st.tuples(st.floats(0, 2), st.floats(0, 2)))
    return TrialResult(
        goal=goal,
        challenge=draw(st.sampled_from(["2D", "2.5D", "3D"])),
        score=float(object_scores(away).sum()),
        distances=away,
        final_poses=draw(st.tuples(st.tuples(*[NUMBERS] * 7), st.tuples(*[NUMBERS] * 7))),
        actions_sha256=COMMANDS.sha256,
        commands=COMMANDS,
    )


@settings(deadline=None)
@given(trials(), st.floats(0, 1e6))
def test_a_result_survives_its_file(
    tmp_path_factory: pytest.TempPathFactory,
    setting: Setting,
    trials: list[TrialResult],
    seconds: float,
) -> None:
    path = tmp_path_factory.getbasetemp() / "score.json"
    result = Result(setting=setting)
    for trial in trials:
        result = result.with_trial(trial, seconds)
    result.save(path)
    assert load_result(path) == result
    assert [trial.goal for trial in result.trials] == sorted(trial.goal for trial in trials)
    assert result.is_complete == (len(trials) == 4)


def test_the_score_is_the_mean_over_goals(result: Result) -> None:
    assert result.score == pytest.approx((2 + 0.5 + 0.125) / 3)


def test_nothing_has_no_score(setting: Setting) -> None:
    with pytest.raises(ResultError):
        _ = Result(setting=setting).score


def test_the_file_shows_the_summary(result: Result, tmp_path: Path) -> None:
    result.save(tmp_path / "score.json")
    content = json.loads((tmp_path / "score.json").read_text())
    assert list(content)[-1] == "timing"
    assert not content["complete"]
    assert [row["name"] for row in content["summary"]] == ["2D", "3D", "total"]
    assert content["summary"][-1]["score"] == pytest.approx(0.875)


def test_a_truncated_file_is_refused_at_every_length(result: Result, tmp_path: Path) -> None:
    path = tmp_path / "score.json"
    result.save(path)
    content = path.read_bytes().rstrip()
    for length in range(0, len(content), 7):
        path.write_bytes(content[:length])
        check_refused(path)


def check_refused(path: Path) -> None:
    with pytest.raises(ResultError) as caught:
        load_result(path)
    assert str(path) in str(caught.value)
    assert str(caught.value).isprintable()
    assert len(str(caught.value)) < len(str(path)) + 1000


@pytest.mark.parametrize(
    "content",
    [b"", b"null", b"[]", b"{}", b"\xff\xfe", b"[" * 100_000, b'{"format": "other"}', b"1e999"],
    ids=lambda content: repr(content[:20]),
)
def test_what_is_no_result_is_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "score.json"
    path.write_bytes(content)
    check_refused(path)


def test_what_is_not_there_is_refused(tmp_path: Path) -> None:
    check_refused(tmp_path)
    check_refused(tmp_path / "score.json")


TOP, SETTING, TRIAL, TOTAL = (), ("setting",), ("trials", 1), ("summary", -1)


def check_tampered(result: Result, path: Path, place: tuple[Any, ...], change: Content) -> None:
    content = json.loads(json.dumps(result.to_json()))
    path.write_text(json.dumps(content))
    assert load_result(path) == result
    functools.reduce(operator.getitem, place, content).update(change)
    path.write_text(json.dumps(content))
    check_refused(path)
    with contextlib.suppress(ValueError, AttributeError):  # some changes cannot be sealed
        path.write_text(json.dumps(sealed(content)))
    check_refused(path)


@pytest.mark.parametrize(
    ("place", "change"),
    [
        (TOP, {"version": 1}),
        (TOP, {"version": 3}),
        (TOP, {"version": "2"}),
        (TOP, {"format": "other"}),
        (TOP, {"opinion": "good"}),
        (TOP, {"trials": None}),
        (TOP, {"timing": {"seconds": {"first": 1}}}),
        (TOP, {"timing": [1]}),
        (SETTING, {"n_goals": 2}),
        (SETTING, {"objects": "two"}),
        (SETTING, {"versions": None}),
        (SETTING, {"mood": "good"}),
        (TRIAL, {"goal": 0}),
        (TRIAL, {"goal": 3}),
        (TRIAL, {"goal": -1}),
        (TRIAL, {"score": float("nan")}),
        (TRIAL, {"score": None}),
        (TRIAL, {"final_poses": [[0, 0, 0]]}),
        (TRIAL, {"opinion": "good"}),
        (TRIAL, {"actions_sha256": "0" * 64}),
        (TRIAL, {"commands": None}),
        (TRIAL, {"commands": {"size": 9, "rows": 100_000, "data": BOMB}}),
        (TRIAL, {"\x1b[2Jnews\n" * 1000: 1}),
        (TRIAL, {"challenge": "\x1b[2Jnews\n" * 1000}),
        (SETTING, {"trial_steps": 9_999}),
    ],
    ids=lambda value: repr(value)[:50],
)
def test_a_tampered_file_is_refused(
    result: Result, tmp_path: Path, place: tuple[Any, ...], change: Content
) -> None:
    check_tampered(result, tmp_path / "score.json", place, change)


@pytest.mark.parametrize(
    ("place", "change"),
    [
        (TRIAL, {"score": 1.9}),
        (TRIAL, {"score": "1"}),
        (TRIAL, {"distances": [0.0, 0.0]}),
        (TRIAL, {"distances": [0.1]}),
        (TRIAL, {"distances": [-0.1, 0.1]}),
        (TRIAL, {"challenge": "4D"}),
        (TRIAL, {"final_poses": []}),
        (TOTAL, {"score": 1.9}),
        (TOTAL, {"n_goals": 50}),
        (SETTING, {"objects": 3}),
        (TOP, {"complete": True}),
        (TOP, {"summary": []}),
    ],
    ids=str,
)
def test_what_contradicts_itself_is_refused(
    result: Result, tmp_path: Path, place: tuple[Any, ...], change: Content
) -> None:
    check_tampered(result, tmp_path / "score.json", place, change)


def test_a_result_appears_whole_or_not_at_all(result: Result, tmp_path: Path) -> None:
    result.save(tmp_path / "score.json")
    result.save(tmp_path / "score.json")
    assert [path.name for path in tmp_path.iterdir()] == ["score.json"]
    with pytest.raises(OutputError):
        result.save(tmp_path / "missing" / "score.json")


def test_scores_are_those_of_the_distances(result: Result) -> None:
    for trial in result.trials:
        assert trial.score == pytest.approx(np.power(0.25, np.array(trial.distances) / 0.1).sum())


def leaves(content: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Where every number and text of a file is."""
    if isinstance(content, dict | list):
        for key in content if isinstance(content, dict) else range(len(content)):
            yield from leaves(content[key], (*place, key))
    else:
        yield place


def altered(value: Any) -> Any:
    """Something else, no farther away than it can be."""
    if isinstance(value, bool) or value is None:
        return not value
    if isinstance(value, int):
        return value + 1
    return float(np.nextafter(value, 9)) if isinstance(value, float) else f"{value}0"


def test_whatever_is_altered_breaks_the_seal(result: Result, tmp_path: Path) -> None:
    path = tmp_path / "score.json"
    result.save(path)
    places = list(leaves(json.loads(path.read_text())))
    assert len(places) > 100
    for *above, last in places:
        content = json.loads(path.read_text())
        holder = functools.reduce(operator.getitem, above, content)
        holder[last] = altered(holder[last])
        (tmp_path / "altered.json").write_text(json.dumps(content))
        check_refused(tmp_path / "altered.json")


def test_the_seal_is_of_the_values_not_of_their_layout(result: Result, tmp_path: Path) -> None:
    content = result.to_json()
    shuffled = dict(reversed(json.loads(json.dumps(content)).items()))
    (tmp_path / "score.json").write_text(json.dumps(shuffled, indent=7))
    assert load_result(tmp_path / "score.json") == result


def test_the_seal_does_not_depend_on_the_time_it_took(result: Result) -> None:
    slower = result.model_copy(update={"seconds": {0: 9.0, 1: 9.0, 2: 9.0}})
    one, other = result.to_json(), slower.to_json()
    assert one["seal"] == other["seal"]
    assert one["timing"]["seal"] != other["timing"]["seal"]


def test_a_name_that_is_given_twice_is_refused(result: Result, tmp_path: Path) -> None:
    text = json.dumps(result.to_json())
    (tmp_path / "score.json").write_text(text.replace('"seed": 0', '"seed": 0, "seed": 0'))
    check_refused(tmp_path / "score.json")


def test_a_file_that_is_too_large_is_neither_written_nor_read(
    result: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "score.json"
    result.save(path)
    before = path.read_bytes()
    monkeypatch.setattr(result_file, "LARGEST_FILE", len(before) - 1)
    with pytest.raises(ResultError, match="fewer goals"):
        result.save(path)
    assert path.read_bytes() == before
    check_refused(path)


def test_results_without_commands_are_still_read(result: Result, tmp_path: Path) -> None:
    kept = list(RESULTS.rglob("real_r-*.json"))
    assert len(kept) > 10
    for path in kept:
        assert load_result(path).score == json.loads(path.read_text())["summary"][-1]["score"]
    old = load_result(kept[0])
    assert not old.keeps_commands
    assert result.keeps_commands
    old.save(tmp_path / "score.json")
    assert load_result(tmp_path / "score.json") == old
    assert json.loads((tmp_path / "score.json").read_text())["version"] == 1


def test_all_trials_keep_their_commands_or_none_does(result: Result) -> None:
    bare = result.trials[0].model_copy(update={"commands": None})
    with pytest.raises(ValueError, match="or none does"):
        Result(setting=result.setting, trials=(bare, *result.trials[1:]))
