"""What every test of bad input asks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import powertrain as pt


def refused(kind: type[pt.PowertrainError], *said: str, do: Callable[[], Any]) -> str:
    """The message of the error that ``do`` raises, which must contain all of ``said``."""
    with pytest.raises(kind) as caught:
        do()
    message = str(caught.value)
    for text in said:
        assert text in message, f"{text!r} is not in:\n{message}"
    return message
