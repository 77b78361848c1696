"""Comparisons written as statements, such as  self.w == 0  without ``yield``: Python drops their values without a word."""

from __future__ import annotations

import dis
from functools import lru_cache
from inspect import isgeneratorfunction
from itertools import pairwise

_DROPPED = bytes((dis.opmap["COMPARE_OP"], dis.opmap["POP_TOP"]))
_CACHE = bytes((dis.opmap["CACHE"],))
"""Fills the places between two instructions."""


@lru_cache(maxsize=4096)
def dropped_comparison(kind: type) -> tuple[str, int] | None:
    """File and line of the first comparison whose value is dropped, in the methods of a class that yield its equations."""
    for function in (f for base in kind.__mro__ for f in vars(base).values() if isgeneratorfunction(f)):
        code = function.__code__
        if _DROPPED not in code.co_code[::2].replace(_CACHE, b""):
            continue
        found = list(dis.get_instructions(code))
        for instruction, after in pairwise(found):
            positions = instruction.positions
            if (instruction.opname, after.opname) == ("COMPARE_OP", "POP_TOP") and positions and positions.lineno:
                return code.co_filename, positions.lineno
    return None
