"""How a path was tracked, as a section of the page of its run."""

import base64
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from planner.errors import PlannerError
from planner.tracking.track_file import TRACK_FILE, TRACK_PICTURE
from protocol.files.data_file import DataFileError, read_json
from protocol.program.page import counted, heading, paragraph, table


class TrackFileError(PlannerError):
    """A damaged `track.json`."""


def track_blocks(folder: Path) -> tuple[str, ...]:
    """Return the section of a folder; nothing where its run was not tracked.

    Raises:
        PlannerError: `track.json` or its picture is damaged.
    """
    file = folder / TRACK_FILE
    if not file.exists():
        return ()
    try:
        rows = list(_rows(read_json(file)))
        picture = base64.b64encode((folder / TRACK_PICTURE).read_bytes()).decode("ascii")
    except (DataFileError, OSError, KeyError, TypeError, ValueError, AttributeError) as error:
        raise TrackFileError(f"{file}: is damaged: {type(error).__name__}, {error}; track the scan again") from error
    alt = "The columns in view at four decisions, with the motion to rest that was kept, and the time of each decision."
    return (
        heading("Decisions"),
        table(("", ""), rows, words=True),
        paragraph(
            "Dark columns were not known at the decision. Orange: the step that was decided, and the motion to rest"
            " that was kept after it."
        ),
        f'<figure><div class="wide"><img alt="{alt}" style="max-width:100%"'
        f' src="data:image/png;base64,{picture}"></div></figure>',
    )


def _rows(document: dict[str, Any]) -> Iterator[tuple[str, str]]:
    decisions, price = document["decisions"], document["price"]
    times_ms = {name: 1000.0 * seconds for name, seconds in decisions["time_s"].items()}
    yield "locations from", str(document["source"])
    yield "planner", f"{document['planner']}, {counted(document['view'], 'column')} in view"
    yield "locations", f"{document['locations']['reached']} reached, {document['locations']['revealed']} revealed"
    yield "decisions", f"{decisions['count']}, of which {decisions['missed']} were not ready in time"
    yield (
        "time of a decision",
        f"median {times_ms['median']:.2f} ms, 99.9 % {times_ms['share_999']:.2f} ms, worst {times_ms['worst']:.2f} ms",
    )
    waited_s = sum(wait["duration_s"] for wait in document["waits"])
    yield "stops", f"{counted(document['pauses'], 'pause')}, {waited_s:.1f} s of waiting"
    yield "changes of configuration", f"{document['reconfigurations']}"
    known = "no plan without a pause" if price["known"] is None else f"{price['known']:.4f}"
    yield "cost", f"{price['tracked']:.4f}; with full knowledge {known}"
    if price["ratio"] is not None:
        yield "price of not knowing", f"{price['ratio']:.4f} times that cost"
