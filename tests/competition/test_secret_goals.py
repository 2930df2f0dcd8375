from __future__ import annotations

import json
import stat
from pathlib import Path
from typing import Any

import pytest

from real_bench.errors import GoalSetError
from real_bench.files.atomic import atomic_replacement
from real_bench.goal_sets import generate_goal_set, load_goal_set
from real_bench.goal_sets.secret import Opening, draw_secret_goals, is_reproduced, read_opening
from real_bench.simulation import Scene
from tests.cli.shell import realbench
from tests.competition.five import GOOD, derived, rounds, submission

TELLING = """

class Telling(Good):
    def next_action(self, observation):
        code = "raise type('LEAK1', (ValueError,), {})('LEAK2')"
        exec(compile(code, __file__.replace("controller.py", "LEAK3.py"), "exec"))
"""
FEW = ["--scene", "builtin", "--2d", "1", "--25d", "1", "--3d", "0"]


@pytest.fixture
def secret(place: Path) -> str:
    """Secret goals instead of the others; gives the commitment."""
    told = realbench(place, "goals", "generate", "--secret", *FEW, "--out", "secret.npy").stdout
    return told.split("commitment, publish it now: ")[1].strip()


def test_committed_goals_can_be_opened(place: Path, secret: str) -> None:
    goal_set, opening = load_goal_set(place / "secret.npy"), place / "secret.opening.json"
    kept = json.loads(opening.read_text())
    assert goal_set.is_secret
    assert goal_set.seed == -1
    assert kept["commitment"] == secret
    assert str(kept["seed"]) not in (place / "secret.npy").read_bytes().decode("latin-1")
    for path in (opening, place / "secret.npy"):
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
    opened = ["goals", "open", "secret.npy", opening, "--scene", "builtin", "--commitment"]
    told = realbench(place, *opened, secret).stdout
    assert f"as committed to, drawn from seed {kept['seed']}" in told
    assert "belongs to another commitment" in realbench(place, *opened, "0" * 64, code=1).stderr
    opening.write_text(json.dumps({**kept, "seed": kept["seed"] + 1}))
    assert "was altered" in realbench(place, *opened, secret, code=1).stderr


def test_goals_of_another_scene_are_not_taken_for_a_forgery(place: Path, secret: str) -> None:
    opened = ["goals", "open", "secret.npy", "secret.opening.json", "--commitment", secret]
    refused = realbench(place, *opened, "--scene", "official", code=1).stderr
    assert "secret.npy was made in scene builtin" in refused
    assert "give its own with --scene" in refused


def test_secret_files_are_never_readable_by_others(tmp_path: Path) -> None:
    path = tmp_path / "secret"
    path.write_text("old")
    path.chmod(0o644)
    with atomic_replacement(path, is_secret=True) as hidden:
        assert stat.S_IMODE(hidden.stat().st_mode) == 0o600
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_secret_goals_are_unique_and_cannot_be_chosen(builtin_scene: Scene) -> None:
    """A set that was chosen, and committed to, is found out when its seed is opened."""
    counts = {"2D": 1}
    one, opening = draw_secret_goals(builtin_scene, 1, counts)
    other, _ = draw_secret_goals(builtin_scene, 1, counts)
    assert one.sha256 != other.sha256
    assert is_reproduced(one, opening, builtin_scene)
    chosen = Opening(seed=5, salt=opening.salt, goals_sha256=other.sha256)
    chosen.check(other, chosen.commitment)
    assert not is_reproduced(other, chosen, builtin_scene)
    with pytest.raises(GoalSetError, match="not the goals that were committed to"):
        opening.check(other, opening.commitment)
    with pytest.raises(GoalSetError, match="commitment"):
        opening.check(one, chosen.commitment)
    assert not generate_goal_set(builtin_scene, 1, 5, counts).is_secret


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"seed": -1}', "\x00", '{"commitment": 1}', "[" * 100_000]
)
def test_malformed_openings_are_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "o.json").write_text(text)
    with pytest.raises(GoalSetError, match="is not an opening"):
        read_opening(tmp_path / "o.json")


def test_secret_goals_refuse_a_seed(place: Path) -> None:
    done = realbench(place, "goals", "generate", "--secret", "--seed", "0", *FEW, code=2)
    assert "--secret draws a seed" in done.stderr


@pytest.mark.parametrize("written", ["4be1...", "x" * 64, "0" * 63])
def test_what_is_no_commitment_is_refused_before_a_round_begins(place: Path, written: str) -> None:
    path = rounds(place, commitment=written)
    done = realbench(place, "round", "run", "submissions", path, code=1)
    assert "64 hexadecimal digits" in done.stderr


def test_a_commitment_to_other_goals_is_refused_before_a_round_begins(
    place: Path, secret: str
) -> None:
    submission(place / "submissions" / "good", GOOD)
    wrong = f"{secret[:-1]}{'0' if secret[-1] != '0' else '1'}"
    path = rounds(place, goals="secret.npy", play="none", commitment=wrong)
    done = realbench(place, "round", "run", "submissions", path, code=1)
    assert "the commitment of round first is not that of secret.npy: " in done.stderr
    assert f"belongs to another commitment: {secret}" in done.stderr


def test_secret_goals_stay_unpublished_until_released(place: Path, secret: str) -> None:
    """Neither on the site nor in a report, nor by what a controller that met them says."""
    submission(place / "submissions" / "good", GOOD)
    telling = derived(TELLING)
    submission(place / "submissions" / "telling", telling, entry="controller.py:Telling")
    asked: dict[str, Any] = {"goals": "secret.npy", "play": "none", "trial_steps": 800}
    asked["commitment"] = f" {secret.upper()}"
    run = ["round", "run", "submissions"]
    ran = realbench(place, *run, rounds(place, **asked), "--junit", "j.xml")
    (standing,) = (place / "results" / "first").glob("telling-*/standing.json")
    assert all(f"LEAK{number}" in standing.read_text() for number in (1, 2, 3))
    assert "why they failed: " in ran.stdout
    shown = ["leaderboard", "results", "--format"]
    formats = [realbench(place, *shown, form).stdout for form in ("text", "markdown", "json")]
    assert all("test, goal 0 (why is not told" in told for told in formats)
    done = realbench(place, "leaderboard", "results", "--site", "site", "--films")
    assert "its goals are secret, so the site does not show them" in done.stderr
    pages = [path.read_text() for path in (place / "site").iterdir() if path.is_file()]
    assert not any("data:image" in page or "<img" in page for page in pages)
    outputs = [ran.stdout, ran.stderr, (place / "j.xml").read_text(), *formats, *pages]
    assert not any("LEAK" in output for output in outputs)
    assert not (place / "site" / "films").exists()
    numbers = (place / "site" / "leaderboard.json").read_text()
    assert "secret.npy" not in "".join(pages)
    assert "final_poses" not in numbers
    assert '"distances"' not in numbers
    committed = f"commitment to the goals: {secret}"
    assert committed in (place / "site" / "index.html").read_text()
    result = str(next((place / "results" / "first").glob("good-*/seed0.json")))
    report = ["report", result, "--goals", "secret.npy", "--out", "r.html"]
    assert "use --released once they may be seen" in realbench(place, *report, code=1).stderr
    assert not (place / "r.html").exists()
    assert realbench(place, *report, "--released")
    realbench(place, *run, rounds(place, **asked, released=True))
    site = ["leaderboard", "results", "--site", "site", "--overwrite"]
    assert "secret" not in realbench(place, *site).stderr
    assert "data:image" in (place / "site" / "first~good.html").read_text()
    assert "LEAK2" in (place / "site" / "first~telling.html").read_text()
    assert committed in (place / "site" / "index.html").read_text()
