"""The public API: the two phases, scores and figures from Python, as the commands have them."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import real_bench
from real_bench.errors import RealBenchError, RecordingError, ResultError
from real_bench.files.atomic import OutputError
from real_bench.goal_sets import save_goal_set
from real_bench.scoring.result import Result
from real_bench.simulation import Scene
from tests.cli.shell import heed_ctrl_c, tiny_goals
from tests.recording.bench import PATIENCE_S, wait_until

notebook: Any = real_bench  # where nothing checks types before a call


def test_help_is_a_table_of_contents() -> None:
    program = "import real_bench; help(real_bench)"
    told = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    ).stdout
    for name in set(real_bench.__all__) - {"__version__"}:
        assert f"``{name}``" in told, name


def test_importing_it_loads_nothing_heavy() -> None:
    heavy = ("pybullet", "h5py", "torch", "matplotlib", "cv2", "scipy")
    program = f"import sys, real_bench; print([name for name in {heavy} if name in sys.modules])"
    told = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    ).stdout
    assert told.strip() == "[]"


def test_every_public_name_exists() -> None:
    for name in real_bench.__all__:
        assert getattr(real_bench, name) is not None
        assert name in dir(real_bench)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        notebook.nothing  # noqa: B018


@pytest.mark.parametrize("judge", [real_bench.score, lambda none: real_bench.compare(none, none)])
def test_no_results_are_an_error(judge: Callable[[list[Result]], object]) -> None:
    with pytest.raises(ResultError, match="no results"):
        judge([])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: notebook.run_intrinsic(notebook.Controller), "write a class into a file"),
        *(
            (partial(notebook.run_intrinsic, "real_r", **{name: value}), f"{name}.*{name_of}")
            for name in ("steps", "seed", "objects")
            for value, name_of in ((2000.5, "2000.5"), ("1", "str '1'"), (-1, "not -1"))
        ),
        (lambda: notebook.run_intrinsic("real_r", out=None), "out must be a path, not NoneType"),
        (lambda: notebook.run_intrinsic("real_r", scene=3), "scene must be a path, not int 3"),
        (lambda: notebook.run_extrinsic(run=5), "run must be a path, not int 5"),
        (lambda: notebook.run_experiment(5), "spec must be a path, not int 5"),
        (lambda: notebook.score("*.json"), "no result found in .*json"),
        (lambda: notebook.Recording("."), "is a folder, not a recording"),
        (lambda: notebook.run_intrinsic("real_r", condition=5), "unknown condition 5"),
        (lambda: notebook.run_intrinsic("real_r", settings=5), "must be a dict.*not int 5"),
        (lambda: notebook.run_extrinsic("real_r", trials=2.5), "trials.*from 1 to 50, not 2.5"),
        (lambda: notebook.run_extrinsic("real_r", trial_steps=0), "trial steps.*not 0"),
        (lambda: notebook.run_extrinsic("real_r", jobs=True), "jobs.*not bool True"),
        (lambda: notebook.run_extrinsic("real_r", goals=5), "a GoalSet or its file, not int 5"),
        (lambda: notebook.make_env(scene="builtin", goals=5), "a GoalSet or its file, not int 5"),
        (lambda: notebook.make_env(scene="builtin", max_steps="a"), "max_steps.*not str 'a'"),
        (lambda: notebook.score(None), "a Result or its file, not NoneType None"),
        (lambda: notebook.compare("no.json", 5), "no.json"),
        (lambda: notebook.run_intrinsic(out="no.h5", resume=True), "no.h5 does not exist"),
        (lambda: notebook.run_extrinsic("real_r", learned="relearn"), "keep, again, nothing"),
        (lambda: notebook.draw_figures("no.h5"), "recording not found: no.h5"),
        (lambda: notebook.draw_figures(results="no.json"), "result not found: no.json"),
        (lambda: notebook.draw_figures(), "nothing to draw"),
        (lambda: notebook.draw_figures("no.h5", run_steps=0), "run steps must be"),
    ],
)
def test_slips_in_a_notebook_get_one_clear_line(
    call: Callable[[], object], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(RealBenchError, match=message):
        call()
    assert not list(tmp_path.iterdir())


def test_notebook_workflow_runs(builtin_scene: Scene, tmp_path: Path) -> None:
    save_goal_set(tiny_goals(builtin_scene), tmp_path / "goals.npy")
    goals = real_bench.load_goals(str(tmp_path / "goals.npy"))
    run, out = str(tmp_path / "run.h5"), str(tmp_path / "score.json")
    play: dict[str, Any] = {"condition": "OM", "scene": "builtin", "steps": 3000, "out": run}
    with real_bench.run_intrinsic("real_r", **play) as recording:
        assert len(recording.transitions) == 3
        whole, *rest = recording[1], *recording[1:]
        assert [each.action.duration for each in rest] == [1000, 1000]
        assert whole.action.duration == rest[0].action.duration
        assert recording[-1].before.joint_positions.tolist() == (
            rest[-1].before.joint_positions.tolist()
        )
        with pytest.raises(IndexError, match="triplet 3 of 3"):
            recording[3]
        assert [each.before.step for each in recording[np.array([2, 0])]] == [2000, 0]
        with pytest.raises(IndexError, match="not str 'last'"):
            recording["last"]  # type: ignore[index]
        assert repr(recording) == f"<Recording {run}: 3 triplets, OM, builtin>"
    for read in (lambda: recording[1], recording.to_numpy, lambda: recording.n_images):
        with pytest.raises(RecordingError, match="is closed: use it inside"):
            read()
    experience = real_bench.Experience(run, "OM")
    assert len(experience) == 3
    test: dict[str, Any] = {"run": recording, "goals": goals, "trial_steps": 1000, "out": out}
    result = real_bench.run_extrinsic("real_d", **test)
    assert result == real_bench.load_result(out)
    assert repr(result) == f"<Result of real_d, OM, 1 object: {result.score:.3f}, 2 goals>"
    assert repr(goals).startswith("<GoalSet: 2 goals (")
    assert len(result.trials) == len(goals) == 2
    verdict = real_bench.score(result, minimum=0.99)
    assert not verdict.passed
    assert repr(verdict).startswith("<Verdict on REAL-D: failed (")
    other = real_bench.run_extrinsic("real_r", **{**test, "out": str(tmp_path / "other.json")})
    assert real_bench.compare(result, other).metrics["score"].difference == pytest.approx(
        result.score - other.score
    )
    told = repr(real_bench.compare(result, other))
    assert told.startswith(f"<Comparison of scores, A - B: {result.score:.3f} - {other.score:.3f}")
    assert real_bench.compare(out, [tmp_path / "other.json"]) == real_bench.compare(result, other)
    assert real_bench.compare(tmp_path.glob("s*.json"), tmp_path / "o*.json").metrics
    with pytest.raises(ResultError, match="controller real_d and real_r"):
        real_bench.score(tmp_path)
    drawn = real_bench.draw_figures(recording, [out])
    assert {"effective-actions", "score-by-goal"} <= drawn.keys()
    again = real_bench.draw_figures(results={out})
    assert "score-by-goal" in again
    assert real_bench.figures.FIGURES


def test_seeds_and_numbers_may_be_numpys(builtin_scene: Scene, tmp_path: Path) -> None:
    """As in ``for seed in np.arange(5)``; and 15e6 is a number of steps."""
    run = tmp_path / "run.h5"
    play = {"condition": "OM", "scene": "builtin", "objects": np.int64(1), "out": run}
    with notebook.run_intrinsic("real_r", seed=np.int64(3), steps=2e3, **play) as recording:
        assert recording.header.seed == 3
        assert len(recording.transitions) == 2
    test = {"run": run, "run_steps": np.int64(2000), "goals": tiny_goals(builtin_scene)}
    numbers = {"seed": np.int64(4), "trials": np.int64(1), "trial_steps": 1e3, "jobs": np.int64(1)}
    out = tmp_path / "score.json"
    result = notebook.run_extrinsic("real_d", **test, **numbers, out=out)
    assert result == real_bench.load_result(out)
    assert (result.setting.seed, result.setting.trial_steps) == (4, 1000)


def test_no_output_replaces_a_file_of_another_kind(builtin_scene: Scene, tmp_path: Path) -> None:
    """Least of all an input."""
    run, goals, code = (tmp_path / name for name in ("run.h5", "goals.npy", "mine.py"))
    save_goal_set(tiny_goals(builtin_scene), goals)
    code.write_text("from real_bench.controllers.real_r import RealR\n")
    play: dict[str, Any] = {"condition": "OM", "scene": "builtin", "steps": 1000}
    real_bench.run_intrinsic("real_r", **play, out=run).close()
    before = {file: file.read_bytes() for file in (run, goals, code)}
    for replaced in (run, goals, code):
        with pytest.raises(
            OutputError, match="is no result, so it is not overwritten: use another"
        ):
            real_bench.run_extrinsic(run=run, goals=goals, out=replaced, overwrite=True)
    for replaced in (goals, code):
        with pytest.raises(OutputError, match="is no recording, so it is not overwritten"):
            real_bench.run_intrinsic(str(code), **play, out=replaced, overwrite=True)
    assert {file: file.read_bytes() for file in before} == before
    (tmp_path / "empty.h5").touch()
    real_bench.run_intrinsic("real_r", **play, out=tmp_path / "empty.h5", overwrite=True).close()


SWEEP = """
import real_bench
for seed in range(3):
    try:
        real_bench.run_intrinsic(
            "real_r", condition="OM", scene="builtin", steps=100_000_000, seed=seed,
            out=f"{seed}.h5", progress=PROGRESS,
        )
    except real_bench.RealBenchError as error:
        print("failed", error)
"""


@pytest.mark.parametrize("progress", [True, False])
def test_ctrl_c_stops_a_sweep_that_goes_on_after_errors(tmp_path: Path, progress: bool) -> None:
    (tmp_path / "sweep.py").write_text(SWEEP.replace("PROGRESS", str(progress)))
    command = [sys.executable, "sweep.py"]
    with subprocess.Popen(
        command, cwd=tmp_path, stderr=subprocess.PIPE, text=True, preexec_fn=heed_ctrl_c
    ) as process:
        wait_until((tmp_path / "0.h5").exists)
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=PATIENCE_S)
    assert process.returncode != 0
    assert "real_bench.errors.Interrupted: stopped " in told
    assert {file.name for file in tmp_path.glob("*.h5")} <= {"0.h5"}


def test_errors_derive_from_real_bench_error(tmp_path: Path) -> None:
    for wrong in (
        lambda: real_bench.run_intrinsic(out=tmp_path / "run.h5"),
        lambda: real_bench.run_intrinsic("no_such", out=tmp_path / "run.h5", scene="builtin"),
        lambda: real_bench.load_goals(tmp_path / "none.npy"),
        lambda: real_bench.load_result(str(tmp_path / "none.json")),
        lambda: real_bench.run_experiment(tmp_path / "none.yaml"),
    ):
        with pytest.raises(real_bench.RealBenchError):
            wrong()
