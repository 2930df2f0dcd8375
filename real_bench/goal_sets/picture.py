"""Pictures of goals and trials, for people."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from real_bench.goal_sets.goal import NO_BODY, GoalSet
from real_bench.text.counting import counted

MARGIN = 8
CAPTION_HEIGHT = 24
FONT_SIZE = 15
THUMBNAIL_WIDTH = 200
MAX_COLUMNS = 4  # of pairs of start and goal
PAPER, INK = "white", "black"

_Retina = NDArray[np.uint8]
Box = tuple[int, int, int, int]


def contact_sheet(goal_set: GoalSet) -> Image.Image:
    """Start and goal of every goal side by side, numbered from 0, in a grid."""
    box = bounding_box_of_bodies([goal.mask for goal in goal_set.goals])
    pairs = [
        _captioned(
            [thumbnail(goal.retina_before, box), thumbnail(goal.retina, box)],
            [f"{index}   {goal.challenge}", "goal"],
        )
        for index, goal in enumerate(goal_set.goals)
    ]
    title = (
        f"{counted(len(goal_set), 'goal')}, {counted(goal_set.n_objects, 'object')}, "
        f"scene {goal_set.scene}, "
        f"{goal_set.generator}, seed {goal_set.seed}"
    )
    return _titled(title, _grid(pairs))


def trial_strip(start: _Retina, goal: _Retina, end: _Retina, title: str) -> Image.Image:
    """Three camera images, (height, width, 3) uint8, side by side: start, goal and end."""
    pictures = [Image.fromarray(image) for image in (start, goal, end)]
    return _titled(title, _captioned(pictures, ["start", "goal", "end"]))


def captioned(images: Sequence[_Retina], captions: Sequence[str]) -> _Retina:
    """Camera images of one size in a row, each under its caption, (24 + height, ..., 3) uint8."""
    return np.asarray(_captioned([Image.fromarray(image) for image in images], captions))


def bounding_box_of_bodies(masks: Sequence[NDArray[np.int32]]) -> Box:
    """Left, upper, right, lower of the part of the images that shows more than background."""
    any_body = np.any([mask != NO_BODY for mask in masks], axis=0)
    height, width = any_body.shape
    rows, columns = np.nonzero(any_body)
    if not rows.size:
        return 0, 0, width, height
    left, right = int(columns.min()) - MARGIN, int(columns.max()) + 1 + MARGIN
    upper, lower = int(rows.min()) - MARGIN, int(rows.max()) + 1 + MARGIN
    return max(0, left), max(0, upper), min(width, right), min(height, lower)


def thumbnail(image: _Retina, box: Box) -> Image.Image:
    """A part of a camera image, (height, width, 3) uint8, scaled to the width of thumbnails."""
    shown = Image.fromarray(image).crop(box)
    size = (THUMBNAIL_WIDTH, max(1, round(shown.height * THUMBNAIL_WIDTH / shown.width)))
    return shown.resize(size, Image.Resampling.LANCZOS)


def _captioned(pictures: Sequence[Image.Image], captions: Sequence[str]) -> Image.Image:
    """Pictures in a row, each under its caption."""
    width, height = pictures[0].size
    row = Image.new("RGB", (len(pictures) * width, CAPTION_HEIGHT + height), PAPER)
    for index, (picture, caption) in enumerate(zip(pictures, captions, strict=True)):
        _write(row, caption, index * width)
        row.paste(picture, (index * width, CAPTION_HEIGHT))
    return row


def _grid(pictures: Sequence[Image.Image]) -> Image.Image:
    n_columns = min(MAX_COLUMNS, len(pictures))
    n_rows = math.ceil(len(pictures) / n_columns)
    width, height = (side + MARGIN for side in pictures[0].size)
    grid = Image.new("RGB", (n_columns * width, n_rows * height), PAPER)
    for index, picture in enumerate(pictures):
        row, column = divmod(index, n_columns)
        grid.paste(picture, (column * width, row * height))
    return grid


def _titled(title: str, picture: Image.Image) -> Image.Image:
    """A picture under a title, wide enough for both."""
    width = max(picture.width, math.ceil(_font().getlength(title))) + 2 * MARGIN
    page = Image.new("RGB", (width, picture.height + CAPTION_HEIGHT + 2 * MARGIN), PAPER)
    _write(page, title, MARGIN)
    page.paste(picture, (MARGIN, CAPTION_HEIGHT + MARGIN))
    return page


def _write(picture: Image.Image, text: str, left: int) -> None:
    middle = (left, CAPTION_HEIGHT // 2)
    ImageDraw.Draw(picture).text(middle, text, INK, _font(), anchor="lm")


def _font() -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(FONT_SIZE)
