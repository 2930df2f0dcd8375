"""Watch a play from outside: what its recording says as it grows."""

from real_bench.watching.following import Moment, follow
from real_bench.watching.snapshot import Snapshot, read_snapshot

__all__ = ["Moment", "Snapshot", "follow", "read_snapshot"]
