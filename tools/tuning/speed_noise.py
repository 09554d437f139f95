"""The noise at the PWM while the table turns at a constant speed, and the speed at which it is worst.

At a constant speed the rounding of the position to counts is not white. At f counts per tick its error is a sawtooth
that repeats f times per tick. It has a line of power 1 / (2 pi^2 m^2) count^2 at each harmonic m f, folded at the tick
rate. The PID amplifies each line by its own response, so some speeds have more noise than a ramp, which passes all of
them.
"""

from functools import lru_cache

import numpy as np
from threadpoolctl import threadpool_limits

from tools.tuning.frequency_response import Array

_SPEEDS = 256
_HARMONICS = 200


def steady_noise(power: Array, most_count_tick: float) -> tuple[Array, Array]:
    """Return the worst standard deviation over all constant speeds, and its fraction of a count per tick.

    Args:
        power: (..., n) squared response to an error of the position of one count, on `frequency_response.grid_z`.
        most_count_tick: the maximum speed; it limits the search if the table makes less than half a count per tick.
    """
    share, lines = _lines(power.shape[-1])
    reached = max(1, int(np.searchsorted(share, most_count_tick, side="right")))
    with threadpool_limits(1, "blas"):  # on a busy computer the threads of a BLAS wait for each other
        variance = power @ lines[:reached].T
    worst = variance.argmax(axis=-1)
    deviation: Array = np.sqrt(np.take_along_axis(variance, worst[..., None], axis=-1)[..., 0])
    return deviation, share[worst]


@lru_cache(maxsize=4)
def _lines(count: int) -> tuple[Array, Array]:
    """Return speeds up to half a count per tick, and for each the power of its sawtooth at each frequency."""
    size = 2 * count
    speed = np.unique(np.linspace(1, count, min(_SPEEDS, count)).round().astype(int))
    harmonic = np.arange(1, _HARMONICS + 1)
    folded = np.outer(speed, harmonic) % size
    folded = np.minimum(folded, size - folded)
    lines = np.zeros((len(speed), count + 1))
    np.add.at(lines, (np.arange(len(speed))[:, None], folded), 0.5 / (np.pi * harmonic) ** 2)
    return speed / size, lines[:, 1:]
