"""How long the phases of the benchmark last (paper, sections Scenario and Metrics), and limits."""

INTRINSIC_STEPS = 15_000_000
TRIAL_STEPS = 10_000

MAX_TRIAL_STEPS = 100_000
"""Ten times the benchmark's. Commands of a longer trial are neither kept nor read."""

LARGEST = 2**63 - 1
"""The largest number of steps, and the largest seed, that files hold."""
