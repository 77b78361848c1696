"""Plots of results: axes, labels, legends, units, modes and events."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import powertrain as pt
from powertrain.figures.plot import axis_label, mark_events, plot_signals, unit_text
from powertrain.result import Result


class Pin(pt.Connector):
    phi: pt.Variable = pt.variable("rad", "Angle")
    tau: pt.Variable = pt.flow("N.m", "Torque")


class Disc(pt.Component):
    pin: Pin = pt.port(Pin)
    w: pt.Variable = pt.variable("rad/s", "Angular velocity")

    def equations(self) -> pt.Equations:
        yield self.w == pt.der(self.pin.phi)
        yield 2 * pt.der(self.w) == self.pin.tau


class Brake(pt.Component):
    pin: Pin = pt.port(Pin)
    w: pt.Variable = pt.variable("rad/s", "Speed of the brake")
    lossPower: pt.Variable = pt.variable("W", "Dissipated power")

    def equations(self) -> pt.Equations:
        yield self.w == pt.der(self.pin.phi)
        yield self.lossPower == self.pin.tau * self.w
        yield pt.friction(self.w, self.pin.tau, -1, 1)


class Stopping(pt.Component):
    disc: Disc = Disc()
    brake: Brake = Brake()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.disc.pin, self.brake.pin)

    def initial(self) -> pt.Equations:
        yield self.disc.w == 1


@pytest.fixture(scope="module")
def result() -> Result[Stopping]:
    return pt.simulate(Stopping(), stop=3, points=100)


def legend(ax: Axes) -> list[str]:
    box = ax.get_legend()
    assert box is not None
    return [text.get_text() for text in box.get_texts()]


def test_one_signal(result: Result[Stopping], tmp_path: Path) -> None:
    ax = result.plot("disc.w")
    (line,) = ax.lines
    assert np.array_equal(line.get_xdata(), result.time)
    assert np.array_equal(line.get_ydata(), result["disc.w"])
    assert (ax.get_xlabel(), ax.get_ylabel(), legend(ax)) == ("Time [s]", "Angular velocity [rad/s]", ["disc.w"])
    figure = ax.get_figure()
    assert isinstance(figure, Figure)
    figure.savefig(tmp_path / "plot.png")


def test_into_given_axes_with_options(result: Result[Stopping]) -> None:
    ax = plt.figure().add_subplot()
    assert plot_signals(result, "disc.w", ax=ax, color="black", linestyle=":") is ax
    result.plot("brake.w", ax=ax)
    assert [line.get_color() for line in ax.lines] == ["black", "C1"]
    assert legend(ax) == ["disc.w", "brake.w"]


def test_two_units_have_two_axes(result: Result[Stopping]) -> None:
    ax = result.plot("*.w", lambda m: m.disc.w - m.brake.w, "brake.pin.tau")
    left, right = ax.figure.axes
    assert left is ax
    assert (left.get_ylabel(), right.get_ylabel()) == ("[rad/s]", "Torque [N·m]")
    assert [line.get_linestyle() for line in (*left.lines, *right.lines)] == ["-", "-", "-", "--"]
    assert legend(right) == ["disc.w", "brake.w", "disc.w-brake.w", "brake.pin.tau"]


def test_the_legend_of_two_axes_hides_no_line(result: Result[Stopping]) -> None:
    """It stands on the right of the second axis, within the figure."""
    ax = result.plot("disc.w", "brake.pin.tau")
    ax.figure.canvas.draw()
    right = ax.figure.axes[1]
    box = right.get_legend()
    assert box is not None
    assert box.get_window_extent().x0 > right.yaxis.get_tightbbox(None).x1  # type: ignore[union-attr]
    assert box.get_window_extent().x1 <= ax.figure.bbox.x1


def test_an_axis_has_one_unit(result: Result[Stopping]) -> None:
    """What is added to axes has their unit; where the meanings differ, the label is the unit alone."""
    ax = result.plot("disc.w")
    with pytest.raises(pt.ParameterError, match=r"shows Angular velocity \[rad/s\]; plot brake\.pin\.tau \[N·m\] in"):
        result.plot("brake.pin.tau", ax=ax)
    with pytest.raises(pt.ParameterError, match=r"shows Mode; plot disc\.w \[rad/s\] in separate Axes"):
        result.plot("disc.w", ax=result.plot("brake.mode"))
    assert len(ax.lines) == 1
    assert result.plot("disc.w", ax=ax).get_ylabel() == "Angular velocity [rad/s]"
    assert result.plot("brake.w", ax=ax).get_ylabel() == "[rad/s]"
    with pytest.raises(pt.ParameterError, match="is not an Axes of matplotlib"):
        result.plot("disc.w", ax=ax.figure)  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match="events = 1 is not a string"):
        result.plot("disc.w", events=1)  # type: ignore[arg-type]


def test_a_run_that_takes_no_time_is_a_point() -> None:
    ax = pt.simulate(Stopping(), stop=0).plot("disc.w")
    assert ax.lines[0].get_marker() == "o"


def test_three_units_are_refused(result: Result[Stopping]) -> None:
    with pytest.raises(pt.ParameterError, match=r"at most two units, not disc\.w \[rad/s\]; .*lossPower \[W\]"):
        result.plot("disc.w", "brake.pin.tau", "brake.lossPower")


def test_nothing_and_unknown_names(result: Result[Stopping]) -> None:
    with pytest.raises(pt.ParameterError, match="names of signals"):
        result.plot()
    with pytest.raises(pt.ParameterError, match=r"did you mean disc\.w"):
        result.plot("disc.ww")
    assert not plt.get_fignums()


def test_modes_are_named(result: Result[Stopping]) -> None:
    ax = result.plot("brake.mode")
    assert [label.get_text() for label in ax.get_yticklabels()] == ["backward", "stuck", "forward", "free"]
    assert ax.get_ylabel() == "Mode"


def test_events_are_marked(result: Result[Stopping]) -> None:
    ax = result.plot("disc.w", events=True)
    (mark,) = ax.lines[1:]
    assert np.asarray(mark.get_xdata()) == pytest.approx(2)
    assert len(mark_events(result, ax, "brake").lines) == 3
    assert legend(ax) == ["disc.w"]


@pytest.mark.parametrize(
    ("unit", "text"),
    [("kg.m2", "kg·m²"), ("N.m.s/rad", "N·m·s/rad"), ("m.s-2", "m·s⁻²"), ("1", "1"), ("W/(m2.K)", "W/(m²·K)")],
)
def test_units_as_printed(unit: str, text: str) -> None:
    assert unit_text(unit) == text


def test_axis_labels() -> None:
    assert axis_label([("a.w", "Speed"), ("b.w", "Speed")], "rad/s") == "Speed [rad/s]"
    assert axis_label([("a.w", "Speed"), ("b.w", "Other speed")], "rad/s") == "w [rad/s]"
    assert axis_label([("a.w", "Speed"), ("b.v", "Other speed")], "rad/s") == "[rad/s]"
    assert axis_label([("a.x", "Ratio")], "1") == "Ratio"


def test_legend_of_many_signals_stands_beside_the_axes(result: Result[Stopping]) -> None:
    ax = result.plot(*["disc.w"] * 40)
    ax.figure.canvas.draw()
    box = ax.get_legend()
    assert box is not None
    legend_box = box.get_window_extent()
    assert legend_box.x0 > ax.get_window_extent().x1
    assert legend_box.x1 <= ax.figure.bbox.x1
    assert legend_box.y0 >= 0
    assert len({str(line.get_color()) for line in ax.lines}) == 40
