"""How long the phases of the benchmark last (paper, sections Scenario and Metrics)."""

INTRINSIC_STEPS = 15_000_000
TRIAL_STEPS = 10_000
