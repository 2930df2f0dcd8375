"""``realbench figures``."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from real_bench.cli import kinds, options
from real_bench.cli.common import progress_display
from real_bench.cli.printing import say

if TYPE_CHECKING:
    from real_bench.figures import FigureData, FigureOptions

EPILOG = """\b
Example:
  realbench figures run.h5 score.json --out figures
  realbench figures ld-*.h5 ild-*.h5 results/*.json --out figures --overwrite
  realbench figures run.h5 --set vae.weight=1 --run-steps 2000000 --out early
"""


@click.command(epilog=EPILOG)
@click.argument("files", type=options.FILE, nargs=-1, required=True)
@click.option(
    "--out", type=options.FILE, metavar="DIR", default="figures", show_default=True, help="Folder."
)
@click.option(
    "--settings",
    "settings_file",
    type=options.FILE,
    help="YAML file of settings of REAL-LD's vision.",
)
@click.option(
    "--set",
    "assignments",
    multiple=True,
    metavar="NAME=VALUE",
    help="One setting of REAL-LD's vision, e.g. vae.weight=1; may be repeated.",
)
@click.option(
    "--run-steps",
    type=int,
    metavar="N",
    help="Use only each recording's first N steps. [default: all]",
)
@click.option(
    "--seed",
    type=int,
    default=0,
    show_default=True,
    help="Seed for learning to see and for drawing pairs.",
)
@options.overwrite_option
@options.json_option
def figures(
    files: tuple[Path, ...],
    out: Path,
    settings_file: Path | None,
    assignments: tuple[str, ...],
    run_steps: int | None,
    seed: int,
    overwrite: bool,
    as_json: bool,
) -> None:
    """Draw the paper's figures from recordings (.h5) and results (.json), in any order.

    Every figure whose data the files hold is written as a picture (.png), a vector drawing (.svg)
    and its numbers (.csv); figures.json lists their sources. Images are encoded with the weights
    in the recording if REAL-LD or REAL-ILD played; otherwise weights are learned now. Results must
    be on the same goals; also give the recordings that they learned from, which say who played.
    """
    from real_bench.figures import FigureOptions
    from real_bench.figures.saving import prepare_folder
    from real_bench.settings import read_settings

    figure_options = FigureOptions(read_settings(settings_file, assignments), seed, run_steps)
    found = kinds.by_kind(files, kinds.RECORDING, kinds.RESULT)
    prepare_folder(out, overwrite=overwrite)
    data = _read(found[kinds.RECORDING], found[kinds.RESULT], figure_options)
    summary = _draw_all(data, figure_options, out)
    if as_json:
        say(json.dumps(summary))
    else:
        _report(summary, out)


def _read(
    recordings: Sequence[Path], results: Sequence[Path], figure_options: FigureOptions
) -> FigureData:
    from real_bench.figures import read_figure_data

    with progress_display("reading recordings", "recordings", len(recordings)) as display:
        return read_figure_data(recordings, results, figure_options, display.update)


def _draw_all(data: FigureData, figure_options: FigureOptions, out: Path) -> dict[str, Any]:
    """Draw and write what can be drawn, then the summary."""
    from real_bench.figures import FIGURES, draw_all, facts
    from real_bench.figures.saving import drawn_before, remove_drawing, save_drawing, save_summary

    before = drawn_before(out)
    drawn = draw_all(data)
    with progress_display("writing", "figures", len(FIGURES)) as display:
        for number, kind in enumerate(FIGURES):
            display.update(number, kind.name)
            if kind.name in drawn:
                save_drawing(out, kind.name, drawn[kind.name])
            elif kind.name in before:
                remove_drawing(out, kind.name)
    summary = {
        "drawn": {kind.name: kind.shows for kind in FIGURES if kind.name in drawn},
        "not_drawn": {kind.name: kind.needs for kind in FIGURES if kind.name not in drawn},
        **facts(data, figure_options),
    }
    save_summary(out, summary)
    return summary


def _report(summary: dict[str, Any], out: Path) -> None:
    """Print what was drawn, and what every other figure needs."""
    for name in summary["drawn"]:
        say(f"{name}: {out / name}.png, .svg, .csv")
    for name, needs in summary["not_drawn"].items():
        say(f"{name}: not drawn, it needs {needs}")
