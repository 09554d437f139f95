"""How well a minute over the wire tells the constants of tables that nobody has seen.

python -m tools.bench identify          ten random plants over emulator://
python -m tools.bench identify --pty    the same over pseudo-terminals, in real time
"""

import subprocess
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from math import exp, log
from pathlib import Path
from random import Random
from typing import NamedTuple, TextIO

import emulator  # noqa: F401  # teaches pyserial the port emulator://
from emulator.config import load_config
from protocol.client import TableClient
from tools.bench.timing import print_table
from tools.identification.constants import DERIVED
from tools.identification.excitation import excitation
from tools.identification.identify_table import identify
from tools.identification.recorder import record
from tools.identification.recording import WireRecording
from tools.identification.recording_checks import check_recording

SPREAD = {
    "motor.torque_constant_Nm_A": 0.3,
    "motor.rotor_inertia_kg_m2": 0.15,
    "gears.efficiency": 0.1,
    "table.inertia_kg_m2": 0.4,
    "table.bearing_friction_Nm": 0.3,
    "friction.coulomb_Nm": 0.4,
    "friction.stiction_ratio": 0.15,
    "friction.stribeck_speed_rad_s": 0.3,
    "friction.viscous_Nm_s": 0.4,
}
"""Up to how far constants are from the default table's, as logarithms, about their share."""

BACKLASH_ARCMIN = (2.5, 40.0)
BOUNDS = {"gain": 0.05, "time constant": 0.05, "Coulomb friction": 0.15, "backlash": 0.2}
_DURATION_S, _SPEED_DEG_S, _ACCELERATION_DEG_S2, _BAUD = 60.0, 40.0, 100.0, 9600


class Found(NamedTuple):
    """One estimate against the truth."""

    error: float
    inside: bool  # the truth is in the 95 % interval
    told: bool


def bench(stream: TextIO, plants: int = 10, seed: int = 1, jobs: int = 2, in_real_time: bool = False) -> None:
    """Print the errors for random plants."""
    seeds = range(seed, seed + plants)
    with tempfile.TemporaryDirectory() as folder, ProcessPoolExecutor(jobs) as workers:
        configs = [write_plant(Path(folder), each) for each in seeds]
        recordings = list(workers.map(partial(_recorded, in_real_time=in_real_time), configs, seeds))
        # Fitted only now: it keeps the cores busy, which would disturb a recording.
        outcomes = list(workers.map(_identified, configs, recordings))
        rows = [
            (
                f"{each}, {load_config(config).gears.backlash_arcmin:.1f} arcmin",
                *(f"{100.0 * found[name].error:+.1f}{'' if found[name].inside else ' *'}" for name in found),
                "yes" if all(abs(found[name].error) <= BOUNDS[name] for name in BOUNDS) else "NO",
            )
            for each, config, found in zip(seeds, configs, outcomes, strict=True)
        ]
    line = "pseudo-terminals in real time" if in_real_time else "emulator://"
    print_table(
        stream,
        f"Errors in % of {_DURATION_S:g} s over {line}; * the truth is outside the 95 % interval",
        ("seed, backlash", *outcomes[0], "within bounds"),
        rows,
    )
    coverage = [f"{name} {sum(found[name].inside for found in outcomes)}" for name in outcomes[0]]
    print(f"  truth inside the 95 % interval, of {plants}: {', '.join(coverage)}", file=stream)
    told = [f"{name} {sum(found[name].told for found in outcomes)}" for name in outcomes[0]]
    print(f"  told, of {plants}: {', '.join(told)}", file=stream, flush=True)


def random_plant(seed: int) -> dict[str, float]:
    """Return constants of a table, by their keys in its configuration."""
    chance = Random(seed)  # noqa: S311  # spreads the plants
    usual = load_config()
    plant = {}
    for name, spread in SPREAD.items():
        section, key = name.split(".")
        plant[name] = getattr(getattr(usual, section), key) * exp(chance.uniform(-spread, spread))
    least, most = BACKLASH_ARCMIN
    plant["gears.backlash_arcmin"] = exp(chance.uniform(log(least), log(most)))
    return plant


def write_plant(folder: Path, seed: int) -> Path:
    """Write the configuration of a random table, and return its path."""
    path = folder / f"{seed}.toml"
    path.write_text("".join(f"{name} = {value!r}\n" for name, value in random_plant(seed).items()), encoding="utf-8")
    return path


def _recorded(config: Path, seed: int, in_real_time: bool) -> WireRecording:
    if not in_real_time:
        return _record_over(f"emulator://?config={config}&seed={seed}")
    command = [sys.executable, "-m", "emulator", "--pty", "--config", str(config), "--seed", str(seed)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as table:
        assert table.stdout
        try:
            return _record_over(table.stdout.readline().strip())
        finally:
            table.terminate()


def _record_over(port: str) -> WireRecording:
    bursts = excitation(_DURATION_S, _SPEED_DEG_S, _ACCELERATION_DEG_S2, seed=0)
    with TableClient.open(port, baud=_BAUD) as client:
        return record(client, bursts, _SPEED_DEG_S, _BAUD)


def _identified(config: Path, recording: WireRecording) -> dict[str, Found]:
    """Return what a fit that knows only the default table makes of a recording."""
    assumed, truth = load_config(), load_config(config)
    check_recording(assumed, recording)
    constants = {constant.name: constant for constant in identify(assumed, recording).constants}
    found = {}
    for name, _, function in DERIVED:
        estimate, true = constants[name], function(truth)
        found[name] = Found(estimate.value / true - 1.0, estimate.low <= true <= estimate.high, estimate.identifiable)
    return found
