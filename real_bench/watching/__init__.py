"""Watch a play from outside: what its recording says as it grows."""

from real_bench.watching.following import Moment, follow
from real_bench.watching.status import PlayStatus, read_status

__all__ = ["Moment", "PlayStatus", "follow", "read_status"]
