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
from real_bench.files.atomic import OutputError
from real_bench.scoring import result_file
from real_bench.scoring.commands import Commands
from real_bench.scoring.result import Result, Setting, TrialResult, load_result
from real_bench.scoring.result_file import sealed
from real_bench.scoring.summary import summarise, summary_json

NUMBERS = st.floats(-5, 5)
COMMANDS = Commands.of([Action.rest(4, 10_000)])
RESULTS = Path(__file__).parents[2] / "evaluation" / "results"
OLDER = {
    1: RESULTS / "earlier-control" / "real_d-OM-1-seed0-a.json",
    2: RESULTS / "earlier-eye" / "real_ild-coarse-IM-1-seed0-a.json",
}
"""A result of each older version."""
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
    assert result.is_complete == result.is_finished == (len(trials) == 4)


def test_the_score_is_the_mean_over_goals(result: Result) -> None:
    assert result.score == pytest.approx((2 + 0.5 + 0.125) / 3)


def test_empty_result_has_no_score(setting: Setting) -> None:
    with pytest.raises(ResultError):
        _ = Result(setting=setting).score


def test_file_keeps_facts_and_no_derived_values(result: Result, tmp_path: Path) -> None:
    result.save(tmp_path / "score.json")
    content = json.loads((tmp_path / "score.json").read_text())
    assert list(content) == ["format", "version", "setting", "trials", "seal", "timing"]
    facts = ["goal", "challenge", "distances", "final_poses", "actions_sha256", "commands"]
    assert list(content["trials"][0]) == facts
    summary = summary_json(result)
    assert not summary["complete"]
    assert [row["name"] for row in summary["classes"]] == ["2D", "3D", "total"]
    assert summary["classes"][-1]["means"]["score"]["value"] == pytest.approx(0.875)


def test_loading_computes_no_intervals(
    result: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: Any, **__: Any) -> None:
        raise AssertionError("an interval was computed")

    monkeypatch.setattr("real_bench.scoring.statistics.bootstrap_interval", fail)
    result.save(tmp_path / "score.json")
    for path in (tmp_path / "score.json", OLDER[1], OLDER[2]):
        assert load_result(path).score > 0
    with pytest.raises(AssertionError):
        summarise(result.trials)


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
def test_files_that_are_no_result_are_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "score.json"
    path.write_bytes(content)
    check_refused(path)


def test_missing_file_and_folder_are_refused(tmp_path: Path) -> None:
    check_refused(tmp_path)
    check_refused(tmp_path / "score.json")


TOP, SETTING, TRIAL = (), ("setting",), ("trials", 1)


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
        (TOP, {"version": 2}),
        (TOP, {"version": 4}),
        (TOP, {"version": "3"}),
        (TOP, {"format": "other"}),
        (TOP, {"opinion": "good"}),
        (TOP, {"trials": None}),
        (TOP, {"timing": {"seconds": {"first": 1}}}),
        (TOP, {"timing": [1]}),
        (SETTING, {"n_goals": 2}),
        (SETTING, {"goal_numbers": [0, 1]}),
        (SETTING, {"goal_numbers": [0, 1, 2, 4]}),
        (SETTING, {"goal_numbers": [0, 2, 1, 3]}),
        (SETTING, {"goal_numbers": [-1, 0, 1, 2]}),
        (SETTING, {"objects": "two"}),
        (SETTING, {"versions": None}),
        (SETTING, {"mood": "good"}),
        *(
            (SETTING, {name: "\x1b[2J\x1b[31mX"})
            for name in Setting.model_fields
            if "sha256" in name
        ),
        (SETTING, {"goals_sha256": "0" * 64 + "\n"}),
        (SETTING, {"learned": {"code_sha256": "\x1b[2J", "settings": {}}}),
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
        (TRIAL, {"distances": [0.1]}),
        (TRIAL, {"distances": [-0.1, 0.1]}),
        (TRIAL, {"challenge": "4D"}),
        (TRIAL, {"final_poses": []}),
        (SETTING, {"objects": 3}),
        (TOP, {"complete": True}),  # what follows from the rest is not said
        (TOP, {"summary": []}),
    ],
    ids=str,
)
def test_contradictory_file_is_refused(
    result: Result, tmp_path: Path, place: tuple[Any, ...], change: Content
) -> None:
    check_tampered(result, tmp_path / "score.json", place, change)


def test_result_is_saved_without_leftovers(result: Result, tmp_path: Path) -> None:
    result.save(tmp_path / "score.json")
    result.save(tmp_path / "score.json")
    assert [path.name for path in tmp_path.iterdir()] == ["score.json"]
    with pytest.raises(OutputError):
        result.save(tmp_path / "missing" / "score.json")


def test_scores_follow_from_the_distances(result: Result) -> None:
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


def test_every_alteration_breaks_the_seal(result: Result, tmp_path: Path) -> None:
    path = tmp_path / "score.json"
    result.save(path)
    places = list(leaves(json.loads(path.read_text())))
    assert len(places) > 80
    for *above, last in places:
        content = json.loads(path.read_text())
        holder = functools.reduce(operator.getitem, above, content)
        holder[last] = altered(holder[last])
        (tmp_path / "altered.json").write_text(json.dumps(content))
        check_refused(tmp_path / "altered.json")


def test_seal_covers_values_not_layout(result: Result, tmp_path: Path) -> None:
    content = result.to_json()
    shuffled = dict(reversed(json.loads(json.dumps(content)).items()))
    (tmp_path / "score.json").write_text(json.dumps(shuffled, indent=7))
    assert load_result(tmp_path / "score.json") == result


def test_seal_does_not_depend_on_timing(result: Result) -> None:
    slower = result.model_copy(update={"seconds": {0: 9.0, 1: 9.0, 2: 9.0}})
    one, other = result.to_json(), slower.to_json()
    assert one["seal"] == other["seal"]
    assert one["timing"]["seal"] != other["timing"]["seal"]


def test_duplicate_name_is_refused(result: Result, tmp_path: Path) -> None:
    text = json.dumps(result.to_json())
    (tmp_path / "score.json").write_text(text.replace('"seed": 0', '"seed": 0, "seed": 0'))
    check_refused(tmp_path / "score.json")


def test_too_large_file_is_neither_written_nor_read(
    result: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "score.json"
    result.save(path)
    before = path.read_bytes()
    monkeypatch.setattr(result_file, "MAX_FILE_BYTES", len(before) - 1)
    with pytest.raises(ResultError, match="fewer goals"):
        result.save(path)
    assert path.read_bytes() == before
    check_refused(path)


@pytest.mark.parametrize("version", [1, 2])
def test_older_results_are_still_read(version: int, tmp_path: Path) -> None:
    content = json.loads(OLDER[version].read_text())
    assert content["version"] == version
    old = load_result(OLDER[version])
    assert old.keeps_commands == (version == 2)
    assert old.setting.goal_numbers == tuple(range(50))
    assert old.setting.n_goals is None  # it does not say
    assert old.is_complete
    old.save(tmp_path / "score.json")
    assert load_result(tmp_path / "score.json") == old
    assert json.loads((tmp_path / "score.json").read_text())["version"] == 3


def test_kept_results_keep_their_scores() -> None:
    told = {path: json.loads(path.read_text()) for path in RESULTS.rglob("*.json")}
    kept = {path: each for path, each in told.items() if each.get("format") == "realbench-result"}
    assert len(kept) > 100
    for path, content in kept.items():
        score = load_result(path).score
        if content["version"] < 3:  # later ones keep facts alone
            assert score == pytest.approx(content["summary"][-1]["score"], abs=1e-12)


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize(
    ("place", "change"),
    [
        (TRIAL, {"score": 0.9}),
        (TRIAL, {"score": None}),
        (TRIAL, {"score": 10**400}),
        (TRIAL, {"distances": [0.0]}),
        (TRIAL, {"distances": [10**400]}),
        (TRIAL, {"commands": None}),
        (TRIAL, {"mood": "good"}),
        (SETTING, {"n_goals": 20}),
        (SETTING, {"n_goals": 10**12}),
        (SETTING, {"n_goals": None}),
        (SETTING, {"goal_numbers": [0]}),
        (TOP, {"trials": None}),
        (TOP, {"trials": [None]}),
        (TOP, {"setting": []}),
        (TOP, {"version": 3}),
    ],
    ids=str,
)
def test_bad_older_results_are_still_refused(
    version: int, tmp_path: Path, place: tuple[Any, ...], change: Content
) -> None:
    content = json.loads(OLDER[version].read_text())
    functools.reduce(operator.getitem, place, content).update(change)
    for text in (content, sealed(content)):
        (tmp_path / "score.json").write_text(json.dumps(text))
        check_refused(tmp_path / "score.json")


def test_seal_of_an_older_result_covers_its_summary(tmp_path: Path) -> None:
    content = json.loads(OLDER[2].read_text())
    content["summary"][-1]["score"] += 0.1
    (tmp_path / "score.json").write_text(json.dumps(content))
    check_refused(tmp_path / "score.json")
    (tmp_path / "score.json").write_text(json.dumps(sealed(content)))
    assert load_result(tmp_path / "score.json").score == load_result(OLDER[2]).score  # unread


def test_part_of_the_goals_is_finished_but_not_complete(setting: Setting, result: Result) -> None:
    part = result.model_copy(
        update={"setting": setting.model_copy(update={"goal_numbers": (0, 1, 2)})}
    )
    assert part.is_finished
    assert not part.is_complete
    assert part.share == "3 of 4 goals"


def test_all_trials_keep_their_commands_or_none_does(result: Result) -> None:
    bare = result.trials[0].model_copy(update={"commands": None})
    with pytest.raises(ValueError, match="all trials keep their commands, or none"):
        Result(setting=result.setting, trials=(bare, *result.trials[1:]))
