"""The battery-electric car: recovery, blending, range, gears."""

from __future__ import annotations

import numpy as np
import pytest
from cases import few
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

import powertrain as pt
from powertrain.cli.running import report
from powertrain.components.cycles import DriveCycle
from powertrain.trials import CycleRun, charge_corrected, drive_cycle, electric_share, full_accelerator
from powertrain.trials.anatomy import anatomy
from powertrain.trials.figures import plot_energy
from powertrain.trials.sankey import plot_energy_flow
from powertrain.vehicles.electric_car import ElectricCar
from powertrain.vehicles.parallel_hybrid import ParallelHybrid

STOP = DriveCycle("stop", ((0.0, 0.0), (12.0, 20.0), (20.0, 20.0), (32.0, 0.0), (36.0, 0.0)))


@pytest.fixture(scope="module")
def run() -> CycleRun:
    return drive_cycle(ElectricCar(), STOP)


def test_figures_that_a_run_does_not_have(run: CycleRun) -> None:
    with pytest.raises(pt.ParameterError, match="electric_share needs a vehicle with an engine; ElectricCar has none"):
        electric_share(run)
    with pytest.raises(pt.ParameterError, match="ElectricCar has no component 'batery'; did you mean battery"):
        charge_corrected(run, "batery")


def test_the_range_is_that_of_the_battery_that_was_driven(run: CycleRun) -> None:
    """Twice the capacity at the same voltage: nearly the same consumption, so nearly twice the range."""
    twice = drive_cycle(run.plant, parameters={"battery.Q": 2 * run.plant.parameters["battery.Q"]})
    assert twice.wh_per_km == pytest.approx(run.wh_per_km, rel=1e-3)
    assert twice.range() == pytest.approx(2 * run.range(), rel=1e-3)


def test_consumption_in_all_its_units(run: CycleRun) -> None:
    km, joule = run.distance / 1e3, run.electricity
    assert run.fuel == run.co2_per_km == run.litres_per_100km == 0
    assert np.isnan(run.efficiency)
    assert np.isnan(charge_corrected(run))
    assert run.wh_per_km == pytest.approx(joule / 3600 / km)
    assert run.mpg() == pytest.approx(km / 1.609344 / (joule / 3.6e6 / 33.705))
    assert run.mpg(0.88) == pytest.approx(0.88 * run.mpg())
    full = ElectricCar().battery.full_energy()
    kilometres, unit = (run.table.loc["range with the whole charge", column] for column in ("value", "unit"))
    assert kilometres == pytest.approx(run.range() / 1e3)
    assert unit == "km"
    assert run.range(0.9) == pytest.approx(0.9 * full / joule * run.distance)
    assert run.mpg("88 %") == run.mpg(0.88)
    for share, function in (90, run.range), (88, run.mpg), (0, run.mpg):
        with pytest.raises(pt.ParameterError, match=rf"= {share} is outside its range \(0, 1\].*88 % is 0.88"):
            function(share)
    for function, name in (run.mpg, "charging"), (run.range, "usable"):
        with pytest.raises(pt.ParameterError, match=rf"{name} = 'x' is not a number"):
            function("x")
    # the stored energy's change is the integral of open-circuit voltage times current
    soc, i = run.result["battery.soc"], run.result["battery.i"]
    chemical = -np.trapezoid(np.asarray(ElectricCar().battery.ocv(soc)) * i, run.result.time)
    assert joule == pytest.approx(chemical, rel=2e-3)
    assert run.audit.closure < 1e-6
    assert run.time_outside == 0


@pytest.mark.parametrize(
    ("soc", "said"),
    [
        (1.5, "starts: battery.soc = 1.5 is outside its range, 0 .empty. to 1 .full.$"),
        (95, "starts: battery.soc = 95 is outside its range, 0 .empty. to 1 .full.; write 0.95 for 95 %$"),
        (-0.1, "starts: battery.soc = -0.1 is outside its range, 0 .empty. to 1 .full.$"),
        ("full", "starts: battery.soc = 'full' is not a finite number"),
    ],
)
def test_a_charge_that_cannot_be(run: CycleRun, soc: object, said: str) -> None:
    """It ended in a message about the open-circuit voltage."""
    with pytest.raises(pt.ParameterError, match=f"^{said}"):
        drive_cycle(run.plant, starts={"battery.soc": soc})


def test_a_run_from_another_charge(run: CycleRun) -> None:
    """The least charge that gives power is named where the car does not move."""
    charged = drive_cycle(run.plant, starts={"battery.soc": 0.9})
    assert charged.result["battery.soc"][0] == 0.9
    assert charged.wh_per_km == pytest.approx(run.wh_per_km, rel=0.02)
    empty = drive_cycle(run.plant, starts={"battery.soc": 0.03})
    assert (
        "battery delivers nothing: its state of charge of 0.03 at the start is not above battery.soc_min = 0.03"
        in empty.message
    )


def test_energy_flows_from_the_battery(run: CycleRun) -> None:
    """All that is supplied is what the battery has given; losses and bars are shares of it, and nothing is stored."""
    assert run.supplied == pytest.approx(run.electricity, rel=1e-3)
    flow, bars = plot_energy_flow(run, ax=Figure().add_subplot()), plot_energy(run, ax=Figure().add_subplot())
    shares = [float(text.get_text().split("\n")[2].rstrip("%")) for text in flow.texts[1:]]
    assert sum(shares) == pytest.approx(100, abs=1)
    widths = [bar.get_width() * 1e6 for bar in bars.patches if isinstance(bar, Rectangle)]
    assert min(widths) > 0
    assert sum(widths) == pytest.approx(run.supplied, rel=5e-3)


@pytest.mark.slow
def test_recovers_and_brakes_alike_with_a_full_battery(run: CycleRun) -> None:
    full = drive_cycle(pt.replace(ElectricCar(), {"control.F_most": 0.0}), STOP)
    assert full.audit.components["lost"]["front.brakes"] > 20 * run.audit.components["lost"]["front.brakes"]
    kinetic = (1700 + 4 / 0.3**2) * 20**2 / 2
    assert 0.75 * kinetic < full.electricity - run.electricity < kinetic
    t = np.linspace(0, 36, 361)
    ours, theirs = (np.interp(t, one.result.time, one.speed) for one in (run, full))
    np.testing.assert_allclose(ours, theirs, atol=0.12)


@pytest.mark.slow
def test_a_battery_that_takes_nothing_leaves_all_to_the_brakes() -> None:
    car = pt.replace(ElectricCar(), {"battery.soc_max": 0.55, "battery.soc_min": 0.1})
    run = drive_cycle(car, STOP)
    assert run.result["machine.tau"].min() > -1
    assert run.time_outside == 0


@pytest.mark.slow
def test_two_speeds() -> None:
    """Energy closes to some multiple of the tolerance: 2e-5, 2e-6 and 2e-7 at 1e-5, 1e-6 and 1e-7."""
    run = drive_cycle(ElectricCar.two_speed(), STOP, rtol=1e-7)
    assert run.time_outside == 0
    assert set(np.unique(run.result["schedule.gear"])) == {1.0, 2.0}
    assert run.audit.closure < 1e-6


@pytest.mark.parametrize(
    ("car", "ratio", "w_limit"),
    few(
        [
            (pt.replace(ElectricCar.two_speed(), {"gearbox.ratios": (6.0, 1.9)}), 6.0 * 3.6, 1680.0),
            (pt.replace(ParallelHybrid(), {"front.final_drive.ratio": 8.0}), 3.8 * 8.0, 680.0),
        ]
    ),
    ids=["electric", "hybrid"],
)
def test_shifts_up_before_the_limit_in_first_gear(car: pt.Component, ratio: float, w_limit: float) -> None:
    """Shift speeds made for longer gears: with the pedal pressed they lie beyond the speed that first gear reaches at the limit."""
    schedule = car.schedule  # type: ignore[attr-defined]
    assert schedule.speeds[0][0] * (1 + float(schedule.eager)) > w_limit * 0.3 / ratio
    result = full_accelerator(car)
    assert result["schedule.gear"][-1] > 1
    assert result["body.v"].max() > 1.5 * w_limit * 0.3 / ratio


def test_what_drives_backward_is_refused() -> None:
    with pytest.raises(pt.SimulationError, match=r"ElectricCar moves backward: .* it covers -.* Check the signs"):
        full_accelerator(pt.replace(ElectricCar(), {"front.final_drive.ratio": -3.6}))


def test_anatomy() -> None:
    parts = anatomy(ElectricCar())
    assert (parts.engines, parts.machines, parts.stores) == ((), ("machine",), ("battery",))
    assert [parts.the(what) for what in ("body", "pedals", "road", "cycle")] == ["body", "driver", "road", "cycle"]
    with pytest.raises(pt.ParameterError, match="ElectricCar has 0 combustion engines"):
        parts.the_engine()


def test_shares_of_the_losses_are_those_of_what_was_supplied(run: CycleRun) -> None:
    """A battery supplies as a tank does: the last row of the printed audit is 100 %."""
    whole = next(line for line in "\n".join(report(run)).splitlines() if line.startswith("  all"))
    assert whole.endswith("100.0%")
