"""Check a recording before it is read: a file from a stranger may declare anything.

HDF5 can point outside the file, declare endless shapes, and unpack a kilobyte to a gigabyte. So
every dataset, and the unpacked size of every compressed piece, is checked before anything is read
from it.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterable
from typing import Any

import h5py
import numpy as np

GZIP, SHUFFLE, ZSTD = 1, 2, 32015  # HDF5's numbers
PACKINGS: tuple[list[int], ...] = ([], [ZSTD], [SHUFFLE, GZIP])
"""The only filters we use; before schema version 2 everything was packed by zstd."""

NUMBERS = "biufc"
"""Kinds of numbers, as numpy calls them."""

MAX_CHUNK_BYTES = 2**28
MAX_SMALL_BYTES = 2**26  # may be declared however little is stored
MAX_RATIO = 1000  # the rows of real recordings shrink to a tenth or so
_MAGIC = b"\x28\xb5\x2f\xfd"


def check_attributes(file: h5py.File) -> None:
    """Raise ValueError unless every attribute is one number or one text."""
    for name in file.attrs:
        kind = file.attrs.get_id(name)
        if kind.shape != () or h5py.check_opaque_dtype(kind.dtype):
            raise ValueError(f"attribute {name} is of shape {kind.shape}")


def check_group(file: h5py.Group, name: str) -> None:
    """Raise ValueError unless a group, if it is there, is in the file itself."""
    if name in file and not (_is_inside(file, name) and isinstance(file[name], h5py.Group)):
        raise ValueError(f"{name} is not a group of the file")


def check_dataset(
    file: h5py.Group,
    name: str,
    dtype: np.dtype[Any] | None,
    row_shape: tuple[int, ...] | None,
) -> None:
    """Raise ValueError unless a dataset is in the file, of its type, and no larger than declared.

    Args:
        file: where it is.
        name: its path from there.
        dtype: what it must hold; None: numbers of any kind.
        row_shape: the shape of a row; None: any.
    """
    if not _is_inside(file, name) or not isinstance(file[name], h5py.Dataset):
        raise ValueError(f"{name} is not a dataset of the file")
    data = file[name]
    if data.dtype != dtype if dtype is not None else data.dtype.kind not in NUMBERS:
        raise ValueError(f"{name} holds {data.dtype}, not {dtype or 'numbers'}")
    if row_shape is not None and data.ndim == 0:
        raise ValueError(f"{name} has no rows")
    if row_shape is not None and data.shape[1:] != row_shape:
        raise ValueError(f"{name} has rows of shape {data.shape[1:]}, not {row_shape}")
    if data.is_virtual or data.external:
        raise ValueError(f"{name} lies in another file")
    if data.chunks is None:
        if data.id.get_storage_size() != _declared_bytes(data):
            raise ValueError(f"{name} declares more than it holds")
        return
    _check_filters(data, name)
    if math.prod(data.chunks) * data.dtype.itemsize > MAX_CHUNK_BYTES:
        raise ValueError(f"{name} has pieces of more than {MAX_CHUNK_BYTES} bytes")
    if data.id.get_num_chunks() != _n_chunks(data):
        raise ValueError(f"{name} declares more than it holds")


def check_images(file: h5py.Group, name: str) -> None:
    """Raise ValueError unless a dataset is of images, (n, height, width, 3) uint8, in the file."""
    check_dataset(file, name, np.dtype("u1"), None)
    shape = file[name].shape
    if len(shape) != 4 or shape[3] != 3:
        raise ValueError(f"{name} has rows of shape {shape[1:]}, not those of images")


def check_sizes(file: h5py.Group, names: Iterable[str]) -> None:
    """Raise ValueError if a dataset that is read as a whole would be far larger than stored."""
    for name in names:
        data = file[name]
        if _declared_bytes(data) > MAX_SMALL_BYTES + MAX_RATIO * data.id.get_storage_size():
            raise ValueError(
                f"{name} declares {_declared_bytes(data)} bytes but holds next to none"
            )


def check_pieces(data: h5py.Dataset, first: int = 0, last: int | None = None) -> None:
    """Raise ValueError unless each compressed piece of these rows unpacks to one chunk exactly."""
    filters = [] if data.chunks is None else _filters(data)
    if not filters:
        return
    unpacks_to = _zstd_unpacks_to if filters == [ZSTD] else _gzip_unpacks_to
    n_bytes = math.prod(data.chunks) * data.dtype.itemsize
    rows = data.chunks[0]
    last = len(data) if last is None else min(last, len(data))
    for start in range(first // rows * rows, last, rows):
        place = (start, *[0] * (data.ndim - 1))
        mask, piece = data.id.read_direct_chunk(place)
        if mask == 0 and not unpacks_to(piece, n_bytes):
            raise ValueError(f"{data.name} has a piece that unpacks to another size")


def _is_inside(file: h5py.Group, name: str) -> bool:
    """Whether each part of a path is a plain link, into this file."""
    parts = name.split("/")
    return all(
        isinstance(file.get("/".join(parts[:end]), getlink=True), h5py.HardLink)
        for end in range(1, len(parts) + 1)
    )


def _declared_bytes(data: h5py.Dataset) -> int:
    n_bytes: int = math.prod(data.shape) * data.dtype.itemsize
    return n_bytes


def _n_chunks(data: h5py.Dataset) -> int:
    """How many pieces there must be if none is missing; rows lie within one piece."""
    if any(size != piece for size, piece in zip(data.shape[1:], data.chunks[1:], strict=True)):
        raise ValueError(f"{data.name} has rows in several pieces")
    n_chunks: int = -(-data.shape[0] // data.chunks[0])
    return n_chunks


def _filters(data: h5py.Dataset) -> list[int]:
    properties = data.id.get_create_plist()
    return [properties.get_filter(n)[0] for n in range(properties.get_nfilters())]


def _check_filters(data: h5py.Dataset, name: str) -> None:
    if (filters := _filters(data)) not in PACKINGS:
        raise ValueError(f"{name} is packed by filters {filters}, which realbench does not use")


def _gzip_unpacks_to(piece: bytes, n_bytes: int) -> bool:
    """Whether a zlib stream unpacks to ``n_bytes``; it does not declare its size."""
    stream = zlib.decompressobj()
    try:
        return len(stream.decompress(piece, n_bytes + 1)) == n_bytes
    except zlib.error as error:
        raise ValueError(f"a piece is not packed by gzip: {error}") from error


def _zstd_unpacks_to(piece: bytes, n_bytes: int) -> bool:
    """Whether a zstd frame declares that it unpacks to ``n_bytes`` (RFC 8878)."""
    if piece[:4] != _MAGIC or len(piece) < 5:
        raise ValueError("a piece is not packed by zstd")
    descriptor = piece[4]
    is_single = bool(descriptor & 0x20)
    width = (1 if is_single else 0, 2, 4, 8)[descriptor >> 6]
    start = 5 + (0 if is_single else 1) + (0, 1, 2, 4)[descriptor & 3]
    if width == 0 or len(piece) < start + width:
        return False
    size = int.from_bytes(piece[start : start + width], "little")
    return (size + 256 if width == 2 else size) == n_bytes
