"""The official evaluation."""

from real_bench.compat.evaluation import evaluate

__all__ = ["evaluate"]
