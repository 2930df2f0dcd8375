"""Watch a play from outside, by its growing recording."""

from real_bench.watching.following import Moment, follow
from real_bench.watching.status import PlayStatus, read_status

__all__ = ["Moment", "PlayStatus", "follow", "read_status"]
