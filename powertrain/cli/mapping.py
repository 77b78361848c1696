"""``powertrain map``: the efficiency of a driveline over speed and force, or of a transmission over ratio and load."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from powertrain.cli import completion
from powertrain.cli.options import (
    DATA,
    PICTURE,
    ArgumentType,
    Command,
    CycleName,
    HeldValue,
    Span,
    progress,
    settings,
)
from powertrain.cli.text import columns, number
from powertrain.cli.vehicle import VehicleArgument, VehicleName, configured

if TYPE_CHECKING:
    import xarray as xr
    from click.shell_completion import CompletionItem
    from matplotlib.figure import Figure

    import powertrain as pt
    from powertrain.components.cycles import DriveCycle
    from powertrain.components.transmissions import SplitPathTransmission

TRANSMISSION = "SplitPathTransmission"
UNIT = "transmission.cvu"
SHAFTS = ("transmission.flange_a", "transmission.flange_b")


class Mapped(ArgumentType):
    """A vehicle, or a transmission by itself."""

    name = "vehicle|transmission"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> VehicleArgument:
        """The transmission by the name of its class, everything else as for other commands."""
        from powertrain.components.transmissions import SplitPathTransmission

        if str(value).lower() == TRANSMISSION.lower():
            return VehicleArgument(TRANSMISSION, SplitPathTransmission())
        return VehicleName().convert(value, param, ctx)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """The vehicles that begin so, and the transmission."""
        names = [*completion.vehicles(incomplete), *completion.beginning([TRANSMISSION], incomplete)]
        return completion.or_file(names, incomplete)


@click.command(
    "map",
    cls=Command,
    short_help="Efficiency of a driveline over speed and force, or of a transmission.",
    examples=(
        "map SplitPathCar --plot map.png",
        "map SplitPathCar --cycle wltc --plot map.png --out map.nc",
        "map SplitPathCar --of transmission --ratio 0.5:2:61 --load 5:150:30 --set transmission.cvu=HydrostaticUnit --plot map.png",
        "map SplitPathTransmission --set layout=abH --plot map.png",
        "map PowerSplitHybrid --held control.running=1 --plot map.png",
    ),
)
@click.argument("what", metavar="VEHICLE|TRANSMISSION", type=Mapped())
@click.option(
    "--of",
    type=click.Choice(["driveline", "transmission"]),
    help="For a vehicle: the complete driveline (default), or its split-path transmission.",
)
@click.option(
    "--speed",
    type=Span(counted=True),
    default=(2.0, 140.0, 47.0),
    help="Driveline: speeds [km/h] and their number. Default: 2:140:47.",
)
@click.option(
    "--pedals",
    type=click.IntRange(3),
    default=61,
    show_default=True,
    help="Driveline: number of accelerator positions.",
)
@click.option("--cycle", type=CycleName(), help="Driveline: plot the operating points of this cycle in the map.")
@click.option(
    "--ratio",
    type=Span(counted=True),
    default=(0.5, 2.0, 61.0),
    help="Transmission: ratios r = output speed over input speed, and their number. Default: 0.5:2:61.",
)
@click.option(
    "--load",
    type=Span(counted=True),
    default=(5.0, 150.0, 30.0),
    help="Transmission: output torques [N.m] and their number. Default: 5:150:30.",
)
@click.option(
    "--input-speed",
    type=click.FloatRange(0, min_open=True),
    default=200.0,
    show_default=True,
    help="Transmission: input speed [rad/s].",
)
@click.option(
    "--held",
    type=HeldValue(),
    multiple=True,
    metavar="PATH=NUMBER",
    help="Driveline: what a part of a hybrid remembers, such as control.running=1 for an engine that is on. May be repeated.",
)
@settings
@click.option("--out", type=DATA, help="Write the map to a netCDF file (.nc) or to a .csv file.")
@click.option("--plot", type=PICTURE, help="Plot the map with the cases of the power flow (.png, .pdf, .svg).")
def command(
    what: VehicleArgument,
    of: str | None,
    speed: tuple[float, ...],
    pedals: int,
    cycle: DriveCycle | None,
    ratio: tuple[float, ...],
    load: tuple[float, ...],
    input_speed: float,
    held: tuple[tuple[str, float], ...],
    texts: tuple[str, ...],
    params: Path | None,
    out: Path | None,
    plot: Path | None,
) -> None:
    """Compute the efficiency map of a vehicle from tank to road, or of a split-path transmission on a test bench.

    The driveline is mapped over speed and tractive force, at steady speed on a rolling road. The transmission is mapped over its ratio
    r and its load. K is the power into the variable unit divided by the input power, and the case says whether the power splits or
    recirculates (Yu & Beachley 1986, Fig. 8). Where friction is at rest (r = 1), efficiency and K may have any value between the
    neighbouring ones.
    """
    from powertrain.presets import catalogue

    model, _ = configured(what, params, texts)
    whole = catalogue.is_vehicle(type(model))
    if (of or "driveline" if whole else "transmission") == "driveline":
        from powertrain.cli.driveline import mapped

        speeds = values(speed, 47) / 3.6
        shown, data, figure = mapped(
            model, speeds, pedals, name=what.name, held=dict(held), cycle=cycle, draw=plot is not None
        )
    else:
        shown, data, figure = _transmission_map(model, ratio, load, input_speed, draw=plot is not None)
    click.echo(shown)
    if plot is not None and figure is not None:
        figure.savefig(plot, dpi=120)
        click.echo(f"wrote {plot}")
    if out is not None:
        _write(data, out)
        click.echo(f"wrote {out}")


def _transmission_map(
    model: pt.Component, ratio: tuple[float, ...], load: tuple[float, ...], speed: float, *, draw: bool
) -> tuple[str, xr.Dataset, Figure | None]:
    """The text, the data and the picture of a transmission's map."""
    import numpy as np

    import powertrain as pt
    from powertrain.design import SplitPathBench

    transmission = _transmission(model)
    grid = {"r": values(ratio, 61), "load": -values(load, 30)}
    if 0 in grid["r"]:
        raise click.UsageError("--ratio: no power is delivered at r = 0; leave it out")
    flow = pt.power_flow(
        pt.compile(SplitPathBench(transmission=transmission)),
        grid,
        outputs={"V": "V"},
        parameters={"drive.w_fixed": speed},
        variator=UNIT,
        shafts=SHAFTS,
        progress=progress(),
    )
    if not np.isfinite(flow.efficiency.values).any():
        raise click.ClickException("the transmission delivers no power at any point of this map")
    return report(flow, transmission, speed), _dataset(flow), picture(flow) if draw else None


def report(flow: pt.PowerFlow, transmission: SplitPathTransmission, speed: float) -> str:
    """V, efficiency, K and case over the ratio at the middle load."""
    middle = flow.isel(load=flow.data.sizes["load"] // 2)
    share = middle.variator(UNIT)
    values = (middle.data["r"], middle.data["V"], middle.efficiency, share["K"])
    step = max(middle.data.sizes["r"] // 15, 1)
    rows = [
        (*(number(float(v[k]), 4) for v in values), str(share["case"].values[k]) or "friction at rest")
        for k in range(0, middle.data.sizes["r"], step)
    ]
    torque = abs(float(middle.data["load"]))
    about = (
        f"{type(transmission).__name__}, layout {transmission.layout}, {transmission.coupling}-coupled, at {speed:g} rad/s "
        f"and {torque:g} N.m at the output; efficiency from {_extreme(flow, 'min')} to {_extreme(flow, 'max')} over all loads"
    )
    return f"{about}\n\n{columns(rows, ('r', 'V', 'efficiency', 'K', 'power flow'), right=[0, 1, 2, 3])}"


def picture(flow: pt.PowerFlow) -> Figure:
    """The map with its cases, and a line of it."""
    from matplotlib.figure import Figure

    from powertrain.power.powerplot import plot_efficiency_map, plot_variator

    figure = Figure(figsize=(13, 5.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    load = flow.data["load"].values
    turned = type(flow)(
        flow.graph, flow.data.assign_coords(load=("load", -load, {"units": "N.m", "long_name": "Torque at the output"}))
    )
    plot_efficiency_map(turned, "r", "load", variator=UNIT, ax=left)
    left.set_title("Efficiency", fontsize=10)
    plot_variator(flow.isel(load=load.size // 2), UNIT, "r", ax=right)
    right.set_title(f"At {abs(load[load.size // 2]):.3g} N.m at the output", fontsize=10)
    return figure


def values(span: tuple[float, ...], number_of: int) -> Any:
    """The points of a span."""
    import numpy as np

    return np.linspace(span[0], span[1], int(span[2]) if len(span) > 2 else number_of).round(9)


def _transmission(model: pt.Component) -> SplitPathTransmission:
    from powertrain.components.transmissions import SplitPathTransmission
    from powertrain.language.component import children

    found = model if isinstance(model, SplitPathTransmission) else dict(children(model)).get("transmission")
    if not isinstance(found, SplitPathTransmission):
        raise click.UsageError(f"{type(model).__name__} has no SplitPathTransmission in its slot 'transmission'")
    return found


def _extreme(flow: pt.PowerFlow, which: str) -> str:
    return number(float(getattr(flow.efficiency, which)()), 4)


def _dataset(flow: pt.PowerFlow) -> xr.Dataset:
    import xarray as xr

    share = flow.variator(UNIT).rename(efficiency="unit_efficiency", power="unit_power")
    data = xr.Dataset({"efficiency": flow.efficiency, "V": flow.data["V"], **share.data_vars})
    torque = ("load", -data["load"].values, {"units": "N.m", "long_name": "Torque at the output"})
    return data.assign_coords(load=torque)


def _write(data: xr.Dataset, path: Path) -> None:
    from powertrain.export import save, suffix

    if "case" in data:
        data["case"] = data["case"].astype(str)
    if suffix(path) == ".csv":
        data.to_dataframe().reset_index().to_csv(path, index=False)
    else:
        save(data, path)
