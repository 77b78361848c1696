"""Electric machine: limits, losses in four quadrants, power balance, heat; and the other parts at the bus."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from electric_rigs import FlywheelDrive, HeldMachine

import powertrain as pt
from powertrain.components.electric import AccessoryLoad, DCDCConverter, ElectricMachine, VoltageSource
from powertrain.components.electric.figures import plot_machine_map
from powertrain.components.rotational import ConstantSpeed
from powertrain.components.thermal import HeatCapacitor

MACHINE = ElectricMachine()  # 200 N.m, 50 kW, 1200 rad/s


def held(machine: ElectricMachine, w: float, demand: float) -> dict[str, float]:
    result = pt.simulate(HeldMachine(machine=machine, drive=ConstantSpeed(w_fixed=w)), 0.1, inputs={"demand": demand})
    return {name: float(result[f"machine.{name}"][-1]) for name in ("tau", "power", "lossPower", "bus.i")}


@pytest.mark.parametrize(
    ("w", "demand", "tau"),
    [
        (0, 150, 150),
        (100, 300, 200),
        (-100, 300, 200),
        (100, -300, -200),
        (500, 300, 100),  # 50 kW
        (-500, -300, -100),
        (1000, 300, 50),
        (1190, 300, 50e3 / 1190 / 2),  # half way down to 1200 rad/s
        (1250, 300, 0),
    ],
)
def test_limits(w: float, demand: float, tau: float) -> None:
    assert held(MACHINE, w, demand)["tau"] == pytest.approx(tau, rel=1e-12, abs=1e-12)
    assert MACHINE.full_load(w) >= abs(tau) * (1 - 1e-12)


@pytest.mark.parametrize("w", [-300.0, 0.0, 300.0])
@pytest.mark.parametrize("demand", [-80.0, 0.0, 80.0])
def test_balance_in_four_quadrants(w: float, demand: float) -> None:
    values = held(MACHINE, w, demand)
    loss = 50 + 0.1 * demand**2 + 1.0 * abs(w) + 1e-3 * w**2
    assert values["lossPower"] == pytest.approx(loss)
    assert values["power"] == pytest.approx(demand * w)
    assert 250 * values["bus.i"] == pytest.approx(demand * w + loss)
    assert MACHINE.losses(w, demand) == pytest.approx(loss)


def test_efficiency() -> None:
    drives, generates = MACHINE.efficiency(300, 80), MACHINE.efficiency(300, -80)
    loss = 50 + 640 + 300 + 90
    assert drives == pytest.approx(24e3 / (24e3 + loss))
    assert generates == pytest.approx((24e3 - loss) / 24e3)
    assert MACHINE.efficiency(300, -1) == 0  # 300 W do not cover the loss
    assert MACHINE.efficiency(-300, -80) == drives
    assert MACHINE.efficiency(0, 0) == 0


def loss_map(low: float) -> pt.Map:
    """Bilinear in speed and torque, so that tables give it back exactly: other numbers driving and generating."""
    w, tau = np.linspace(0, 1200, 5), np.linspace(low, 200, 9)
    values = 40 + w[:, None] * (1 + np.where(tau > 0, 0.02 * tau, -0.03 * tau))
    axes = pt.Axis("speed", "rad/s", w, "clip"), pt.Axis("torque", "N.m", tau, "clip")
    return pt.Map(axes, values, "W", "loss")


@pytest.mark.parametrize(
    ("low", "w", "demand", "loss"),
    [
        (0, 300, 100, 40 + 300 * 3),
        (0, 300, -100, 40 + 300 * 3),
        (0, -300, -100, 40 + 300 * 3),
        (-200, 300, 100, 40 + 300 * 3),
        (-200, 300, -100, 40 + 300 * 4),
        (-200, -300, -100, 40 + 300 * 3),
        (-200, -300, 100, 40 + 300 * 4),
        (-200, 0, 100, 40),
    ],
)
def test_loss_from_a_map(low: float, w: float, demand: float, loss: float) -> None:
    machine = pt.replace(MACHINE, loss_map=loss_map(low))
    values = held(machine, w, demand)
    assert values["lossPower"] == pytest.approx(loss)
    assert 250 * values["bus.i"] == pytest.approx(demand * w + loss)


@pytest.mark.parametrize(("w", "loss"), [(0.0, 4050.0), (1e-6, 4050.0), (0.5, 4050.0), (-0.5, 4050.0), (3.0, 4050.0)])
def test_a_signed_map_keeps_its_loss_of_torque_at_standstill(w: float, loss: float) -> None:
    """50 W and 0.1 W/(N.m)^2 whatever the sign of the torque: holding 200 N.m at rest costs what it costs at any speed."""
    tau = np.linspace(-200, 200, 41)
    axes = pt.Axis("speed", "rad/s", [0, 1200], "clip"), pt.Axis("torque", "N.m", tau, "error")
    machine = pt.replace(MACHINE, loss_map=pt.Map(axes, np.tile(50 + 0.1 * tau**2, (2, 1)), "W", "loss"))
    for demand in (200.0, -200.0):
        assert held(machine, w, demand)["lossPower"] == pytest.approx(loss)


def test_a_signed_map_at_standstill_is_the_mean_of_driving_and_generating() -> None:
    """At 20 N.m the map has 20 W driving and 60 W generating. Its torques end at -50 N.m; what is not asked for is not refused."""
    axes = pt.Axis("speed", "rad/s", [0, 1200], "clip"), pt.Axis("torque", "N.m", [-50, 0, 200], "error")
    table = pt.Map(axes, [[150, 0, 200]] * 2, "W", "loss")
    machine = pt.replace(MACHINE, loss_map=table)
    for w, loss in (0, (20 + 60) / 2), (0.5, 0.75 * 20 + 0.25 * 60), (1, 20), (-0.5, 0.75 * 60 + 0.25 * 20), (-1, 60):
        assert machine.losses(w, 20) == pytest.approx(loss)
    assert held(machine, 5.0, 180.0)["lossPower"] == pytest.approx(180)


@pytest.mark.parametrize(("low", "high"), [(-100, 300), (-300, 100), (-300, 0)])
def test_a_signed_map_that_ends_early_on_one_side(low: float, high: float) -> None:
    """50 W and 0.1 W/(N.m)^2 both ways: at rest 300 N.m cost 9050 W, although one side of the map ends below."""
    tau = np.linspace(low, high, 41)
    axes = pt.Axis("speed", "rad/s", [0, 1200], "clip"), pt.Axis("torque", "N.m", tau, "clip")
    machine = pt.replace(MACHINE, loss_map=pt.Map(axes, np.tile(50 + 0.1 * tau**2, (2, 1)), "W", "loss"))
    sign = 1 if high == 300 else -1
    assert machine.losses([0, 0.5, 1, 5], sign * 300) == pytest.approx(9050)
    assert machine.losses([0, -1e-12, 1e-12], -sign * 300) == pytest.approx(9050)


EFFICIENCIES = "speed [rpm], torque [Nm], efficiency [%]\n" + "".join(
    f"{n}, {tau}, {eta}\n"
    for n, row in ((1000, (78, 85, 82, 90)), (6000, (90, 93, 91, 96)))
    for tau, eta in zip((-100, -20, 20, 100), row, strict=True)
)


@pytest.mark.parametrize(
    ("n", "tau", "eta"), [(1000, 100, 0.9), (6000, 20, 0.91), (1000, -100, 0.78), (6000, -20, 0.93)]
)
def test_efficiencies_of_a_data_sheet_are_power_out_over_power_in(tmp_path: Path, n: int, tau: int, eta: float) -> None:
    (file := tmp_path / "efficiency.csv").write_text(EFFICIENCIES, encoding="utf-8")
    machine = ElectricMachine.from_efficiency(file, no_load="120 W", standstill="1 kW", P_max="80 kW")
    assert machine.P_max == 80e3
    w = n * np.pi / 30
    values = held(machine, w, tau)
    shaft, bus = tau * w, 250 * values["bus.i"]
    assert (shaft / bus if tau > 0 else bus / shaft) == pytest.approx(eta)
    assert held(machine, -w, -tau)["bus.i"] == pytest.approx(values["bus.i"]), "backward like forward"


def test_losses_that_no_efficiency_tells() -> None:
    """Without torque and at rest the losses are those given; between them and the table they are linear."""
    axes = pt.Axis("n", "rad/s", [0, 100, 400], "clip"), pt.Axis("M", "N.m", [0, 50], "clip")
    table = pt.Map(axes, np.array([[0, 0], [0, 0.8], [0, 0.9]]), "1", "efficiency")
    drag = pt.Map.curve([0, 400], [20, 100], x="w", x_unit="rad/s", unit="W")
    copper = pt.Map.curve([0, 50], [0, 600], x="tau", x_unit="N.m", unit="W")
    machine = ElectricMachine.from_efficiency(table, no_load=drag, standstill=copper)
    at_50 = {0: 600, 100: 5000 / 0.8 - 5000, 50: (600 + 1250) / 2, 400: 20e3 / 0.9 - 20e3}
    for w, loss in at_50.items():
        assert machine.losses(w, 50) == pytest.approx(loss)
    assert machine.losses([0, 100, 400], 0) == pytest.approx([20, 40, 100])
    assert machine.losses(100, 25) == pytest.approx((40 + 1250) / 2)
    for given, said in (
        (
            {"standstill": 50.0},
            r"does not determine the loss without torque, and the table has M = 0 N.m; .* no_load='150 W'",
        ),
        (
            {"no_load": 50.0},
            r"does not determine the loss at rest, and the table has n = 0 rad/s; .* standstill='150 W'",
        ),
        (
            {"no_load": copper, "standstill": 1.0},
            r"no_load gives map \[W\] over tau \[N.m\]; it must give a loss \[W\] over",
        ),
        ({"no_load": "-5 W", "standstill": 1.0}, r"no_load = -5 W is outside its range"),
    ):
        with pytest.raises(pt.ParameterError, match=said):
            ElectricMachine.from_efficiency(table, **given)


@pytest.mark.parametrize(
    ("w", "eta", "said"),
    [
        ([100, 400], [0.8, 1.05], r"an efficiency of 1.05 at 3820 rpm and 50 N.m; it must be above 0 and at most 1"),
        ([100, 400], [80, 90], r"of 80 at 954.9 rpm and 50 N.m; .* a column in percent is headed efficiency \[%\]"),
        (
            [100, 400],
            [0.008, 0.0095],
            r"the best efficiency is 0.95%; a column of fractions such as 0.95 is headed efficiency \[1\]",
        ),
        ([100, 400], [0.8, 0], r"of 0 at 3820 rpm .* beyond the limit of the machine, repeat"),
        ([-100, 400], [0.8, 0.9], r"a speed of -954.93 rpm; speeds must not be negative"),
    ],
)
def test_efficiencies_that_are_refused(w: list[float], eta: list[float], said: str) -> None:
    axes = pt.Axis("n", "rad/s", w), pt.Axis("M", "N.m", [50])
    with pytest.raises(pt.ParameterError, match=said):
        ElectricMachine.from_efficiency(pt.Map(axes, np.transpose([eta]), "1", "efficiency"))


def test_loss_maps_that_are_refused() -> None:
    good = loss_map(0)
    for wrong, said in (
        (
            pt.Map(good.axes, good.values, "N", "loss"),
            r"machine.loss_map gives loss \[N\] over speed \[rad/s\], torque",
        ),
        (pt.Map(good.axes[::-1], good.values.T, "W", "loss"), r"over torque \[N.m\], speed \[rad/s\]; it must"),
        (pt.Map(good.axes, good.values, "1", "eta"), "ElectricMachine.from_efficiency takes efficiencies"),
        (pt.Map(good.axes, good.values - 50, "W", "loss"), "falls to -10 W; a loss must not be negative"),
    ):
        with pytest.raises(pt.ParameterError, match=said):
            pt.compile(HeldMachine(machine=pt.replace(MACHINE, loss_map=wrong), drive=ConstantSpeed(w_fixed=1)))


def test_a_loss_map_does_not_follow_the_temperature() -> None:
    """An alpha beside it had no effect: at 120 degC the copper's loss of a winding is 1.39 times that of the map."""
    with pytest.raises(pt.ParameterError, match=r"self.alpha <= 0.*\n.*with alpha = 0.0039 1/K"):
        pt.replace(MACHINE, loss_map=loss_map(0), alpha=0.0039)


def test_a_torque_that_fades_at_rest_is_refused() -> None:
    """With w_max = 15 rad/s and the default band it was at most 3/4 of tau_max anywhere."""
    with pytest.raises(pt.ParameterError, match=r"w_max = 15 rad/s, band = 20 rad/s"):
        ElectricMachine(w_max=15)
    assert ElectricMachine(w_max=15, band=15).full_load([0, 7.5]) == pytest.approx([200, 100])


def test_round_trip_through_a_flywheel() -> None:
    """Speeds by hand, 60 N.m over 2.03 kg.m2, and the battery's account of the losses."""
    result = pt.simulate(FlywheelDrive(), 16, rtol=1e-9)
    assert result.at(np.array([4.0]), "machine.w")[0] == pytest.approx(240 / 2.03, rel=1e-7)
    assert result["machine.w"].max() == pytest.approx(480 / 2.03, rel=1e-7)
    assert result["machine.w"][-1] == pytest.approx(0, abs=1e-6)
    audit = pt.energy_audit(result)
    table = audit.components
    assert table.loc["battery", "stored"] == pytest.approx(-table.loc[["battery", "machine"], "lost"].sum(), rel=1e-7)
    times = np.linspace(0, 8, 4001)
    w = 60 * times / 2.03
    loss = 2 * np.trapezoid(50 + 0.1 * 3600 + w + 1e-3 * w**2, times)
    assert table.loc["machine", "lost"] == pytest.approx(loss, rel=1e-6)


@pytest.mark.parametrize(
    ("V", "w", "limit"), [(250, 500, 100), (120, 500, 80), (120, 950, 50e3 * 0.8 / 950 * 0.5), (120, 970, 0)]
)
def test_a_low_voltage_takes_power_and_top_speed(V: float, w: float, limit: float) -> None:
    """50 kW and 1,200 rad/s from 150 V on; at 120 V 40 kW and 960 rad/s."""
    machine = pt.replace(MACHINE, tau_max=200, P_max=50e3, w_max=1200, band=20, V_full=150)
    assert machine.full_load(w, V) == pytest.approx(limit)
    rig = HeldMachine(machine=machine, drive=ConstantSpeed(w_fixed=w), source=VoltageSource(V=V))
    result = pt.simulate(rig, 0.1, inputs={"demand": 1000.0})
    assert result["machine.tau"][-1] == pytest.approx(limit)


def test_without_voltage_there_is_no_torque() -> None:
    """Nor at rest, where the power's limit is 0/0."""
    machine = pt.replace(MACHINE, V_full=300)
    assert machine.full_load([0.0, 1e-15, 1.0, -500.0], 0.0).tolist() == [0.0] * 4
    assert machine.full_load(0.0, 300.0) == pytest.approx(200)
    assert machine.full_load(0.0, 1.0) == pytest.approx(200 * 1200 / 300 / 20)


def test_a_warm_winding_loses_more() -> None:
    """alpha = 0.0039: at 100 K above 20 degC 1.39 times the copper's loss, and no more of the rest."""
    machine = pt.replace(MACHINE, alpha=0.0039)
    cold, warm = machine.losses(300, 80), machine.losses(300, 80, 393.15)
    assert warm - cold == pytest.approx(0.39 * 0.1 * 80**2)
    assert cold == pytest.approx(MACHINE.losses(300, 80))


def test_its_heat_can_be_collected() -> None:
    class Warm(pt.Component):
        machine: ElectricMachine = MACHINE
        drive: ConstantSpeed = ConstantSpeed(w_fixed=300)
        source: VoltageSource = VoltageSource()
        winding: HeatCapacitor = HeatCapacitor(C=5e3)
        demand: pt.Input = pt.signal_input("N.m", "Torque")

        def equations(self) -> pt.Equations:
            yield pt.connect(self.source.bus, self.machine.bus)
            yield pt.connect(self.machine.shaft, self.drive.flange)
            yield pt.connect(self.demand, self.machine.torque_demand)
            yield pt.connect(self.machine.heat_port, self.winding.port)

    result = pt.simulate(Warm(), 10, inputs={"demand": 80.0})
    assert result["winding.T"][-1] == pytest.approx(293.15 + 1080 * 10 / 5e3)


class LowVoltage(pt.Component):
    """An accessory behind a converter, and a source at its side."""

    source: VoltageSource = VoltageSource(V=250)
    converter: DCDCConverter = DCDCConverter(eta=0.9)
    load: AccessoryLoad = AccessoryLoad(P=700)
    state: HeatCapacitor = HeatCapacitor(C=1e3)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.source.bus, self.converter.high)
        yield pt.connect(self.converter.low, self.load.bus)
        yield pt.connect(self.load.heat_port, self.state.port)


def test_accessory_behind_a_converter() -> None:
    result = pt.simulate(LowVoltage(), 10, parameters={"load.demand": 0.5})
    assert result["load.bus.v"][-1] == 14
    assert result["load.bus.i"][-1] == pytest.approx(350 / 14)
    assert result["converter.high.i"][-1] == pytest.approx(350 / 0.9 / 250)
    assert result["converter.lossPower"][-1] == pytest.approx(350 * (1 / 0.9 - 1))
    assert result["state.T"][-1] == pytest.approx(293.15 + 3.5)
    audit = pt.energy_audit(result)
    assert audit.closure < 1e-9
    assert not audit.hidden
    assert audit.components.loc["source", "sources"] == pytest.approx(3500 / 0.9)
    none = pt.simulate(LowVoltage(), 1, parameters={"load.demand": -1.0})
    assert np.all(none["load.lossPower"] == 0)


def test_converter_carries_power_back() -> None:
    class Back(pt.Component):
        source: VoltageSource = VoltageSource(V=250)
        converter: DCDCConverter = DCDCConverter(eta=0.9)
        machine: ElectricMachine = MACHINE
        drive: ConstantSpeed = ConstantSpeed(w_fixed=300)
        demand: pt.Input = pt.signal_input("N.m", "Torque")

        def equations(self) -> pt.Equations:
            yield pt.connect(self.source.bus, self.converter.high)
            yield pt.connect(self.converter.low, self.machine.bus)
            yield pt.connect(self.machine.shaft, self.drive.flange)
            yield pt.connect(self.demand, self.machine.torque_demand)

    result = pt.simulate(Back(), 0.1, inputs={"demand": -80.0})
    assert result["converter.P"][-1] == pytest.approx(-(24e3 - 1080))
    assert result["converter.high.i"][-1] == pytest.approx(-0.9 * (24e3 - 1080) / 250)
    assert result["converter.lossPower"][-1] == pytest.approx(0.1 * (24e3 - 1080))


def test_machine_map() -> None:
    ax = plot_machine_map(MACHINE)
    limit = np.asarray(ax.lines[0].get_xydata(), float)
    assert limit[:, 1].max() == pytest.approx(200)
    assert plot_machine_map(MACHINE, ax=ax) is ax
