"""Every figure, drawn for real: whole, legible, and always the same."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from xml.etree import ElementTree

import matplotlib as mpl
import pytest
from matplotlib.text import Text
from PIL import Image

from real_bench.figures import FIGURES, Drawing, FigureData, FigureKind
from real_bench.figures.style import COLUMN_CM, DOTS_PER_INCH, PAGE_CM, in_style, line_style
from tests.figures.bench import only

SMALLEST_PT = 8
INCH_CM = 2.54
kinds = pytest.mark.parametrize("kind", FIGURES, ids=lambda kind: kind.name)


def draw(kind: FigureKind, material: FigureData) -> Drawing:
    drawing = kind.draw(material)
    assert drawing is not None
    return drawing


@dataclass(frozen=True)
class Printed:
    drawing: Drawing
    png: bytes
    svg: bytes


@pytest.fixture(scope="module")
def some(material: FigureData) -> FigureData:
    """Two recordings and all results: small multiples, and lines together."""
    return FigureData(only(material, "pushed", "two").plays, material.tested)


@pytest.fixture(scope="module")
def printed(some: FigureData) -> dict[str, Printed]:
    drawings = {kind.name: draw(kind, some) for kind in FIGURES}
    return {name: Printed(one, one.png(), one.svg()) for name, one in drawings.items()}


@kinds
def test_picture_has_a_printable_width(kind: FigureKind, printed: dict[str, Printed]) -> None:
    with Image.open(io.BytesIO(printed[kind.name].png)) as picture:
        width_cm = picture.width / DOTS_PER_INCH * INCH_CM
        assert any(abs(width_cm - wanted) < 0.02 for wanted in (COLUMN_CM, PAGE_CM))
        assert picture.height > 400
        assert len(picture.convert("L").getcolors(1 << 20) or []) > 10


@kinds
def test_vector_drawing_is_svg_without_a_date(
    kind: FigureKind, printed: dict[str, Printed]
) -> None:
    svg = printed[kind.name].svg
    assert ElementTree.fromstring(svg).tag == "{http://www.w3.org/2000/svg}svg"
    assert b"date" not in svg


@kinds
def test_the_same_input_gives_the_same_bytes(
    kind: FigureKind, some: FigureData, printed: dict[str, Printed]
) -> None:
    again, before = draw(kind, some), printed[kind.name]
    assert again.svg() == before.svg  # in another order than before
    assert again.numbers == before.drawing.numbers


def test_a_drawing_is_rendered_the_same_again(printed: dict[str, Printed]) -> None:
    one = printed["coverage"]
    assert (one.drawing.svg(), one.drawing.png()) == (one.svg, one.png)


@kinds
@pytest.mark.parametrize("names", [("pushed",), ("pushed", "learned", "one", "still", "two")])
def test_nothing_is_clipped_or_too_small_to_read(
    kind: FigureKind, material: FigureData, names: tuple[str, ...]
) -> None:
    figure = draw(kind, FigureData(only(material, *names).plays, material.tested)).figure
    with in_style():
        figure.draw_without_rendering()
        drawn = figure.get_tightbbox()
    width, height = figure.get_size_inches()
    assert min(drawn.x0, drawn.y0) > -0.01
    assert drawn.x1 < width + 0.01
    assert drawn.y1 < height + 0.01
    texts = [text for text in figure.findobj(Text) if isinstance(text, Text) and text.get_text()]
    assert min(float(text.get_fontsize()) for text in texts) >= SMALLEST_PT


@kinds
def test_numbers_are_written_as_csv(kind: FigureKind, printed: dict[str, Printed]) -> None:
    text = printed[kind.name].drawing.numbers.csv().decode()
    rows = list(csv.reader(io.StringIO(text)))
    assert len(rows) > 1
    assert {len(row) for row in rows} == {len(rows[0])}
    assert rows[0][0] in ("recording", "controller")


@kinds
def test_nothing_is_drawn_without_data(kind: FigureKind) -> None:
    assert kind.draw(FigureData()) is None
    assert kind.needs


def test_matplotlib_settings_of_the_user_have_no_effect(
    some: FigureData, printed: dict[str, Printed]
) -> None:
    (kind,) = (kind for kind in FIGURES if kind.name == "displacements")
    with mpl.rc_context({"font.size": 30, "axes.facecolor": "red"}):
        assert draw(kind, some).png() == printed[kind.name].png
        assert mpl.rcParams["font.size"] == 30


def test_lines_differ_without_colour() -> None:
    signs = [(line_style(number).line, line_style(number).marker) for number in range(28)]
    assert len(set(signs)) == 28
