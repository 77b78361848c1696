"""What the documentation is made with: executed pages, docstrings as Markdown, facts of components."""

from __future__ import annotations

import inspect
import re
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

import powertrain
from powertrain.cli.docstrings import blocks, is_equation
from powertrain.cli.facts import facts, text_of
from powertrain.components.rotational import Clutch
from powertrain.presets.catalogue import components

DOCS = Path(__file__).parents[1] / "docs"


@pytest.fixture
def made_with(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Imports a module of docs/_ext."""
    monkeypatch.syspath_prepend(str(DOCS / "_ext"))
    monkeypatch.setenv("MPLBACKEND", "Agg")
    yield import_module
    for name in ("executed", "formulas", "pagetext", "component_pages"):
        sys.modules.pop(name, None)


def page(folder: Path, *blocks: str) -> Path:
    path = folder / "page.md"
    path.write_text("# Page\n\n" + "\n\n".join(blocks) + "\n", encoding="utf-8")
    return path


def test_blocks_share_names_and_their_output_stands_below(made_with: Any, tmp_path: Path) -> None:
    executed = made_with("executed")
    draws = "```python\nimport matplotlib.pyplot as plt\n\nplt.plot([x, 1])\n```\n<!-- figure: A line. -->"
    text = page(tmp_path, "```python\nx = 41 + 1\n```", "```python\nprint(x)\n```", draws)
    assert executed.run_page(text, tmp_path / "out")["x"] == 42
    shown = executed.inserted(text.read_text(encoding="utf-8"), tmp_path / "out", "/out")
    assert "print(x)\n```\n\n```{code-block} text\n:class: printed\n\n42\n```" in shown
    assert "```{figure} /out/2.png\n:alt: A line." in shown
    assert (tmp_path / "out" / "2.png").stat().st_size > 1000


def test_figures_have_captions(made_with: Any, tmp_path: Path) -> None:
    without = page(tmp_path, "```python\nimport matplotlib.pyplot as plt\n\nplt.plot([1])\n```")
    with pytest.raises(ValueError, match="line 3: 1 figures, 0 captions"):
        made_with("executed").run_page(without, tmp_path / "out")


def test_an_error_names_the_line_of_the_page(made_with: Any, tmp_path: Path) -> None:
    fails = page(tmp_path, "```python\nx = 1\n```", "```python\n1 / 0\n```")
    with pytest.raises(ZeroDivisionError) as caught:
        made_with("executed").run_page(fails, tmp_path / "out")
    assert caught.traceback[-1].lineno + 1 == 8


@pytest.mark.parametrize(
    ("line", "formula"),
    [
        ("m a = front.f + rear.f - drag - m g sin(alpha),  tan(alpha) = grade", True),
        ("flange_a drives: tauLoss = (1 - eta_mf1) flange_a.tau + tau_bf1 sign(w_a)", True),
        ("w_rel = 0: |tau| <= peak cgeo mue_pos(0) fn;  fn <= 0: tau = 0", True),
        ("Power in is T_a w_a + T_b w_b = tauLoss w_a, which is lost. With P_2 = -T_b w_b, the power", False),
        ("For N friction faces with radii ri, ro and uniform wear cgeo = N (ro + ri)/2.", False),
        ("Hence w_large - w_h = -(Z_ring/Z_large) (w_ring - w_h): each mesh", False),
        ("T_L = -left.tau goes out to the left. The rollers wedge the cams apart.", False),
        ("The car drives.", False),
        ("Ti der(integral) = u_s - u_m + (y - v)/(k Ni)", True),
        ("Td is the time constant with which y = u in the end.", False),
    ],
)
def test_formulas_in_docstrings(line: str, formula: bool) -> None:
    assert is_equation(line) is formula


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("J der(w_rel) = tau_max", "<i>J</i> <i>w\u0307</i><sub>rel</sub> = <i>τ</i><sub>max</sub>"),
        ("der(s - r phi) <= 0", "d(<i>s</i> − <i>r</i> <i>φ</i>)/d<i>t</i> ≤ 0"),
        ("k w^2 + x^(n - 1)", "<i>k</i> <i>w</i><sup>2</sup> + <i>x</i><sup><i>n</i> − 1</sup>"),
        ("flange_b.tau = -lossPower", "flange_b.<i>τ</i> = −<i>lossPower</i>"),
        ("phi0 where it slips < 1", "<i>φ</i><sub>0</sub> where it slips &lt; 1"),
    ],
)
def test_formulas_are_typeset(made_with: Any, text: str, shown: str) -> None:
    assert made_with("formulas").typeset(text, {"lossPower"}) == shown


def test_every_line_between_formulas_is_one() -> None:
    """A condition that begins with words is indented; otherwise the page would show it as prose between two frames."""
    for entry in components():
        for paragraph in (inspect.getdoc(entry.kind) or "").split("\n\n")[1:]:
            kinds = [are_formulas for are_formulas, _ in blocks(f"\n\n{paragraph}")]
            assert (True, False, True) not in zip(kinds, kinds[1:], kinds[2:], strict=False), (
                f"{entry.name}: {paragraph}"
            )


def test_a_line_of_prose_that_begins_with_a_minus_is_no_list(made_with: Any) -> None:
    shown = made_with("pagetext").docstring(
        "It is released by (kappa - 1)/2 times the torque, or by (kappa\n- 1)/kappa times it."
    )
    assert shown.splitlines()[1] == r"\- 1)/kappa times it."


def test_a_line_of_formulas_is_one_of_statements(made_with: Any) -> None:
    shown = made_with("pagetext").docstring("A brake.\n\nw > 0: tau = limit,  w = 0: |tau| <= limit\n\nIt holds.")
    assert shown.startswith("A brake.")
    assert shown.endswith("It holds.")
    assert shown.count('<span class="statement">') == 2


def test_examples_in_docstrings_keep_their_lines() -> None:
    call, answer = (
        ">>> [round(eta, 4) for eta in HypoidGear(ratio=3.7, map_ab=None, map_ba=None).efficiencies() if eta > 0.5]",
        "[0.9732]",
    )
    assert list(blocks(f"A gear.\n\n{call}\n{answer}\n\nIt holds.")) == [
        (False, ["A gear."]),
        (True, [call, answer]),
        (False, ["It holds."]),
    ]


@pytest.mark.slow
def test_every_component_gets_a_page(made_with: Any, tmp_path: Path) -> None:
    made_with("component_pages").write_pages(tmp_path)
    clutch = (tmp_path / "components" / "rotational" / "Clutch.md").read_text(encoding="utf-8")
    assert "from powertrain.components.rotational import Clutch" in clutch
    assert "| `fn_max` | – | N | \\[0,\N{NO-BREAK SPACE}∞) | Pressing force" in clutch
    assert "Source: `components/rotational/clutch.py`, line" in clutch
    assert (tmp_path / "components" / "vehicles" / "SplitPathCar.md").is_file()


def test_every_public_name_is_in_the_reference() -> None:
    pages = "\n".join(path.read_text(encoding="utf-8") for path in (DOCS / "reference").glob("*.md"))
    shown = set(re.findall(r"^\.\. auto(?:class|function):: (\w+)$", pages, re.MULTILINE))
    named = set(re.findall(r"`pt\.(\w+)`", pages))
    assert shown | named >= set(powertrain.__all__) - {"__version__"}


def test_every_page_of_the_reference_has_an_entry() -> None:
    index = (DOCS / "reference.md").read_text(encoding="utf-8")
    for path in (DOCS / "reference").glob("*.md"):
        assert f"\nreference/{path.stem}\n" in index
        assert f"(reference/{path.name})" in index


def test_facts_are_those_of_the_declarations() -> None:
    tables = {table.title: table for table in facts(Clutch)}
    assert list(tables) == ["Parameters", "Slots and fields", "Ports", "Variables"]
    assert ("cgeo", "1", "m", "[0, inf)", "Friction radius times number of friction faces") in tables["Parameters"].rows
    text = text_of(Clutch)
    assert text.index("def equations") < text.index("def loss") < text.index("def _limit") < text.index("def _friction")
