"""Numbers with units, in and out."""

from __future__ import annotations

import math

import pytest

import powertrain as pt
from powertrain.components.body import CoastDownBody, VehicleBody
from powertrain.components.engines import WillansEngine
from powertrain.components.rotational import Inertia
from powertrain.language.quantities import converted, quantity


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("1500 kg", "kg", 1500.0),
        ("100 kW", "W", 1e5),
        ("2000 rpm", "rad/s", 2000 * math.pi / 30),
        ("36 km/h", "m/s", 10.0),
        ("60 mph", "m/s", 26.8224),
        ("150 hp", "W", 111854.98),
        ("1.8 l", "m3", 1.8e-3),
        ("250 Nm", "N.m", 250.0),
        ("250 N*m", "N.m", 250.0),
        ("0.2 kg*m^2", "kg.m2", 0.2),
        ("20 °C", "K", 293.15),
        ("240 g/kWh", "kg/J", 240e-3 / 3.6e6),
        ("5 %", "1", 0.05),
        ("-3e1 deg", "rad", -math.pi / 6),
        ("1500kg", "kg", 1500.0),
        ("1.5e3kg", "kg", 1500.0),
        ("250Nm", "N.m", 250.0),
        ("20°C", "K", 293.15),
        ("2 1/s", "1/s", 2.0),
        ("800 ms", "s", 0.8),
        ("0.2 lbf/mph", "N.s/m", 0.2 * 4.4482216152605 / 0.44704),
        ("0.018 lbf/mph**2", "N.s2/m2", 0.018 * 4.4482216152605 / 0.44704**2),
        ("0.018 lbf/mph^2", "N.s2/m2", 0.018 * 4.4482216152605 / 0.44704**2),
        ("0.5 N/(km/h)", "N.s/m", 1.8),
        ("0.5 N.h/km", "N.s/m", 1.8),
        ("0.1 N/(km/h)2", "N.s2/m2", 1.296),
        ("0.1 N/(km/h)^2", "N.s2/m2", 1.296),
        ("0.1 N/(km/h)²", "N.s2/m2", 1.296),
        ("0.2 lbf/(mi/h)", "N.s/m", 0.2 * 4.4482216152605 / 0.44704),
        ("0.018 lbf/(mph)2", "N.s2/m2", 0.018 * 4.4482216152605 / 0.44704**2),
        ("3 N/(m/s)", "N.s/m", 3.0),
        ("800 1/min", "rad/s", 800 * math.pi / 30),
        ("10500 min-1", "rad/s", 10500 * math.pi / 30),
        ("10500 min^-1", "rad/s", 10500 * math.pi / 30),
        ("10500 min⁻¹", "rad/s", 10500 * math.pi / 30),
        ("5 m·s⁻²", "m/s2", 5.0),
        ("250 N-m", "N.m", 250.0),
        ("150 lb·ft", "N.m", 150 * 4.4482216152605 * 0.3048),
        ("13.3 Hz", "rad/s", 13.3 * 2 * math.pi),
        ("13.3 1/s", "Hz", 13.3),
        ("0.1 N.m.min", "N.m.s/rad", 0.1 * 30 / math.pi),
        ("0.1 N.m.s", "N.m.s/rad", 0.1),
        ("60 1/min", "1/s", 1.0),
        ("2 Hz", "1/s", 2.0),
        ("60 rpm", "1/s", 1.0),
        ("3 1/min", "1/min", 3.0),
        ("23 ft2", "m2", 23 * 0.3048**2),
        ("3300 lbs", "kg", 3300 * 0.45359237),
        ("150 bhp", "W", 150 * 745.6998715822702),
        ("1395 cc", "m3", 1.395e-3),
        ("1395 ccm", "m3", 1.395e-3),
        ("200 lb-ft", "N.m", 200 * 1.3558179483314004),
        ("200 ft.lb", "N.m", 200 * 1.3558179483314004),
        ("200 lb ft", "N.m", 200 * 1.3558179483314004),
        ("200 ft-lbf", "N.m", 200 * 1.3558179483314004),
        ("250 N m", "N.m", 250.0),
        ("0.2 kg m2", "kg.m2", 0.2),
        ("0.2 kg m²/s", "kg.m2/s", 0.2),
        ("80 mΩ", "Ohm", 0.08),
        ("2 hp/t", "W/kg", 2 * 0.7456998715822702),
        ("-40 degF", "K", 233.15),
        ("212°F", "K", 373.15),
        ("20 C", "K", 293.15),
        ("20 Celsius", "K", 293.15),
        ("212 F", "K", 373.15),
        ("20 C", "A.s", 20.0),
        ("5 kJ/°C", "J/K", 5000.0),
        ("36 km / h", "m/s", 10.0),
        ("36 kmh", "m/s", 10.0),
        ("250 N * m", "N.m", 250.0),
        ("3000/min", "rad/s", 100 * math.pi),
    ],
)
def test_text_to_number(text: str, unit: str, value: float) -> None:
    assert quantity(text, unit, "x") == pytest.approx(value, rel=1e-7)


def test_parameters_take_units() -> None:
    body = pt.replace(VehicleBody(), m="1.5 t")
    assert float(body.m) == 1500
    assert float(pt.replace(VehicleBody(), m="1.5t").m) == 1500
    assert float(WillansEngine(P_max="82 kW").P_max) == 82e3  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match=r"VehicleBody.m = '1500 N': N cannot be converted to kg"):
        VehicleBody(m="1500 N")  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match=r"'5 stones': unknown unit 'stones'"):
        VehicleBody(m="5 stones")  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match=r"unknown unit 'lbx' .*did you mean lb "):
        VehicleBody(m="3300 lbx")  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match=r"'1,500 kg' has a comma; write decimals with a point"):
        VehicleBody(m="1,500 kg")  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match=r"a text without a unit; write 1500, or '1500 kg'"):
        VehicleBody(m="1500")  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match=r"a text without a unit; write 0.3 \("):
        VehicleBody(Cd="0.3")  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match=r"'1 lb/foo': unknown unit 'foo'"):
        VehicleBody(m="1 lb/foo")  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match=r"'1 lb/ft/s': .* has two slashes.* write lb/\(ft/s\) or lb/\(ft.s\)$"):
        VehicleBody(m="1 lb/ft/s")  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match=r"is outside its range"):
        VehicleBody(m="-1 kg")  # type: ignore[arg-type]


def test_what_is_no_unit_is_named() -> None:
    with pytest.raises(pt.ParameterError, match=r"CoastDownBody.F_1 = '1 N/km/h': .* write N/\(km/h\) or N/\(km.h\)$"):
        CoastDownBody(m=1500, F_1="1 N/km/h")  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match=r"CoastDownBody.F_1 = '1 N/\(km/h': unknown unit '\(km/h'"):
        CoastDownBody(m=1500, F_1="1 N/(km/h")  # type: ignore[arg-type]
    with pytest.raises(pt.ModelError, match=r"Drag: unknown unit 'stone' in 'N/\(stone/s\)'"):
        pt.parameter("N/(stone/s)", "Drag")
    with pytest.raises(pt.ParameterError, match=r"'1500 KG': unknown unit 'KG' .*did you mean kg\?$"):
        VehicleBody(m="1500 KG")  # type: ignore[arg-type]


class Braked(pt.Component):
    d: pt.Parameter = pt.parameter("N/(m/s)", "Force over speed", default=2.0)
    f: pt.Variable = pt.variable("N/(m/s)", "The same, falling", start=1.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.f) == -self.d / pt.Map.curve([0, 1], [1, 1], x="d", x_unit="N.s/m", outside="clip")(self.f)


def test_components_may_declare_quotients_in_brackets() -> None:
    assert float(Braked(d="1 N/(km/h)").d) == pytest.approx(3.6)  # type: ignore[arg-type]
    pt.compile(Braked())


class Turning(pt.Component):
    rotor: Inertia = Inertia(J=1)
    other: Inertia = Inertia(J=1)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.rotor.flange_b, self.other.flange_a)


def test_results_come_in_other_units() -> None:
    result = pt.simulate(Turning(), 1.0, points=3, starts={"rotor.w": 100.0})
    assert result.converted("rotor.w", "rpm") == pytest.approx(100 * 30 / math.pi)
    with pytest.raises(pt.ModelError, match=r"rad/s cannot be converted to km"):
        result.converted("rotor.w", "km")
    assert converted(3.6, "kg/h", "g/s") == pytest.approx(1.0)
    assert result.converted("rotor.w", "1/min") == pytest.approx(100 * 30 / math.pi)
    assert converted(300.0, "K", "degC") == pytest.approx(26.85)
    assert converted(37.0, "degC", "°F") == pytest.approx(98.6)
    with pytest.raises(pt.ModelError, match=r"^1/s may count radians or rotations; write rad/s or Hz$"):
        result.converted("rotor.w", "1/s")


def test_a_rate_without_an_angle_is_no_angular_speed() -> None:
    with pytest.raises(
        pt.ParameterError, match=r"w_idle = '83 1/s': 1/s may count radians or rotations; write rad/s or Hz$"
    ):
        WillansEngine(w_idle="83 1/s")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("kgm2", "kg.m2"),
        ("kg*m^2", "kg.m2"),
        ("Nm/rad", "N.m/rad"),
        ("Nms/rad", "N.m.s/rad"),
        ("Ns/m", "N.s/m"),
        ("m/s**2", "m/s2"),
        ("kmh", "km/h"),
        ("°C", "degC"),
        ("U/min", "rpm"),
        ("km/hr", "h"),
        ("mbar", "bar"),
    ],
)
def test_a_declared_unit_in_another_notation_is_answered_with_the_right_one(given: str, meant: str) -> None:
    with pytest.raises(pt.ModelError, match=rf"unknown unit .*; did you mean {meant}\?$"):
        pt.parameter(given, "Something")


def test_pounds_and_feet_need_no_sign() -> None:
    """1 lbf = 0.45359237 kg x 9.80665 m/s2, 1 ft = 0.3048 m."""
    assert quantity("10 lbft", "N.m", "x") == pytest.approx(10 * 0.45359237 * 9.80665 * 0.3048, rel=1e-12)
