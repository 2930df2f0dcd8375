"""The tables of a recording as CSV or Parquet files, one column per number."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from real_bench.extras import extra
from real_bench.files.atomic import atomic_replacement
from real_bench.files.outputs import check_folder, check_output
from real_bench.recording import Recording
from real_bench.recording.columns import flat, pose_type, to_columns

if TYPE_CHECKING:
    from real_bench.exporting.formats import Export, OnExport

ROWS_AT_ONCE = 50_000
FACTS = "recording.json"
POSES = "object_poses"
"""The table that not every recording has."""

Rows = NDArray[Any]
Writer = Callable[[Rows], None]


def save_csv(export: Export, report: OnExport) -> str:
    """One CSV file per table: a line of names, then one row per line, with all digits."""
    return _save(export, report, "csv", _csv)


def save_parquet(export: Export, report: OnExport) -> str:
    """One Parquet file per table; raises MissingExtraError without pyarrow."""
    extra("pyarrow.parquet", "parquet")
    return _save(export, report, "parquet", _parquet)


def tables_of(recording: Recording) -> dict[str, tuple[int, Callable[[int], Rows]]]:
    """The number of rows of each table, and a function that reads some, given the first."""
    states, logged = recording.states, recording.logged
    poses = recording.object_poses if recording.has_poses else None

    def commands(first: int) -> Rows:
        return recording.commands(first, ROWS_AT_ONCE)

    def part_of(rows: Rows) -> Callable[[int], Rows]:
        return lambda first: rows[first : first + ROWS_AT_ONCE]

    tables = {
        "transitions": (len(recording), part_of(recording.transitions)),
        "commands": (recording.n_commands, commands),
        "states": (len(states), part_of(states)),
        "logged": (len(logged), part_of(logged)),
    }
    if poses is not None:
        rows = to_columns(poses, pose_type(recording.header.object_names))
        tables[POSES] = (len(rows), part_of(rows))
    return tables


def _save(
    export: Export,
    report: OnExport,
    suffix: str,
    opened: Callable[[Path, np.dtype[Any]], AbstractContextManager[Writer]],
) -> str:
    tables = tables_of(export.recording)
    paths = {name: export.folder / f"{name}.{suffix}" for name in (*tables, POSES)}
    check_folder(export.folder, make=True)
    for path in (*paths.values(), export.folder / FACTS):
        check_output(path, overwrite=export.overwrite)
    total, done = sum(count for count, _ in tables.values()), 0
    facts = json.dumps(export.recording.header.model_dump(mode="json"), indent=1)
    with ExitStack() as all_at_once:  # tables of two recordings must not be mixed
        for name, (count, read) in tables.items():
            hidden = all_at_once.enter_context(atomic_replacement(paths[name]))
            with opened(hidden, flat(read(0).dtype)) as write:
                for first in range(0, count, ROWS_AT_ONCE):
                    rows = read(first)
                    write(to_columns(rows, flat(rows.dtype)))
                    report(done + first + len(rows), total)
            done += count
        hidden = all_at_once.enter_context(atomic_replacement(export.folder / FACTS))
        hidden.write_text(facts + "\n", encoding="utf-8")
    if POSES not in tables:  # of another recording, exported before
        paths[POSES].unlink(missing_ok=True)
    return f"{len(tables)} tables and {FACTS} in {export.folder}"


@contextmanager
def _csv(path: Path, dtype: np.dtype[Any]) -> Iterator[Writer]:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(dtype.names or ())

        def write(rows: Rows) -> None:
            writer.writerows(rows.tolist())

        yield write


@contextmanager
def _parquet(path: Path, dtype: np.dtype[Any]) -> Iterator[Writer]:
    import pyarrow as pa
    from pyarrow import parquet

    kinds = {
        name: pa.string() if dtype[name].kind == "O" else pa.from_numpy_dtype(dtype[name])
        for name in dtype.names or ()
    }
    schema = pa.schema(list(kinds.items()))
    with parquet.ParquetWriter(path, schema) as writer:

        def write(rows: Rows) -> None:
            columns = [pa.array(rows[name], kind) for name, kind in kinds.items()]
            writer.write_table(pa.Table.from_arrays(columns, schema=schema))

        yield write
