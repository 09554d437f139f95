"""Gain tuning: the speed loop as python-control systems, gain design within bounds, and checks on the emulator.

The names below are the public interface; docs/tuning.md, "In Python", shows how to use them.
"""

from emulator.config.table_config import GainsConfig
from tools.bounds import Limits
from tools.tuning.check import Check, Curve, Figure
from tools.tuning.checks import EmulatorChecks, check_on_emulator
from tools.tuning.gain_files import gains_config
from tools.tuning.linear_model import Teeth, plant, quantization_noise
from tools.tuning.loop import closed_loop, open_loop, registers, regulator
from tools.tuning.loop_figures import LoopFigures

__all__ = [
    "Check",
    "Curve",
    "EmulatorChecks",
    "Figure",
    "GainsConfig",
    "Limits",
    "LoopFigures",
    "Teeth",
    "check_on_emulator",
    "closed_loop",
    "gains_config",
    "open_loop",
    "plant",
    "quantization_noise",
    "registers",
    "regulator",
]
