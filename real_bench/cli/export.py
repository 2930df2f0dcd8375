"""``realbench export``."""

from __future__ import annotations

from pathlib import Path

import click

from real_bench.cli import options
from real_bench.cli.common import progress_display
from real_bench.cli.printing import say
from real_bench.errors import RecordingError

EPILOG = """\b
Example:
  realbench export run.h5 --to csv
  realbench export run.h5 --to parquet --out tables
  realbench export run.h5 --to minari --image-size 80x60 --out datasets
"""

MAX_SIDE = 4096
KINDS = ("csv", "parquet", "minari")  # as in exporting/formats.py, which --help must not import


def _size(
    context: click.Context, option: click.Parameter, value: str | None
) -> tuple[int, int] | None:
    """Width and height: ``80x60``."""
    if value is None:
        return None
    sides = value.split("x")
    if len(sides) != 2 or not all(side.isascii() and side.isdigit() for side in sides):
        raise click.BadParameter(f"{value!r} is not a width and height like 80x60")
    width, height = map(int, sides)
    if not (1 <= width <= MAX_SIDE and 1 <= height <= MAX_SIDE):
        raise click.BadParameter(f"{value!r}: width and height must be 1 to {MAX_SIDE}")
    return width, height


@click.command(epilog=EPILOG)
@click.argument("file", type=options.FILE)
@click.option("--to", "form", type=click.Choice(KINDS), default="csv", show_default=True)
@click.option(
    "--out", type=options.FILE, metavar="DIR", help="Output folder. [default: named after --to]"
)
@click.option("--images/--no-images", default=None, help="Include images. [default: if recorded]")
@click.option("--image-size", callback=_size, metavar="WxH", help="Shrink images, e.g. to 80x60.")
@click.option("--name", help="Name of the Minari dataset. [default: realbench/FILE-v0]")
@options.overwrite_option
def export(
    file: Path,
    form: str,
    out: Path | None,
    images: bool | None,
    image_size: tuple[int, int] | None,
    name: str | None,
    overwrite: bool,
) -> None:
    """Convert a recording to tables or to a Minari dataset.

    CSV and Parquet have one file per table (transitions, commands, states, object_poses, logged),
    without images. A Minari dataset has one episode per stretch of play and one step per action,
    with what the condition lets a controller see.
    """
    from real_bench.exporting import FORMATS, Export
    from real_bench.recording import Recording

    if form != "minari" and (images is not None or image_size is not None or name is not None):
        raise click.UsageError("--images, --image-size and --name need --to minari")
    if images is False and image_size is not None:
        raise click.UsageError("--image-size needs images: leave out --no-images")
    with Recording(file) as recording:
        if images and recording.n_images is None:
            raise RecordingError(f"{file} has no images: leave out --images")
        chosen = Export(
            recording, out or Path(form), images is not False, image_size, name, overwrite
        )
        with progress_display(f"exporting {file.name}", "actions", len(recording)) as display:
            message = FORMATS[form](
                chosen, lambda done, total: display.update(len(recording) * done // total)
            )
    say(message)
