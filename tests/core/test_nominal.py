"""The nominal size of a variable: what the absolute tolerance of its state counts in."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
import pytest

import powertrain as pt


class Decay(pt.Component):
    """x runs towards sin(t), far below its nominal size."""

    x: pt.Variable = pt.variable("m", "Small quantity", start=0.0, nominal=1e-6)
    y: pt.Variable = pt.variable("m", "The same, larger", start=0.0, nominal=1.0)
    k: pt.Parameter = pt.parameter("1", "Factor", default=1e6)

    def equations(self) -> pt.Equations:
        """der(x) = 1e-6 cos(t) - (x - 1e-6 sin(t)), and the same for y = k x."""
        yield pt.der(self.x) == 1e-6 * ca.cos(pt.time) - (self.x - 1e-6 * ca.sin(pt.time))
        yield pt.der(self.y) == ca.cos(pt.time) - (self.y - ca.sin(pt.time))


class Geared(pt.Component):
    """Two names of one state, of which the larger has a nominal size."""

    w: pt.Variable = pt.variable("rad/s", "Slow side", start=1.0, prefer=True)
    fast: pt.Variable = pt.variable("rad/s", "Fast side", nominal=500.0)
    i: pt.Parameter = pt.parameter("1", "Ratio", default=5.0)

    def equations(self) -> pt.Equations:
        """fast = i w, der(w) = -w."""
        yield self.fast == self.i * self.w
        yield pt.der(self.w) == -self.w


class Shaken(pt.Component):
    """An oscillator that is shaken a little."""

    s: pt.Variable = pt.variable("m", "Position", start=1e-3)

    def equations(self) -> pt.Equations:
        """der(der(s)) = -100 s + sin(t)/10."""
        yield pt.der(pt.der(self.s)) == -100 * self.s + ca.sin(pt.time) / 10

    def initial(self) -> pt.Equations:
        """At rest."""
        yield pt.der(self.s) == 0


def test_absolute_tolerance_counts_in_nominal_sizes() -> None:
    """The error of a quantity of the order of its nominal size is that of the same quantity of the order of one."""
    plant = pt.compile(Decay())
    assert plant.compiled.dae.nominal == (1e-6, 1.0)
    run = plant.simulate(20.0, rtol=1e-9, atol=1e-7)
    small, large = (np.abs(run["x"] * 1e6 - np.sin(run.time)).max(), np.abs(run["y"] - np.sin(run.time)).max())
    assert small == pytest.approx(large, rel=1e-6)
    assert large < 1e-5


def test_nominal_size_of_a_multiple() -> None:
    """The root of an alias has the nominal size that its multiples say."""
    dae = pt.compile(Geared()).compiled.dae
    expected = {"w": 100.0, "fast": 500.0}
    assert dae.nominal[0] == pytest.approx(expected[dae.state_names[0]])


def test_tolerances_without_declaration() -> None:
    """The nominal size is 0.01, and atol equals rtol."""
    plant = pt.compile(Shaken())
    assert plant.compiled.dae.nominal == (0.01, 0.01)
    alone, given = plant.simulate(1.0, rtol=1e-5), plant.simulate(1.0, rtol=1e-5, atol=1e-5)
    assert (alone["s"] == given["s"]).all()
    assert alone.statistics["steps"] < plant.simulate(1.0, rtol=1e-5, atol=1e-7).statistics["steps"]


@pytest.mark.parametrize("size", [0.0, -1.0, math.inf, math.nan])
def test_nominal_size_is_positive(size: float) -> None:
    """Anything else is refused where the variable is declared."""
    with pytest.raises(pt.ParameterError, match=r"nominal = .* (must be positive|is not a finite number)"):
        pt.variable("m", "Quantity", nominal=size)
