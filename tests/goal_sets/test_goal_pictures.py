import numpy as np
import pytest
from PIL import Image

from real_bench.goal_sets import contact_sheet, trial_strip
from real_bench.goal_sets.picture import CAPTION_HEIGHT, MARGIN
from tests.goal_sets.goal_examples import make_goal_set, with_goal


@pytest.mark.parametrize("n_goals", [1, 4, 5, 13])
def test_a_sheet_has_room_for_every_goal(n_goals):
    goal_set = make_goal_set(n_goals=n_goals, shape=(24, 32))
    sheet = contact_sheet(goal_set)
    assert sheet.mode == "RGB"
    assert sheet.width >= 2 * 200 * min(n_goals, 4)
    assert sheet.height >= 150 * -(-n_goals // 4)


def test_a_sheet_shows_start_and_goal_in_their_colours():
    red, blue = (np.full((24, 32, 3), colour, np.uint8) for colour in ((255, 0, 0), (0, 0, 255)))
    goal_set = with_goal(make_goal_set(n_goals=1, shape=(24, 32)), retina_before=red, retina=blue)
    counts = contact_sheet(goal_set).getcolors(10_000)
    assert counts is not None
    colours = {colour: count for count, colour in counts}
    assert colours[(255, 0, 0)] == colours[(0, 0, 255)] == 200 * 150


def test_goal_set_with_an_empty_mask_can_be_drawn():
    nothing = np.full((24, 32), -1)
    goal_set = with_goal(make_goal_set(n_goals=1, shape=(24, 32)), mask=nothing)
    assert contact_sheet(goal_set).size > (400, 150)


@pytest.mark.parametrize("title", ["goal 3, 2D: score 0.52", "a long title " * 100])
def test_strip_shows_its_images_unaltered(title):
    images = np.random.default_rng(0).integers(0, 256, (3, 240, 320, 3), dtype=np.uint8)
    strip = trial_strip(images[0], images[1], images[2], title)
    top, left = MARGIN + 2 * CAPTION_HEIGHT, MARGIN
    shown = np.array(strip)[top : top + 240, left : left + 3 * 320]
    np.testing.assert_array_equal(shown, np.concatenate(list(images), axis=1))
    assert isinstance(strip, Image.Image)
