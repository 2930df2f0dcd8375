"""Objects' rows from images, like those from positions, learned from play."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from real_bench.real_g.arrays import Array, Image
from real_bench.real_g.blobs import Blob, find_blobs, split_blobs
from real_bench.real_g.foreground import Foreground
from real_bench.real_g.ground import Ground
from real_bench.real_g.hand_eye import Contingencies, HandEye, resample_path
from real_bench.real_g.looks import Appearances

FIRST_LESSON = 4
"""Number of changed images after which it learns for the first time."""

GROWTH = 1.25
"""It learns again when there are this many times more of them than at the last lesson."""

MIN_CHANGE = 0.125
"""A smaller share of the usual difference between two images may be flicker."""

MOVED_PIXELS = 1.0
"""Smaller movements are ignored; the middle of a patch is known more finely than that."""


class ImageObjects:
    """Finds things in images: (x, y, z) in metres of what can be commanded.

    It gets the images of a play in order, and the hand's paths between them. Now and then it
    learns again from all of them: the background, which things there are, and the map from the
    image to the hand's reach. The rows of earlier images change accordingly.

    What it learns depends only on the seed, the images, the paths, and the ground. The ground is
    not recorded, and therefore part of its state.

    Args:
        low, high: the range of x, y that can be commanded, (2,) metres each.
        image_map: as given to :class:`HandEye`; None: it is learned.
    """

    def __init__(self, low: Array, high: Array, image_map: Array | None = None) -> None:
        self._low, self._high = np.asarray(low, np.float64), np.asarray(high, np.float64)
        self._image_map = image_map
        self.seed(0)

    def seed(self, seed: int) -> None:
        """Begin with an empty memory."""
        self._seed = seed
        self._foreground = Foreground(np.random.default_rng(seed))
        self._appearances = Appearances()
        self._ground = Ground()
        self._hand_eye = HandEye(self._low, self._high, self._image_map)
        self._images: list[NDArray[np.uint8]] = []  # distinct ones, packed
        self._blobs: list[list[Blob]] = []
        self._positions = np.zeros((0, 0, 2))  # of things in these, pixels
        self._change = 0.0
        self._moments: list[int] = []  # which of them was seen when
        self._paths: dict[int, Array] = {}  # by the moment that each began at
        self._next_lesson = FIRST_LESSON

    def __deepcopy__(self, memo: object) -> ImageObjects:
        twin = copy.copy(self)  # what is remembered never changes, so copies may share it
        twin._images, twin._blobs = list(self._images), list(self._blobs)
        twin._moments, twin._paths = list(self._moments), dict(self._paths)
        twin._foreground = copy.deepcopy(self._foreground)
        twin._appearances, twin._ground = (
            copy.deepcopy(self._appearances),
            copy.deepcopy(self._ground),
        )
        twin._hand_eye = copy.deepcopy(self._hand_eye)
        return twin

    @property
    def n_objects(self) -> int:
        """How many things it knows; 0 before it has learned where anything is."""
        return len(self._appearances) if self._hand_eye.is_known else 0

    def see(self, image: Image | None, depth: NDArray[Any] | None = None) -> None:
        """Look at the next moment of the play, and learn if enough is new.

        Args:
            image: (height, width, 3) uint8; None while the arm is in the way.
            depth: (height, width) at the same moment, if available.
        """
        if image is not None and depth is not None:
            self.see_depth(depth)
        self.remember(image)
        if len(self._images) >= self._next_lesson:
            self.learn()

    def see_depth(self, depth: NDArray[Any]) -> None:
        """Learn about the ground from a depth image, (height, width), with the arm out of view."""
        self._ground.add(depth)

    def act(self, path: Array) -> None:
        """The hand follows a path after the last moment.

        Args:
            path: (k, 2) or with height (k, 3) metres.
        """
        self._paths[len(self._moments) - 1] = resample_path(np.asarray(path, np.float64))

    def changed(self) -> bool:
        """Whether more than flicker has changed at the last moment."""
        return self._change > MIN_CHANGE

    def forget(self) -> None:
        """Begin with an empty memory, on the ground that is known."""
        ground = self._ground
        self.seed(self._seed)
        self._ground = ground

    def remember(self, image: Image | None) -> None:
        """The next moment of a play, without learning from it; as in :meth:`see`."""
        self._change = 0.0
        if image is not None and self._foreground.add(image):
            self._change = self._foreground.change
            self._images.append(_compress(image))
            if self._foreground.is_known:
                blobs, positions = self._find(image)
                self._blobs.append(blobs)
                self._positions = np.concatenate([self._positions, positions[None]])
        self._moments.append(len(self._images) - 1)

    def learn(self) -> None:
        """Learn again from everything remembered; does nothing if too little has changed."""
        if len(self._images) < FIRST_LESSON:
            return
        self._next_lesson = int(np.ceil(GROWTH * len(self._images)))
        if self._foreground.learn():
            self._blobs = [self._blobs_in(_decompress(packed)) for packed in self._images]
        self._appearances.learn(self._blobs)
        self._positions = np.array([self._positions_in(n) for n in range(len(self._blobs))])
        if len(self._appearances) and any(
            moment + 1 < len(self._moments) for moment in self._paths
        ):
            self._hand_eye.fit(self._contingencies(), np.random.default_rng(self._seed))

    def rows(self, first: int = 0) -> Array:
        """x, y, z of each thing at each moment since the first, (k, n_objects, 3) metres.

        An unseen thing stays where it was last seen; NaN before it was ever seen.
        """
        if self.n_objects == 0:
            return np.zeros((len(self._moments) - first, 0, 3))
        begin = first
        while begin > 0 and np.isnan(self._positions_at(slice(begin, begin + 1))).any():
            begin -= 1
        rows = self._rows(self._positions_at(slice(begin, None)))
        for thing in range(rows.shape[1]):
            visible = ~np.isnan(rows[:, thing, 0])
            last = np.maximum.accumulate(np.where(visible, np.arange(len(rows)), -1))
            rows[last >= 0, thing] = rows[last[last >= 0], thing]
        return rows[first - begin :]

    def look(self, image: Image) -> Array:
        """x, y, z of each thing in any image, (n_objects, 3) metres; NaN where it is not seen."""
        if self.n_objects == 0:
            return np.zeros((0, 3))
        return self._rows(self._find(image)[1])

    def get_state(self) -> dict[str, Any]:
        """The seed and what it has learned; not its memory, which is in the recording."""
        return {
            "seed": self._seed,
            "foreground": self._foreground.get_state(),
            "looks": self._appearances.get_state(),
            "ground": self._ground.get_state(),
            "hand_eye": self._hand_eye.get_state(),
        }

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Restore what was learned, with an empty memory."""
        self.seed(state["seed"])
        self._foreground.set_state(state["foreground"])
        self._appearances.set_state(state["looks"])
        self._ground.set_state(state["ground"])
        self._hand_eye.set_state(state["hand_eye"])

    def _contingencies(self) -> Contingencies:
        """Of every thing that was seen before and after what the hand did."""
        starts = np.array([m for m in self._paths if m + 1 < len(self._moments)], np.intp)
        paths = np.array([self._paths[moment] for moment in starts])
        positions = self._positions_at(slice(None))
        before, after = positions[starts], positions[starts + 1]
        action, thing = np.nonzero(~np.isnan(before + after).any(axis=2))
        before, after = before[action, thing], after[action, thing]
        moved = np.linalg.norm(after - before, axis=1) > MOVED_PIXELS
        return Contingencies(
            self._depth_corrected(before), self._depth_corrected(after), paths[action], moved
        )

    def _find(self, image: Image) -> tuple[list[Blob], Array]:
        """The blobs in an image, and where each thing is, (k, 2) pixels."""
        blobs = self._blobs_in(image)
        return blobs, self._positions_of(blobs, image)

    def _positions_in(self, number: int) -> Array:
        """Where each thing is in a distinct image, by the blobs that were found in it."""
        blobs = self._blobs[number]
        image = (
            _decompress(self._images[number]) if self._appearances.may_be_merged(blobs) else None
        )
        return self._positions_of(blobs, image)

    def _positions_at(self, moments: slice) -> Array:
        """Where each thing was seen at some moments, (n, k, 2) pixels; NaN where it was not."""
        numbers = np.array(self._moments[moments], np.intp)
        if not len(self._positions):
            return np.full((len(numbers), len(self._appearances), 2), np.nan)
        return np.where(numbers[:, None, None] < 0, np.nan, self._positions[numbers])

    def _positions_of(self, blobs: list[Blob], image: Image | None) -> Array:
        things = self._appearances.assign(blobs)
        if image is not None and self._appearances.may_be_merged(blobs):
            mask = self._foreground.mask(image)
            parts = split_blobs(image, mask, self._appearances.likelihoods)
            things = [
                part if part is not None and self._appearances.is_whole(k, part) else None
                for k, part in enumerate(parts)
            ]
        missing = np.full(2, np.nan)
        positions = [missing if thing is None else thing.position for thing in things]
        return np.array(positions).reshape(-1, 2)

    def _blobs_in(self, image: Image) -> list[Blob]:
        return find_blobs(image, self._foreground.mask(image))

    def _depth_corrected(self, positions: Array) -> Array:
        """Places as if the ground were equally far from the camera everywhere, (..., 2).

        The farther something is, the more metres a pixel covers.
        """
        centre = np.array(self._foreground.size) / 2
        return np.asarray((positions - centre) * self._ground.distance(positions)[..., None])

    def _rows(self, positions: Array) -> Array:
        """x, y, z of positions, (..., 2) pixels to (..., 3)."""
        xy = self._hand_eye.xy(self._depth_corrected(positions))
        z = -self._hand_eye.scale * self._foreground.size[0] / 2 * self._ground.distance(positions)
        return np.concatenate([xy, np.where(np.isnan(xy[..., :1]), np.nan, z[..., None])], axis=-1)


def _compress(image: Image) -> NDArray[np.uint8]:
    packed = cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, 1])[1]
    return np.asarray(packed, np.uint8)


def _decompress(packed: NDArray[np.uint8]) -> Image:
    return np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR), np.uint8)
