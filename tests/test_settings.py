from __future__ import annotations

import copy
import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import h5py
import pydantic
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import Field, ValidationError, computed_field

from real_bench.conditions import Condition
from real_bench.controller import Controller
from real_bench.errors import ControllerError, RecordingError, ResultError
from real_bench.goal_sets import GoalSet, save_goal_set
from real_bench.phases.extrinsic import ExtrinsicPhase
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.phases.plans import plan_play, plan_test
from real_bench.phases.trial import TrialPlan
from real_bench.recording import Header, Recording
from real_bench.scoring.result import Result, load_result
from real_bench.settings import (
    Settings,
    check_settings,
    merged,
    read_settings,
    settings_class,
    settings_in_full,
    validated,
)
from real_bench.simulation import Scene
from real_bench.text.nearest import did_you_mean
from tests.cli.shell import realbench, tiny_goals
from tests.recording.bench import ignore

OM = Condition.parse("OM")


class Arm(Settings):
    reach: float = Field(0.5, gt=0)
    joints: int = Field(7, ge=1, le=9)


class RobotSettings(Settings):
    arm: Arm = Arm()
    names: tuple[str, ...] = ("one", "two")
    careful: bool = False


class Robot:
    Settings = RobotSettings


class Plain:
    """It has no settings."""


@pytest.mark.parametrize(
    ("assignments", "values"),
    [
        ([], {}),
        (["depth=8"], {"depth": 8}),
        (["a.b.c=8"], {"a": {"b": {"c": 8}}}),
        (["a.b=1", "a.c=2", "d=3"], {"a": {"b": 1, "c": 2}, "d": 3}),
        (["a=1", "a=2"], {"a": 2}),
        (["a.b=1", "a={c: 2}"], {"a": {"b": 1, "c": 2}}),
        (["a.b=1", "a=2"], {"a": 2}),
        (["a=2", "a.b=1"], {"a": {"b": 1}}),
        (["a=-0.5"], {"a": -0.5}),
        (["a=[0.02, 0.04]"], {"a": [0.02, 0.04]}),
        (["a={b: {c: false}}"], {"a": {"b": {"c": False}}}),
        (["a=true"], {"a": True}),
        (["a=null"], {"a": None}),
        (["a="], {"a": None}),
        (["a='8'"], {"a": "8"}),
        (["a=two words"], {"a": "two words"}),
        (["a=b=c"], {"a": "b=c"}),
    ],
)
def test_assignments_are_parsed_as_names_and_yaml(
    assignments: list[str], values: dict[str, Any]
) -> None:
    assert read_settings(None, assignments) == values


@pytest.mark.skipif(
    tuple(map(int, pydantic.VERSION.split(".")[:2])) < (2, 10), reason="pydantic before 2.10"
)
def test_default_that_depends_on_other_values_is_told_as_computed() -> None:
    class Dependent(Settings):
        first: int = 1
        second: int = Field(default_factory=lambda known: known["first"] + 1)

    with pytest.raises(ControllerError, match=r"frist.*first=1, second=\(computed\)"):
        validated(Dependent, {"frist": 2}, "owner")


@pytest.mark.parametrize("assignment", ["depth", "=8", ".depth=8", "planner.=8", "a..b=8", ""])
def test_an_assignment_without_name_or_value_is_refused(assignment: str) -> None:
    with pytest.raises(ControllerError, match="--set needs name=value") as caught:
        read_settings(None, ["good=1", assignment])
    assert str(caught.value).endswith(f"not {assignment}")


BAD_YAML = ["[1, 2", "'open", "{a: 1", "a: b: c", "!!python/object:os.system x", "&", "\x07"]
BAD_SCALARS = [
    "!!int four",
    "!!timestamp now",
    "!!bool maybe",
    "!!int ''",
    "[" * 500 + "]" * 500,
]
"""The YAML reader's own errors are not all of one family."""


@pytest.mark.parametrize(
    "text",
    [
        *BAD_YAML,
        *(pytest.param(text, id=text[:14]) for text in BAD_SCALARS),
    ],
)
def test_invalid_yaml_value_gives_a_one_line_error(text: str) -> None:
    with pytest.raises(ControllerError, match=r"--set planner\.depth: ") as caught:
        read_settings(None, [f"planner.depth={text}"])
    assert "\n" not in str(caught.value)


NAMES = st.text("abc", min_size=1, max_size=3)
LEAVES = st.one_of(
    st.integers(-9, 9), st.booleans(), st.none(), st.text("xyz 0", max_size=4), st.just([0.5, "a"])
)
TREES = st.recursive(
    st.dictionaries(NAMES, LEAVES, max_size=3),
    lambda trees: st.dictionaries(NAMES, st.one_of(LEAVES, trees), max_size=3),
    max_leaves=8,
)


def leaves(tree: Mapping[str, Any], names: tuple[str, ...] = ()) -> Iterator[tuple[str, Any]]:
    """The values of a tree by their dotted names; a branch without any is a value."""
    for name, value in tree.items():
        if isinstance(value, dict) and value:
            yield from leaves(value, (*names, name))
        else:
            yield ".".join((*names, name)), value


@settings(max_examples=75, deadline=None)
@given(TREES, st.randoms(use_true_random=False))
def test_any_file_content_can_be_assigned(tree: dict[str, Any], random: Any) -> None:
    assignments = [f"{name}={json.dumps(value)}" for name, value in leaves(tree)]
    random.shuffle(assignments)
    assert read_settings(None, assignments) == tree


@settings(max_examples=75, deadline=None)
@given(TREES, TREES)
def test_merged_settings_prefer_the_second(below: dict[str, Any], above: dict[str, Any]) -> None:
    before = copy.deepcopy((below, above))
    both = merged(below, above)
    assert (below, above) == before
    assert merged(below, {}) == merged({}, below) == merged(below, below) == below
    assert merged(both, above) == both
    assert both.keys() == below.keys() | above.keys()
    for key, value in both.items():
        if isinstance(below.get(key), dict) and isinstance(above.get(key), dict):
            assert value == merged(below[key], above[key])
        else:
            assert value == (above[key] if key in above else below[key])


def test_assignments_override_the_file(tmp_path: Path) -> None:
    file = tmp_path / "settings.yaml"
    file.write_text("planner:\n  depth: 8  # short\n  width: 2\nlevels: 5\n", encoding="utf-8")
    assert read_settings(file, []) == {"planner": {"depth": 8, "width": 2}, "levels": 5}
    over = read_settings(file, ["planner.depth=3", "other=1"])
    assert over == {"planner": {"depth": 3, "width": 2}, "levels": 5, "other": 1}


def test_a_file_without_values_sets_nothing(tmp_path: Path) -> None:
    file = tmp_path / "settings.yaml"
    for content in ("", "# planner:\n#   depth: 8\n"):
        file.write_text(content, encoding="utf-8")
        assert read_settings(file, []) == {}


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (None, "was not found"),
        (b"\xff\xfe\x00", "cannot be read: .*decode"),
        (b"- depth\n", "must hold names and values"),
        (b"depth\n", "must hold names and values"),
        (b"planner: [1\ndepth: 3\n", "while parsing"),
        (b"a: 1\n\tb: 2\n", "cannot start any token"),
    ],
)
def test_missing_or_malformed_file_is_refused(
    tmp_path: Path, content: bytes | None, complaint: str
) -> None:
    file = tmp_path / "settings.yaml"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(ControllerError, match=complaint) as caught:
        read_settings(file, ["a=1"])
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_folder_is_refused_as_settings_file(tmp_path: Path) -> None:
    with pytest.raises(ControllerError, match="cannot be read"):
        read_settings(tmp_path, [])


def test_values_become_a_frozen_record() -> None:
    made = check_settings(Robot, "robot", {"arm": {"reach": "1e-3"}, "names": ["three"]})
    assert made == RobotSettings(arm=Arm(reach=0.001), names=("three",))
    assert check_settings(Robot, "robot", {}) == RobotSettings()
    with pytest.raises(ValidationError):
        made.careful = True  # type: ignore[misc]


def test_all_errors_are_reported_at_once_with_the_known_settings() -> None:
    values = {
        "arm": {"reach": -1, "joints": 9.5, "legs": 2},
        "names": "one",
        "speed": {"most": 3},
        "careful": None,
    }
    with pytest.raises(ControllerError) as caught:
        check_settings(Robot, "robot.py", values)
    message = str(caught.value)
    assert message.startswith("controller robot.py, bad settings: ")
    faults, _, known = message.partition(" (settings and defaults: ")
    for name in ("arm.reach", "arm.joints", "arm.legs", "names", "speed", "careful"):
        assert f" {name}: " in faults
    assert faults.count(";") == 5
    assert known == "arm.reach=0.5, arm.joints=7, names=('one', 'two'), careful=False)"
    assert "\n" not in message


@pytest.mark.parametrize(
    ("values", "fault"),
    [
        ({"arm": 3}, "arm: "),
        ({"arm": None}, "arm: "),
        ({"arm": [1]}, "arm: "),
        ({"arm": {"reach": "far"}}, "arm.reach: "),
        ({"arm": {"reach": float("nan")}}, "arm.reach: .*finite"),
        ({"arm": {"reach": float("inf")}}, "arm.reach: .*finite"),
        ({"arm": {"joints": 10}}, "arm.joints: .* 9"),
        ({"names": [1, 2]}, "names.0: "),
        ({8: 1}, "8: "),
        ({"Arm": {}}, "Arm: "),
    ],
)
def test_bad_value_is_reported_with_its_name(values: dict[Any, Any], fault: str) -> None:
    with pytest.raises(ControllerError, match=f"bad settings: {fault}"):
        check_settings(Robot, "robot", values)


def test_a_controller_without_settings_takes_none() -> None:
    assert settings_class(Plain) is None
    assert check_settings(Plain, "plain", {}) is None
    assert settings_in_full(Plain, "plain", {}) == {}
    with pytest.raises(ControllerError, match="plain has no settings, got arm, names"):
        check_settings(Plain, "plain", {"arm": {}, "names": 1})


def test_controller_without_settings_refuses_numbered_names() -> None:
    with pytest.raises(ControllerError, match="plain has no settings, got 8"):
        check_settings(Plain, "plain", {8: 1})  # type: ignore[dict-item]


@pytest.mark.parametrize("kind", [dict, {}, 3, "settings", int])
def test_settings_class_of_another_kind_is_refused(kind: Any) -> None:
    controller = type("Odd", (Controller,), {"Settings": kind})
    with pytest.raises(ControllerError, match=r"Odd.Settings must derive from real_bench"):
        settings_class(controller)


def test_recorded_settings_are_plain_and_complete() -> None:
    kept = settings_in_full(Robot, "robot", {"arm": {"joints": "3"}})
    assert kept == {
        "arm": {"reach": 0.5, "joints": 3},
        "names": ["one", "two"],
        "careful": False,
    }
    assert json.loads(json.dumps(kept)) == kept
    assert settings_in_full(Robot, "robot", kept) == kept


PUSHER = """
from pydantic import Field
from real_bench.actions import Action
from real_bench.controller import Controller
from real_bench.settings import Settings


class PushSettings(Settings):
    start: tuple[float, float] = (-0.1, 0.2)
    length: float = Field(0.1, ge=0)


class Pusher(Controller):
    Settings = PushSettings

    def __init__(self, action_space, observation_space, settings):
        super().__init__(action_space, observation_space)
        self.settings = settings

    def next_action(self, observation):
        x, y = self.settings.start
        return Action.macro([[x, y], [x, y - self.settings.length]])
"""

Play = Callable[..., Path]
Face = Callable[..., Result]


@pytest.fixture(scope="module")
def pusher(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A controller in a file, with settings of its own."""
    file = tmp_path_factory.mktemp("controllers") / "pusher.py"
    file.write_text(PUSHER)
    return str(file)


@pytest.fixture(scope="module")
def goals(builtin_scene: Scene) -> GoalSet:
    return tiny_goals(builtin_scene)


@pytest.fixture
def play(builtin_scene: Scene, tmp_path: Path) -> Play:
    """Run an intrinsic phase; gives the recording."""

    def play(controller: str, steps: int, values: dict[str, Any], *, resume: bool = False) -> Path:
        out = tmp_path / "run.h5"
        phase = IntrinsicPhase(controller, OM, 1, builtin_scene, steps, 0, out, settings=values)
        phase.run(ignore, resume=resume)
        return out

    return play


@pytest.fixture
def face(builtin_scene: Scene, goals: GoalSet, tmp_path: Path) -> Face:
    """Run a short extrinsic phase."""

    def face(
        controller: str, n_trials: int, values: dict[str, Any], *, resume: bool = False
    ) -> Result:
        plan = TrialPlan(controller, OM, builtin_scene, goals, 0, 500, settings=values)
        phase = ExtrinsicPhase(plan, n_trials, tmp_path / "score.json")
        return phase.run(ignore, resume=resume)

    return face


def header_of(path: Path) -> Header:
    with Recording(path) as recording:
        return recording.header


def commands_of(path: Path) -> list[list[float]]:
    with Recording(path) as recording:
        commands: list[list[float]] = recording.commands()["command"].round(12).tolist()
    return commands


def test_settings_reach_the_controller_and_are_recorded(play: Play, pusher: str) -> None:
    run = play(pusher, 1000, {"start": [-0.2, 0.3]})
    assert commands_of(run) == [[-0.2, 0.3, -0.2, 0.2]]
    assert header_of(run).settings == {"start": [-0.2, 0.3], "length": 0.1}


def test_a_run_of_a_controller_without_settings_records_none(play: Play) -> None:
    assert header_of(play("real_r", 500, {})).settings == {}


def test_resumed_run_keeps_its_settings_and_refuses_others(play: Play, pusher: str) -> None:
    values = {"start": [-0.2, 0.3], "length": 0.25}
    before = play(pusher, 500, values).read_bytes()
    for others in ({}, {**values, "length": 0.3}):
        with pytest.raises(
            RecordingError, match=r"other settings and cannot be resumed: settings: .*0.25.* not "
        ):
            play(pusher, 1000, others, resume=True)
    run = play(pusher, 500, values, resume=True)
    assert run.read_bytes() == before
    play(pusher, 1000, values, resume=True)
    assert commands_of(run) == [[-0.2, 0.3, -0.2, 0.05]] * 2
    assert header_of(run).settings == values


def test_bad_settings_leave_no_files(play: Play, face: Face, pusher: str, tmp_path: Path) -> None:
    for controller, complaint in ((pusher, "length: "), ("real_r", "has no settings, got length")):
        with pytest.raises(ControllerError, match=complaint):
            play(controller, 500, {"length": -1})
        with pytest.raises(ControllerError, match=complaint):
            face(controller, 1, {"length": -1})
    assert list(tmp_path.iterdir()) == []


def test_older_run_without_settings_can_be_read_and_resumed(play: Play) -> None:
    run = play("real_r", 500, {})
    with h5py.File(run, "r+") as file:
        del file.attrs["settings"]
    assert header_of(run).settings == {}
    play("real_r", 700, {}, resume=True)


def test_result_records_settings_and_resumes_only_with_them(
    face: Face, pusher: str, tmp_path: Path
) -> None:
    values = {"length": 0.25}
    face(pusher, 1, values)
    out = tmp_path / "score.json"
    before = out.read_bytes()
    assert load_result(out).setting.settings == {"start": [-0.1, 0.2], "length": 0.25}
    with pytest.raises(ResultError, match="of another test and cannot be resumed: settings differ"):
        face(pusher, 2, {"length": 0.3}, resume=True)
    assert out.read_bytes() == before
    one, other = face(pusher, 2, values, resume=True).trials
    assert one.actions_sha256 == other.actions_sha256  # the same pushes
    out.unlink()
    assert face(pusher, 1, {"length": 0.3}).trials[0].actions_sha256 != one.actions_sha256


def test_result_of_a_controller_without_settings_records_none(face: Face) -> None:
    assert face("real_r", 1, {}).setting.settings == {}


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory, goals: GoalSet) -> Path:
    """A folder with goals, a file of settings, and a run of REAL-D that was given some."""
    folder = tmp_path_factory.mktemp("place")
    save_goal_set(goals, folder / "goals.npy")
    (folder / "mine.yaml").write_text("abstraction:\n  levels: 7\nplanner:\n  depth: 5\n")
    play = ("intrinsic", "--controller", "real_d", "--scene", "builtin", "--condition", "OM")
    given = ("--settings", "mine.yaml", "--set", "planner.depth=3")
    realbench(folder, *play, *given, "--steps", "1000")
    return folder


def setting_of(folder: Path, *arguments: str) -> dict[str, Any]:
    """The setting of a test of one goal."""
    test = ("--goals", "goals.npy", "--trials", "1", "--trial-steps", "500", "--overwrite")
    realbench(folder, "extrinsic", *test, *arguments)
    return load_result(folder / "score.json").setting.model_dump()


def test_command_reads_settings_from_file_and_command_line(place: Path) -> None:
    recorded = header_of(place / "run.h5").settings
    assert recorded["abstraction"]["levels"] == 7
    assert recorded["planner"]["depth"] == 3


def resumed(folder: Path, *assignments: str, **given: Any) -> IntrinsicPhase:
    """The run that a command line with these options and ``--resume`` asks for."""
    settings = read_settings(given.pop("settings_file", None), assignments)
    options = {"steps": 2000, "resume": True, **given}
    return plan_play(folder / "run.h5", settings=settings, **options)


def test_run_is_resumed_with_its_own_settings(place: Path) -> None:
    recorded = header_of(place / "run.h5").settings
    realbench(place, "intrinsic", "--resume", "--steps", "1500")
    assert header_of(place / "run.h5").settings == recorded
    with pytest.raises(RecordingError, match=r"cannot be resumed.* settings: "):
        resumed(place, "planner.depth=4").run(ignore, resume=True)
    assert header_of(place / "run.h5").settings == recorded


def test_same_controller_is_tested_with_the_recorded_settings(place: Path) -> None:
    setting = setting_of(place)
    assert setting["controller"] == "real_d"
    assert setting["settings"] == header_of(place / "run.h5").settings


def test_another_controller_is_tested_with_its_own_defaults(place: Path) -> None:
    setting = setting_of(place, "--controller", "real_t")
    assert setting["settings"] == {"thresholds": [0.02, 0.04], "planner": {"depth": 10}}
    assert setting["run_steps"] > 0


def test_bad_settings_on_the_command_line_give_a_one_line_error(place: Path) -> None:
    given = ("--set", "planner.depht=3", "--set", "abstraction.levels=1")
    refused = realbench(
        place, "extrinsic", *given, "--goals", "goals.npy", "--out", "no.json", code=1
    )
    for text in ("planner.depht: ", "abstraction.levels: ", "planner.depth=10"):
        assert text in refused.stderr
    assert refused.stderr.count("\n") == 1
    assert not (place / "no.json").exists()


def planned(folder: Path, *assignments: str, **given: Any) -> TrialPlan:
    """The test that a command line with these options asks for."""
    settings = read_settings(given.pop("settings_file", None), assignments)
    place = {"run": folder / "run.h5", "goals": folder / "goals.npy"}
    return plan_test(settings=settings, **{**place, **given})


def test_command_line_settings_override_recorded_ones(place: Path) -> None:
    assert planned(place).settings == header_of(place / "run.h5").settings
    over = planned(place, "planner.depth=2", settings_file=place / "mine.yaml").settings
    assert (over["abstraction"]["levels"], over["planner"]["depth"]) == (7, 2)
    file_only = planned(place, settings_file=place / "mine.yaml").settings
    assert file_only["planner"]["depth"] == 5
    assert planned(place, "planner.depth=2", controller="real_t").settings == {
        "planner": {"depth": 2}
    }


def test_controller_is_recognised_by_its_other_name(place: Path) -> None:
    other_name = "real_bench.controllers.real_d:RealD"
    assert planned(place, controller=other_name).settings == planned(place).settings


def test_resuming_with_another_controller_is_refused(place: Path) -> None:
    with pytest.raises(RecordingError, match=r"cannot be resumed.* controller"):
        resumed(place, controller="real_r").run(ignore, resume=True)


class Named(Settings):
    lam: float = Field(0.5, alias="lambda")


class OnlyReadByName(Settings):
    lam: float = Field(0.5, validation_alias="lambda")


class Computing(Settings):
    lam: float = 0.5

    @computed_field
    def twice(self) -> float:
        return 2 * self.lam


class Hiding(Settings):
    lam: float = Field(0.5, exclude=True)


@pytest.mark.parametrize(
    ("kind", "values"),
    [
        (Named, {}),
        (Named, {"lambda": 2}),
        (OnlyReadByName, {"lambda": 2}),
        (Computing, {}),
        (Hiding, {"lam": 2}),
    ],
)
def test_unserialisable_settings_are_refused_with_the_reason(
    kind: type[Settings], values: dict[str, Any]
) -> None:
    odd = type("Odd", (), {"Settings": kind})
    with pytest.raises(ControllerError, match="do not survive being written and read: ") as caught:
        settings_in_full(odd, "odd.py", values)
    told = str(caught.value)
    assert told.isprintable()
    assert any(word in told for word in ("lam", "twice"))


def test_unserialisable_settings_are_refused_before_play(
    play: Play, face: Face, tmp_path: Path
) -> None:
    path = tmp_path / "odd.py"
    path.write_text(PUSHER.replace("Field(0.1, ge=0)", 'Field(0.1, ge=0, alias="lambda")'))
    with pytest.raises(ControllerError, match="do not survive"):
        play(str(path), 500, {"lambda": 0.2})
    with pytest.raises(ControllerError, match="do not survive"):
        face(str(path), 1, {"lambda": 0.2})
    assert not [file for file in tmp_path.iterdir() if file.suffix in (".h5", ".json")]


def test_a_dotted_name_in_a_file_is_answered_with_its_nested_form() -> None:
    names = ["planner.depth", "abstraction.levels"]
    assert did_you_mean("planner.depth", names) == ", write it as planner: {depth: ...}"
    assert did_you_mean("planner.deph", names) == ", did you mean planner.depth?"
