import io

from protocol.program.progress import progress_line


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_terminal_sees_one_line_that_is_gone_in_the_end() -> None:
    terminal = Terminal()
    show = progress_line("map", terminal)
    assert show is not None
    show(1, 4)
    show(4, 4)
    shown = terminal.getvalue().split("\r\x1b[K")
    assert shown == ["", "map  25%", ""]


def test_a_pipe_sees_nothing() -> None:
    assert progress_line("map", io.StringIO()) is None
