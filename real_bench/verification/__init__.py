"""Results and recordings proved by replay: the recorded commands, in a clean simulation."""

from real_bench.verification.bundles import Bundle, bundles_in
from real_bench.verification.recordings import RecordingVerification
from real_bench.verification.results import ResultVerification
from real_bench.verification.verdicts import RecordingVerdict, ResultVerdict, TrialCheck
from real_bench.verification.wholes import BundleVerdict, BundleVerification

__all__ = [
    "Bundle",
    "BundleVerdict",
    "BundleVerification",
    "RecordingVerdict",
    "RecordingVerification",
    "ResultVerdict",
    "ResultVerification",
    "TrialCheck",
    "bundles_in",
]
