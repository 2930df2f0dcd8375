"""Results and recordings proved by replay: the recorded commands, in a clean simulation."""

from real_bench.verification.recordings import RecordingVerification
from real_bench.verification.results import ResultVerification
from real_bench.verification.verdicts import RecordingVerdict, ResultVerdict, TrialCheck

__all__ = [
    "RecordingVerdict",
    "RecordingVerification",
    "ResultVerdict",
    "ResultVerification",
    "TrialCheck",
]
