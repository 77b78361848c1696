"""``powertrain reproduce``: the tables and figures of a paper, printed and computed."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import click

from powertrain.cli import completion
from powertrain.cli.options import Command, of_the_command_line, progress
from powertrain.cli.text import columns, title

if TYPE_CHECKING:
    from powertrain.reproductions import Row, Table

HEAD = ("quantity", "unit", "source", "printed", "computed", "agreement")


@click.command(
    "reproduce",
    cls=Command,
    short_help="Tables and figures of a paper: printed and computed values.",
    examples=(
        "reproduce yu-beachley --out report",
        "reproduce provatidis --no-report",
        "reproduce madhavan --out report --no-pictures",
    ),
)
@click.argument("paper", shell_complete=completion.papers)
@click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), help="Folder for the report. Default: ./reproduction."
)
@click.option("--report/--no-report", default=True, help="Write a report, or only print the tables.")
@click.option("--pictures/--no-pictures", default=True, help="Draw the figures for the report.")
def command(paper: str, out: Path | None, report: bool, pictures: bool) -> None:
    """Recompute the tables and figures of a paper, print both values, and write a report with the figures (Markdown and PNG).

    `powertrain list papers` lists the papers. Values that agree to the printed digits are marked; for known misprints the report gives
    the reason. The exit code is 1 if any value differs.
    """
    from powertrain import reproductions as library

    with of_the_command_line():
        about = library.paper(paper)
    about = replace(about, tables=tuple(cache(table) for table in about.tables))
    if not pictures:
        about = replace(about, pictures=())
    page = library.write_report(about, out or Path("reproduction"), progress=progress()) if report else None
    tables = [compute() for compute in about.tables]
    click.echo(f"{about.title}\n{about.citation}")
    for table in tables:
        click.echo(title(table.title))
        click.echo(shown(table))
    click.echo(f"\n{library.Tally(tables)}.")
    if page is not None:
        click.echo(f"wrote {page} with {len(about.pictures)} pictures")
    if "DIFFERS" in library.Tally(tables).counts:
        raise click.ClickException("values differ from the printed ones by more than their digits allow")


def shown(table: Table) -> str:
    """A table as text."""
    return columns([_row(row) for row in table.rows], HEAD, right=[3, 4])


def _row(row: Row) -> tuple[str, ...]:
    verdict = row.verdict if row.right is None else f"{row.verdict}: should be {row.right}"
    verdict = f"differs {row.differs}" if verdict == "differs" else verdict
    return row.quantity, row.unit, row.source, row.printed, row.shown, verdict
