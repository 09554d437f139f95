"""Plant and controller over time. Ticks without external events are computed only when the state is read."""

from emulator.faults.schedule import FaultSchedule
from emulator.table.drive_faults import faulty_step, is_faulty
from emulator.table.fast_ticks import Run
from emulator.table.tick import TableConstants, TableState, run_undisturbed, step


class ControlLoop:
    """Plant and controller. They are brought up to date when they are read.

    Args:
        constants: per tick.
        state: at the present tick.
        load_torque_Nm: opposes positive rotation.
        run: computes undisturbed ticks; without it they are interpreted.
    """

    def __init__(
        self, constants: TableConstants, state: TableState, load_torque_Nm: float = 0.0, run: Run | None = None
    ) -> None:
        self.constants = constants
        self._run = run
        self._past_state = state
        self._load_torque_Nm = load_torque_Nm
        self._owed_ticks = 0  # number of ticks that the state is behind
        self._resting = False  # the state repeats itself, so ticks need no computation

    @property
    def state(self) -> TableState:
        """The state at the present tick."""
        self.catch_up()
        return self._past_state

    @state.setter
    def state(self, state: TableState) -> None:
        self._owed_ticks, self._past_state, self._resting = 0, state, False

    @property
    def load_torque_Nm(self) -> float:
        """The torque that opposes positive rotation."""
        return self._load_torque_Nm

    @load_torque_Nm.setter
    def load_torque_Nm(self, torque_Nm: float) -> None:
        self.catch_up()  # ticks under the old torque; a new torque may end a rest
        self._load_torque_Nm, self._resting = torque_Nm, False

    def pass_ticks(self, ticks: int) -> None:
        """Advance by ticks without external events."""
        self._owed_ticks += ticks

    def catch_up(self) -> None:
        """Compute the ticks that the state is behind."""
        if self._owed_ticks and not self._resting:
            run = self._run or run_undisturbed
            state, resting = run(self.constants, self._past_state, self._load_torque_Nm, self._owed_ticks)
            # One statement without a call: Ctrl-C occurs before it, and all ticks are still due, or after it.
            self._past_state, self._resting, self._owed_ticks = state, resting, 0
        self._owed_ticks = 0

    def step(self, faults: FaultSchedule, supply_V: float) -> None:
        """Advance the state by one tick, also with a faulty drive."""
        if is_faulty(faults):
            self.constants, self.state = faulty_step(faults, self.constants, self.state, self._load_torque_Nm, supply_V)
        else:
            self.state = step(self.constants, self.state, self._load_torque_Nm)
