"""The report: one HTML page."""

import re
from collections.abc import Callable, Sequence
from html import escape
from importlib.resources import files
from itertools import groupby
from math import inf
from pathlib import Path

from protocol.conformance.bench.wire import Event
from protocol.conformance.cases.case import Case
from protocol.conformance.cases.catalog import all_cases
from protocol.conformance.judgement.reference import MotionRecord
from protocol.conformance.judgement.verdict import Measurement, Verdict
from protocol.conformance.results.record import Header, count_verdicts, versions, write_whole
from protocol.conformance.results.svg_plot import Panel, plot, range_bar
from protocol.conformance.session.suite import Outcome
from protocol.program.page import Origin, counted, page, paragraph, verdict

_CHAPTERS = {
    "2": "The serial line",
    "3": "Lines",
    "4": "Commands",
    "5": "Replies",
    "6": "Registers",
    "7": "Motion",
    "8": "Recovery",
}
_LINE_STEP_S = 0.01
_SPEED_WINDOW_S = 0.06
_MOST_POINTS = 900

_BAD = {Verdict.FAIL, Verdict.ERROR}
_EMPHASIS = re.compile(r"\*([^*]+)\*")

Repeat = Callable[[Case], str]
"""Returns the command that repeats one case."""


def write_report(path: Path, header: Header, outcomes: Sequence[Outcome], repeat: Repeat, command: str = "") -> None:
    """Write the report.

    The file appears under its name when it is complete. `command` is the command line that made it.
    """
    counts = count_verdicts(outcomes)
    sums = "".join(f'<div class="sum"><b>{count}</b>{ended}</div>' for ended, count in counts.items())
    strip = "".join(
        f'<a class="{outcome.verdict}" href="#{outcome.case.id}" title="{outcome.case.id} {outcome.verdict}"></a>'
        for outcome in outcomes
    )
    facts = "".join(f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>" for name, text in _facts(header, outcomes))
    blocks = (
        verdict(_headline(outcomes), not any(outcome.verdict in _BAD for outcome in outcomes)),
        paragraph(
            "Each case tests the table against one clause of docs/protocol.md, quoted beside its verdict."
            " Open a case to see how it was done, what was measured, and what was sent and received."
        ),
        f'<div class="sums">{sums}</div>',
        f'<div class="strip">{strip}</div>',
        _failed(outcomes),
        f"<dl>{facts}</dl>",
        *_chapters(outcomes, repeat),
    )
    style = files("protocol.conformance.results").joinpath("report.css").read_text(encoding="utf-8")
    title = f"Conformance of {header.profile.table.name} at {header.device}"
    write_whole(path, page(title, blocks, Origin(command, header.begun), style))


def _headline(outcomes: Sequence[Outcome]) -> str:
    """Return the number of failed cases, and the measurement nearest to its limit or farthest beyond it."""
    failed = sum(outcome.verdict in _BAD for outcome in outcomes)
    text = f"{failed} of {counted(len(outcomes), 'case')} failed."
    bounded = [(one.margin, outcome, one) for outcome in outcomes for one in outcome.measurements if one.margin < inf]
    if not bounded:
        return text
    margin, outcome, one = min(bounded, key=lambda each: each[0])
    place = "Nearest to its limit" if margin >= 0.0 else "Farthest beyond its limit"
    return f"{text} {place}, in {outcome.case.id}: {one}."


def _facts(header: Header, outcomes: Sequence[Outcome]) -> list[tuple[str, str]]:
    motion, serial = header.profile.motion, header.profile.serial
    decimals = counted(serial.decimals, "decimal")
    in_motion_s = sum(outcome.seconds for outcome in outcomes if outcome.case.travel_deg)
    all_s = sum(outcome.seconds for outcome in outcomes)
    return [
        ("begun", header.begun or "in simulated time"),
        ("cases", f"{len(outcomes)} of the suite's {len(all_cases())}"),
        ("took", f"{all_s:.0f} s on the table's clock, {in_motion_s:.0f} s of it in cases that move the table"),
        (
            "may be moved",
            f"{motion.reach_deg:g} deg each way, {motion.speed_deg_s:g} deg/s, {motion.acceleration_deg_s2:g} deg/s2",
        ),
        ("line", f"{serial.baud or 'any'} baud, {decimals}, latency {1000 * serial.latency_s:g} ms"),
        ("can be used", ", ".join(header.capabilities)),
        ("seed", str(header.seed)),
        ("versions", ", ".join(f"{name} {text}" for name, text in versions().items())),
    ]


def _failed(outcomes: Sequence[Outcome]) -> str:
    """Return the failed cases, each with its reason and a link to it."""
    rows = "".join(
        f'<li><a href="#{outcome.case.id}"><code>{outcome.case.id}</code></a><span>{escape(outcome.reason)}</span></li>'
        for outcome in outcomes
        if outcome.verdict in _BAD
    )
    return f'<ul class="failed">{rows}</ul>' if rows else ""


def _chapters(outcomes: Sequence[Outcome], repeat: Repeat) -> list[str]:
    parts = []
    for chapter, members in groupby(outcomes, lambda outcome: outcome.case.clause.number[0]):
        parts.append(f"<h2>{chapter} {_CHAPTERS[chapter]}</h2>")
        parts += [_case(outcome, repeat) for outcome in members]
    return parts


def _case(outcome: Outcome, repeat: Repeat) -> str:
    case, ended = outcome.case, outcome.verdict
    bad = ended in _BAD
    parts = [
        f'<details id="{case.id}"{" open" if bad else ""}><summary><span class="chip {ended}">{ended}</span>'
        f'<code>{case.id}</code><span class="soft">{case.clause.level}</span><span>{_marked(case.clause.text)}</span>'
        f'</summary><div class="body"><p class="soft">{_marked(case.how)}</p>'
    ]
    if outcome.reason:
        parts.append(f'<p class="reason{"" if bad else " quiet"}">{escape(outcome.reason)}</p>')
    parts += [f'<p class="reason quiet">Run again, since {escape(run)}</p>' for run in outcome.spoiled]
    if outcome.measurements:
        parts.append(_measurements(outcome.measurements))
    if outcome.motion is not None:
        parts.append(_motion_plot(outcome.motion))
    if bad:
        parts.append(f'<p class="soft">To repeat:</p><pre class="repeat">{escape(repeat(case))}</pre>')
    if outcome.wire:
        parts.append(_wire(outcome.wire))
    return "".join(parts) + "</div></details>"


def _measurements(measurements: Sequence[Measurement]) -> str:
    rows = "".join(
        f'<tr><td>{escape(one.name)}</td><td class="number">{one.value:.5g}</td><td>{one.unit}</td>'
        f"<td>{range_bar(one.value, one.least, one.most, one.verdict)}</td>"
        f'<td class="soft">{"" if one.least is None else f"{one.least:.6g}"} &hellip; '
        f"{'' if one.most is None else f'{one.most:.6g}'}</td></tr>"
        for one in measurements
    )
    head = "<tr><th>measured</th><th></th><th></th><th>within</th><th>range</th></tr>"
    return f'<div class="wide"><table>{head}{rows}</table></div>'


def _motion_plot(motion: MotionRecord) -> str:
    """Return expected and measured position and speed, over the time since the first command."""
    samples, expectations = motion.samples, motion.expectations
    begin_s = min(samples[0].time_s, expectations[min(1, len(expectations) - 1)].began_s)
    end_s = samples[-1].time_s
    step_s = max(_LINE_STEP_S, (end_s - begin_s) / _MOST_POINTS)
    expected = []
    for index in range(int((end_s - begin_s) / step_s) + 1):
        time_s = begin_s + index * step_s
        running = [one for one in expectations if one.began_s <= time_s] or expectations[:1]
        expected.append((index * step_s, *running[-1].at(time_s)))
    stride = max(1, len(samples) // _MOST_POINTS)
    positions = [(sample.time_s - begin_s, sample.position_deg) for sample in samples[::stride]]
    speeds = []
    for index, sample in enumerate(samples):
        earlier = next((one for one in samples[index::-1] if sample.time_s - one.time_s >= _SPEED_WINDOW_S), None)
        if earlier is not None and sample.time_s - earlier.time_s < 4 * _SPEED_WINDOW_S and not index % stride:
            speed = (sample.position_deg - earlier.position_deg) / (sample.time_s - earlier.time_s)
            speeds.append(((sample.time_s + earlier.time_s) / 2 - begin_s, speed))
    panels = (
        Panel("position (deg)", [(time_s, position) for time_s, position, _ in expected], positions),
        Panel("speed (deg/s)", [(time_s, speed) for time_s, _, speed in expected], speeds),
    )
    return plot(
        panels, "time (s); line: expected, dots: measured", "Position and speed over time, expected and measured."
    )


def _wire(events: Sequence[Event]) -> str:
    """Return the traffic. A command and its reply share a row if nothing came between them."""
    begin_s, rows, index = events[0].time_s, [], 0
    while index < len(events):
        event = events[index]
        row = f"{event.time_s - begin_s:9.3f}  "
        if event.direction == "sent":
            row += f"&rarr; {_shown(event.data):24}"
            if index + 1 < len(events) and events[index + 1].direction == "received":
                index += 1
                row += f" {events[index].time_s - begin_s:9.3f}  &larr; {_shown(events[index].data)}"
        elif event.direction == "received":
            row += f"{'':36} &larr; {_shown(event.data)}"
        else:
            row += f"[{_shown(event.data)}]"
        rows.append(row)
        index += 1
    lines = "\n".join(rows)
    summary = f"<summary>the wire, {counted(len(events), 'event')}</summary>"
    return f'<details class="inner">{summary}<pre class="wire">{lines}</pre></details>'


def _shown(data: bytes) -> str:
    return escape(data.decode("latin-1").encode("unicode_escape").decode().replace("\\r", "\u21b5"), quote=False)


def _marked(text: str) -> str:
    """Return a sentence of the specification with its `code` and its *figures* as markup."""
    pieces = escape(text, quote=False).split("`")
    return "".join(
        f"<code>{piece}</code>" if index % 2 else _EMPHASIS.sub(r"<em>\1</em>", piece)
        for index, piece in enumerate(pieces)
    )
