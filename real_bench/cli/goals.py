"""realbench goals: draw, import and look at sets of goals."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from real_bench.cli import options
from real_bench.cli.common import HelpfulGroup, progress_display
from real_bench.cli.printing import say
from real_bench.lengths import LARGEST
from real_bench.text.counting import counted

if TYPE_CHECKING:
    from real_bench.goal_sets import GoalSet
    from real_bench.simulation import Scene


existing_file = click.Path(exists=True, dir_okay=False, path_type=Path)
output_file = click.Path(path_type=Path)

scene_option = click.option(
    "--scene",
    default="official",
    show_default=True,
    help="Name of a scene, or path to its manifest.",
)

GOALS_EPILOG = """\b
Example:
  realbench goals generate --objects 1 --seed 7 --out goals.npy
  realbench goals show goals.npy
"""

GENERATE_EPILOG = """\b
Example:
  realbench goals generate --objects 2 --seed 7 --out goals.npy
  realbench goals generate --secret --out secret.npy
"""

OPEN_EPILOG = """\b
Example:
  realbench goals open secret.npy secret.opening.json --commitment 4be1...
"""

SHOW_EPILOG = """\b
Example:
  realbench goals show goals.npy --out sheet.png
"""

IMPORT_EPILOG = """\b
Example:
  realbench goals import official-2-objects.npz --out goals.npy
"""


def goal_count_option(default: int) -> dict[str, Any]:
    """What the options for numbers of goals share."""
    kind = click.IntRange(min=0)
    return {"type": kind, "default": default, "show_default": True, "metavar": "N"}


@click.group(cls=HelpfulGroup, epilog=GOALS_EPILOG)
def goals() -> None:
    """Draw, import and look at goals."""


@goals.command(epilog=GENERATE_EPILOG)
@click.option(
    "--objects", type=click.IntRange(min=1), default=1, show_default=True, help="How many objects."
)
@click.option(
    "--seed",
    type=click.IntRange(0, LARGEST),
    default=0,
    show_default=True,
    metavar="N",
    help="Seed that the goals are drawn from.",
)
@click.option(
    "--out", type=output_file, default="goals.npy", show_default=True, help="The goal set to write."
)
@click.option(
    "--secret",
    is_flag=True,
    help="Draw a secret seed, keep it in a file of its own, and print a commitment to publish.",
)
@scene_option
@click.option("--2d", "n_2d", **goal_count_option(25), help="Goals on the table.")
@click.option("--25d", "n_25d", **goal_count_option(15), help="Goals on table and shelf.")
@click.option(
    "--3d", "n_3d", **goal_count_option(10), help="Goals on table and shelf, in any orientation."
)
@options.overwrite_option
@click.pass_context
def generate(
    context: click.Context,
    objects: int,
    seed: int,
    out: Path,
    secret: bool,
    scene: str,
    n_2d: int,
    n_25d: int,
    n_3d: int,
    overwrite: bool,
) -> None:
    """Draw goals by the rules of the official sets; the same seed gives the same file.

    With --secret the seed and a salt go into a file of their own beside the set (.opening.json).
    Publish the commitment before the competition and that file after it; then anybody can check
    the goals with `realbench goals open`.
    """
    from real_bench.files.kinds import GOAL_SET
    from real_bench.files.outputs import check_output
    from real_bench.goal_sets import save_goal_set
    from real_bench.simulation import load_scene

    counts = {"2D": n_2d, "2.5D": n_25d, "3D": n_3d}
    if not any(counts.values()):
        raise click.UsageError("--2d, --25d and --3d are all 0: ask for at least one goal")
    if secret and context.get_parameter_source("seed") is ParameterSource.COMMANDLINE:
        raise click.UsageError("--secret draws a seed: leave out --seed")
    check_output(out, overwrite=overwrite, kind=GOAL_SET)
    if secret:
        return _generate_secret(load_scene(scene), objects, counts, out, overwrite=overwrite)
    goal_set = _generate_with_progress(load_scene(scene), objects, seed, counts)
    save_goal_set(goal_set, out)
    _report(goal_set, out)


@goals.command("open", epilog=OPEN_EPILOG)
@click.argument("file", type=existing_file)
@click.argument("opening", type=existing_file)
@click.option("--commitment", required=True, metavar="SHA256", help="The published commitment.")
@click.option(
    "--redraw/--no-redraw",
    default=True,
    show_default=True,
    help="Also draw the goals again from the opened seed.",
)
@scene_option
def open_command(file: Path, opening: Path, commitment: str, redraw: bool, scene: str) -> None:
    """Check that secret goals match their commitment, and were drawn rather than chosen."""
    from real_bench.errors import GoalSetError
    from real_bench.goal_sets import load_goal_set
    from real_bench.goal_sets.secret import is_reproduced, read_opening
    from real_bench.simulation import load_scene

    goal_set, opened = load_goal_set(file), read_opening(opening)
    opened.check(goal_set, commitment)
    if redraw:
        loaded = load_scene(scene)
        if loaded.sha256 != goal_set.scene_sha256:
            raise GoalSetError(
                f"{file} was made in scene {goal_set.scene} ({goal_set.scene_sha256[:12]}), not in "
                f"this {loaded.name} ({loaded.sha256[:12]}): give its own with --scene"
            )
        with progress_display("drawing goals", "goals", len(goal_set)) as display:
            same = is_reproduced(goal_set, opened, loaded, lambda n_done, _: display.update(n_done))
        if not same:
            raise GoalSetError(
                f"{file} matches the commitment, but seed {opened.seed} draws different goals here "
                "(different physics can cause this: see `realbench doctor`)"
            )
    how = f", drawn from seed {opened.seed}" if redraw else ""
    say(f"{file}: {counted(len(goal_set), 'goal')} as committed to{how}")


@goals.command(epilog=SHOW_EPILOG)
@click.argument("file", type=existing_file)
@click.option("--out", type=output_file, help="The picture.  [default: FILE with suffix .png]")
@options.overwrite_option
def show(file: Path, out: Path | None, overwrite: bool) -> None:
    """Draw a picture of all goals: start and goal side by side."""
    import io

    from real_bench.files.atomic import write_atomically
    from real_bench.files.outputs import check_output
    from real_bench.goal_sets import contact_sheet, load_goal_set

    sheet = out or file.with_suffix(".png")
    if sheet.suffix != ".png":
        raise click.BadParameter(f"{sheet} must end in .png", param_hint="--out")
    check_output(sheet, overwrite=overwrite)
    goal_set = load_goal_set(file)
    stream = io.BytesIO()
    contact_sheet(goal_set).save(stream, format="PNG")
    write_atomically(sheet, stream.getvalue())
    _report(goal_set, sheet)


@goals.command("import", epilog=IMPORT_EPILOG)
@click.argument("official", type=existing_file)
@click.option("--out", type=output_file, required=True, help="The goal set to write.")
@scene_option
@options.overwrite_option
def import_command(official: Path, out: Path, scene: str, overwrite: bool) -> None:
    """Turn a goal file of the official package (.npz) into a goal set.

    The file is a pickle; it is read as data, and no code in it is run.
    """
    from real_bench.files.kinds import GOAL_SET
    from real_bench.files.outputs import check_output
    from real_bench.goal_sets import import_official, save_goal_set
    from real_bench.simulation import load_scene

    check_output(out, overwrite=overwrite, kind=GOAL_SET)
    goal_set = import_official(official, load_scene(scene))
    save_goal_set(goal_set, out)
    _report(goal_set, out)


def _generate_secret(
    scene: Scene, n_objects: int, counts: dict[str, int], out: Path, *, overwrite: bool
) -> None:
    from real_bench.files.atomic import write_atomically
    from real_bench.files.outputs import check_output
    from real_bench.goal_sets import save_goal_set
    from real_bench.goal_sets.secret import draw_secret_goals, opening_of

    kept = opening_of(out)
    check_output(kept, overwrite=overwrite)
    with progress_display("drawing goals", "goals", sum(counts.values())) as display:
        goal_set, opening = draw_secret_goals(
            scene, n_objects, counts, lambda n_done, _: display.update(n_done)
        )
    write_atomically(kept, opening.to_json().encode(), is_secret=True)
    save_goal_set(goal_set, out, is_secret=True)
    _report(goal_set, out)
    say(f"{kept}: seed and salt; keep it and the goals secret until they may be known")
    say(f"commitment, publish it now: {opening.commitment}")


def _generate_with_progress(
    scene: Scene, n_objects: int, seed: int, counts: dict[str, int]
) -> GoalSet:
    from real_bench.goal_sets import generate_goal_set

    with progress_display("drawing goals", "goals", sum(counts.values())) as display:
        return generate_goal_set(
            scene, n_objects, seed, counts, lambda n_done, _: display.update(n_done)
        )


def _report(goal_set: GoalSet, written: Path) -> None:
    classes = ", ".join(f"{count} {name}" for name, count in goal_set.counts.items() if count)
    objects = ", ".join(goal_set.object_names)
    number = counted(len(goal_set), "goal")
    say(f"{written}: {number} ({classes}), {objects}, scene {goal_set.scene}")
