"""``powertrain split-path``: which split-path transmission for a duty."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from powertrain.cli.options import (
    PICTURE,
    ArgumentType,
    Command,
    OutputFile,
    Span,
    of_the_command_line,
    progress,
)
from powertrain.cli.text import columns, number

if TYPE_CHECKING:
    from powertrain.components.transmissions import UnitLoss
    from powertrain.design import Duty, SplitPathDesigns

NAMES = {
    "mean_efficiency": "mean efficiency",
    "min_efficiency": "least efficiency",
    "max_K": "largest |K|",
    "unit_range": "range of V",
}
SHOWN = ("mean_efficiency", "min_efficiency", "max_K", "V_min", "V_max")
DRAWN = 201
"""Points of a curve."""
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


class Shared(ArgumentType):
    """A file and its share: ``file.csv`` or ``file.csv:share``."""

    name = "file[:share]"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[Path, float]:
        """A file that is there."""
        if isinstance(value, tuple):
            return value
        text, colon, share = str(value).rpartition(":")
        path, size = (Path(text), share) if colon and not Path(str(value)).is_file() else (Path(str(value)), "1")
        if not path.is_file():
            self.fail(f"there is no file {str(path)!r}", param, ctx)
        try:
            return path, float(size)
        except ValueError:
            self.fail(f"the share {size!r} of the delivered energy is not a number", param, ctx)


@click.command(
    "split-path",
    cls=Command,
    short_help="Design a split-path transmission: rank layouts, couplings and basic ratios.",
    examples=(
        "split-path --ratio 0.5:2 --unit 0.4:2.5",
        "split-path --ratio 0.5:2 --unit 4 --basic -4:-0.25:31 --coupling input --by max_K --top 5",
        "split-path --ratio 0:2 --unit -1:1 --duty duty.csv --refine --teeth --out designs.csv",
        "split-path --ratio 0.1:1.5 --space --unit -1:1 --unit-map hydrostatic.csv --duty field.csv:3 --duty road.csv:1 --plot best.png",
    ),
)
@click.option(
    "--ratio",
    type=Span(),
    default=(0.5, 2.0),
    help="Required range of the ratio r = output speed over input speed. Default: 0.5:2.",
)
@click.option(
    "--unit",
    type=UnitRange(),
    help="Range of the ratio V of the variable unit, or its span V_max/V_min if fixed gears may shift it. Default: any.",
)
@click.option(
    "--basic",
    type=Span(counted=True),
    default=(-4.0, -0.25, 16.0),
    help="Basic ratios R_o of the differential, and their number. Default: -4:-0.25:16.",
)
@click.option(
    "--duty",
    "duties",
    multiple=True,
    type=Shared(),
    help="CSV with the columns r, weight (share of the delivered energy), and optionally torque [N.m], speed [rad/s]. Several with shares: "
    "a.csv:3 b.csv:1.",
)
@click.option(
    "--coupling",
    type=click.Choice(["input", "output", "both"]),
    default="both",
    show_default=True,
    help="The unit is coupled to the input or to the output.",
)
@click.option(
    "--combinations/--no-combinations", default=True, help="Include the switched combinations of two types, or not."
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
    "--unit-map",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="CSV with the efficiency of the unit over ratio [1], w_a [rad/s], tau [N.m] or some of these, instead of --eta-unit.",
)
@click.option(
    "--space",
    is_flag=True,
    help="Also search auxiliary gears and two ranges: efficiency against the size of the unit.",
)
@click.option("--plot", type=PICTURE, help="Plot the best design: shafts, efficiency, power, unit (.png, .pdf, .svg).")
@click.option(
    "--by",
    type=click.Choice(["mean_efficiency", "min_efficiency", "max_K", "unit_range"]),
    default="mean_efficiency",
    show_default=True,
    help="Criterion for the ranking.",
)
@click.option("--top", type=click.IntRange(1), default=10, show_default=True, help="Number of designs to print.")
@click.option("--refine", is_flag=True, help="Optimise R_o of the best design by the criterion --by.")
@click.option("--teeth", is_flag=True, help="Print tooth numbers near the R_o of the best design.")
@click.option("--out", type=OutputFile(".csv"), help="Write the complete table to this CSV file.")
def command(
    ratio: tuple[float, float],
    unit: Unit | None,
    basic: tuple[float, ...],
    duties: tuple[tuple[Path, float], ...],
    coupling: str,
    combinations: bool,
    eta: float,
    eta_unit: float,
    unit_map: Path | None,
    space: bool,
    plot: Path | None,
    by: Any,
    top: int,
    refine: bool,
    teeth: bool,
    out: Path | None,
) -> None:
    """Compare split-path transmissions for a range of ratios: six layouts, both couplings, basic ratios, switched combinations.

    A differential and a variable unit are connected in parallel. For every design the table gives the mean efficiency over the duty,
    the lowest efficiency, the largest share |K| of the input power in the unit, the required range of V, and the direction of the power
    flow. After D. Yu, N. Beachley, Gear Technology, July/August 1986.
    """
    import numpy as np

    from powertrain.components.differentials import FundamentalDifferential
    from powertrain.components.transmissions import SplitPathTransmission
    from powertrain.design import split_path_designs
    from powertrain.design.parts import cvu_of

    work, loss = _duty(ratio, duties), _loss(eta_unit, unit_map)
    if space:
        _space(work, loss, unit, eta, top, out, plot)
        return
    given = SplitPathTransmission(
        differential=FundamentalDifferential(ratio=-1.7, eta_ab=eta, eta_ba=eta), cvu=cvu_of(loss)
    )
    ratios = np.linspace(basic[0], basic[1], int(basic[2]) if len(basic) > 2 else 16)
    with of_the_command_line():
        found = split_path_designs(
            work,
            ratios[(ratios != 0) & (ratios != 1)],
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
            "no design meets the requirements; the table gives the reasons. Widen --unit or --basic, or narrow --ratio."
        )
    if plot is not None:
        _draw(found, loss, eta, plot)
    R_o = _refined(found) if refine else float(found.table.R_o[0])
    if teeth:
        click.echo(_teeth(R_o))


def _refined(found: SplitPathDesigns) -> float:
    """The basic ratio of the best layout after its optimisation, which is told."""
    best = found.refine(0)
    click.echo(
        f"\nThe best of these layouts: R_o = {best.R_o:.4f}, {NAMES[best.by]} {best.value:.4f} (before: {best.before:.4f})"
        + ("; at the edge of --basic: a wider range may hold a better one" if best.edge else "")
    )
    return best.R_o


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
    about = f"r from {duty.low:g} to {duty.high:g}, a unit with {unit}: {len(found.feasible)} of {len(found.table)} designs are feasible"
    edge = "\nThe first design lies at the edge of the compared R_o: a wider --basic may hold a better one."
    note = edge if len(found.feasible) and found.at_edge() else ""
    return f"{about}\n\n{columns(rows, head, right=[2, 3, 4, 5, 6, 7])}{note}"


def _duty(ratio: tuple[float, float], files: tuple[tuple[Path, float], ...]) -> Duty:
    """The range of r alone, or the files' duties with their shares."""
    import pandas as pd

    from powertrain.design import Duty

    given = []
    for path, share in files:
        try:
            table = pd.read_csv(path, comment="#", skipinitialspace=True)
        except ValueError as error:
            raise click.UsageError(f"{path} is not a table: {error}") from None
        with of_the_command_line():
            given.append((Duty.over(ratio, table), share))
    with of_the_command_line():
        return Duty.over(ratio) if not given else given[0][0] if len(given) == 1 else Duty.together(given)


def _loss(eta: float, path: Path | None) -> UnitLoss:
    """The unit's efficiency, the same in both directions."""
    from powertrain import Map
    from powertrain.components.transmissions import UnitLoss

    if path is None:
        return UnitLoss(eta, eta)
    with of_the_command_line():
        table = Map.from_csv(path, outside="clip")
        return UnitLoss(table, table)


def _space(
    duty: Duty, loss: UnitLoss, unit: Unit | None, eta: float, top: int, out: Path | None, plot: Path | None
) -> None:
    """The Pareto front of structures with auxiliary gears and ranges."""
    from powertrain.design import Efficiencies, Variator, split_path_space
    from powertrain.design.figures import design_figure

    if unit is not None and not isinstance(unit, tuple):
        raise click.UsageError("--space: gears beside the unit bring V into its range; give --unit as low:high")
    with of_the_command_line():
        variator = Variator("unit", loss) if unit is None else Variator("unit", loss, unit)
        found = split_path_space(duty, [variator], efficiencies=Efficiencies(planetary=eta), progress=progress())
    if found.table.empty:
        raise click.ClickException("no design meets the requirements. Widen --unit, or narrow --ratio.")
    names = ("mean_efficiency", "min_efficiency", "unit_size", "max_K")
    rows = []
    for _, row in found.pareto.head(top).iterrows():
        told = [", ".join(f"{x:.3g}" for x in row[n]) for n in ("shifts", "points", "R_o")]
        rows.append([str(row.structure), *(number(float(row[n]), 3) for n in names), *told])
    head = ("unit's sides", "mean eff.", "least eff.", "unit size", "max |K|", "shift at r", "mechanical points", "R_o")
    click.echo(
        f"r from {duty.low:g} to {duty.high:g}: {len(found.pareto)} designs that no other surpasses in both efficiency and unit size "
        f"(torque times speed over power)\n\n{columns(rows, head, right=[1, 2, 3, 4])}"
    )
    if out is not None:
        found.table.drop(columns="_number").to_csv(out, index=False)
        click.echo(f"wrote {out}: {len(found.table)} designs")
    if plot is not None:
        design_figure(found, int(found.pareto.index[0]), plot)
        click.echo(f"wrote {plot}")


def _draw(found: SplitPathDesigns, loss: UnitLoss, eta: float, path: Path) -> None:
    """The first design of the table."""
    from powertrain.components.transmissions import TYPES, Network
    from powertrain.design.figures import ranges_figure
    from powertrain.design.rating import over_range

    best, duty, types = found.table.iloc[0], found.duty, found.types()
    ends = [duty.low, *([1.0] if len(types) > 1 else []), duty.high]
    networks = [Network.split_path(TYPES[kind], best.coupling, float(best.R_o), eta) for kind in types]
    parts = [
        (*over_range(network, low, high, duty, loss, DRAWN), network)
        for network, (low, high) in zip(networks, pairwise(ends), strict=True)
    ]
    ranges_figure(parts, f"Type {best.type}, {best.coupling}-coupled, R_o = {best.R_o:.4g}", path)
    click.echo(f"wrote {path}")


def _teeth(R_o: float) -> str:
    from powertrain.design import sets_near

    sets = sets_near(R_o, tolerance=0.005).head(5)
    if sets.empty:
        return f"\nNo set of teeth comes within 0.5 % of R_o = {R_o:.4f}"
    rows = [[str(value) for value in row] for row in sets.round(5).itertuples(index=False)]
    return f"\nTeeth near R_o = {R_o:.4f}\n{columns(rows, tuple(map(str, sets.columns)))}"
