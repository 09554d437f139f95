"""`track.json`: how a path was tracked, beside the files of the run."""

import json
from pathlib import Path

import numpy as np

from planner.tracking.online_planner import Step
from planner.tracking.price import Price
from planner.tracking.track_record import TrackRecord
from planner.tracking.tracker import Tracker
from protocol.files.whole_file import write_whole

_FORMAT = "seventh-axis track"
_FORMAT_VERSION = 1
TRACK_FILE, TRACK_PICTURE = "track.json", "track.png"
TRACK_RESULTS = (TRACK_FILE, TRACK_PICTURE)


def save_track(folder: Path, source: str, tracker: Tracker, record: TrackRecord, price: Price) -> None:
    """Write `track.json`; angles in degrees, times in s."""
    settings = tracker.settings
    document = {
        "format": _FORMAT,
        "format_version": _FORMAT_VERSION,
        "source": source,
        "planner": settings.planner,
        "view": settings.view,
        "margin_deg": settings.margin_deg,
        "locations": {"revealed": tracker.count, "reached": record.location_count},
        "decisions": {
            "count": len(record.decision_s),
            "missed": tracker.missed,
            "by_reason": {why.value: count for why, count in record.whys.items()},
            "time_s": decision_times_s(record),
        },
        "pauses": len(record.pauses),
        "waits": [wait._asdict() for wait in record.waits],
        "reconfigurations": tracker.reconfigurations,
        "price": price._asdict() | {"ratio": price.ratio},
        "moments": [_moment(step) for step in record.moments],
    }
    write_whole(folder / TRACK_FILE, json.dumps(document, indent=1, allow_nan=False) + "\n")


def decision_times_s(record: TrackRecord) -> dict[str, float]:
    """Return how long a decision took: the median, 99.9 % and the worst."""
    times = np.array(record.decision_s)
    if not len(times):
        return {}
    return {
        "median": float(np.median(times)),
        "share_999": float(np.quantile(times, 0.999)),
        "worst": float(times.max()),
    }


def _moment(step: Step) -> dict[str, object]:
    return {
        "location": step.start.location,
        "angle_deg": step.start.angle_deg,
        "speed_deg_s": step.start.speed_deg_s,
        "last_known": step.last_known,
        "acceleration_deg_s2": step.acceleration_deg_s2,
        "why": step.why.value,
        "rest": {"location": step.rest.location, "angle_deg": step.rest.angle_deg},
    }
