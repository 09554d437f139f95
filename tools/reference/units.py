"""The unit at the end of a key's name."""

_UNITS = {
    "duty_s_deg": "s/deg",
    "Nm_s": "Nm s",
    "Nm_A": "Nm/A",
    "kg_m2": "kg m2",
    "deg_s2": "deg/s2",
    "deg_s": "deg/s",
    "rad_s": "rad/s",
    "mm_s": "mm/s",
    "1_s": "1/s",
    "counts_per_deg": "counts/deg",
    "k_a": "s4/deg2",
    "k_w": "s2/deg2",
    "in_base": "mm, deg",
    "on_table": "mm, deg",
    "on_flange": "mm, deg",
    "ticks": "ticks",
    "lines": "lines",
    "bytes": "bytes",
    "bits": "bits",
    "count": "counts",
    "arcmin": "arcmin",
    "ohm": "ohm",
    "baud": "Bd",
    "deg": "deg",
    "hz": "Hz",
    "Nm": "Nm",
    "mm": "mm",
    "H": "H",
    "V": "V",
    "s": "s",
}
"""Each suffix; the longer one of two comes first."""


def unit(key: str) -> str:
    """Return the unit of a key such as `motor.resistance_ohm`; nothing for a number without a unit."""
    name = key.rpartition(".")[2]
    return next((text for ending, text in _UNITS.items() if f"_{name}".endswith(f"_{ending}")), "")
