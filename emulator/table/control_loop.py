"""Plant and controller of a table in time: ticks in which nothing comes from outside pass when somebody looks."""

from emulator.faults.schedule import FaultSchedule
from emulator.table.drive_faults import faulty_step, is_faulty
from emulator.table.fast_ticks import Run
from emulator.table.tick import TableConstants, TableState, run_undisturbed, step


class ControlLoop:
    """Plant and controller, level with the table when they are looked at.

    Args:
        constants: per tick.
        state: at the present tick.
        load_torque_Nm: resists positive rotation.
        run: passes undisturbed ticks; without it they are interpreted.
    """

    def __init__(
        self, constants: TableConstants, state: TableState, load_torque_Nm: float = 0.0, run: Run | None = None
    ) -> None:
        self.constants = constants
        self._run = run
        self._past_state = state
        self._load_torque_Nm = load_torque_Nm
        self._owed_ticks = 0  # by which the state is behind
        self._resting = False  # the state repeats itself, so ticks cost nothing

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
        """The torque that resists positive rotation."""
        return self._load_torque_Nm

    @load_torque_Nm.setter
    def load_torque_Nm(self, torque_Nm: float) -> None:
        self.catch_up()  # under the old torque; a new one may end a rest
        self._load_torque_Nm, self._resting = torque_Nm, False

    def pass_ticks(self, ticks: int) -> None:
        """Let ticks pass in which nothing comes from outside."""
        self._owed_ticks += ticks

    def catch_up(self) -> None:
        """Let the ticks pass that the state is behind."""
        if self._owed_ticks and not self._resting:
            run = self._run or run_undisturbed
            state, resting = run(self.constants, self._past_state, self._load_torque_Nm, self._owed_ticks)
            # In one statement without a call: Ctrl-C comes before it, and all is still owed, or after it.
            self._past_state, self._resting, self._owed_ticks = state, resting, 0
        self._owed_ticks = 0

    def step(self, faults: FaultSchedule, supply_V: float) -> None:
        """Take the state one tick on, in whatever state a fault has left the drive."""
        if is_faulty(faults):
            self.constants, self.state = faulty_step(faults, self.constants, self.state, self._load_torque_Nm, supply_V)
        else:
            self.state = step(self.constants, self.state, self._load_torque_Nm)
