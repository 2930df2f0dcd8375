"""What participants mail in, honest and forged in every way that has a name."""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import h5py
import pytest

from real_bench.controller_code.source import ControllerSource
from real_bench.goal_sets import (
    generate_goal_set,
    load_goal_set,
    save_goal_set,
    shipped_goal_set,
)
from real_bench.physics import PHYSICS, fingerprint
from real_bench.scoring.result import load_result
from real_bench.simulation import Scene
from real_bench.verification import ResultVerification, doing_again
from real_bench.verification.doing_again import draw_trials
from real_bench.verification.results import NotGivenError
from tests.cli.shell import realbench
from tests.competition.five import submission
from tests.competition.learner import LEARNER, forge
from tests.competition.wheels import wheel

Bundle = Callable[..., Path]


@pytest.fixture(scope="session")
def honest(tmp_path_factory: pytest.TempPathFactory, goals_file: Path) -> Path:
    """A submission that played twice, with other seeds, and was tested after each."""
    place = tmp_path_factory.mktemp("honest")
    shutil.copy(goals_file, place / "goals.npy")
    submission(place / "submission", LEARNER)
    for seed in (1, 2):
        play = ["--scene", "builtin", "--steps", "3000", "--seed", seed, "--out", f"run{seed}.h5"]
        realbench(place, "intrinsic", "--controller", "submission", "--isolate", *play)
        test = ["--goals", "goals.npy", "--trial-steps", "1000", "--out", f"score{seed}.json"]
        realbench(place, "extrinsic", "--run", f"run{seed}.h5", "--isolate", *test)
    return place


@pytest.fixture
def bundle(honest: Path, tmp_path: Path) -> Bundle:
    """A copy of the first of these, as it would be mailed in."""

    def bundle(name: str = "team") -> Path:
        place = tmp_path / "mailed" / name
        place.mkdir(parents=True)
        shutil.copytree(honest / "submission", place / "submission")
        shutil.copy(honest / "run1.h5", place / "run.h5")
        shutil.copy(honest / "score1.json", place / "score.json")
        return place

    return bundle


def verdict(place: Path, honest: Path, *options: str, code: int = 4) -> dict[str, Any]:
    goals = ["--goals", honest / "goals.npy"]
    done = realbench(place, "verify", ".", *goals, "--json", *options, code=code)
    (found,) = json.loads(done.stdout)
    return dict(found)


def parts(found: dict[str, Any]) -> dict[str, str]:
    return {part["what"]: part["verdict"] for part in found["parts"]}


def detail(found: dict[str, Any], what: str) -> str:
    return str(next(part["detail"] for part in found["parts"] if part["what"] == what))


def test_honest_bundle_verifies_in_every_part(bundle: Bundle, honest: Path) -> None:
    found = verdict(bundle(), honest, "--play-again", code=0)
    assert set(parts(found).values()) == {"holds"}
    assert found["detail"] == "verified: trials, recording, code, settings, state, play"


def test_packed_submission_is_accepted_like_a_folder(bundle: Bundle, honest: Path) -> None:
    place = bundle()
    realbench(place, "submission", "pack", "submission", "--out", "mine.zip")
    shutil.rmtree(place / "submission")
    (place / "damaged.zip").write_bytes(b"PK")
    found = verdict(place, honest, code=0)
    assert {"trials", "recording", "code", "settings", "state"} == {
        what for what, word in parts(found).items() if word == "holds"
    }
    (place / "mine.zip").unlink()
    assert parts(verdict(place, honest, code=0))["code"] == "not checked"


def test_forged_score_is_found(bundle: Bundle, honest: Path) -> None:
    place = bundle()

    def nearer(content: dict[str, Any]) -> None:
        content["trials"][0]["distances"] = [0.001]

    forge(place / "score.json", nearer)
    found = verdict(place, honest)
    assert parts(found)["trials"] == "FAILS"
    assert "first goal 0: distance" in found["detail"]


def test_code_swapped_after_the_play_is_found(bundle: Bundle, honest: Path) -> None:
    place = bundle()
    (place / "submission" / "controller.py").write_text(LEARNER + "\nBETTER = True\n")
    found = verdict(place, honest)
    assert found["detail"] == "code: the submission is not the code that was tested"
    swapped = ControllerSource.of(str(place / "submission")).code_sha256

    def hash_too(content: dict[str, Any]) -> None:
        content["setting"]["controller_sha256"] = swapped

    forge(place / "score.json", hash_too)
    found = verdict(place, honest)
    assert found["detail"] == "code: what it learned was learned with other code"

    def all_hashes(content: dict[str, Any]) -> None:
        content["setting"]["learned"]["code_sha256"] = swapped

    forge(place / "score.json", all_hashes)
    assert verdict(place, honest)["detail"] == "code: the submission is not the code that played"


def test_result_on_other_goals_is_found(
    bundle: Bundle, honest: Path, builtin_scene: Scene, tmp_path: Path
) -> None:
    """Tested on goals of its own choice, whatever hash it then writes into the file."""
    place, easy = bundle(), tmp_path / "easy.npy"
    save_goal_set(generate_goal_set(builtin_scene, 1, 8, counts={"2D": 2, "2.5D": 1}), easy)
    test = ["--goals", easy, "--trial-steps", "1000", "--out", "score.json", "--overwrite"]
    whom = ["--controller", "submission", "--run", "run.h5", "--isolate"]
    realbench(place, "extrinsic", *whom, *test)
    assert "is on goals" in verdict(place, honest)["detail"]
    wanted = json.loads((honest / "score1.json").read_text())["setting"]["goals_sha256"]

    def hash_too(content: dict[str, Any]) -> None:
        content["setting"]["goals_sha256"] = wanted

    forge(place / "score.json", hash_too)
    found = verdict(place, honest)
    assert parts(found)["trials"] == "FAILS"
    assert "trials differ" in found["detail"]


def test_what_was_not_given_to_the_judge_is_no_fault_of_the_bundle(
    bundle: Bundle, honest: Path
) -> None:
    place = bundle()
    done = realbench(place.parent, "verify", place, "--json", code=5)
    (found,) = json.loads(done.stdout)
    assert (found["verified"], found["undecided"]) == (False, True)
    assert "give its goals with --goals" in found["detail"]
    goals = ["--goals", honest / "goals.npy"]
    for wrong, told in (
        (["--jobs", "0"], "jobs must be a whole number of at least 1"),
        (["--steps", "0"], "steps must be a whole number of at least 1"),
        (["--goals", "none.npy"], "cannot read none.npy"),
    ):
        done = realbench(place.parent, "verify", place, *goals, *wrong, code=1)
        assert told in done.stderr
    (place / "run.h5").unlink()
    found = verdict(place, honest, code=0)
    assert parts(found)["state"] == "not checked"
    assert "the recording that it learned from is not here" in str(found["parts"])


def test_pipe_among_the_results_is_passed_over(bundle: Bundle, honest: Path) -> None:
    place = bundle()
    os.mkfifo(place / "waits.json")
    assert verdict(place, honest, "--relearn", "0", code=0)["verified"] is True


def test_state_of_another_play_is_found(bundle: Bundle, honest: Path) -> None:
    """The recording is of one play, what was learned of another: trials and play replay."""
    place = bundle()
    with h5py.File(honest / "run2.h5") as other, h5py.File(place / "run.h5", "r+") as run:
        names = [name for name in run if "state" in name and name != "states"]
        assert names
        for name in names:
            del run[name]
            other.copy(name, run)
    test = ["--goals", honest / "goals.npy", "--trial-steps", "1000", "--overwrite"]
    whom = ["--controller", "submission", "--run", "run.h5", "--isolate"]
    realbench(place, "extrinsic", *whom, *test, "--out", "score.json")
    found = verdict(place, honest)
    assert parts(found) == {
        "trials": "holds",
        "recording": "holds",
        "code": "holds",
        "settings": "holds",
        "state": "FAILS",
        "play": "not checked",
    }
    assert "its state is from another play" in found["detail"]
    found = verdict(place, honest, "--relearn", "0", "--play-again")
    assert "it plays the same, but hands over another state" in found["detail"]


def test_state_that_no_recording_shows_holds_if_the_play_repeats(
    honest: Path, tmp_path: Path
) -> None:
    """It counts its own actions, and learns nothing of them from a recording."""
    thinking = LEARNER.replace(
        "        x, y = self._random", "        self.learned += 0.001\n        x, y = self._random"
    ).replace("if self.learned == 0.0:", "if False:")
    submission(tmp_path / "submission", thinking)
    play = ["--scene", "builtin", "--steps", "3000", "--out", "run.h5"]
    realbench(tmp_path, "intrinsic", "--controller", "submission", "--isolate", *play)
    test = ["--goals", honest / "goals.npy", "--trial-steps", "1000", "--out", "score.json"]
    realbench(tmp_path, "extrinsic", "--run", "run.h5", "--isolate", *test)
    found = verdict(tmp_path, honest)
    assert parts(found)["state"] == "FAILS"
    assert "--play-again decides" in found["detail"]
    found = verdict(tmp_path, honest, "--play-again", code=0)
    assert (parts(found)["state"], parts(found)["play"]) == ("holds", "holds")


def test_goals_that_were_tested_out_of_order_are_tried_again(bundle: Bundle, honest: Path) -> None:
    """With several processes a test that is stopped may lack its first goals."""
    place = bundle()

    def without_the_first(content: dict[str, Any]) -> None:
        del content["trials"][0]

    forge(place / "score.json", without_the_first)
    found = verdict(place, honest, "--allow-incomplete", code=0)
    assert parts(found)["state"] == "holds"
    assert "(2 goals: 1, 2)" in detail(found, "state")


def test_another_recording_and_other_commands_are_found(bundle: Bundle, honest: Path) -> None:
    place = bundle()
    shutil.copy(honest / "run2.h5", place / "run.h5")
    assert "run.h5 is not the recording it learned from" in verdict(place, honest)["detail"]
    place = bundle("second")
    shutil.copy(honest / "score2.json", place / "score.json")
    shutil.copy(honest / "run2.h5", place / "run.h5")

    def as_of_another_seed(content: dict[str, Any]) -> None:
        content["setting"]["seed"] = 77

    forge(place / "score.json", as_of_another_seed)
    assert "these are not its commands" in verdict(place, honest)["detail"]


def test_every_bundle_in_a_folder_gets_a_verdict(bundle: Bundle, honest: Path) -> None:
    mailed = bundle("honest").parent
    forged = bundle("forged")
    forge(forged / "score.json", lambda content: content["trials"][0].update(distances=[0.0]))
    (bundle("damaged") / "score.json").write_text('{"format": "realbench-result", "version": 3}')
    alone = bundle("alone")
    shutil.rmtree(alone / "submission")
    (alone / "run.h5").unlink()
    (alone / "more.tar.gz").touch()
    (mailed / "packed").mkdir()
    for name in ("team.zip", "run.h5"):
        (mailed / "packed" / name).write_bytes(b"PK")
    goals = ["--goals", honest / "goals.npy"]
    done = realbench(mailed, "verify", ".", *goals, code=4)
    for passed_over in (
        "alone/more.tar.gz is not looked at: unpack it",
        "packed/run.h5 is not looked at: no result lies beside it",
        "packed/team.zip is not looked at: unpack it",
    ):
        assert passed_over in done.stderr
    refused = realbench(mailed, "verify", "packed/team.zip", code=2).stderr
    assert "packed/team.zip is an archive: unpack it, and give the folder" in refused
    lines = [line for line in done.stdout.splitlines() if "score.json: " in line]
    assert [line.partition(":")[0] for line in lines] == [
        f"{name}/score.json" for name in ("alone", "damaged", "forged", "honest")
    ]
    assert "verified: trials, settings (not checked: recording, code, state, play)" in lines[0]
    assert "\n  not checked: recording, " in done.stdout
    assert re.search(r"\n  holds: state, .* \(2 goals: \d, \d\)\n", done.stdout)
    assert "NOT VERIFIED: result: score.json is damaged" in lines[1]
    assert "NOT VERIFIED: trials: " in lines[2]
    assert "honest/score.json: verified: trials, " in lines[3]


def test_goals_to_test_again_are_drawn_from_all(honest: Path) -> None:
    """Those who learn from trial to trial begin at the first."""
    trials = load_result(honest / "score1.json").trials
    backwards = trials[::-1]
    assert draw_trials(backwards, 2, in_order=True) == list(trials[:2])
    for n in range(5):
        draws = [draw_trials(backwards, n, in_order=False) for _ in range(60)]
        for drawn in draws:
            assert len(drawn) == min(n, len(trials))
            assert drawn == [trial for trial in trials if trial in drawn]
        assert n == 0 or {trial.goal for drawn in draws for trial in drawn} == {0, 1, 2}


def test_what_cannot_be_had_here_is_no_fault_of_the_bundle(bundle: Bundle, honest: Path) -> None:
    """A wheel for another platform, say: what was tested had it."""
    place = bundle()
    shutil.rmtree(place / "submission")
    submission(place / "submission", LEARNER, requirements=["elsewhere"])
    wheel(place / "submission" / "wheels")
    here = ControllerSource.of(str(place / "submission")).code_sha256

    def tested_so(content: dict[str, Any]) -> None:
        content["setting"].update(controller_sha256=here, learned=None)

    forge(place / "score.json", tested_so)
    found = verdict(place, honest, code=5)
    assert parts(found)["state"] == "undecided"
    assert "its requirements (elsewhere) cannot be installed" in found["detail"]


def test_play_that_cannot_be_repeated_proves_nothing(honest: Path, tmp_path: Path) -> None:
    by_chance = LEARNER.replace("default_rng(seed)", "default_rng()")
    submission(tmp_path / "submission", by_chance)
    play = ["--scene", "builtin", "--steps", "1500", "--out", "run.h5"]
    realbench(tmp_path, "intrinsic", "--controller", "submission", "--isolate", *play)
    test = ["--goals", honest / "goals.npy", "--trial-steps", "1000", "--out", "score.json"]
    realbench(tmp_path, "extrinsic", "--run", "run.h5", "--isolate", *test)
    found = verdict(tmp_path, honest, "--relearn", "1", "--play-again", code=0)
    assert (parts(found)["state"], parts(found)["play"]) == ("not checked", "not checked")
    assert detail(found, "play") == "it does not play the same twice"
    assert found["unchecked"] == ["state"]


def test_commands_that_differ_under_other_physics_are_no_fault() -> None:
    """What the controller saw there was not quite the same."""
    assert doing_again._differs({PHYSICS: fingerprint()}, "it differs")[0] == "FAILS"
    assert doing_again._differs({PHYSICS: "0" * 16}, "it differs")[0] == "undecided"


def test_submission_with_a_name_that_is_no_text_gets_a_verdict(
    bundle: Bundle, honest: Path
) -> None:
    place = bundle()
    (place / "submission" / os.fsdecode(b"\xff.py")).write_text("x = 1\n")
    assert parts(verdict(place, honest, "--relearn", "0"))["code"] == "FAILS"


def test_changed_recording_is_found_among_several(bundle: Bundle, honest: Path) -> None:
    place = bundle()
    shutil.copy(honest / "run2.h5", place / "other.h5")
    assert verdict(place, honest, "--relearn", "0", code=0)["verified"] is True
    with h5py.File(place / "run.h5", "r+") as recording:
        recording.attrs["more"] = 1
    found = verdict(place, honest, "--relearn", "0")
    assert found["verified"] is False
    assert parts(found)["trials"] == "FAILS"


def test_options_that_do_not_apply_are_refused(bundle: Bundle) -> None:
    place = bundle()
    done = realbench(place, "verify", "score.json", "--relearn", "1", code=2)
    assert "--relearn is not for a result" in done.stderr
    done = realbench(place, "verify", ".", "--run", "run.h5", code=2)
    assert "--run is not for a folder" in done.stderr
    done = realbench(place, "verify", "submission", code=1)
    assert "no result found in submission" in done.stderr


@pytest.mark.parametrize("scene", ["builtin", "official"])
def test_goals_default_to_the_shipped_set_of_the_scene(scene: str) -> None:
    goals = load_goal_set(shipped_goal_set(1, scene))
    setting = SimpleNamespace(objects=1, scene=scene, goals_sha256=goals.sha256)
    result = SimpleNamespace(setting=setting)
    assert doing_again._goal_set(result, None).sha256 == goals.sha256  # type: ignore[arg-type]
    setting.objects = 9
    with pytest.raises(NotGivenError, match="give its goals with --goals"):
        ResultVerification(Path("score.json"))._shipped_goals(setting)  # type: ignore[arg-type]
