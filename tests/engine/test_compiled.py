"""The cache of compiled steps: damaged entries are rebuilt, foreign ones are not loaded, and without a cache the run goes on."""

from __future__ import annotations

import os
import platform
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from powertrain.errors import PowertrainError
from powertrain.numerics import compiled
from powertrain.numerics.compiled import compile_functions

pytestmark = pytest.mark.skipif(not (shutil.which("cc") or shutil.which("gcc")), reason="no C compiler on this machine")


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("POWERTRAIN_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache" / "compiled"


def doubled(name: str = "powertrain_doubled") -> dict[str, ca.Function]:
    x = ca.SX.sym("x")
    return {"f": ca.Function(name, [x], [2 * x + ca.sin(x)])}


def libraries(cache: Path) -> list[Path]:
    return sorted(cache.glob("*.so"))


# A damaged library may end the interpreter, so that it is loaded in another one.
LOAD = """
import casadi as ca
from powertrain.numerics.compiled import compile_functions
x = ca.SX.sym("x")
print(float(compile_functions({"f": ca.Function("powertrain_doubled", [x], [2 * x + ca.sin(x)])})["f"](0.0)))
"""


def loaded_elsewhere() -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", LOAD], capture_output=True, text=True, check=False)


@pytest.mark.parametrize("damage", ["truncated", "empty", "another library"])
def test_a_damaged_library_is_rebuilt(cache: Path, damage: str) -> None:
    compile_functions(doubled())
    (library,) = libraries(cache)
    whole = library.read_bytes()
    if damage == "another library":
        compile_functions(doubled("powertrain_other"))
        (other,) = (found for found in libraries(cache) if found != library)
        shutil.copy(other, library)
    else:
        library.write_bytes(whole[: len(whole) // 2 if damage == "truncated" else 0])
    done = loaded_elsewhere()
    assert (done.returncode, done.stdout.split()) == (0, ["0.0"]), done.stderr
    assert library.read_bytes() == whole


@pytest.mark.parametrize("text", ["", "../../elsewhere", "0" * 64])
def test_an_entry_that_names_no_library_is_written_again(cache: Path, text: str) -> None:
    compile_functions(doubled())
    (entry,) = cache.glob("*.txt")
    right = entry.read_text()
    entry.write_text(text)
    assert float(compile_functions(doubled())["f"](0.0)) == 0.0
    assert entry.read_text() == right


def test_a_second_use_does_not_compile(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compile_functions(doubled())
    monkeypatch.setattr(compiled, "_built", None)
    assert float(compile_functions(doubled())["f"](0.0)) == 0.0


def test_another_compiler_or_processor_has_an_entry_of_its_own(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compile_functions(doubled())
    monkeypatch.setattr(platform, "machine", lambda: "another")
    compile_functions(doubled())
    assert len(list(cache.glob("*.txt"))) == 2
    monkeypatch.setattr(compiled, "_version", lambda _: "cc 99.0")
    compile_functions(doubled())
    assert len(list(cache.glob("*.txt"))) == 3


@pytest.mark.skipif(os.name != "posix", reason="rights of POSIX")
def test_the_folder_is_its_owners_alone(cache: Path) -> None:
    before = os.umask(0)
    try:
        compile_functions(doubled())
        assert stat.S_IMODE(cache.stat().st_mode) == 0o700
        cache.chmod(0o777)
        compile_functions(doubled())
        assert stat.S_IMODE(cache.stat().st_mode) == 0o700
    finally:
        os.umask(before)


@pytest.mark.skipif(os.name != "posix", reason="rights of POSIX")
def test_a_folder_of_another_user_is_not_used(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compile_functions(doubled())
    monkeypatch.setattr(os, "getuid", lambda: cache.stat().st_uid + 1)
    functions = doubled()
    with pytest.warns(RuntimeWarning, match=r"compile=True has no effect .*belongs to another user.*POWERTRAIN_CACHE"):
        assert compile_functions(functions)["f"] is functions["f"]


def test_without_a_place_to_write_the_functions_stay_as_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("POWERTRAIN_CACHE", str(tmp_path / "file" / "cache"))
    functions = doubled()
    with pytest.warns(RuntimeWarning, match="POWERTRAIN_CACHE"):
        assert compile_functions(functions)["f"] is functions["f"]


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("/nowhere/cc", "/nowhere/cc cannot be run"),
        ("'cc", "CC is not a command"),
        ("false", "the C compiler false failed with exit status 1"),
    ],
)
def test_a_compiler_that_does_not_work_is_named(
    cache: Path, monkeypatch: pytest.MonkeyPatch, command: str, said: str
) -> None:
    monkeypatch.setenv("CC", command)
    with pytest.raises(PowertrainError, match=said):
        compile_functions(doubled())


def test_a_compiler_may_have_arguments(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "cc -pipe")
    assert float(compile_functions(doubled())["f"](0.0)) == 0.0
    assert len(libraries(cache)) == 1


def test_a_compiler_may_lie_in_a_folder_with_spaces(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "with a space"
    folder.mkdir()
    (folder / "cc").symlink_to(str(shutil.which("cc") or shutil.which("gcc")))
    for command in str(folder / "cc"), f"'{folder / 'cc'}' -pipe":
        monkeypatch.setenv("CC", command)
        assert float(compile_functions(doubled())["f"](0.0)) == 0.0


def test_minima_and_maxima_are_those_of_the_library(cache: Path) -> None:
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    interpreted = ca.Function("powertrain_limits", [a, b], [ca.fmin(a, b), ca.fmax(a, b)])
    machine_code = compile_functions({"f": interpreted})["f"]
    numbers = (1.0, -1.0, 0.0, 2.5, np.nan, np.inf, -np.inf)
    for x in numbers:
        for y in numbers:
            np.testing.assert_array_equal(machine_code(x, y), interpreted(x, y))


def test_the_compiler_of_a_package_serves_where_the_machine_has_none(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("ziglang")
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    assert compiled.compiler() == (sys.executable, "-m", "ziglang", "cc")
    assert float(compile_functions(doubled())["f"](0.5)) == pytest.approx(1.0 + np.sin(0.5), rel=1e-15)
    assert libraries(cache)
