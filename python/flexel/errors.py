"""Errors of Flexel: the programs' own messages, and the exit codes that they end with."""


class FlexelError(Exception):
    """What a run ended with. `str()` is the line that the program prints; `where` is "file:line", "file" or ""."""

    exit_code = 1

    def __init__(self, what: str, where: str = ""):
        super().__init__(f"{where}: {what}" if where else what)
        self.where = where


class InputError(FlexelError, ValueError):
    """The input, the arguments or the environment; the message says what is wrong and what to do."""

    exit_code = 2


class DivergedError(FlexelError, ArithmeticError):
    """The simulation diverged; the message names the step, the element and a suggestion."""

    exit_code = 3


class InvalidMappingError(FlexelError):
    """`strict` found an invalid mapping."""

    exit_code = 4


class StoppedByTimeout(FlexelError, TimeoutError):
    """The time that `timeout` allows ran out."""

    exit_code = 5


class FlexelWarning(UserWarning):
    """What a program would warn of."""
