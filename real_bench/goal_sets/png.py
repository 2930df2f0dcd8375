"""Images to PNG, without loss, and back, without trusting what is read."""

from __future__ import annotations

import io
import struct
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from real_bench.errors import GoalSetError

MAX_SIDE = 4096
_MODES = {0: "L", 2: "RGB"}  # by PNG's numbers for colour types
_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_START = struct.Struct(">8sI4sIIBBBBB")


@dataclass(frozen=True)
class PngHeader:
    """What a PNG declares: its size, and Pillow's mode (``L`` or ``RGB``, 8 bits per channel)."""

    width: int
    height: int
    mode: str


def encode_png(image: NDArray[np.uint8]) -> bytes:
    """Encode (height, width) or (height, width, 3) uint8."""
    stream = io.BytesIO()
    Image.fromarray(image).save(stream, format="PNG")
    return stream.getvalue()


def read_png_header(data: bytes) -> PngHeader:
    """What a PNG declares, read without decoding any of it.

    Raises:
        GoalSetError: it is not a PNG, not of the kind that :func:`encode_png` writes, or too large.
    """
    if len(data) < _START.size:
        raise GoalSetError("an image is not a PNG")
    signature, _, chunk, width, height, depth, colour, *_ = _START.unpack_from(data)
    if signature != _SIGNATURE or chunk != b"IHDR":
        raise GoalSetError("an image is not a PNG")
    if depth != 8 or colour not in _MODES:
        raise GoalSetError(
            f"an image has {depth} bits, colour type {colour}: use 8-bit RGB or grey"
        )
    if not (1 <= width <= MAX_SIDE and 1 <= height <= MAX_SIDE):
        raise GoalSetError(f"an image declares {width}x{height}: use at most {MAX_SIDE} per side")
    return PngHeader(width, height, _MODES[colour])


def decode_png(data: bytes) -> NDArray[np.uint8]:
    """Decode what :func:`encode_png` made; zeros after its end are ignored.

    Raises:
        GoalSetError: it is damaged, or see :func:`read_png_header`.
    """
    header = read_png_header(data)
    try:
        with Image.open(io.BytesIO(data), formats=["PNG"]) as image:
            pixels: NDArray[Any] = np.array(image)
            mode = image.mode
    except (OSError, SyntaxError, ValueError, EOFError, struct.error, zlib.error) as error:
        raise GoalSetError(f"an image is damaged ({error})") from error
    if mode != header.mode or pixels.shape[:2] != (header.height, header.width):
        raise GoalSetError("an image does not fit its header")
    return pixels
