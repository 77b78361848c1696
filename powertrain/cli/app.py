"""The group of commands: each is imported when it is needed, and what the library refuses becomes a message."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import click

from powertrain import PowertrainError, __version__
from powertrain.cli.options import INTERRUPTED, write_examples
from powertrain.errors import suggestion

COMMANDS = {
    "list": "listing",
    "info": "describing",
    "run": "running",
    "view": "viewing",
    "compare": "comparing",
    "convert": "converting",
    "performance": "measuring",
    "map": "mapping",
    "split-path": "designing",
    "reproduce": "reproducing",
}
"""The commands and their modules."""

EXAMPLES = (
    "list vehicles",
    "run SplitPathCar --cycle wltc --plot run.png",
    "run SplitPathCar --set body.m=1500 --out run.nc",
    "view PowerSplitHybrid --cycle udds",
    "compare ManualCar AutomaticCar --cycle udds",
    "performance ManualCar",
    "info CircularCamDifferential",
    "map SplitPathCar --plot map.png",
    "split-path --ratio 0.5:2 --unit 0.4:2.5",
)


class Commands(click.Group):
    """Commands by name, from their modules."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """In the order in which a newcomer meets them."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The module's ``command``."""
        if cmd_name not in COMMANDS:
            return None
        command = import_module(f"powertrain.cli.{COMMANDS[cmd_name]}").command
        assert isinstance(command, click.Command)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """As click does it, with the right name for a wrong one."""
        if args and not args[0].startswith("-") and args[0] not in COMMANDS:
            ctx.fail(f"unknown command {args[0]!r}{suggestion(args[0], COMMANDS)} (commands: {', '.join(COMMANDS)})")
        return super().resolve_command(ctx, args)

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The first commands to try."""
        write_examples(EXAMPLES, formatter)

    def invoke(self, ctx: click.Context) -> Any:
        """Errors of the library, and files that cannot be read or written, end with code 1 and the message.

        That the reader of the output has gone, such as ``head``, is no error.
        """
        try:
            return super().invoke(ctx)
        except BrokenPipeError:
            raise
        except OSError as error:
            raise click.ClickException(
                f"{error.filename}: {error.strerror}" if error.filename else str(error)
            ) from None
        except PowertrainError as error:
            raise click.ClickException(str(error)) from None
        except KeyboardInterrupt:
            click.echo("interrupted", err=True)
            raise click.exceptions.Exit(INTERRUPTED) from None


@click.group(
    cls=Commands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    subcommand_metavar="COMMAND [OPTIONS] ...",
)
@click.version_option(__version__, prog_name="powertrain")
def main() -> None:
    """Vehicle powertrains: simulate vehicles over drive cycles, map their efficiency, describe components, design transmissions.

    See also `powertrain COMMAND --help`. Exit codes: 0 success, 1 the model or the simulation failed, 2 error in the command line,
    130 interrupted.
    """
