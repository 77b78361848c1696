"""Types of arguments and the options that several commands share."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, TypeVar

import click

from powertrain import ModelError, ParameterError, SimulationError
from powertrain.cli import completion

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

    import powertrain as pt
    from powertrain.components.cycles import DriveCycle

    ArgumentType = click.ParamType[Any]
else:
    ArgumentType = click.ParamType  # has parameters in newer versions only

F = TypeVar("F", bound=Callable[..., Any])


class Command(click.Command):
    """A command with examples at the end of its help."""

    def __init__(self, *args: Any, examples: Sequence[str] = (), **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.examples = examples

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The examples, a line each."""
        write_examples(self.examples, formatter)


def write_examples(examples: Sequence[str], formatter: click.HelpFormatter) -> None:
    """A section of commands as they are typed."""
    with formatter.section("Examples"):
        for example in examples:
            formatter.write(f"{' ' * formatter.current_indent}powertrain {example}\n")


@contextmanager
def of_the_command_line() -> Iterator[None]:
    """Errors of the library about what was typed are errors in the command line: exit code 2."""
    try:
        yield
    except (ParameterError, ModelError) as error:
        raise click.UsageError(str(error)) from None


class CycleName(ArgumentType):
    """A legislated cycle's name, or a CSV file."""

    name = "cycle"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> DriveCycle:
        """A name first."""
        from powertrain.components.cycles import CYCLES, DriveCycle
        from powertrain.errors import suggestion

        text = str(value)
        if text.lower() not in CYCLES and not Path(text).is_file():
            near = suggestion(text.lower(), CYCLES)
            self.fail(
                f"{text!r} is neither a drive cycle ({', '.join(CYCLES)}) nor an existing CSV file{near}", param, ctx
            )
        with of_the_command_line():
            return DriveCycle.named(text.lower()) if text.lower() in CYCLES else DriveCycle.from_csv(text)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """The cycles that begin so, or files."""
        from powertrain.components.cycles import CYCLES

        return completion.or_file(completion.beginning(CYCLES, incomplete), incomplete)


class Span(ArgumentType):
    """``low:high``, and ``low:high:number`` where ``counted``."""

    def __init__(self, counted: bool = False) -> None:
        self.counted = counted
        self.name = "low:high:number" if counted else "low:high"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, ...]:
        """Two increasing numbers, and how many."""
        if isinstance(value, tuple):
            return value
        numbers: list[float] = []
        with suppress(ValueError):
            numbers = [float(text) for text in str(value).split(":")]
        if len(numbers) not in ((2, 3) if self.counted else (2,)):
            self.fail(f"{value!r} is not {self.name}, such as {'-4:-0.25:16' if self.counted else '0.5:2'}", param, ctx)
        if not numbers[0] < numbers[1]:
            self.fail(f"{value!r}: the first number must be less than the second", param, ctx)
        if len(numbers) == 3 and (numbers[2] < 2 or numbers[2] % 1):
            self.fail(f"{value!r}: the number of points must be a whole number, at least 2", param, ctx)
        return tuple(numbers)


class OutputFile(click.Path):
    """A file to be written, of one of some formats; looked at before anything is computed."""

    name = "file"

    def __init__(self, *suffixes: str) -> None:
        super().__init__(dir_okay=False, writable=True, path_type=Path)
        self.suffixes = suffixes

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Its ending is known, it can be written."""
        path = Path(str(super().convert(value, param, ctx)))
        if path.suffix.lower() not in self.suffixes:
            self.fail(f"{str(path)!r} must end in {' or '.join(self.suffixes)}", param, ctx)
        if not path.parent.is_dir():
            self.fail(f"there is no folder {str(path.parent)!r}", param, ctx)
        try:
            there = path.exists()
            with path.open("ab"):
                pass
        except OSError as error:
            self.fail(f"{str(path)!r} cannot be written: {error.strerror}", param, ctx)
        if not there:
            path.unlink()
        return path


PICTURE = OutputFile(".png", ".pdf", ".svg")
DATA = OutputFile(".nc", ".csv")
PAGE = OutputFile(".html")


class HeldValue(ArgumentType):
    """A discrete variable or a state, and its value."""

    name = "held"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, float]:
        """The path and the number."""
        path, _, number = str(value).partition("=")
        try:
            return path.strip(), float(number)
        except ValueError:
            self.fail(f"{value} is not PATH=NUMBER, such as control.running=1", param, ctx)


def settings(function: F) -> F:
    """The options --set and --params."""
    texts = click.option(
        "--set",
        "texts",
        multiple=True,
        metavar="PATH=VALUE",
        help="Set a parameter, a field, or the component in a slot, by its path; see the examples. May be repeated.",
    )
    params = click.option(
        "--params",
        type=click.Path(exists=True, dir_okay=False, path_type=Path),
        help="TOML file with parameters and components; --set overrides it.",
    )
    return params(texts(function))


def driving(function: F) -> F:
    """The options --cycle, --span and --start."""
    cycle = click.option(
        "--cycle",
        type=CycleName(),
        help="wltc, udds, hwfet, nedc, ..., or a CSV file (header time_s,speed_km_h). Default: that of the vehicle.",
    )
    span = click.option("--span", type=Span(), help="Only this part of the cycle, in seconds, such as 0:200.")
    return cycle(span(starting(function)))


def starting(function: F) -> F:
    """The option --start."""
    return click.option(
        "--start",
        "begin",
        multiple=True,
        metavar="PATH=VALUE",
        help="Value of a variable at the start, such as the charge of the battery: battery.soc=0.95. May be repeated.",
    )(function)


def starts_of(begin: Sequence[str], plant: pt.Plant[Any]) -> dict[str, float]:
    """The values of the option --start for a plant; what it does not have is an error in the command line."""
    from powertrain.presets.settings import assignments, number_or_text
    from powertrain.trials.starting import checked_starts

    with of_the_command_line():
        pairs = assignments(begin, "--start", "battery.soc=0.95")
        return checked_starts(plant, {path: number_or_text(text) for path, text in pairs}, "--start")


def progress() -> bool:
    """Whether to show bars of progress: on terminals only."""
    return sys.stderr.isatty()


INTERRUPTED = 130
"""The exit code after Ctrl-C."""


class Interrupted(click.ClickException):
    """A command that kept what it had reached at Ctrl-C."""

    exit_code = INTERRUPTED


class Interruption:
    """Ctrl-C as an end of the simulation, so that what was reached is kept; a second one ends the command at once.

    ``with Interruption(cycle, say) as watch: plant.simulate(..., progress=watch)``; draws a bar on terminals, with the text of ``say``.
    """

    def __init__(self, cycle: DriveCycle, say: Callable[[pt.Present[Any]], str]) -> None:
        self.asked, self._bar, self._stop = False, None, float(cycle.times[-1])
        if progress():
            from powertrain.present import Bar

            self._bar = Bar(float(cycle.times[0]), self._stop, say)

    def __call__(self, now: pt.Present[Any]) -> None:
        """Shows the progress of the simulation, or ends it."""
        if self._bar is not None:
            self._bar(now)
        if self.asked and now.time < self._stop:
            raise SimulationError("interrupted")

    def __enter__(self) -> Interruption:
        self._before = signal.signal(signal.SIGINT, self._ask)
        return self

    def _ask(self, number: int, frame: FrameType | None) -> None:
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        signal.signal(signal.SIGINT, self._before)
        if self._bar is not None:
            self._bar.close()
        if self.asked and isinstance(error, SimulationError):  # before there was anything to keep
            raise Interrupted(str(error)) from None
