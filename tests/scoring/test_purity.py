from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import real_bench.scoring

HEAVY = ("pybullet", "h5py", "torch", "matplotlib", "real_bench.recording", "real_bench.phases")


def test_scoring_loads_neither_simulation_nor_recordings() -> None:
    modules = [path.stem for path in Path(real_bench.scoring.__file__).parent.glob("[a-z]*.py")]
    assert "metric" in modules
    assert "verdict" in modules
    script = "import sys\n"
    script += "".join(f"import real_bench.scoring.{name}\n" for name in modules)
    script += f"print([name for name in {HEAVY} if name in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"
