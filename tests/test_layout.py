"""The layout and the direction of imports: powertrain <- components <- vehicles <- examples."""

from __future__ import annotations

import ast
import graphlib
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

import powertrain as pt

ROOT = Path(__file__).parents[1]
PACKAGES = {"powertrain": "powertrain", "components": "powertrain.components", "vehicles": "powertrain.vehicles"}

# A core module imports modules of its own row and of rows above it. A new module gets its place here.
ORDER = [
    "errors interruption lazy",
    "language: units symbols htmltext tables reals readonly",
    "language: dimensions",
    "language: quantities labelled",
    "language: arguments",
    "language: texttable",
    "language: gridtable",
    "language: recorder",
    "language: checks makers conditions",
    "language: law",
    "language: fields",
    "language: component",
    "language: packing",
    "language: connectors",
    "language: laws",
    "language: replacing",
    "language: cutting",
    "language: map",
    "dae: tolerances",
    "dae: hybrid",
    "dae: friction contact switch when",
    "numerics: tape buffers lookup hoisting vertex_elimination pivots sparse_lu newton elimination compiled background vectorised least",
    "numerics: batch many newton_abreast",
    "numerics: replay folding",
    "compiler: matching calls cancellation generic intervals",
    "compiler: texts operations walks flat connections flatten binding jumps domains alias index state_selection law_torques "
    "structure blocks torques resolver continuity records assemble",
    "modes: lemke",
    "modes: complementarity indicators rules projection jam guards selflocking admissible algebra uniqueness",
    "modes: resting discontinuities resolve",
    "integration: samples step_control step dopri5 rodas5p fused parts sparse_step specialized",
    "engine: catalogue waves chatter schedules trajectory location",
    "engine: continuity overlaps zeno failure prepared options limits in_c loop simulator",
    "signals present nonfinite events export saved",
    "initialization: choice conditions start_rows guesses report outdated notes initial",
    "result given_runs running plant environment",
    "native: code driver",
    "analysis: linear_model operating_point reduction perturbation linearization energy_terms quadrature jumps audit",
    "analysis: identity archive cases dispatch sweep sweeping sampling surrogate",
    "equilibrium: points placed elimination starts system search",
    "equilibrium: laws corrector beginnings continuation solutions creep operating",
    "steadystate: axes intervals known_modes rowwise results",
    "steadystate: steady_map dataset",
    "steadystate: steady gradient function",
    "variational: record unknowns objectives partials",
    "variational: functional transitions instants curvature corners mapping simultaneous saltation begin crossing sweeps second "
    "gradients floquet indices differences hessian",
    "optimal: rounding dynamics experiment fitting phases plan planning stages scheduling pareto",
    "vibration: eigenvectors energies operating_line order_map order_response",
    "vibration: eigenmodes tracking campbell",
    "power: paths circulation powergraph variator directedflow powerterms powerflow",
    "figures.layout",
    "figures.plot figures.scaledtext figures.schematic power.powerdiagram power.powerplot",
    "viewer: operating_map decimation recording document exploring comparison",
    "__init__",
    "__main__",
]
# (module, what it imports from a row below, or of what `import powertrain` shows, in the function that needs it)
LATER = {
    ("result", "figures.plot"),
    ("result", "explore"),
    ("plant", "optimal.dynamics"),
    ("plant", "native.code"),
    ("plant", "native.driver"),
    ("power.powerflow", "power.powerdiagram"),
}


def row_names(row: str) -> list[str]:
    """The modules of a row: 'engine: a b' are engine.a and engine.b."""
    package, colon, names = row.rpartition(":")
    return [f"{package}.{name}" if colon else name for name in names.split()]


RANK = {name: rank for rank, row in enumerate(ORDER) for name in row_names(row)}
PROGRAMS = ["trials", "design", "reproductions", "measured", "presets", "cli"]
"""Programs about components and vehicles. Each imports from the core, the components, the vehicles and the programs before it."""
THIRD_PARTY = {"casadi", "numpy", "scipy"}
DRAWN = {"figures", "animation"}
"""Modules of the components that may draw; no package imports them by itself."""


def modules(folder: str) -> list[Path]:
    """The Python files of a top-level folder; for the core without its two links."""
    links = [ROOT / "powertrain" / name for name in ("components", "vehicles")]
    found = (ROOT / folder).rglob("*.py")
    return sorted(path for path in found if not any(path.is_relative_to(link) for link in links))


def imports(path: Path) -> Iterator[tuple[str, str]]:
    """What a file imports anywhere in its text, with the place; ``from powertrain import x`` gives ``powertrain.x``."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"), str(path))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: relative imports would bind to the folder's name"
            module = node.module or ""
            inside = module == "powertrain" or (ROOT / module.replace(".", "/")).is_dir()
            names = [f"{module}.{alias.name}" for alias in node.names] if inside else [module]
        else:
            continue
        yield from ((name, f"{path.relative_to(ROOT)}:{node.lineno}: {name}") for name in names)


def within(module: str, *packages: str) -> bool:
    return any(module == package or module.startswith(f"{package}.") for package in packages)


def short(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts[1:])


def test_packages_listed_are_the_folders() -> None:
    setup = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]
    folders = {
        ".".join((package, *path.parent.relative_to(ROOT / folder).parts))
        for folder, package in PACKAGES.items()
        for path in modules(folder)
    }
    assert set(setup["packages"]) == folders
    assert setup["package-dir"] == {package: folder for folder, package in PACKAGES.items()}


def core() -> list[Path]:
    return [path for path in modules("powertrain") if path.relative_to(ROOT).parts[1] not in PROGRAMS]


@pytest.mark.parametrize("path", core(), ids=short)
def test_core_imports_go_up_the_order(path: Path) -> None:
    name = short(path)
    if name.endswith(".__init__"):
        assert not list(imports(path))[1:], f"{path} only says what the package is"
        return
    assert name in RANK, f"give powertrain/{name}.py its place in ORDER"
    for module, place in imports(path):
        assert not within(module, "powertrain.components", "powertrain.vehicles"), f"{place} is not known to the core"
        if name != "__init__" and within(module, "powertrain") and module != "powertrain.__version__":
            target = module.removeprefix("powertrain.")
            if (name, target) in LATER and target in pt.__all__:
                continue  # by what `import powertrain` shows
            assert target in RANK, f"{place} is no module in ORDER (import the module, not the package)"
            assert RANK[target] <= RANK[name] or (name, target) in LATER, f"{place} comes after {name} in ORDER"


@pytest.mark.parametrize("program", PROGRAMS)
def test_programs_import_programs_before_them(program: str) -> None:
    later = [f"powertrain.{name}" for name in PROGRAMS[PROGRAMS.index(program) + 1 :]]
    for path in modules(f"powertrain/{program}"):
        for module, place in imports(path):
            assert not within(module, *later, "examples", "tests", "components", "vehicles"), place


@pytest.mark.parametrize("path", modules("components"), ids=short)
def test_components_use_what_powertrain_shows(path: Path) -> None:
    import powertrain

    public = {f"powertrain.{name}" for name in powertrain.__all__}
    for module, place in imports(path):
        if within(module, "powertrain"):
            allowed = module == "powertrain" or module in public or within(module, "powertrain.components")
            allowed |= path.name == "__init__.py" and within(module, "powertrain.lazy")  # finds the package's own names
            assert allowed, f"{place} is not shown by `import powertrain`"
        else:
            first = module.partition(".")[0]
            known = THIRD_PARTY | ({"matplotlib", "mpl_toolkits"} if path.stem in DRAWN else set())
            assert first in known | sys.stdlib_module_names, f"{place}: components do without"


@pytest.mark.parametrize("path", modules("vehicles"), ids=short)
def test_vehicles_do_not_import_programs(path: Path) -> None:
    if path.name == "__init__.py":  # shows what the presets hold, when it is asked for
        return
    for module, place in imports(path):
        programs = [f"powertrain.{name}" for name in PROGRAMS]
        assert not within(module, *programs, "examples", "tests", "components", "vehicles"), place


def test_no_circles() -> None:
    """Imports of all kinds, in functions and for types, too; packages that only pass names on do not count."""
    files = {full_name(path): path for folder in PACKAGES for path in modules(folder) if path.name != "__init__.py"}
    needed = {name: {m for m, _ in modules_imported(path, files) if m != name} for name, path in files.items()}
    graphlib.TopologicalSorter(needed).prepare()


def test_no_circles_among_packages() -> None:
    """Of the core: each folder counts as a whole."""
    files = {full_name(path): path for path in core() if path.name != "__init__.py"}
    needed: dict[str, set[str]] = {}
    for name, path in files.items():
        others = {
            package(m) for m, _ in modules_imported(path, files) if (short(path), m.partition(".")[2]) not in LATER
        }
        needed.setdefault(package(name), set()).update(others - {package(name)})
    graphlib.TopologicalSorter(needed).prepare()


def package(module: str) -> str:
    """The folder of a module of the core, or the module itself beside the folders."""
    return ".".join(module.split(".")[:2])


def full_name(path: Path) -> str:
    folder, *inside = path.relative_to(ROOT).with_suffix("").parts
    return ".".join([PACKAGES[folder], *inside])


def modules_imported(path: Path, files: dict[str, Path]) -> Iterator[tuple[str, str]]:
    """The modules among ``files`` that a module imports, with the place."""
    for name, place in imports(path):
        module = name if name in files else name.rpartition(".")[0]
        if module in files:
            yield module, place


def test_no_module_has_a_public_name() -> None:
    """Importing it would put the module in the name's place."""
    assert not {path.stem for path in (ROOT / "powertrain").iterdir()} & set(pt.__all__)


@pytest.mark.parametrize("folder", ["components", "vehicles"])
def test_folder_cannot_be_imported_by_its_own_name(folder: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT))
    with pytest.raises(ImportError, match=f"import powertrain.{folder}"):
        __import__(folder)


def test_checkout_without_links(tmp_path: Path) -> None:
    """Where a file system has no links, git leaves a file with the link's text in its place."""
    for folder in PACKAGES:
        (tmp_path / folder).mkdir()
        for path in modules(folder):
            target = tmp_path / path.relative_to(ROOT)
            target.parent.mkdir(exist_ok=True)
            shutil.copy(path, target)
    for link in "components", "vehicles":
        (tmp_path / "powertrain" / link).write_text(f"../{link}", encoding="utf-8")
    program = "import powertrain.components as parts, powertrain.vehicles; print(parts.__name__, parts.__file__)"
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["powertrain.components", str(tmp_path / "components" / "__init__.py")], done.stderr


def test_tests_share_what_is_in_helper_modules() -> None:
    """A test file imported by another one would drag its own parametrisation and its marks along."""
    tests = (ROOT / "tests").rglob("test_*.py")
    assert not [place for path in tests for name, place in imports(path) if name.startswith("test_")]
