"""The ways of control, one class each: everything the rest needs to know about one.

========= ====== ==== =============================================================
control   letter size command vector
========= ====== ==== =============================================================
macro     M      4    x1, y1, x2, y2 (metres): push from the first to the second point
joints    J      9    seven arm joints, gripper base, gripper tip (radians)
cartesian C      9    x, y, z (metres), quaternion (x, y, z, w), gripper base and tip
========= ====== ==== =============================================================
"""

from typing import Any

from real_bench.controls.cartesian import CartesianControl
from real_bench.controls.control import Control
from real_bench.controls.joints import JointControl
from real_bench.controls.macro import MacroControl

CONTROLS: dict[str, type[Control]] = {
    control.letter: control for control in (MacroControl, JointControl, CartesianControl)
}

__all__ = [
    "CONTROLS",
    "CartesianControl",
    "Control",
    "JointControl",
    "MacroControl",
    "control_of",
]


def control_of(action_space: Any) -> type[Control]:
    """The way of control of an action space; raises KeyError if there is none."""
    for control in CONTROLS.values():
        if set(control.keys) <= set(action_space.spaces):
            return control
    raise KeyError(f"no control has the keys {', '.join(action_space.spaces)}")
