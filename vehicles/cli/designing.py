"""``powertrain split-path``: which split-path transmission for a duty."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from powertrain.vehicles.cli.options import ArgumentType, Command, OutputFile, Span, of_the_command_line, progress
from powertrain.vehicles.cli.text import columns, number

if TYPE_CHECKING:
    import pandas as pd

    from powertrain.vehicles.split_path import SplitPathDesigns

NAMES = {
    "mean_efficiency": "mean efficiency",
    "min_efficiency": "least efficiency",
    "max_K": "largest |K|",
    "unit_range": "range of V",
}
SHOWN = ("mean_efficiency", "min_efficiency", "max_K", "V_min", "V_max")
Unit = tuple[float, float] | float


class UnitRange(ArgumentType):
    """``low:high`` of V, or a number: its span V_max/V_min."""

    name = "low:high|span"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Unit:
        """A number alone is a span."""
        text = str(value)
        if ":" in text or isinstance(value, tuple):
            low, high = Span().convert(value, param, ctx)
            return low, high
        return float(click.FloatRange(min=1, min_open=True).convert(value, param, ctx))


@click.command(
    "split-path",
    cls=Command,
    short_help="Design a split-path transmission: layouts, couplings, basic ratios ranked.",
    examples=(
        "split-path --ratio 0.5:2 --unit 0.4:2.5",
        "split-path --ratio 0.5:2 --unit 4 --basic -4:-0.25:31 --coupling input --by max_K --top 5",
        "split-path --ratio 0:2 --unit -1:1 --duty duty.csv --refine --teeth --out designs.csv",
    ),
)
@click.option(
    "--ratio",
    type=Span(),
    default=(0.5, 2.0),
    help="Wanted range of the ratio r = output speed over input speed. Default: 0.5:2.",
)
@click.option(
    "--unit",
    type=UnitRange(),
    help="Range of the variable unit's ratio V, or its span V_max/V_min where fixed gears may shift it. Default: any.",
)
@click.option(
    "--basic",
    type=Span(counted=True),
    default=(-4.0, -0.25, 16.0),
    help="Basic ratios R_o of the differential, and how many. Default: -4:-0.25:16.",
)
@click.option(
    "--duty",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="CSV with the columns r, weight (share of the delivered energy), and if wanted torque [N.m], speed [rad/s].",
)
@click.option(
    "--coupling",
    type=click.Choice(["input", "output", "both"]),
    default="both",
    show_default=True,
    help="The unit lies beside the input or the output.",
)
@click.option(
    "--combinations/--no-combinations", default=True, help="With the switched combinations of two types, or without."
)
@click.option(
    "--eta",
    type=click.FloatRange(0, 1, min_open=True),
    default=0.95,
    show_default=True,
    help="Efficiency of the differential with a fixed carrier.",
)
@click.option(
    "--eta-unit",
    type=click.FloatRange(0, 1, min_open=True),
    default=0.9,
    show_default=True,
    help="Efficiency of the variable unit.",
)
@click.option(
    "--by",
    type=click.Choice(["mean_efficiency", "min_efficiency", "max_K", "unit_range"]),
    default="mean_efficiency",
    show_default=True,
    help="What ranks the designs.",
)
@click.option("--top", type=click.IntRange(1), default=10, show_default=True, help="How many lines to print.")
@click.option("--refine", is_flag=True, help="Find the best R_o of the best design, by what --by ranks.")
@click.option("--teeth", is_flag=True, help="Sets of teeth near the R_o of the best design.")
@click.option("--out", type=OutputFile(".csv"), help="Write the whole table to this CSV file.")
def command(
    ratio: tuple[float, float],
    unit: Unit | None,
    basic: tuple[float, ...],
    duty: Path | None,
    coupling: str,
    combinations: bool,
    eta: float,
    eta_unit: float,
    by: Any,
    top: int,
    refine: bool,
    teeth: bool,
    out: Path | None,
) -> None:
    """Compare split-path transmissions for a range of ratios: six layouts, both couplings, basic ratios, switched combinations.

    A differential and a variable unit lie side by side. For every design the table tells the mean efficiency over the duty, the least
    efficiency, the largest share |K| of the input power in the unit, the range of V the unit must have, and how the power flows.
    After D. Yu, N. Beachley, Gear Technology, July/August 1986.
    """
    import numpy as np

    from powertrain.components.cvu import CVU
    from powertrain.components.differentials import FundamentalDifferential
    from powertrain.components.transmissions import SplitPathTransmission
    from powertrain.vehicles.split_path import split_path_designs

    given = SplitPathTransmission(
        differential=FundamentalDifferential(ratio=-1.7, eta_ab=eta, eta_ba=eta),
        cvu=CVU(eta_ab=eta_unit, eta_ba=eta_unit),
    )
    ratios = np.linspace(basic[0], basic[1], int(basic[2]) if len(basic) > 2 else 16)
    with of_the_command_line():
        found = split_path_designs(
            ratio,
            ratios[(ratios != 0) & (ratios != 1)],
            weights=_table(duty),
            unit=unit,
            transmission=given,
            couplings=("input", "output") if coupling == "both" else (coupling,),  # type: ignore[arg-type]
            combinations=combinations,
            by=by,
            progress=progress(),
        )
    click.echo(report(found, top))
    if out is not None:
        found.table.to_csv(out, index=False)
        click.echo(f"wrote {out}: {len(found.table)} designs")
    if found.feasible.empty:
        raise click.ClickException(
            "no design can do it; the table tells why. Widen --unit, --basic, or narrow --ratio."
        )
    R_o = float(found.table.R_o[0])
    if refine:
        best = found.refine(0)
        R_o = best.R_o
        click.echo(
            f"\nThe best of these layouts: R_o = {R_o:.4f}, {NAMES[best.by]} {best.value:.4f} (before: {best.before:.4f})"
            + ("; at the edge of --basic: a wider range may hold a better one" if best.edge else "")
        )
    if teeth:
        click.echo(_teeth(R_o))


def report(found: SplitPathDesigns, top: int) -> str:
    """The first lines of the table."""
    duty, table = found.duty, found.table.head(top)
    unit = "any V" if found.unit is None else f"a span of V of {found.unit}"
    if isinstance(found.unit, tuple):
        unit = f"V from {found.unit[0]:g} to {found.unit[1]:g}"
    rows = []
    for _, row in table.iterrows():
        numbers = [number(float(row[name]), 3) for name in SHOWN]
        rows.append([str(row.coupling), str(row.type), f"{row.R_o:.4g}", *numbers, str(row.problem or row.regimes)])
    head = (
        "coupling",
        "type",
        "R_o",
        "mean eff.",
        "least eff.",
        "max |K|",
        "V from",
        "to",
        "power flow, or problem",
    )
    about = f"r from {duty.low:g} to {duty.high:g}, a unit with {unit}: {len(found.feasible)} of {len(found.table)} designs can do it"
    edge = "\nThe first design lies at the edge of the compared R_o: a wider --basic may hold a better one."
    note = edge if len(found.feasible) and found.at_edge() else ""
    return f"{about}\n\n{columns(rows, head, right=[2, 3, 4, 5, 6, 7])}{note}"


def _table(path: Path | None) -> pd.DataFrame | None:
    if path is None:
        return None
    import pandas as pd

    try:
        return pd.read_csv(path, comment="#", skipinitialspace=True)
    except ValueError as error:
        raise click.UsageError(f"{path} is no table: {error}") from None


def _teeth(R_o: float) -> str:
    from powertrain.vehicles.split_path import sets_near

    sets = sets_near(R_o, tolerance=0.005).head(5)
    if sets.empty:
        return f"\nNo set of teeth comes within 0.5 % of R_o = {R_o:.4f}"
    rows = [[str(value) for value in row] for row in sets.round(5).itertuples(index=False)]
    return f"\nTeeth near R_o = {R_o:.4f}\n{columns(rows, tuple(map(str, sets.columns)))}"
