import pytest
from click.testing import CliRunner
from PIL import Image

from real_bench.cli.goals import goals
from real_bench.errors import GoalSetError, RealBenchError
from real_bench.goal_sets import load_goal_set, save_goal_set
from tests.goal_sets.goal_examples import make_goal_set, write_official


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Run `realbench goals ...` in an empty folder; errors for the main command are raised."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        result = CliRunner().invoke(goals, [str(argument) for argument in arguments])
        if isinstance(result.exception, RealBenchError):
            raise result.exception
        return result

    return run


@pytest.fixture
def saved(tmp_path):
    save_goal_set(make_goal_set(), tmp_path / "saved.npy")
    return tmp_path / "saved.npy"


def test_generate_writes_the_requested_goals(run, tmp_path, official_scene):
    result = run("generate", "--2d", 1, "--25d", 0, "--3d", 1, "--seed", 3)
    assert result.exit_code == 0
    goal_set = load_goal_set(tmp_path / "goals.npy")
    assert goal_set.counts == {"2D": 1, "2.5D": 0, "3D": 1}
    assert goal_set.seed == 3
    assert "goals.npy: 2 goals (1 2D, 1 3D), cube, scene official" in result.stdout


@pytest.mark.parametrize(
    "options",
    [
        ("--2d", -1),
        ("--objects", 0),
        ("--objects", "two"),
        ("--seed", -1),
        ("--seed", 2**63),
        ("--2d", 0, "--25d", 0, "--3d", 0),
    ],
)
def test_invalid_values_are_usage_errors(run, tmp_path, options):
    assert run("generate", *options).exit_code == 2
    assert list(tmp_path.iterdir()) == []


def test_goal_file_is_overwritten_only_on_request(run, saved, official_scene):
    before = saved.read_bytes()
    for command in (("generate",), ("import", saved)):
        with pytest.raises(RealBenchError, match=r"saved.npy exists: use --overwrite"):
            run(*command, "--out", saved)
    assert saved.read_bytes() == before
    run("generate", "--2d", 1, "--25d", 0, "--3d", 0, "--out", saved, "--overwrite")
    assert len(load_goal_set(saved)) == 1


def test_missing_folder_is_reported_before_work_begins(run, monkeypatch):
    monkeypatch.delattr("real_bench.goal_sets.generator.generate_goal_set")
    with pytest.raises(RealBenchError, match="cannot write into missing"):
        run("generate", "--out", "missing/goals.npy")


def test_show_draws_a_picture_beside_the_file(run, saved):
    assert run("show", saved).exit_code == 0
    with Image.open(saved.with_suffix(".png")) as sheet:
        assert sheet.width > 400
    with pytest.raises(RealBenchError, match=r"saved.png exists: use --overwrite"):
        run("show", saved)
    assert run("show", saved, "--overwrite", "--out", "other.png").exit_code == 0


def test_show_refuses_files_that_are_no_goal_set(run, tmp_path):
    (tmp_path / "notes.npy").write_text("hello")
    with pytest.raises(GoalSetError, match=r"notes.npy cannot be used as a goal set"):
        run("show", "notes.npy")
    assert run("show", "missing.npy").exit_code == 2
    assert "must end in .png" in run("show", "notes.npy", "--out", "sheet.gif").stderr


def test_import_makes_a_goal_set(run, tmp_path, official_scene):
    made = make_goal_set(n_objects=3)
    write_official(tmp_path / "official.npz", made)
    assert run("import", "official.npz", "--out", "goals.npy").exit_code == 0
    imported = load_goal_set(tmp_path / "goals.npy")
    assert [goal.sha256 for goal in imported.goals] == [goal.sha256 for goal in made.goals]


@pytest.mark.parametrize("command", ["generate", "show", "import"])
def test_help_has_an_example(run, command):
    assert f"realbench goals {command}" in run(command, "--help").output
