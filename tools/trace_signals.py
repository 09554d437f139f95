"""Names of the trace columns that can be drawn; this module does not load matplotlib."""

from protocol.files.data_file import did_you_mean

SIGNALS = (
    "reference_speed_deg_s",
    "true_speed_deg_s",
    "speed_deg_s",
    "reference_deg",
    "true_deg",
    "encoder_deg",
    "duty",
    "current_A",
)
DEFAULT_SIGNALS = tuple(name for name in SIGNALS if name != "true_deg")


def check_signals(signals: tuple[str, ...]) -> None:
    """Refuse names of signals that there are not.

    Raises:
        ValueError: One is not in `SIGNALS`, or there is none.
    """
    for name in signals:
        if name not in SIGNALS:
            raise ValueError(f"{name!r} is not a signal; allowed are {', '.join(SIGNALS)}{did_you_mean(name, SIGNALS)}")
    if not signals:
        raise ValueError(f"no signal to draw; allowed are {', '.join(SIGNALS)}")
