"""Vehicles by name and from files: what is written is what is read."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from differential_kinds import KINDS

import powertrain as pt
from powertrain.components import rotational, translational
from powertrain.components.body import Body, DrivenAxle, RoadProfile, VehicleBody
from powertrain.components.cycles import DriveCycle
from powertrain.components.differentials import LimitedSlipDifferential
from powertrain.components.electric import cells_in_series
from powertrain.components.engines import MappedEngine, WillansEngine, read_fuel_map
from powertrain.components.gearless.spherical_cam import SphericalCam
from powertrain.components.rotational import IdealGear, Inertia
from powertrain.components.transmissions import ManualGearbox, RangeTransmission
from powertrain.components.wheels import RigidWheel
from powertrain.presets.catalogue import components
from powertrain.presets.files import applied, written
from powertrain.presets.places import place
from powertrain.presets.settings import assigned
from powertrain.vehicles import load, names, save
from powertrain.vehicles.automatic_car import AutomaticCar
from powertrain.vehicles.electric_car import ElectricCar
from powertrain.vehicles.manual_car import ManualCar
from powertrain.vehicles.parallel_hybrid import ParallelHybrid
from powertrain.vehicles.split_path_car import SplitPathCar
from powertrain.vehicles.variator_car import VariatorCar

HILL = DriveCycle("hill", ((0.0, 0.0), (10.0, 12.5), (20.0, 0.0)), "mine", (0.0, 0.05, -0.01))


def read_again(car: Any) -> Any:
    return applied(type(car)(), tomllib.loads(written(car)))[0]


def test_a_file_may_begin_with_a_measured_car(tmp_path: Path) -> None:
    path = tmp_path / "car.toml"
    path.write_text('class = "Mazda-Mazda3-Manual"\nbody.m = "1.4 t"\n')
    assert load(path) == pt.replace(load("mazda-mazda3-manual"), {"body.m": 1400})


@pytest.mark.slow
@pytest.mark.parametrize("name", names())
def test_every_vehicle_goes_through_a_file(name: str) -> None:
    assert read_again(load(name)) == load(name)


@pytest.mark.parametrize(
    "car",
    [
        ManualCar(engine=MappedEngine.gasoline(), road=RoadProfile.from_heights([0, 1000, 2000], [0, 10, 5])),
        pt.replace(ManualCar(), {"cycle.cycle": HILL, "gearbox": ManualGearbox.of_ratios(3.5, 2.0, 1.2)}),
        pt.replace(ManualCar(), {"cycle.cycle": DriveCycle("hill", HILL.table, heights=(7.0, 9.0, 8.5))}),
        pt.replace(ElectricCar.two_speed(), {"battery.ocv": cells_in_series(108)}),
        pt.replace(load("mazda-mazda3-manual"), engine=WillansEngine()),
    ],
    ids=["maps", "cycle and gears", "cycle with heights", "voltage", "without a curve"],
)
def test_what_is_not_plain_goes_through_a_file(car: Any) -> None:
    assert read_again(car) == car


@pytest.mark.slow
def test_same_consumption_after_saving_and_loading(tmp_path: Path) -> None:
    from powertrain.trials import drive_cycle

    car = pt.replace(load("nissan-versa-manual"), {"cycle.cycle": DriveCycle.named("udds").part(0, 125)})
    save(car, tmp_path / "car.toml")
    again = load(tmp_path / "car.toml")
    assert again == car
    assert drive_cycle(again).fuel == drive_cycle(car).fuel


def test_a_cycle_beside_its_file_is_not_one_of_that_name_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where the ending is in capitals."""
    beside = tmp_path / "cars"
    beside.mkdir()
    for folder, v in (tmp_path, 72), (beside, 36):
        (folder / "LAP.CSV").write_text(f"time_s,speed_km_h\n0,0\n10,{v}\n20,0\n", encoding="utf-8")
    (beside / "mine.toml").write_text('class = "ManualCar"\n[cycle]\ncycle = "LAP.CSV"\n', encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert load("cars/mine.toml").cycle.cycle.top_speed == pytest.approx(10.0)


def test_a_file_of_ones_own(tmp_path: Path) -> None:
    (tmp_path / "full.csv").write_text("w [rad/s], tau [N.m]\n80,110\n400,160\n650,120\n", encoding="utf-8")
    (tmp_path / "lap.csv").write_text("time_s,speed_km_h\n0,0\n10,36\n30,0\n", encoding="utf-8")
    path = tmp_path / "mine.toml"
    path.write_text(
        'class = "ManualCar"\nbody.m = "1.2 t"\n'
        '[engine]\ncurve = { csv = "full.csv", outside = "clip" }\nP_max = "100 hp"\nw_limit = 650\n'
        '[cycle]\ncycle = "lap.csv"\n'
        "[[gearbox.gears]]\nratio = 3.5\n[[gearbox.gears]]\nratio = 1.5\n"
        "[[gearbox.synchronisers]]\nfn_max = 900\n[[gearbox.synchronisers]]\nfn_max = 800\n",
        encoding="utf-8",
    )
    car = load(path)
    assert float(car.body.m) == 1200
    assert float(car.engine.full_load(240.0)) == pytest.approx(135)
    assert car.cycle.cycle.distance == pytest.approx(150)
    assert [float(g.ratio) for g in car.gearbox.gears] == [3.5, 1.5]
    assert np.allclose([float(s.fn_max) for s in car.gearbox.synchronisers], [900, 800])


@pytest.mark.parametrize(
    "part", [{"front": DrivenAxle()}, {"transmission": RangeTransmission()}], ids=["bound", "rows"]
)
def test_parts_with_bound_parameters_and_rows_with_records(part: dict[str, Any]) -> None:
    """The ratio of a crown gear's mesh is bound to that of the gear, so no file has it; a range has its network in a row."""
    car = pt.replace(SplitPathCar(), part)
    assert applied(SplitPathCar(), tomllib.loads(written(car, ())))[0] == car


@pytest.mark.parametrize("name", KINDS)
def test_every_differential_goes_through_a_file(name: str) -> None:
    car = pt.replace(ManualCar(), {"front": DrivenAxle(differential=KINDS[name])})
    assert read_again(car) == car


def test_every_component_goes_through_a_file() -> None:
    read = 0
    for kind in (entry.kind for entry in components()):
        try:
            part = kind()
        except pt.ParameterError:  # needs values
            continue
        assert read_again(part) == part
        read += 1
    assert read > 150


class _Anything(pt.Component):
    """Slots for components of any kind."""

    one: pt.Component = Inertia(J=1)
    several: tuple[pt.Component, ...] = (Inertia(J=2),)

    def equations(self) -> pt.Equations:
        yield from ()


@pytest.mark.parametrize("kind", [rotational.SpringDamper, translational.SpringDamper])
def test_components_of_one_name_in_two_families_go_through_a_file(kind: Any) -> None:
    part = kind(c=1, d=2)
    model = _Anything(one=part, several=(part, Inertia(J=3)))
    assert applied(_Anything(), tomllib.loads(written(model)))[0] == model


CAM = "front.differential.cam"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{ M = 5 }", "is not a SphericalCam: it lacks N"),
        ("{ M = 5, N = 6, K = 1 }", "unknown key 'K'; known keys are M, N, alpha_1, alpha_3, alpha_4"),
        ("{ M = 5, N = ", "is not a table as in a parameter file"),
        ("mine", "is not a SphericalCam: give a table of M, N, alpha_1, alpha_3, alpha_4"),
        ("{ M = 5, N = 5 }", "as many lobes as rollers"),
    ],
)
def test_tables_in_texts(text: str, said: str) -> None:
    car: Any = pt.replace(ManualCar(), {"front": DrivenAxle(differential=KINDS["spherical cam"])})
    assert assigned(car, [(CAM, "{ M = 5, N = 6 }")]).front.differential.cam == SphericalCam(5, 6)
    with pytest.raises(pt.ParameterError, match=said):
        assigned(car, [(CAM, text)])


SLOPE = '{{ name = "g", unit = "{}", axes = [{{ name = "s", unit = "m", points = {} }}], values = [0, 0.1] }}\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("body.m = 5\n", "does not say which vehicle"),
        ('class = "ManualCar"\nbody.m = "5 N"\n', "N cannot be converted to kg"),
        ('class = "ManualCar"\n[cycle]\ncycle = "uds"\n', "unknown drive cycle 'uds'"),
        ('class = "ManualCar"\n[engine]\ncurve = { name = "x" }\n', r"engine.curve = .* is not a map: it lacks 'axes'"),
        ('class = "ManualCar"\n[[engine]]\nJ = 1\n', "engine is not a tuple of components"),
        ('class = "ManualCarr"\n', "unknown vehicle 'ManualCarr'"),
        (
            'class = "ManualCar"\nfront = "LumpedAxle"\n[front.wheels]\nradius = 0.3\n',
            "write its name as class = ... in the",
        ),
        ("class = ManualCar\n", "texts stand in quotation marks"),
        ('class = "ManualCar"\nbody.m = 1500 kg\n', 'quotation marks, as in m = "1500 kg"'),
        ('class = "ManualCar"\n[body]\nm = 1\n[body]\nA = 2\n', "all values of a component in one table"),
        ("class: ManualCar\n", "write name = value"),
        (
            'class = "DualClutchCar"\n[gearbox]\nratios = [3.8, 2.3]\n',
            r"gearbox = DualClutchGearbox.of_ratios\(...\) takes ratios",
        ),
        ('class = "ManualCar"\n[cycle]\ncycle = 3\n', r"cycle.cycle = 3 is neither a name nor a table of numbers"),
        (
            'class = "ManualCar"\n[[gearbox.gears]]\nratio = "3.5"\n',
            r"toml: gearbox.gears\[0\]: ratio = '3.5' is a text",
        ),
        (
            'class = "ManualCar"\n[road]\nprofile = ' + SLOPE.format("1", "[9, 0]"),
            "toml: road.profile: axis s: the points must",
        ),
        (
            'class = "ManualCar"\n[road]\nprofile = ' + SLOPE.format("%", "[0, 9]"),
            "toml: road.profile: unknown unit '%'",
        ),
    ],
)
def test_what_a_file_cannot_say(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(pt.ParameterError, match=said) as caught:
        load(path)
    assert str(caught.value).startswith(str(path))


def test_a_file_may_begin_with_a_byte_order_mark_and_spell_the_class_otherwise(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text('class = "manual-car"\n[engine]\nclass = "willans_engine"\nJ = 0.2\n', encoding="utf-8-sig")
    assert load(path) == pt.replace(ManualCar(), {"engine.J": 0.2})
    with pytest.raises(pt.ParameterError, match=r"absent.toml cannot be read: No such file"):
        load(tmp_path / "absent.toml")


CYCLE = '[cycle]\ncycle = { name = "hill", table = [[0, 0], [9, 5]], grade = [0, 0.1] }\n'
CURVE = '[engine]\ncurve = { name = "c", unit = "N.m", values = [1, 2], axes = [{ name = "w", unit = "rad/s", points = [0, 9]'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            CYCLE,
            "cycle.cycle = .* unknown key 'grade'; did you mean grades.*known keys are name, table, source, grades",
        ),
        (
            '[engine]\ncurve = { csv = "full.csv", outsid = "clip" }\n',
            "engine.curve = .* unknown key 'outsid'; did you mean",
        ),
        (f'{CURVE} }}], methode = "smooth" }}\n', "engine.curve = .* unknown key 'methode'; did you mean method"),
        (f'{CURVE}, outsid = "clip" }}] }}\n', "engine.curve = .* unknown key 'outsid'; did you mean outside"),
    ],
)
def test_misspelt_keys_are_refused(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "full.csv").write_text("w [rad/s],torque [N.m]\n80,110\n400,150\n", encoding="utf-8")
    path = tmp_path / "misspelt.toml"
    path.write_text(f'class = "ManualCar"\n{text}', encoding="utf-8")
    with pytest.raises(pt.ParameterError, match=said):
        load(path)


@pytest.mark.parametrize(
    ("text", "path", "part"),
    [
        (
            '[front]\nclass = "DrivenAxle"\ndifferential = "LimitedSlipDifferential(preload=100)"\n',
            "front.differential",
            LimitedSlipDifferential(preload=100),
        ),
        (
            '[transfer]\nclass = "CentreDifferential"\ndifferential = "LimitedSlipDifferential"\n',
            "transfer.differential",
            LimitedSlipDifferential(),
        ),
        (
            '[front]\nclass = "DrivenAxle"\n[front.left]\nclass = "RigidWheel(J=1.1)"\nCr = 0.02\n',
            "front.left",
            RigidWheel(J=1.1, Cr=0.02),
        ),
        (
            '[engine]\nclass = "MappedEngine.gasoline()"\nJ = 0.2\n',
            "engine",
            MappedEngine.gasoline(J=0.2),
        ),
        (
            '[[gearbox.gears]]\nclass = "IdealGear(ratio=3)"\n[[gearbox.gears]]\nratio = 2\n',
            "gearbox.gears[0]",
            IdealGear(ratio=3),
        ),
    ],
)
def test_texts_and_classes_of_parts_at_any_depth(text: str, path: str, part: pt.Component) -> None:
    """Also where the part around them is made anew by its class."""
    assert place(applied(ManualCar(), tomllib.loads(text))[0], path).value == part


@pytest.mark.parametrize(
    "text",
    [
        "engine = \"MappedEngine.from_csv('t.csv', fuel='f.csv')\"",
        "[engine]\nclass = \"MappedEngine.from_csv('t.csv', 'f.csv')\"",
    ],
)
def test_files_named_in_a_variant_lie_beside_the_parameter_file(tmp_path: Path, text: str) -> None:
    data = files("powertrain.components").joinpath("engines", "data")
    for name, source in {"t.csv": "gasoline_1600_torque.csv", "f.csv": "gasoline_1600_fuel.csv"}.items():
        (tmp_path / name).write_text(data.joinpath(source).read_text(encoding="utf-8"), encoding="utf-8")
    path = tmp_path / "mine.toml"
    path.write_text(f'class = "ManualCar"\n{text}\n', encoding="utf-8")
    assert load(path).engine.full_load(200.0) == pytest.approx(MappedEngine.gasoline().full_load(200.0))


@pytest.mark.parametrize("engine", ['class = "MappedEngine"\n', ""])
def test_tables_of_engines_in_other_layouts_are_pointed_to_their_reader(tmp_path: Path, engine: str) -> None:
    (tmp_path / "t.csv").write_text(
        "n [rpm],full load [Nm],motoring [Nm]\n800,110,-15\n6000,140,-33\n", encoding="utf-8"
    )
    path, car = tmp_path / "mine.toml", pt.replace(ManualCar(), engine=MappedEngine.gasoline())
    path.write_text(f'[engine]\n{engine}torque_map = "t.csv"\nfuel_map = "t.csv"\n', encoding="utf-8")
    for model in (car, ManualCar()) if engine else (car,):
        with pytest.raises(pt.ParameterError, match=r'^engine.torque_map: .*; write class = "MappedEngine.from_csv\('):
            applied(model, tomllib.loads(path.read_text(encoding="utf-8")), tmp_path)


def test_tables_of_engines_by_their_files(tmp_path: Path) -> None:
    """Units of every day; beyond the tables the simulation ends, unless the table says otherwise."""
    (tmp_path / "t.csv").write_text(
        "speed [rpm],throttle [%],torque [lbf.ft]\n800,0,-12\n800,100,80\n6000,0,-25\n6000,100,103\n", encoding="utf-8"
    )
    (tmp_path / "f.csv").write_text(
        "speed [rpm],torque [lbf.ft],fuel [g/s]\n1000,0,0.15\n1000,120,1.2\n6000,0,1.5\n6000,120,8\n", encoding="utf-8"
    )
    engine = {"class": "MappedEngine", "torque_map": {"csv": "t.csv", "outside": "clip"}, "fuel_map": "f.csv"}
    with pytest.raises(pt.ParameterError, match=r"highest speed of the full load(.|\n)*w_limit = 680 rad/s"):
        applied(ManualCar(), {"engine": engine}, tmp_path)
    engine["w_limit"] = "6000 rpm"
    made: Any = applied(ManualCar(), {"engine": engine}, tmp_path)[0].engine
    assert made.full_load(6000 * np.pi / 30) == pytest.approx(103 * 1.3558179483314004)
    assert [axis.outside for axis in (*made.torque_map.axes, *made.fuel_map.axes)] == ["clip"] * 2 + ["error"] * 2


def test_unknown_name() -> None:
    with pytest.raises(pt.ParameterError, match="there is no vehicle 'toyota-rav4'"):
        load("toyota-rav4")
    with pytest.raises(
        pt.ParameterError, match="did you mean volkswagen-golf-gti-dual-clutch or volkswagen-golf-gti-manual"
    ):
        load("golf")
    assert "ManualCar" in names()
    assert "toyota-rav4-automatic" in names()
    assert pt.vehicles.load is load


def test_names_of_a_file_are_answered_with_what_there_is() -> None:
    with pytest.raises(
        pt.ParameterError, match=r"no parameter or component 'tyres'; choose from cycle, driver, .*gearbox"
    ):
        applied(ManualCar(), {"tyres": {"radius": 0.3}})
    assert applied(ManualCar(), {"class": "manualcar", "body": {"m": 1250}})[1] == ["body.m"]


def test_variants_of_vehicles(tmp_path: Path) -> None:
    """What a class method of a vehicle makes has a name, too, and a file can begin with it."""
    path = tmp_path / "plug_in.toml"
    path.write_text('class = "ParallelHybrid.plug_in()"\nbody.m = "1650 kg"\n', encoding="utf-8")
    assert pt.vehicles.load(path) == pt.replace(ParallelHybrid.plug_in(), {"body.m": 1650.0})
    assert pt.vehicles.load('ParallelHybrid.at("P4")') == ParallelHybrid.at("P4")
    assert pt.vehicles.load("ManualCar()") == pt.vehicles.load("ManualCar")
    with pytest.raises(pt.ParameterError, match="no variant 'plugin'; choose from at, plug_in"):
        pt.vehicles.load("ParallelHybrid.plugin()")
    with pytest.raises(pt.ParameterError, match=r"ParallelHybrid.at\(\) cannot be created"):
        pt.vehicles.load("ParallelHybrid.at()")


def test_files_that_cannot_be_written_or_read(tmp_path: Path) -> None:
    with pytest.raises(pt.ParameterError, match=r"car.json: parameter files end in .toml"):
        save(ManualCar(), tmp_path / "car.json")  # which load would take for a name
    with pytest.raises(pt.ParameterError, match=r"car.toml cannot be written: there is no folder"):
        save(ManualCar(), tmp_path / "absent" / "car.toml")
    with pytest.raises(pt.ParameterError, match=r"no vehicle 'car.yaml'.*parameter files end in .toml"):
        load("car.yaml")
    save(ManualCar(), tmp_path / "CAR.TOML")
    assert load(tmp_path / "CAR.TOML") == ManualCar()


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("gearbox", "Automatic.of('TEN_SPEED')"),
        ("road", "RoadProfile.from_heights([0, 100], 'heights.csv')"),
        ("front.final_drive", "CrownGear.from_teeth('ten', 41)"),
    ],
)
def test_makers_that_cannot_take_what_they_get(path: str, text: str) -> None:
    with pytest.raises(pt.ParameterError) as caught:
        assigned(AutomaticCar(), [(path, text)])
    maker, wrong = text.partition("(")[0], text.split("'")[1]
    assert wrong in str(caught.value)
    assert path in str(caught.value) or maker in str(caught.value) or "teeth" in str(caught.value)


@pytest.mark.parametrize("text", ["85 %", "0.85"])
def test_a_plain_number_takes_percent_everywhere(text: str) -> None:
    """In Python, as a text of the command line, and in a file."""
    car = VariatorCar(share=0.7)
    assert assigned(car, [("share", text)]).share == 0.85
    assert applied(car, {"share": text if "%" in text else 0.85})[0].share == 0.85
    for wrong in ("85 kg", "much"):
        with pytest.raises(pt.ParameterError, match=f"^share = '{wrong}'"):
            assigned(car, [("share", wrong)])


def test_roads_are_not_steeper_than_45_degrees() -> None:
    """500 % is a percentage passed as a fraction."""
    steep = pt.Map.curve([0.0, 100.0], [0.0, -5.0], x="s", x_unit="m", name="grade")
    with pytest.raises(pt.ParameterError, match=r"road.profile has a grade of -5, -500%; no road is steeper than 100%"):
        pt.compile(ManualCar(road=RoadProfile(profile=steep)))


def test_a_tailwind_reduces_the_relative_speed_of_the_air() -> None:
    """At 20 m/s against 10 m/s the drag Cd A rho u^2/2 is that of 30 m/s."""
    body = assigned(VehicleBody(Cd=0.3, A=2.0), [("tailwind", "-10 m/s")])
    result = pt.simulate(PulledBody(body=body), stop=1)
    assert result["body.chassis.drag"][-1] == pytest.approx(0.3 * 2.0 * 1.2 * 30**2 / 2)


class PulledBody(pt.Component):
    """A body that is pulled at 20 m/s."""

    body: Body
    pull: translational.ConstantSpeed = translational.ConstantSpeed(v_fixed=20)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.pull.flange, self.body.front)


def test_maps_by_a_function(tmp_path: Path) -> None:
    """The cells of a battery and a fuel table with columns of its own, in a file and as options: the functions were for Python alone."""
    (tmp_path / "fuel.csv").write_text(
        "Nmot,Md [Nm],be [g/kWh]\n1000,20,390\n1000,120,262\n6500,20,385\n6500,120,240\n"
    )
    (tmp_path / "car.toml").write_text('class = "ElectricCar"\n[battery]\nocv = "cells_in_series(180)"\nQ = "111 Ah"\n')
    car = pt.vehicles.load(tmp_path / "car.toml")
    assert car == pt.replace(ElectricCar(), {"battery.ocv": cells_in_series(180), "battery.Q": "111 A.h"})
    assert car.battery.soc_min == ElectricCar().battery.soc_min
    assert assigned(ElectricCar(), [("battery.ocv", "cells_in_series(180)"), ("battery.Q", "111 Ah")]) == car
    call = "read_fuel_map('fuel.csv', speed='Nmot [rpm]')"
    (tmp_path / "petrol.toml").write_text(
        f'class = "ManualCar"\n[engine]\nclass = "MappedEngine.gasoline()"\nfuel_map = "{call}"\n'
    )
    engine = pt.vehicles.load(tmp_path / "petrol.toml").engine
    assert engine.fuel_map == read_fuel_map(tmp_path / "fuel.csv", speed="Nmot [rpm]")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "cells_in_serie(96)",
            r"battery.ocv = .* no function 'cells_in_serie' that gives a map; did you mean cells_in_series",
        ),
        ("cells_in_series()", r"missing 1 required positional argument: 'cells'; it takes cells"),
        ("cells_in_series(96.5)", "96.5 cells; give a whole number"),
        ("cells_in_series(n)", "battery.ocv"),
        ("cells in series (96)", "battery.ocv"),
        ("__import__('os').getcwd()", "no function"),
    ],
)
def test_calls_that_give_no_map(text: str, said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        assigned(ElectricCar(), [("battery.ocv", text)])
