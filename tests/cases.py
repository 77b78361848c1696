"""Cases that stand for their class in the ordinary suite, with the others in the slow one."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def few(cases: Iterable[Any], ordinary: int = 1) -> list[Any]:
    """Cases of ``parametrize`` of which the first are ordinary and the others slow. A tuple holds the values of several arguments."""
    return [
        case if k < ordinary else pytest.param(*case if isinstance(case, tuple) else (case,), marks=pytest.mark.slow)
        for k, case in enumerate(cases)
    ]
