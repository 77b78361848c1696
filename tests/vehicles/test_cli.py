"""The command line: what it prints and writes, its exit codes, and what it says to a user who mistypes."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner, Result

import powertrain as pt
from powertrain.cli import main
from powertrain.cli.running import report, spanned
from powertrain.components.cycles import DriveCycle
from powertrain.components.engines import WillansEngine
from powertrain.presets.catalogue import assembled, components, vehicles
from powertrain.presets.files import applied, read, written
from powertrain.presets.places import places
from powertrain.presets.settings import assigned
from powertrain.trials import drive_cycle
from powertrain.trials.cycle import on_cycle
from powertrain.vehicles.electric_car import ElectricCar
from powertrain.vehicles.manual_car import ManualCar
from powertrain.vehicles.split_path_car import SplitPathCar

PNG = b"\x89PNG"


def powertrain(*arguments: str) -> Result:
    return CliRunner().invoke(main, list(arguments))


def done(*arguments: str) -> str:
    result = powertrain(*arguments)
    assert result.exit_code == 0, result.output
    return result.output


def refused(*arguments: str, code: int = 2) -> str:
    """The message; there is no traceback."""
    result = powertrain(*arguments)
    assert result.exit_code == code, result.output
    assert isinstance(result.exception, SystemExit)
    assert "Traceback" not in result.output
    return " ".join(result.output.split())


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Half a minute: off to 30 km/h and back."""
    path = tmp_path_factory.mktemp("cycles") / "short.csv"
    path.write_text("time_s,speed_km_h\n0,0\n3,0\n13,30\n18,30\n27,0\n30,0\n")
    return str(path)


def test_help_of_every_command_has_examples() -> None:
    assert "Examples:" in done("--help")
    for name in (
        main.commands if main.commands else ("list", "info", "run", "performance", "map", "split-path", "reproduce")
    ):
        text = done(name, "--help")
        assert f"powertrain {name}" in text, name
        assert "Examples:" in text


def test_commands_take_a_parameter_file_in_place_of_a_vehicle(tmp_path: Path, short: str) -> None:
    """The name in the results is the file's; --set changes what the file has set."""
    path = tmp_path / "heavy.toml"
    path.write_text('class = "ElectricCar"\n[body]\nm = "1.7t"\nCd = 0.3\n')
    run = done("run", str(path), "--set", "body.m=1.9t", "--cycle", short)
    assert run.startswith("heavy over short")
    same = done("run", "ElectricCar", "--set", "body.m=1900", "--set", "body.Cd=0.3", "--cycle", short)
    assert run.splitlines()[1:] == same.splitlines()[1:]
    assert "there is no file" in refused("run", str(tmp_path / "light.toml"))
    path.write_text("[body]\nm = 1900\n")
    assert "does not say which vehicle it is" in refused("run", str(path))


def test_notes_of_the_run_are_printed_below_its_table(monkeypatch: pytest.MonkeyPatch) -> None:
    run = drive_cycle(ElectricCar(), DriveCycle("short", ((0.0, 0.0), (1.0, 0.0), (4.0, 3.0))), rtol=1e-3)
    monkeypatch.setattr(run.result, "notes", ("the start is not unique", "3 of 9 steps were outside"), raising=True)
    text = next(report(run)).splitlines()
    assert text[-4:] == ["", "Note: the start is not unique.", "", "Note: 3 of 9 steps were outside."]


@pytest.mark.slow
def test_a_measured_car_is_run_by_its_name(short: str) -> None:
    measured = "mitsubishi-mirage-manual"
    assert done("run", measured, "--cycle", short).startswith(f"{measured} over short")


@pytest.mark.parametrize(
    ("typed", "completed"),
    [
        ("run split", ["plain,SplitPathCar"]),
        ("run ManualCar --cycle wl", ["plain,wltc"]),
        ("run ManualCar --cycle mine.c", ["file,mine.c"]),
        ("view ParallelH", ["plain,ParallelHybrid"]),
        ("compare ManualCar before.n", ["file,before.n"]),
        ("info circularcam", ["plain,CircularCamDifferential"]),
        ("map SplitPathT", ["plain,SplitPathTransmission"]),
        ("reproduce yu", ["plain,yu-beachley"]),
        ("run my_car.to", ["file,my_car.to"]),
        ("info Nothing", []),
    ],
)
def test_the_shell_completes_names(typed: str, completed: list[str]) -> None:
    """What a completion script of Bash asks for and is told (click's protocol)."""
    words = f"powertrain {typed}".split()
    asked = {"COMP_WORDS": " ".join(words), "COMP_CWORD": str(len(words) - 1), "_POWERTRAIN_COMPLETE": "bash_complete"}
    told = CliRunner().invoke(main, [], prog_name="powertrain", env=asked, complete_var="_POWERTRAIN_COMPLETE")
    assert told.output.split() == completed


def test_version() -> None:
    assert pt.__version__ in done("--version")


def test_real_process_help_is_light() -> None:
    """Nothing heavy is imported for a help text (so it comes in half a second)."""
    heavy = ["scipy", "pandas", "xarray", "matplotlib", "powertrain.components.cycles", "powertrain.trials"]
    program = f"""
import sys
from powertrain.cli import main
main(["--help"], standalone_mode=False)
print(*(name for name in {heavy!r} if name in sys.modules), file=sys.stderr)
"""
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert "split-path" in ran.stdout
    assert ran.stderr.split() == []


@pytest.mark.slow
def test_real_process_exit_codes() -> None:
    command = [sys.executable, "-W", "error", "-m", "powertrain.cli"]
    ran = subprocess.run([*command, "info", "Inertia"], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    assert "J der(w)" in ran.stdout or "kg.m2" in ran.stdout
    ran = subprocess.run([*command, "info", "Inertai"], capture_output=True, text=True, check=False)
    assert ran.returncode == 2
    assert "did you mean Inertia" in ran.stderr
    assert "Traceback" not in ran.stderr


def test_unknown_command() -> None:
    assert "did you mean list" in refused("lst")


# list and info


def test_list_finds_vehicles_and_families_by_walking() -> None:
    text = done("list")
    assert {"SplitPathCar", "RearDriveCar", "FourWheelDriveCar"} <= {entry.name for entry in vehicles()}
    for entry in (*assembled(), *components()):
        assert entry.name in text
    assert "wltc" in text
    assert "yu-beachley" in text


def test_list_one_family() -> None:
    text = done("list", "--family", "differentials")
    assert "BevelDifferential" in text
    assert "Clutch" not in text
    assert "did you mean differentials" in refused("list", "--family", "differntials")


def test_info_has_parameters_slots_ports_equations_and_source() -> None:
    text = done("info", "Clutch")
    for part in ("fn_max", "must be given", "[0, inf)", "mue_pos", "flange_a", "tau [N.m]", "f_normalized", "w_rel"):
        assert part in text
    assert "yield friction(self.w_rel, self.tau, -limit, limit, peak=self.peak)" in text
    assert "def _transmit" in text  # a helper of a partial class
    assert "powertrain.components.rotational.clutch" in text


def test_info_of_a_vehicle_lists_what_can_be_set() -> None:
    text = done("info", "split-path-car")
    assert "transmission.differential.ratio" in text
    assert "unit_ratio.basic_ratio" not in text  # the transmission determines it
    assert "WillansEngine MappedEngine, WillansEngine" in " ".join(text.split())


@pytest.mark.slow
@pytest.mark.parametrize("name", [entry.full_name for entry in (*assembled(), *components())])
def test_info_of_everything(name: str) -> None:
    assert name.rpartition(".")[2] in done("info", name)


def test_info_of_a_parameter_file_and_of_a_measured_car(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text('class = "ManualCar"\n', encoding="utf-8")
    assert done("info", str(file)).startswith("ManualCar (manual_car)")
    assert done("info", "honda-civic-4dr-belt").startswith("VariatorCar")


def test_info_of_a_file_has_its_values(tmp_path: Path) -> None:
    """Own parameters, slots, and the parameters of parts; without a file the defaults of the class."""
    file = tmp_path / "mine.toml"
    file.write_text(
        'class = "ManualCar"\nfront = "RollingAxle"\nrear = "LumpedAxle"\n[body]\nm = "1234 kg"\n', encoding="utf-8"
    )
    text = done("info", str(file))
    assert re.search(r"^  body.m +1234  kg", text, re.MULTILINE)
    assert re.search(r"^  front +Axle +RollingAxle", text, re.MULTILINE)
    assert re.search(r"^  name +kind +value +takes", text, re.MULTILINE)
    assert re.search(r"^  body.m +1300  kg", done("info", "ManualCar"), re.MULTILINE)


def test_info_fills_prose_to_the_terminal_and_leaves_formulas_their_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "70")
    lines = done("info", "CircularCamDifferential").partition("Parameters")[0].splitlines()
    assert max(map(len, lines)) <= 70
    assert any(line.startswith("  kappa = mu D_R (lambda/(D_out tan(alpha_out))") for line in lines)


def test_a_reader_that_goes_away_gets_no_message() -> None:
    program = "import sys; from powertrain.cli import main; main(['list'])"
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.close()
        assert process.stderr is not None
        assert process.stderr.read() == b""


def test_info_draws_a_schematic(tmp_path: Path) -> None:
    picture = tmp_path / "car.png"
    assert f"wrote {picture}" in done("info", "ManualCar", "--schematic", str(picture)).replace("\n", "")
    assert picture.read_bytes().startswith(PNG)
    assert "nothing to draw" in refused("info", "AlwaysOn", "--schematic", str(picture))


def test_info_of_an_ambiguous_name() -> None:
    assert "rotational.Fixed, translational.Fixed" in refused("info", "Fixed")


# run


@pytest.fixture(scope="module")
def ran(short: str, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    folder = tmp_path_factory.mktemp("run")
    text = done(
        *(
            "run",
            "SplitPathCar",
            "--cycle",
            short,
            "--set",
            "body.m=1400",
            "--set",
            "transmission.cvu=CVU(eta_ab=0.8, eta_ba=0.8)",
        ),
        *(
            "--out",
            str(folder / "run.nc"),
            "--plot",
            str(folder / "run.png"),
            "--write-params",
            str(folder / "car.toml"),
        ),
    )
    return text, folder


def test_run_prints_consumption_and_audit(ran: tuple[str, Path]) -> None:
    text, _ = ran
    assert "SplitPathCar over short (30 s, 0.12 km, up to 30.0 km/h)" in text
    for part in (
        "l/100 km",
        "g/km",
        "time outside the speed tolerance",
        "Energy by component",
        "WillansEngine",
        "energy residual",
    ):
        assert part in text


def test_run_writes_signals_picture_and_parameters(ran: tuple[str, Path]) -> None:
    _, folder = ran
    data = pt.load(folder / "run.nc")
    assert data["body.v"].attrs["units"] == "m/s"
    assert float(data["body.v"].max()) == pytest.approx(30 / 3.6, abs=0.6)
    assert (folder / "run.png").read_bytes().startswith(PNG)
    written_values = tomllib.loads((folder / "car.toml").read_text())
    assert written_values["body"]["m"] == 1400
    assert written_values["transmission"]["cvu"] == {"class": "CVU", "map_ab": "none", "map_ba": "none"} | {
        name: written_values["transmission"]["cvu"][name] for name in ("eta_ab", "eta_ba", "ratio_min", "ratio_max")
    }
    assert written_values["transmission"]["cvu"]["eta_ab"] == 0.8


HILL = "time_s,speed_km_h,grade_percent\n0,0,0\n2,0,0\n12,30,20\n20,30,20\n"


def climbed(model: pt.Component) -> float:
    """The height [m] to which the road of a vehicle leads within 50 m."""
    profile = pt.replace(model).road.profile  # type: ignore[attr-defined]
    return float(np.trapezoid(profile(np.linspace(0, 50, 501)), dx=0.1))


def test_the_grades_of_a_cycle_are_the_road(tmp_path: Path) -> None:
    """Of a file, of the cycle in a parameter file and of a part of it; another cycle leaves that road."""
    (tmp_path / "hill.csv").write_text(HILL, encoding="utf-8")
    hill, level = DriveCycle.from_csv(tmp_path / "hill.csv"), ElectricCar()
    (tmp_path / "car.toml").write_text('class = "ElectricCar"\n[cycle]\ncycle = "hill.csv"\n', encoding="utf-8")
    own = applied(level, read(tmp_path / "car.toml"), tmp_path)[0]
    for model, cycle, span in (level, hill, None), (own, None, None), (own, None, (0.0, 20.0)):
        car, driven = spanned(model, cycle, span)
        assert driven.grades == hill.grades
        assert climbed(car) == pytest.approx(climbed(on_cycle(level, hill)))
        assert climbed(car) > 5
    assert climbed(on_cycle(spanned(own, None, None)[0], "udds")) == 0


def test_a_road_of_ones_own_stays_with_a_level_cycle() -> None:
    road = {"road.profile": pt.Map.constant(0.1, x="s", x_unit="m", name="grade")}
    assert climbed(on_cycle(pt.replace(ElectricCar(), road), "udds")) == pytest.approx(5)


@pytest.mark.slow
def test_run_and_compare_climb_the_hill_of_a_cycle(tmp_path: Path) -> None:
    (tmp_path / "hill.csv").write_text(HILL, encoding="utf-8")
    (tmp_path / "car.toml").write_text('class = "ElectricCar"\n[cycle]\ncycle = "hill.csv"\n', encoding="utf-8")
    run = drive_cycle(ElectricCar(), DriveCycle.from_csv(tmp_path / "hill.csv"))
    said = f"{run.wh_per_km:.4g}"
    assert run.wh_per_km > 500
    assert said in done("run", "ElectricCar", "--cycle", str(tmp_path / "hill.csv"))
    assert said in done("run", str(tmp_path / "car.toml"))
    assert said in done("compare", "ElectricCar", "--set", "body.m=1400", "--cycle", str(tmp_path / "hill.csv"))


@pytest.mark.slow
def test_parameter_file_gives_the_same_run(ran: tuple[str, Path], short: str, tmp_path: Path) -> None:
    text, folder = ran
    out = tmp_path / "again.csv"
    again = done(
        *(
            "run",
            "SplitPathCar",
            "--cycle",
            short,
            "--params",
            str(folder / "car.toml"),
            "--out",
            str(out),
            "--signals",
            "engine.fuel",
        )
    )
    assert again.split("wrote")[0] == text.split("wrote")[0]
    fuel = pd.read_csv(out)
    assert list(fuel.columns) == ["time", "engine.fuel"]
    np.testing.assert_allclose(
        fuel["engine.fuel"].iloc[-1], pt.load(folder / "run.nc")["engine.fuel"].values[-1], rtol=1e-9
    )


@pytest.mark.slow
def test_parts_can_be_exchanged(short: str) -> None:
    text = done(
        "run",
        "SplitPathCar",
        "--cycle",
        short,
        "--set",
        "transmission.cvu=HydrostaticUnit",
        "--set",
        "engine=MappedEngine.gasoline()",
    )
    assert "HydrostaticUnit" in text
    assert "MappedEngine" in text


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("body.mass=3", "did you mean body.m"),
        ("bodi.m=3", "did you mean body.m"),
        ("body.m=-3", "body.m = -3 kg is outside its range (0, inf) kg (Mass of the vehicle"),
        ("body.m=heavy", "body.m = 'heavy' is not a number"),
        ("body.m", "write path=value"),
        ("engine=WilansEngine", "did you mean WillansEngine"),
        ("engine=Clutch", "engine must be of class Engine, which Clutch is not; choose from"),
        ("engine=WillansEngine(J=-1)", "engine: WillansEngine.J = -1 kg.m2 is outside its range"),
        ("engine=WillansEngine(Jay=1)", "engine: WillansEngine has no field Jay"),
        ("engine.displacement=2", "no parameter or component 'engine.displacement'; choose from engine.J, "),
        ("engine=2", "(it takes MappedEngine, WillansEngine); or set its parameters: engine.J, "),
        ("radius=0.3", "did you mean front.wheels.radius or rear.wheels.radius?"),
        ("front.differential.eta=0.9", "differential belongs to DrivenAxle, but front is of class LumpedAxle"),
        (
            "front.wheels.mu=0.3",
            "mu belongs to MagicFormulaWheel and SlipWheel, but front.wheels is of class RigidWheel",
        ),
        ("cycle=udds", "unknown CycleSpeed 'udds'; choose from CycleSpeed; or set cycle.cycle"),
        ("body=VehicleBody.of(3)", "body: VehicleBody has no variant 'of'; give its fields, as in VehicleBody(m=..."),
        ("engine=WillansEngine.of(3)", "WillansEngine has no variant 'of'; choose from of_displacement"),
        ("engine=WillansEngine.of_displacement(3)", "displacement = 3 m3 is outside its range (0, 0.1] m3"),
        ("engine=MappedEngine.gasolin()", "no variant 'gasolin'; choose from from_csv, gasoline, diesel"),
        ("engine=MappedEngine", "must be given"),
        ("engine=2", "engine is a component: give the name of a component"),
        ("transmission.layout=aHc", "must be one of bHa"),
        ("unit_ratio.basic_ratio=3", "cannot be set: SplitPathCar determines it"),
        ("cycle.cycle=wtlc", "unknown drive cycle 'wtlc'"),
        ("engine.curve=absent.csv", "absent.csv: cannot be read: No such file"),
    ],
)
def test_wrong_settings_are_told(setting: str, said: str, short: str) -> None:
    assert said in refused("run", "SplitPathCar", "--cycle", short, "--set", setting)


def test_wrong_arguments_are_told(short: str, tmp_path: Path) -> None:
    assert "did you mean SplitPathCar" in refused("run", "SplitPathCr")
    assert "did you mean volkswagen-golf-gti-dual-clutch or volkswagen-golf-gti-manual?" in refused("run", "golf")
    assert "did you mean hwfet?" in refused("run", "SplitPathCar", "--cycle", "hwfte")
    assert "must end in .nc or .csv" in refused("run", "SplitPathCar", "--cycle", short, "--out", "run.txt")
    assert "there is no folder" in refused(
        "run", "SplitPathCar", "--cycle", short, "--out", str(tmp_path / "no" / "run.nc")
    )
    assert "0:30 s" in refused("run", "SplitPathCar", "--cycle", short, "--span", "0:31")
    bad = tmp_path / "bad.csv"
    bad.write_text("time,speed\n0,0\n")
    assert "a time needs a unit; write time_s" in refused("run", "SplitPathCar", "--cycle", str(bad))
    toml = tmp_path / "bad.toml"
    toml.write_text("body.m = \n")
    assert "is not a TOML file" in refused("run", "SplitPathCar", "--params", str(toml))
    toml.write_text("body.m = 1300\nbody.m = 1400\n")
    assert "a value is given once" in refused("run", "SplitPathCar", "--params", str(toml))
    toml.write_text("body.m = -3\n")
    assert "bad.toml: body.m = -3 kg is outside" in refused("run", "SplitPathCar", "--params", str(toml))
    toml.write_text('class = "RearDriveCar"\n')
    assert "is for RearDriveCar" in refused("run", "SplitPathCar", "--params", str(toml))


@pytest.mark.slow
def test_cycle_that_is_too_fast_is_driven_and_told(short: str) -> None:
    """A truck of twenty tonnes with the same engine."""
    text = done("run", "SplitPathCar", "--cycle", short, "--set", "body.m=20000")
    assert "The vehicle does not follow the cycle" in text
    assert "too slow" in text


def test_failing_model_is_code_1_with_a_message(short: str) -> None:
    """The ratio that the car needs leaves the range of the unit."""
    said = refused("run", "SplitPathCar", "--cycle", short, "--set", "transmission.cvu.ratio_min=0.9", code=1)
    assert "ratio" in said


# parameter files


def test_toml_round_trip() -> None:
    pairs = {"transmission.cvu": "VBelt", "body.m": "1234.5", "clutch.mue_pos": "((0.0, 0.4), (10.0, 0.3))"}
    car = assigned(SplitPathCar(), pairs.items())
    again, paths = applied(SplitPathCar(), tomllib.loads(written(car)))
    assert {p.path: p.value for p in places(again) if p.spec} == {p.path: p.value for p in places(car) if p.spec}
    assert again == car
    assert "body.m" in paths


def test_values_of_one_part_are_set_together(tmp_path: Path) -> None:
    """The largest torque of a diesel engine lies above the default's largest power, and its power below the default's torque."""
    pairs = {"engine.w_P": "366.5", "engine.w_tau": "183", "engine.w_low": "120", "engine.P_max": "50e3"}
    engine = WillansEngine(w_P=366.5, w_tau=183.0, w_low=120.0, P_max=50e3)
    assert assigned(SplitPathCar(), pairs.items()) == SplitPathCar(engine=engine)
    lines = "".join(f"{path.partition('.')[2]} = {value}\n" for path, value in pairs.items())
    assert applied(SplitPathCar(), tomllib.loads(f"[engine]\n{lines}"))[0] == SplitPathCar(engine=engine)


@pytest.mark.parametrize(
    ("pairs", "said"),
    [
        ([("body.m", "1500"), ("body.m", "1600")], "body.m is given twice"),
        (
            [("engine.J", "0.2"), ("engine", "MappedEngine.gasoline()")],
            r"engine = MappedEngine.gasoline\(\) replaces engine.J, which is given before it; give engine first",
        ),
        ([("gearbox.gears[0].ratio", "4"), ("gearbox", "ManualGearbox")], r"replaces gearbox.gears\[0\].ratio"),
    ],
)
def test_values_that_a_later_one_would_replace(pairs: list[tuple[str, str]], said: str) -> None:
    """They were lost."""
    with pytest.raises(pt.ParameterError, match=said):
        assigned(ManualCar(), pairs)


def test_a_component_and_then_its_values() -> None:
    car = assigned(ManualCar(), [("engine", "MappedEngine.gasoline()"), ("engine.J", "0.2"), ("body.m", "1500")])
    assert (float(car.engine.J), float(car.body.m)) == (0.2, 1500.0)


def test_another_number_of_gears_in_a_file(tmp_path: Path) -> None:
    """The gears of a file replace all, and the synchronisers that they lack are an error of the model, not of the notes."""
    file = tmp_path / "car.toml"
    file.write_text(
        'class = "ManualCar"\n[[gearbox.gears]]\nratio = 3.5\n[[gearbox.gears]]\nratio = 1.9\n', encoding="utf-8"
    )
    done = CliRunner().invoke(main, ["run", str(file), "--span", "0:3"])
    assert done.exit_code in (1, 2)
    assert isinstance(done.exception, SystemExit)
    assert "but gearbox (ManualGearbox) has 2" in done.output


def test_maps_and_cycles_are_set_by_their_names(tmp_path: Path) -> None:
    """As in a parameter file; they could be set there and in Python only."""
    file = tmp_path / "full.csv"
    file.write_text("w [rad/s], tau [N.m]\n80,110\n400,160\n650,120\n", encoding="utf-8")
    car = assigned(SplitPathCar(), [("engine.curve", str(file)), ("engine.w_limit", "650"), ("cycle.cycle", "udds")])
    engine = WillansEngine(curve=pt.Map.from_csv(file), w_limit=650)
    assert car == pt.replace(SplitPathCar(), {"engine": engine, "cycle.cycle": DriveCycle.named("udds")})
    assert assigned(car, [("engine.curve", "none")]) == pt.replace(car, {"engine.curve": None})


def test_toml_has_units_and_ranges(tmp_path: Path) -> None:
    path = tmp_path / "car.toml"
    path.write_text(written(SplitPathCar()))
    line = next(line for line in path.read_text().splitlines() if line.startswith("heating_value"))
    assert line == "heating_value = 43000000.0  # J/kg, Lower heating value of the fuel, range (0, inf)"
    assert read(path)["class"] == "SplitPathCar"


def test_toml_with_dotted_keys_and_a_part_that_needs_values(tmp_path: Path) -> None:
    path = tmp_path / "car.toml"
    path.write_text('body.m = 999\nfront.final_drive.ratio = 4\n[transmission.cvu]\nclass = "CVU"\neta_ab = 0.7\n')
    car, paths = applied(SplitPathCar(), read(path))
    assert car.body._values["m"] == 999
    assert paths == ["body.m", "front.final_drive.ratio", "transmission.cvu.eta_ab"]
    path.write_text(
        '[transmission.differential]\nclass = "FundamentalDifferential"\n[clutch]\nclass = "Clutch"\nfn_max = 5\n'
    )
    car, _ = applied(SplitPathCar(), read(path))
    assert car.clutch._values["fn_max"] == 5


# map, split-path, reproduce


def test_map_of_the_split_path_transmission(tmp_path: Path) -> None:
    text = done(
        *("map", "SplitPathCar", "--of", "transmission", "--set", "transmission.layout=aHb"),
        *("--ratio", "0.5:1.9:8", "--load", "20:60:3"),
        *("--out", str(tmp_path / "map.csv"), "--plot", str(tmp_path / "map.png")),
    )
    assert "positive recirculation" in text
    table = pd.read_csv(tmp_path / "map.csv")
    assert len(table) == 24
    first = table[(table.r == 0.5) & (table.load == 20)].iloc[0]
    assert pytest.approx(0.685, abs=5e-4) == first.V  # Yu & Beachley, Fig. 11
    assert 0.79 < first.efficiency < 0.80
    assert (tmp_path / "map.png").read_bytes().startswith(PNG)


def test_map_of_a_layout(tmp_path: Path) -> None:
    out = tmp_path / "map.nc"
    done(
        "map",
        "SplitPathTransmission",
        "--set",
        "layout=abH",
        "--ratio",
        "0.5:0.9:5",
        "--load",
        "20:60:2",
        "--out",
        str(out),
    )
    assert set(pt.load(out)["case"].values.ravel()) <= {"split", "positive recirculation", "negative recirculation"}
    assert "has no SplitPathTransmission" in refused("map", "RearDriveCar", "--of", "transmission")
    assert "r = 0" in refused("map", "SplitPathCar", "--of", "transmission", "--ratio", "0:1:5")


def test_the_ending_of_a_map_may_be_in_capitals(tmp_path: Path) -> None:
    few = ("map", "SplitPathTransmission", "--ratio", "0.5:0.9:3", "--load", "20:60:2")
    done(*few, "--out", str(tmp_path / "map.CSV"))
    done(*few, "--out", str(tmp_path / "map.csv"))
    assert (tmp_path / "map.CSV").read_text(encoding="utf-8") == (tmp_path / "map.csv").read_text(encoding="utf-8")


@pytest.mark.slow
def test_map_of_a_driveline_with_a_cycle(short: str, tmp_path: Path) -> None:
    out, plot = tmp_path / "map.nc", tmp_path / "map.png"
    few = ("--speed", "20:110:7", "--pedals", "10")
    text = done("map", "SplitPathCar", *few, "--cycle", short, "--out", str(out), "--plot", str(plot))
    assert "from the tank to the road" in text
    found = pt.load(out)
    assert dict(found.sizes) == {"speed": 7, "accelerator": 10}
    assert found["speed"].attrs["units"] == "m/s"
    assert 0.15 < float(found["efficiency"].max()) < 0.38  # less than the engine's indicated efficiency
    assert plot.read_bytes().startswith(PNG)


@pytest.mark.slow
def test_run_draws_the_map_under_its_cycle(short: str, tmp_path: Path) -> None:
    plot = tmp_path / "map.png"
    text = done("run", "SplitPathCar", "--cycle", short, "--map", str(plot))
    assert "from the tank to the road" in text
    assert "100% of" in text
    assert plot.read_bytes().startswith(PNG)


@pytest.mark.slow
def test_run_of_what_stands(tmp_path: Path) -> None:
    plot = tmp_path / "run.png"
    text = done("run", "SplitPathCar", "--span", "0:8", "--plot", str(plot))
    assert re.search(r"consumption +-  l/100 km", text)
    assert plot.read_bytes().startswith(PNG)


@pytest.mark.slow
def test_run_of_what_drives_without_the_engine(tmp_path: Path) -> None:
    plot = tmp_path / "run.png"
    text = done("run", "FlywheelHybrid", "--span", "0:20", "--plot", str(plot))
    assert re.search(r"consumption, corrected to equal charge \(flywheel\) +-  l/100 km", text)
    assert re.search(r"mean efficiency of the engine +-  1", text)


@pytest.mark.slow
def test_run_far_from_equal_charge_is_not_corrected() -> None:
    """A plug-in hybrid burns fuel above 36 m/s only, for seconds of the WLTC; on the way, a hybrid is near its charge."""
    text = done("run", "ParallelHybrid.plug_in()")
    assert re.search(r"consumption, corrected to equal charge \(battery\) +-  l/100 km", text)
    far = r"the battery gave 2\d\d\d% of the fuel's energy, too far from equal charge"
    assert re.search(far, text.replace("\n", " "))
    assert "No consumption at equal charge" not in done("run", "ParallelHybrid", "--span", "0:500")


def test_run_from_another_charge(short: str, tmp_path: Path) -> None:
    out = tmp_path / "run.csv"
    done("run", "ElectricCar", "--cycle", short, "--start", "battery.soc=0.95", "--out", str(out))
    assert pd.read_csv(out)["battery.soc"].iloc[0] == pytest.approx(0.95)


@pytest.mark.slow
def test_performance_from_another_charge() -> None:
    """Nearly empty, the battery limits both the top speed, which is 200 km/h, and the slope, which is 62 %."""
    text = done("performance", "ElectricCar", "--start", "battery.soc=0.032")
    top, slope = (float(re.search(rf"{what} +(\S+)", text)[1]) for what in ("top speed", "gradeability"))  # type: ignore[index]
    assert top < 60
    assert slope < 40
    text = refused("performance", "ElectricCar", "--start", "battery.soc=0.02", code=1)
    assert "it covers 0 m in 60 s. battery delivers nothing: its state of charge of 0.02" in text


@pytest.mark.parametrize(
    ("start", "said"),
    [
        (
            "battery.soc=95",
            "--start: battery.soc = 95 is outside its range, 0 (empty) to 1 (full); write 0.95 for 95 %",
        ),
        (
            "battery.soc=0",
            "--start: battery.soc = 0: an empty battery cannot supply the accessories; start above battery",
        ),
        ("battery.soc=0.9 V", "--start: battery.soc = '0.9 V': V cannot be converted to 1"),
        ("battery.socc=0.9", "--start: the model has no variable battery.socc; did you mean battery.soc"),
        ("battery.soc", "--start 'battery.soc': write path=value, such as battery.soc=0.95"),
    ],
)
def test_starts_that_cannot_be(short: str, start: str, said: str) -> None:
    assert said in refused("run", "ElectricCar", "--cycle", short, "--start", start)


def test_every_command_with_starts_refuses_them(short: str) -> None:
    start, said = ("--start", "battery.socc=0.9"), "--start: the model has no variable battery.socc"
    assert said in refused("view", "ElectricCar", "--cycle", short, *start)
    assert said in refused("performance", "ElectricCar", *start)


def test_a_variable_that_is_set_as_a_parameter(short: str) -> None:
    said = refused("run", "ElectricCar", "--cycle", short, "--set", "battery.soc=0.9")
    assert "ElectricCar.battery.soc is a variable, not a parameter" in said
    assert "powertrain run --start battery.soc=VALUE" in said


@pytest.mark.slow
def test_the_correction_to_equal_charge_holds_from_any_charge() -> None:
    """Consumptions from 0.55 and 0.65 differ by 0.8 l/100 km, the corrected ones by 0.1: marginal efficiency is not constant."""
    found = []
    for soc in (0.55, 0.65):
        text = done("run", "PowerSplitHybrid", "--cycle", "udds", "--span", "0:500", "--start", f"battery.soc={soc}")
        lines = [line.split() for line in text.splitlines() if line.lstrip().startswith("consumption")]
        found.append([float(line[-3]) for line in lines])
    (raw, corrected), (other, same) = found
    assert raw - other > 0.7
    assert corrected == pytest.approx(same, rel=0.05)


@pytest.mark.slow
def test_run_calculates_backward(short: str) -> None:
    text = done("run", "SplitPathCar", "--cycle", short, "--backward")
    said = text.partition("Backward, from steady operating points")[2].split()
    forward = next(line.split()[1] for line in text.splitlines() if line.split()[:1] == ["fuel"])
    assert said[:1] == ["fuel"]
    assert float(said[1]) == pytest.approx(float(forward), rel=0.2)  # half a minute of transients
    assert float(said[-1].rstrip("%")) == pytest.approx(
        100 * (float(said[1]) / float(forward) - 1), abs=0.1
    )  # four digits
    assert "Backward" in done("run", "ManualCar", "--cycle", short, "--backward")
    depend = "depend on the history of control (PowerSplitControl): control.running. Simulate it with drive_cycle"
    assert depend in refused("run", "PowerSplitHybrid", "--cycle", short, "--backward")
    assert "Give a value for control.running: held=" in refused("map", "PowerSplitHybrid", code=1)
    assert "is not PATH=NUMBER" in refused("map", "PowerSplitHybrid", "--held", "control.running")


@pytest.mark.slow
def test_performance_is_that_of_the_signals(tmp_path: Path) -> None:
    out, plot = tmp_path / "acceleration.csv", tmp_path / "acceleration.png"
    text = done("performance", "SplitPathCar", "--set", "body.m=1500", "--out", str(out), "--plot", str(plot))
    said = {what: float(value) for what, value in re.findall(r"^  (\S.*?)  +([\d.]+)  ", text, re.MULTILINE)}
    data = pd.read_csv(out)
    v = data["body.v"] * 3.6
    times = {speed: float(data.time[v >= speed].iloc[0]) for speed in (50, 80, 100, 120)}
    assert said["0 to 50 km/h"] == pytest.approx(times[50], abs=0.06)  # three digits, hundredths of a second
    assert said["0 to 100 km/h"] == pytest.approx(times[100], abs=0.06)
    assert said["80 to 120 km/h"] == pytest.approx(times[120] - times[80], abs=0.06)
    assert said["top speed"] == pytest.approx(v.max(), abs=0.5)
    assert said["0 to 100 km/h"] > 10  # 9.1 s with 1,300 kg
    assert 40 < said["gradeability"] < 60  # 62 % with 1,300 kg
    assert plot.read_bytes().startswith(PNG)


def test_performance_of_what_cannot_be_measured() -> None:
    assert "did you mean body.m" in refused("performance", "ManualCar", "--set", "body.mm=3")
    assert "cannot be set" in refused("performance", "SplitPathCar", "--set", "unit_ratio.basic_ratio=3")


@pytest.mark.slow
@pytest.mark.parametrize("name", [entry.name for entry in vehicles()])
def test_performance_of_every_vehicle_with_a_driver(name: str) -> None:
    text = done("performance", name)
    assert "-" not in text.split()  # every speed is reached


@pytest.mark.slow
def test_split_path_ranks_designs(tmp_path: Path) -> None:
    out = tmp_path / "designs.csv"
    text = done(
        *(
            "split-path",
            "--ratio",
            "0.5:2",
            "--unit",
            "0.4:2.5",
            "--basic",
            "-2:-1:3",
            "--coupling",
            "input",
            "--no-combinations",
        ),
        *("--top", "3", "--refine", "--teeth", "--out", str(out)),
    )
    assert "R_o =" in text
    assert "sun" in text
    table = pd.read_csv(out)
    assert len(table) == 18
    best = table.mean_efficiency[0]
    assert (table[table.feasible].mean_efficiency <= best).all()


def test_split_path_with_a_duty(tmp_path: Path) -> None:
    duty = tmp_path / "duty.csv"
    duty.write_text("r,weight\n0.6,1\n1.5,3\n")
    few = ("--basic", "-2:-1.5:2", "--coupling", "input", "--no-combinations")
    assert "any V" in done("split-path", "--duty", str(duty), *few)
    duty.write_text("r,share\n0.6,1\n")
    assert "columns r (required), weight" in refused("split-path", "--duty", str(duty), *few)
    assert "the first number must be less than the second" in refused("split-path", "--ratio", "2:0.5")
    assert "low:high" in refused("split-path", "--ratio", "2")


@pytest.mark.slow
def test_split_path_with_maps_duties_and_pictures(tmp_path: Path) -> None:
    """A unit by its map, two duties with shares, a drawing; the same for the space of auxiliary gears and ranges."""
    for name, r in (("field", (0.1, 0.4)), ("road", (0.5, 1.5))):
        rows = "".join(f"{x},1,{100 / x},200\n" for x in r)
        (tmp_path / f"{name}.csv").write_text(f"r,weight,torque,speed\n{rows}")
    unit = tmp_path / "unit.csv"
    unit.write_text("ratio [1],efficiency [1]\n-1,0.85\n0,0.7\n1,0.85\n")
    few = ("--ratio", "0.1:1.5", "--unit-map", str(unit), "--top", "2")
    both = ("--duty", f"{tmp_path / 'field.csv'}:3", "--duty", str(tmp_path / "road.csv"))
    picture = tmp_path / "best.png"
    done(
        "split-path",
        *few,
        *both,
        "--basic",
        "-3:-0.5:3",
        "--no-combinations",
        "--coupling",
        "input",
        "--plot",
        str(picture),
    )
    assert picture.read_bytes()[:4] == PNG
    assert "there is no file" in refused("split-path", "--duty", "nothing.csv:2")
    assert "the share 'much' of the delivered energy is not a number" in refused(
        "split-path", "--duty", f"{tmp_path / 'road.csv'}:much"
    )
    assert "low:high" in refused("split-path", "--space", "--unit", "3")


@pytest.mark.slow
def test_split_path_space(tmp_path: Path) -> None:
    table, picture = tmp_path / "space.csv", tmp_path / "best.png"
    text = done(
        "split-path", "--space", "--ratio", "0.2:1.5", "--top", "3", "--out", str(table), "--plot", str(picture)
    )
    assert "mechanical points" in text
    assert picture.read_bytes()[:4] == PNG
    assert {"structure", "unit_size", "mean_efficiency", "front"} <= set(pd.read_csv(table).columns)


@pytest.mark.slow
def test_split_path_without_a_solution() -> None:
    few = ("--basic", "-2:-1.5:2", "--coupling", "input", "--no-combinations", "--unit", "1.1:1.2")
    assert "no design meets the requirements" in refused("split-path", *few, code=1)


def test_reproduce_knows_its_papers() -> None:
    assert "did you mean yu-beachley" in refused("reproduce", "yu-beachly")


@pytest.mark.slow
def test_reproduce_prints_and_writes(tmp_path: Path) -> None:
    text = done("reproduce", "yu-beachley", "--out", str(tmp_path), "--no-pictures")
    assert "39.4" in text
    assert "agree with the print" in text
    assert (tmp_path / "yu-beachley.md").is_file()


@pytest.mark.slow
def test_what_cannot_be_written_is_refused_before_the_simulation(
    tmp_path: Path, short: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def simulated(*_: object, **__: object) -> None:
        raise AssertionError("simulated")

    monkeypatch.setattr(pt.Plant, "simulate", simulated)
    run = ("run", "SplitPathCar", "--cycle", short)
    out = str(tmp_path / "y.csv")
    assert "no signal engin.*; did you mean engine" in refused(*run, "--out", out, "--signals", "engin.*")
    assert "--signals selects what --out writes" in refused(*run, "--signals", "engine.*")
    assert "cannot be written" in refused(*run, "--out", "/proc/y.csv")
    assert "cannot be written: File name too long" in refused(*run, "--out", str(tmp_path / f"{'y' * 300}.csv"))
    monkeypatch.setattr("powertrain.export.find_spec", lambda _: None)
    assert "netCDF4 is not installed" in refused(*run, "--out", str(tmp_path / "y.nc"), code=1)
    assert not list(tmp_path.iterdir())


def test_ctrl_c_keeps_and_writes_what_was_reached(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    simulate, out = pt.Plant.simulate, tmp_path / "y.csv"

    def interrupted(plant: Any, stop: float, *, progress: Callable[[pt.Present[Any]], None], **options: Any) -> Any:
        def watch(now: pt.Present[Any]) -> None:
            if now.time > 10.0:
                os.kill(os.getpid(), signal.SIGINT)
            progress(now)

        monkeypatch.setattr("powertrain.engine.loop._throttled", lambda watch: watch)
        return simulate(plant, stop, progress=watch, **options)

    monkeypatch.setattr(pt.Plant, "simulate", interrupted)
    text = refused("run", "SplitPathCar", "--cycle", "wltc", "--out", str(out), "--signals", "body.v", code=130)
    assert "the run ended at 1" in text
    assert "interrupted" in text
    assert f"wrote {out}" in text
    assert 10.0 < pd.read_csv(out)["time"].iloc[-1] < 20.0


def test_ctrl_c_elsewhere_ends_with_130(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("powertrain.compile", interrupted)
    assert "interrupted" in refused("run", "SplitPathCar", code=130)
