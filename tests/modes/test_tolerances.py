"""One table of tolerances: the module and its page say the same, and no other small number stands in the core without its reason."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

from powertrain.dae import tolerances

ROOT = Path(__file__).parents[2]
PACKAGES = "modes engine integration equilibrium steadystate initialization compiler numerics".split()
SMALL, UNDERFLOW = 1e-5, 1e-100
"""Numbers between these are tolerances; smaller ones keep a division from failing."""
ARGUMENTS = {"rtol", "atol"}


def assigned(tree: ast.Module) -> dict[str, str]:
    """Names in capitals that are assigned in the module, with the text that follows them."""
    found: dict[str, str] = {}
    for one, following in pairwise([*tree.body, ast.Pass()]):
        if isinstance(one, ast.Assign):
            said = (
                following.value.value
                if isinstance(following, ast.Expr) and isinstance(following.value, ast.Constant)
                else ""
            )
            targets = [
                t for target in one.targets for t in (target.elts if isinstance(target, ast.Tuple) else [target])
            ]
            found |= {t.id: str(said) for t in targets if isinstance(t, ast.Name) and t.id.isupper()}
    return found


def test_the_page_lists_all_tolerances_with_their_values() -> None:
    page = (ROOT / "docs" / "theory" / "tolerances.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\* - `([A-Z_]+)`\n  - (\S+)\n  - \S", page, re.MULTILINE)
    names = assigned(ast.parse(Path(tolerances.__file__).read_text(encoding="utf-8")))
    assert [name for name, _ in rows] == list(names)
    assert all(names.values())
    for name, value in rows:
        assert float(value) == getattr(tolerances, name), name


def small_numbers(node: ast.AST) -> Iterator[ast.Constant]:
    """The tolerances in a piece of code; defaults of arguments are the user's."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Constant) and isinstance(child.value, float) and UNDERFLOW < child.value < SMALL:
            yield child
        elif not isinstance(child, ast.arguments):
            yield from small_numbers(child)


def test_no_tolerance_stands_anywhere_without_a_name_and_a_reason() -> None:
    for path in (p for package in PACKAGES for p in sorted((ROOT / "powertrain" / package).rglob("*.py"))):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        reasons = assigned(tree)
        for one in tree.body:
            names = [n.id for n in ast.walk(one) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
            for number in small_numbers(one):
                told = isinstance(one, ast.Assign) and all(reasons.get(name) for name in names)
                assert told, f"{path.relative_to(ROOT)}:{number.lineno}: {number.value!r} has no name, or no reason"
