"""Linear blocks against SciPy, python-control and matrix exponentials; sampled blocks against difference equations."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
import scipy.signal
from joined import joined, run
from numpy.typing import NDArray
from scipy.linalg import expm

import powertrain as pt
from powertrain.components import blocks as b

Array = NDArray[np.float64]

RANDOM = np.random.default_rng(7)
A = RANDOM.normal(size=(4, 4)) - 2 * np.eye(4)
B, C, D = RANDOM.normal(size=(4, 2)), RANDOM.normal(size=(3, 4)), RANDOM.normal(size=(3, 2))
STARTS = (1.0, -2.0, 3.0, 4.0)


class Stepped(pt.Component):
    """A linear system behind two steps."""

    first: b.Step = b.Step(startTime=0.25, offset=0.5)
    second: b.Step = b.Step(startTime=0.5, height=-3.0)
    system: b.StateSpace

    def equations(self) -> pt.Equations:
        yield pt.connect(self.first.y, self.system.u[0])
        yield pt.connect(self.second.y, self.system.u[1])


def _state_space(**given: Any) -> b.StateSpace:
    matrices: dict[str, Any] = {"A": A, "B": B, "C": C, "D": D}
    return b.StateSpace(**(matrices | given))


def test_state_space_is_its_matrix_exponential() -> None:
    result = pt.simulate(Stepped(system=_state_space(initType="InitialState", x_start=STARTS)), 1.0, rtol=1e-10)
    x, times = np.array(STARTS), (0.0, 0.25, 0.5, 1.0)
    for begin, end, u in zip(times, times[1:], ((0.5, 0.0), (1.5, 0.0), (1.5, -3.0)), strict=False):
        rest = -np.linalg.solve(A, B @ u)
        x = rest + expm(A * (end - begin)) @ (x - rest)
        y = C @ x + D @ u
        found = [result.at([end - 1e-12], f"system.y[{i}]")[0] for i in range(3)]
        np.testing.assert_allclose(found, y, atol=1e-8)


def test_state_space_starts_in_its_steady_state() -> None:
    result = pt.simulate(Stepped(system=_state_space()), 0.2)
    rest = -np.linalg.solve(A, B @ (0.5, 0.0))
    for i in range(4):
        np.testing.assert_allclose(result[f"system.x[{i}]"], rest[i], atol=1e-12)


def test_state_space_by_itself_is_the_linear_model_of_control() -> None:
    linear = pt.linearize(pt.compile(_state_space()), ["u[0]", "u[1]"], ["y[0]", "y[1]", "y[2]"])
    w = 1j * np.geomspace(0.01, 100, 9)
    wanted: Any = control.ss(A, B, C, D)(w)
    np.testing.assert_allclose(linear(w), wanted, rtol=1e-12)


def test_arrays_and_tuples_make_equal_systems() -> None:
    rows: dict[str, Any] = {
        name: tuple(map(tuple, matrix.tolist())) for name, matrix in (("A", A), ("B", B), ("C", C), ("D", D))
    }
    assert b.StateSpace(**rows) == _state_space()
    assert repr(b.StateSpace(**rows)) == repr(_state_space())
    table: Any = np.array([[0.0, 1.0], [2.0, 3.0]])
    assert b.TimeTable(table=table) == b.TimeTable(table=((0.0, 1.0), (2.0, 3.0)))


def test_replaced_matrices_have_their_own_inputs() -> None:
    smaller: Any = pt.replace(_state_space(), B=B[:, :1], D=())
    assert (len(smaller.u), len(smaller.y), len(smaller.x)) == (1, 3, 4)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"D": D[:2]}, "D must have 3 rows of 2 numbers"),
        ({"B": B[:3]}, "B must have 4 rows of 2 numbers"),
        ({"A": A[:3]}, "A must have 3 rows of 3 numbers"),
        ({"x_start": (1.0,)}, "x_start has a value for each state"),
        ({"A": A - np.outer(A[:, 0], (1, 0, 0, 0))}, "steady start needs a regular A"),
        ({"A": [[1, 2], [3]]}, "row"),
    ],
)
def test_matrices_that_do_not_fit_are_rejected(given: dict[str, Any], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=f"StateSpace.*{said}"):
        _state_space(**given)


FUNCTIONS: list[tuple[Any, Any]] = [
    scipy.signal.butter(4, 50.0, analog=True),
    scipy.signal.cheby1(5, 1.0, 2e4, analog=True),  # coefficients up to 1e21
    ((1.0, 2.0, 3.0), (2.0, 5.0, 4.0)),
    ((3.0,), (1.0, 1e-3)),
    ((1.0, 0.0), (0.1, 1.0)),
]


@pytest.mark.parametrize(("numerator", "denominator"), FUNCTIONS)
def test_transfer_function_answers_a_step_as_its_poles_do(numerator: Any, denominator: Any) -> None:
    slowest = 1 / np.abs(np.roots(denominator)).min()
    block = b.TransferFunction(b=numerator, a=denominator)
    begin = 0.1 * slowest
    result = run(joined(b.Step(height=2.0, startTime=begin), block, joints="0.y=1.u"), 8 * slowest)
    t = np.linspace(0.0, 7.8 * slowest, 100)[1:]
    residues, poles, direct = scipy.signal.residue(numerator, denominator)
    parts = [2 * (r / p * (np.exp(p * t) - 1)).real for r, p in zip(residues, poles, strict=True)]
    wanted = np.sum(parts, axis=0) + 2 * (direct[0] if len(direct) else 0.0)
    np.testing.assert_allclose(result.at(begin + t, "parts[1].y"), wanted, atol=1e-7 * np.abs(wanted).max())


@pytest.mark.parametrize(("numerator", "denominator"), FUNCTIONS)
def test_transfer_function_starts_in_its_steady_state(numerator: Any, denominator: Any) -> None:
    result = run(joined(b.Constant(k=3.0), b.TransferFunction(b=numerator, a=denominator), joints="0.y=1.u"), 1.0)
    gain = numerator[-1] / denominator[-1]
    np.testing.assert_allclose(result["parts[1].y"], 3 * gain, rtol=1e-12, atol=1e-12)
    assert result.statistics["steps"] < 60


def test_transfer_functions_that_integrate() -> None:
    """Against their linear models: an integrator with a lag, a double integrator."""
    w = 1j * np.geomspace(0.01, 100, 9)
    for denominator in ((1.0, 2.0, 0.0), (4.0, 0.0, 0.0)):
        with pytest.raises(pt.ParameterError, match="a steady start needs"):
            b.TransferFunction(b=(1.0, 2.0), a=denominator)
        plant = pt.compile(b.TransferFunction(b=(1.0, 2.0), a=denominator, initType="InitialState"))
        wanted: Any = np.polyval((1.0, 2.0), w) / np.polyval(denominator, w)
        np.testing.assert_allclose(pt.linearize(plant, ["u"], ["y"])(w), wanted, rtol=1e-12)
        assert plant.simulate(1.0, inputs={"u": 0.0})["y"][-1] == 0


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"b": (1.0, 0.0, 0.0), "a": (1.0, 1.0)}, "not of higher degree"),
        ({"b": (), "a": (1.0, 1.0)}, "not of higher degree"),
        ({"b": (1.0,), "a": (0.0, 1.0)}, "the highest power"),
        ({"b": (1.0,), "a": 3.0}, "not a row of finite numbers"),
    ],
)
@pytest.mark.parametrize("block", [b.TransferFunction, b.DiscreteTransferFunction])
def test_improper_transfer_functions_are_rejected(block: Any, given: dict[str, Any], said: str) -> None:
    period: dict[str, Any] = {"period": 0.1} if block is b.DiscreteTransferFunction else {}
    with pytest.raises(pt.ParameterError, match=f"(?s){block.__name__}.*{said}"):
        block(**given, **period)


def test_a_constant_factor_is_no_transfer_function() -> None:
    with pytest.raises(pt.ParameterError, match="a constant factor is a Gain"):
        b.TransferFunction(b=(2.0,), a=(1.0,))


WAVE = b.Sine(f=0.7, phase=1.0, offset=2.0)
T = 0.1


def _wave(t: Any) -> Array:
    return np.asarray(2 + np.sin(2 * np.pi * 0.7 * t + 1))


@pytest.mark.parametrize("start", [0.0, 0.3, 0.35, 100.7])
def test_a_hold_samples_at_the_start_and_at_multiples_of_the_period(start: float) -> None:
    """0.3/0.1 is less than 3 by round-off."""
    result = run(joined(WAVE, b.ZeroOrderHold(period=T), joints="0.y=1.u"), start + 1.0, start=start)
    instants = T * (np.floor(start / T + 1e-6) + np.arange(1, 10))
    for begin, end in zip([start, *instants], instants, strict=False):
        held = result.at([begin + 1e-9, (begin + end) / 2, end - 1e-9], "parts[1].y")
        np.testing.assert_allclose(held, _wave(begin), rtol=1e-13)
    assert result["parts[1].y"][0] == result["parts[0].y"][0]


def test_a_hold_reads_a_jump_at_its_instant_after_the_jump() -> None:
    result = run(joined(b.Step(startTime=0.3), b.ZeroOrderHold(period=T), joints="0.y=1.u"), 0.5)
    assert list(result.at([0.29, 0.31], "parts[1].y")) == [0, 1]


DISCRETE: list[tuple[Any, Any]] = [
    scipy.signal.butter(3, 0.3),
    ((1.0,), (1.0, 0.0)),
    ((0.25,) * 4, (1.0, 0.0, 0.0, 0.0)),
    ((1.0, 2.0), (2.0, 0.5, 0.3)),
    ((2.0,), (4.0,)),
]


@pytest.mark.parametrize("steady", [True, False])
@pytest.mark.parametrize(("numerator", "denominator"), DISCRETE)
def test_discrete_transfer_function_is_its_difference_equation(numerator: Any, denominator: Any, steady: bool) -> None:
    """Written out: sum a_k y_(n-k) = sum b_k u_(n-k), with what was before the start."""
    block = b.DiscreteTransferFunction(
        period=T, b=numerator, a=denominator, initType="SteadyState" if steady else "InitialState"
    )
    result = run(joined(WAVE, block, joints="0.y=1.u"), 2.0)
    order, gain = len(denominator) - 1, sum(numerator) / sum(denominator)
    padded = [0.0] * (order + 1 - len(numerator)) + list(numerator)
    samples = _wave(T * np.arange(20))
    u = [samples[0] * steady] * order + list(samples)
    y = [samples[0] * gain * steady] * order
    for n in range(order, len(u)):
        past = sum(denominator[k] * y[n - k] for k in range(1, order + 1))
        y.append((sum(padded[k] * u[n - k] for k in range(order + 1)) - past) / denominator[0])
    np.testing.assert_allclose(result.at(T * (np.arange(20) + 0.5), "parts[1].y"), y[order:], rtol=1e-12, atol=1e-12)
    at = result.time[np.flatnonzero(np.diff(result["parts[1].y"])) + 1]
    np.testing.assert_allclose(at, T * np.round(at / T), rtol=1e-14)  # it changes at samples only


def test_a_discrete_integrator_starts_at_zero() -> None:
    with pytest.raises(pt.ParameterError, match="a steady start needs a sum"):
        b.DiscreteTransferFunction(period=T, b=(1.0,), a=(1.0, -1.0))
    block = b.DiscreteTransferFunction(period=T, b=(T, 0.0), a=(1.0, -1.0), initType="InitialState")
    result = run(joined(b.Constant(k=2.0), block, joints="0.y=1.u"), 1.0)
    assert result["parts[1].y"][-1] == pytest.approx(2 * T * 11)


def test_a_chain_of_two_sampled_blocks_has_a_delay_of_one_period() -> None:
    """As the docstring says: the second sees what the first held before the instant."""
    parts = WAVE, b.ZeroOrderHold(period=T), b.ZeroOrderHold(period=T)
    result = run(joined(*parts, joints="0.y=1.u 1.y=2.u"), 1.0)
    times = T * (np.arange(1, 10) + 0.5)
    np.testing.assert_allclose(result.at(times, "parts[2].y"), result.at(times - T, "parts[1].y"), rtol=1e-13)


def test_a_sampled_loop_is_that_of_control() -> None:
    """A digital controller around a continuous plant: the plant sampled with a hold, the loop closed in z."""
    controller, plant = ((0.8, -0.6), (1.0, -0.4)), ((2.0,), (0.5, 1.3, 1.0))
    parts = (
        b.Constant(k=1.0),
        b.Feedback(),
        b.DiscreteTransferFunction(period=T, b=controller[0], a=controller[1], initType="InitialState"),
        b.TransferFunction(b=plant[0], a=plant[1], initType="InitialState"),
    )
    result = run(joined(*parts, joints="0.y=1.u1 3.y=1.u2 1.y=2.u 2.y=3.u"), 3.05)
    loop = control.tf(*controller, T) * control.sample_system(control.tf(*plant), T, method="zoh")
    wanted = control.step_response(control.feedback(loop, 1), T=T * np.arange(31)).outputs
    np.testing.assert_allclose(result.at(T * np.arange(31), "parts[3].y"), wanted, atol=1e-8)


def test_dead_zone() -> None:
    result = run(joined(b.Sine(f=1.0), b.DeadZone(uMin=-0.2, uMax=0.3), joints="0.y=1.u"), 1.0)
    u = result["parts[0].y"]
    np.testing.assert_allclose(result["parts[1].y"], u - np.clip(u, -0.2, 0.3), atol=1e-14)


def test_a_dead_zone_is_approached_without_switching() -> None:
    """der(x) = -dead(x) from 1: x = 0.1 + 0.9 exp(-t)."""
    parts = b.Gain(k=-1.0), b.Integrator(y_start=1.0), b.DeadZone(uMin=-0.1, uMax=0.1)
    result = run(joined(*parts, joints="0.y=1.u 1.y=2.u 2.y=0.u"), 40.0)
    np.testing.assert_allclose(result["parts[1].y"], 0.1 + 0.9 * np.exp(-result.time), atol=1e-8)
    assert len(result.events) == 0


@pytest.mark.parametrize(
    "source",
    [
        b.Sine(f=0.7, phase=1.0, offset=2.0),
        b.Ramp(duration=1.0, offset=-0.5),
        b.Step(height=3.33, startTime=0.5),
        b.Sine(f=1.0, amplitude=0.05),
        b.Constant(k=0.25),
        b.Constant(k=-7.77),
    ],
    ids=["sine", "ramp", "jump over many steps", "touches the first threshold", "at a threshold", "far off"],
)
def test_quantizer(source: pt.Component) -> None:
    result = run(joined(source, b.Quantizer(quantum=0.1), joints="0.y=1.u"), 1.0, points=1000)
    u, y = result["parts[0].y"], result["parts[1].y"]
    np.testing.assert_allclose(y / 0.1, np.round(y / 0.1), atol=1e-12)
    assert np.abs(y - u).max() < 0.05 + 1e-9


def test_the_steps_of_a_quantizer_are_exact_events() -> None:
    """u = t passes the thresholds at 0.05, 0.15, ...: the integral of y is that of the steps, and of the way back."""
    parts = b.Trapezoid(amplitude=1.0, rising=1.0, width=0.0, falling=1.0, period=4.0), b.Quantizer(quantum=0.1)
    result = run(joined(*parts, b.Integrator(), joints="0.y=1.u 1.y=2.u"), 2.0)
    rising = sum(0.1 * (0.1 * k) for k in range(10)) + 0.05
    assert result["parts[2].y"][-1] == pytest.approx(2 * rising, rel=1e-9)


def test_a_loop_at_a_threshold_needs_a_hold() -> None:
    """der(x) = 0.23 - Q(x) settles at x = 0.25."""
    parts = b.Constant(k=0.23), b.Feedback(), b.Integrator(), b.Quantizer(quantum=0.1)
    loop = "0.y=1.u1 3.y=1.u2 1.y=2.u"
    with pytest.raises(pt.SimulationError, match="switches without end"):
        run(joined(*parts, joints=f"{loop} 2.y=3.u"), 30.0)
    result = run(joined(*parts, b.ZeroOrderHold(period=T), joints=f"{loop} 2.y=4.u 4.y=3.u"), 30.0)
    x = result["parts[2].y"][result.time > 10]
    assert 0.24 < x.min() < x.max() < 0.26


class Chain(pt.Component):
    """All of them, one behind the other."""

    amplitude: pt.Parameter = pt.parameter("1", "Amplitude", default=1.3)
    wave: b.Sine = b.Sine(f=0.7, phase=1.0)
    dead: b.DeadZone = b.DeadZone(uMin=-0.2, uMax=0.3)
    smooth: b.TransferFunction = b.TransferFunction(b=(1.0, 3.0), a=(0.1, 0.5, 1.0))
    system: b.StateSpace = b.StateSpace(A=((-1.0, 2.0), (-3.0, -0.5)), B=((1.0,), (0.0,)), C=((1.0, 1.0),))
    filter: b.DiscreteTransferFunction = b.DiscreteTransferFunction(period=0.13, b=(1.0, 0.5), a=(1.0, -0.6))
    hold: b.ZeroOrderHold = b.ZeroOrderHold(period=0.17)
    steps: b.Quantizer = b.Quantizer(quantum=0.1)
    sums: tuple[b.Integrator, ...] = (b.Integrator(),) * 3

    def equations(self) -> pt.Equations:
        yield self.wave.amplitude == self.amplitude
        yield pt.connect(self.wave.y, self.dead.u)
        yield pt.connect(self.dead.y, self.smooth.u)
        yield pt.connect(self.smooth.y, self.system.u[0])
        yield pt.connect(self.system.y[0], self.filter.u, self.hold.u, self.steps.u)
        yield pt.connect(self.filter.y, self.sums[0].u)
        yield pt.connect(self.hold.y, self.sums[1].u)
        yield pt.connect(self.steps.y, self.sums[2].u)


SUMS = [f"sums[{i}].y" for i in range(3)]


@pytest.mark.parametrize("name", ["amplitude", "filter.period", "hold.period", "steps.quantum", "wave.f"])
def test_gradients_are_those_of_differences(name: str) -> None:
    plant, h = pt.compile(Chain()), 1e-6

    def ends(value: float) -> Array:
        result = plant.simulate(2.05, parameters={name: value}, rtol=1e-12, atol=1e-13)
        return np.array([result[s][-1] for s in SUMS])

    reference = plant.simulate(2.05, rtol=1e-11, atol=1e-12)
    value = reference.parameters[name]
    found = [pt.gradient(reference, pt.final(s), [name])[name] for s in SUMS]
    np.testing.assert_allclose(found, (ends(value + h) - ends(value - h)) / (2 * h), rtol=1e-4, atol=1e-4)


def test_repeated_runs_are_equal() -> None:
    plant = pt.compile(Chain())
    first, again = plant.simulate(3.0), plant.simulate(3.0)
    assert np.array_equal(first.time, again.time)
    assert all(np.array_equal(first[s], again[s]) for s in SUMS)


@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")
def test_runs_in_c_are_those_of_python(tmp_path: Path) -> None:
    plant = pt.compile(Chain())
    inside, outside = plant.simulate(3.0), plant.export_c(tmp_path).simulate(3.0)
    for s in SUMS:
        assert outside[s][-1] == pytest.approx(inside[s][-1], rel=1e-12)


def test_a_steady_start_of_states_that_differ_in_speed() -> None:
    """With rates of 1e-6/s and 1e12/s the matrix is regular, although its rank in double precision is one."""
    slow_and_fast = b.StateSpace(A=[[-1e-6, 0], [0, -1e12]], B=[[1e-6], [1e12]], C=[[1, 1]])  # type: ignore[arg-type]
    assert pt.simulate(slow_and_fast, 1, inputs={"u[0]": 3.0})["y[0]"][-1] == pytest.approx(6.0)
    with pytest.raises(pt.ParameterError, match="a steady start needs a regular A"):
        b.StateSpace(A=[[-1, 1], [0, 0]], B=[[1], [1]], C=[[1, 1]])  # type: ignore[arg-type]
