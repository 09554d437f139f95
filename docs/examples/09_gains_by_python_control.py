"""Gains by python-control: a PI regulator for the table's speed loop, from the emulator's own linear model.

`python -m tools.tune` does much more; this shows how to use the model with your own method.
"""

import control
import numpy as np

from emulator import load_config
from tools.tuning.linear_model import Teeth, plant, time_constant_s

config = load_config()
model = plant(config, Teeth.DRIVING)["measured_deg_s", "duty"]  # sampled at the firmware's tick
tick_s = 1.0 / config.control.tick_hz
delay_s = tick_s * (2 + config.control.speed_window_ticks / 2)

# Internal model control: the loop becomes as fast as three times its delay.
gain, time_constant = float(np.real(model.dcgain())), time_constant_s(config, Teeth.DRIVING)
proportional = time_constant / (gain * 4.0 * delay_s)
integral_time_s = min(time_constant, 16.0 * delay_s)
regulator = control.tf([proportional * (1 + tick_s / integral_time_s), -proportional], [1, -1], tick_s)

frequencies = np.logspace(0, np.log10(np.pi / tick_s), 2000)  # rad/s
z = np.exp(1j * frequencies * tick_s)
loop = regulator(z) * model(z)
gain_margin, phase_margin, *_ = control.margin(control.frd(loop, frequencies, smooth=True))
peak = np.abs(1.0 / (1.0 + loop)).max()
print(f"proportional {proportional:.4f} duty s/deg, integral time {1e3 * integral_time_s:.1f} ms")
print(f"gain margin {20 * np.log10(gain_margin):.1f} dB, phase margin {phase_margin:.0f} deg, Ms {peak:.2f}")
