"""The plots of a run, read back from the drawing."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from planner.execution.run_file import RunConditions, StoredRun
from planner.execution.run_plots import deviation_figure, map_figure, motion_figure
from planner.execution.run_record import Observation, Record
from planner.execution.run_verification import verify_run
from planner.execution.table_motion import PauseTimes
from planner.table.wire import Wire
from tests.planner.drawn import Drawn
from tests.planner.run_examples import short_run_input

LEAD_S, LAG_S, OFF_DEG = 0.05, 0.02, 0.07


def stored_run() -> StoredRun:
    """Return a run in which the encoder has a constant deviation besides its lag; the reference is early."""
    run_input = short_run_input()
    motion = run_input.motion()
    seen = []
    for column, time_s in enumerate(motion.column_times_s.tolist()):
        reference_deg = motion.state_at(time_s + LEAD_S).angle_deg
        encoder_deg = motion.state_at(time_s + LEAD_S - LAG_S).angle_deg + OFF_DEG
        seen.append(Observation(time_s, "inside", encoder_deg, column, reference_deg, encoder_deg + 0.01))
        seen.append(Observation(time_s, "H", encoder_deg))
    conditions = RunConditions("", Wire(), LEAD_S, 1.0, 0, PauseTimes())
    return StoredRun(run_input, conditions, motion, Record(observations=seen))


def line(figure: Figure, axes: int, label: str) -> "tuple[np.ndarray[tuple[int], np.dtype[np.float64]], ...]":
    found = next(each for each in figure.axes[axes].lines if each.get_label() == label)
    return np.asarray(found.get_xdata(), dtype=np.float64), np.asarray(found.get_ydata(), dtype=np.float64)


def widths(figure: Figure, axes: int) -> dict[str, float]:
    return {str(each.get_label()): each.get_linewidth() for each in figure.axes[axes].lines}


def test_the_map_shows_the_forbidden_cells_where_they_are_and_the_paths_on_their_angles() -> None:
    run = stored_run()
    configuration_map = run.run_input.problem.map
    figure = map_figure(run, verify_run(run.run_input, run.motion, run.record, LEAD_S))
    drawn, axes = Drawn(figure), figure.axes[0]
    for location in range(configuration_map.location_count):
        for angle_deg in (60.0, 190.0, 205.0, 235.0, 250.0, 320.0, 345.0):
            is_gray = np.ptp(drawn.color(axes, location, angle_deg)) < 0.02
            on_path = abs((run.run_input.plan.angles_deg[location] - angle_deg + 180.0) % 360.0 - 180.0) < 12.0
            assert on_path or is_gray == configuration_map.is_allowed(location, angle_deg)
    columns, angles_deg = line(figure, 0, "planned")
    assert widths(figure, 0)["planned"] > 3.0 * widths(figure, 0)["executed (encoder)"]
    assert columns.tolist() == list(range(configuration_map.location_count))
    assert (angles_deg - run.run_input.plan.angles_deg) % 360.0 == pytest.approx(0.0, abs=1e-9)


def test_the_deviation_is_seen_less_planned_and_the_reference_is_judged_as_commanded() -> None:
    run = stored_run()
    figure = deviation_figure(run, verify_run(run.run_input, run.motion, run.record, LEAD_S))
    times_s, reference = line(figure, 0, "reference, as commanded")
    assert reference == pytest.approx(0.0, abs=1e-9)
    _, encoder = line(figure, 0, "encoder")
    expected = [
        run.motion.state_at(time_s + LEAD_S - LAG_S).angle_deg + OFF_DEG - run.motion.state_at(time_s).angle_deg
        for time_s in times_s.tolist()
    ]
    assert encoder == pytest.approx(expected)


def test_angle_and_speed_are_drawn_over_the_time_at_which_they_were() -> None:
    run = stored_run()
    figure = motion_figure(run)
    times_s, angles_deg = line(figure, 0, "planned")
    assert angles_deg == pytest.approx(np.interp(times_s, times_s, run.motion.angles_at(times_s)))
    read_s, read_deg = line(figure, 0, "read (H)")
    polled = [(each.time_s, each.encoder_deg) for each in run.record.observations if each.source == "H"]
    assert list(zip(read_s.tolist(), read_deg.tolist(), strict=True)) == polled
    _, speeds = line(figure, 1, "planned")
    assert speeds[1:-1] == pytest.approx(np.gradient(angles_deg, times_s)[1:-1], abs=3.0)
