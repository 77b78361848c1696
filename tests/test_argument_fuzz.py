"""Whatever is given to the public functions: an answer or a PowertrainError, nothing from inside."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, note, settings
from hypothesis import strategies as st

import powertrain as pt
from powertrain.components.rotational import Inertia, Spring, Torque

WAYS = settings(
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much],
    print_blob=False,
    phases=(Phase.explicit, Phase.generate),
)


class Fuzzed(pt.Component):
    """Two inertias on a spring, driven from outside."""

    u: pt.Input = pt.signal_input("N.m", "Torque")
    source: Torque = Torque()
    J1: Inertia = Inertia(J=1.0)
    spring: Spring = Spring(c=100.0)
    J2: Inertia = Inertia(J=1.0)
    js: tuple[Inertia, ...] = (Inertia(J=1.0), Inertia(J=2.0))

    def equations(self) -> pt.Equations:
        yield pt.connect(self.u, self.source.tau)
        yield pt.connect(self.source.flange, self.J1.flange_a)
        yield pt.connect(self.J1.flange_b, self.spring.flange_a)
        yield pt.connect(self.spring.flange_b, self.J2.flange_a)


PLANT = pt.compile(Fuzzed())
RESULT = PLANT.simulate(0.1, points=5)
NAMES = ["J1.w", "J1.J", "u", "spring.tau", "js[0].w", "js[7].w", "J1", "nothing", "", "[", "J1[0].w", 3, None]
WEIRD = [
    None, True, False, -1, 0, 1, 10.5, math.nan, math.inf, -math.inf, 1e300, 1j, "text", "", "1.0", b"x", (), [], {}, {1, 2}, range(3),
    np.float64(2.0), np.array([1.0, 2.0]), np.array([]), np.array("a"), np.zeros((2, 2)), [1, "a"], [1, [2]], (1, 2, 3), [None],
    ([0, 1], [1, 2]), ([1, 0], [1, 2]), {"J1.w": "fast"}, {3: 1}, {"J1.w": math.nan}, [pt.Axis("x", "1", [0, 1])], slice(1), print,
    object(), Fuzzed, Fuzzed(), Inertia(J=1.0), PLANT, RESULT, pt.Symbol.sym("x"),
]  # fmt: skip
values = st.sampled_from(WEIRD)
mappings = st.dictionaries(st.sampled_from([n for n in NAMES if n is not None]), values, max_size=2) | values


def options(**known: st.SearchStrategy[Any]) -> st.SearchStrategy[dict[str, Any]]:
    """One or two options with odd values."""
    return st.lists(st.sampled_from(sorted(known)), max_size=2, unique=True).flatmap(
        lambda names: st.fixed_dictionaries({name: known[name] for name in names})
    )


RUN = options(
    start=values,
    stop=values,
    parameters=mappings,
    starts=mappings,
    guesses=mappings,
    inputs=mappings,
    times=values,
    points=values,
    rtol=values,
    atol=values,
    max_step=values,
    method=values,
    record=values,
    progress=values,
    tol=values,
)
unwritable = st.sampled_from([w for w in WEIRD if not isinstance(w, str | bytes) or not w] + ["/dev/null/runs", "a\0b"])
MEASURED = pt.Experiment(RESULT.time, {"J1.w": RESULT["J1.w"] + 0.1})
WANTED = values | st.sampled_from([pt.final("J1.w"), pt.maximum("J1.w"), "J1.w", pt.integral("nothing")])
NAMED = st.lists(st.sampled_from(NAMES), max_size=2) | values


def only_refused(call: Callable[[], Any]) -> None:
    """Fails on any other error."""
    said = "answered"
    try:
        call()
    except pt.PowertrainError as error:
        said = str(error)
    assert said.strip()
    assert "Possible prototypes" not in said


def a_run(given: dict[str, Any]) -> Any:
    return PLANT.simulate(**{"stop": 0.01, "points": 2, **given})


def a_sweep(given: dict[str, Any]) -> Any:
    return pt.sweep(PLANT, **{"cases": [{}], "stop": 0.01, "points": 2, **given}).table


CALLS: dict[str, tuple[st.SearchStrategy[Any], Callable[[Any], Any]]] = {
    "simulate": (RUN, a_run),
    "initialize": (
        options(t=values, parameters=mappings, starts=mappings, guesses=mappings, inputs=mappings),
        lambda o: PLANT.initialize(**o),
    ),
    "parameter_vector": (mappings, PLANT.parameter_vector),
    "compile": (values, pt.compile),
    "simulate a model": (values, lambda v: pt.simulate(v, 0.01)),
    "replace": (st.tuples(values | st.just(Fuzzed()), mappings), lambda v: pt.replace(*v)),
    "component": (
        st.dictionaries(st.sampled_from(["J", "K", "w", "flange_a", "_x"]), values, max_size=2),
        lambda o: Inertia(**o),
    ),
    "fields": (
        st.dictionaries(st.sampled_from(["J1", "js", "u", "spring"]), values, max_size=2),
        lambda o: Fuzzed(**o),
    ),
    "axis": (st.tuples(values, values, values, values), lambda v: pt.Axis(*v)),
    "map": (
        st.tuples(values, values, values),
        lambda v: pt.Map(v[0], *v[1:]),
    ),
    "curve": (
        options(x=values, x_unit=values, unit=values, outside=values, method=values),
        lambda o: pt.Map.curve([0, 1], [1, 2], **o),
    ),
    "curve of values": (st.tuples(values, values), lambda v: pt.Map.curve(*v)),
    "value of a map": (values, pt.Map.curve([0, 1], [1, 2])),
    "from_csv": (values, pt.Map.from_csv),
    "linearize": (
        options(inputs=NAMED, outputs=NAMED, at=mappings, parameters=mappings),
        lambda o: pt.linearize(PLANT, **o),
    ),
    "linearize a model": (values, pt.linearize),
    "eigenmodes": (options(shapes=NAMED, at=mappings, parameters=mappings), lambda o: pt.eigenmodes(PLANT, **o)),
    "sweep": (
        options(
            cases=values | st.lists(mappings | st.fixed_dictionaries({"parameters": mappings}), max_size=2),
            to=unwritable,
            record=NAMED,
            scalars=mappings,
            executor=values,
            on_error=values | st.just("keep"),
            progress=values,
            rtol=values,
            stop=values,
        ),
        a_sweep,
    ),
    "steady": (
        options(
            grid=mappings,
            outputs=NAMED | mappings,
            parameters=mappings,
            inputs=mappings,
            free=NAMED,
            guesses=mappings,
            time=values,
            first=values,
            side=values,
            progress=values,
        ),
        lambda o: pt.steady(PLANT, **{"grid": {"J1.w": 10.0}, "progress": False, **o}),
    ),
    "steady of a model": (st.tuples(values, values), lambda v: pt.steady(*v)),
    "steady_gradient": (
        options(
            grid=mappings, wrt=NAMED, outputs=NAMED, parameters=mappings, inputs=mappings, free=NAMED, guesses=mappings
        ),
        lambda o: pt.steady_gradient(PLANT, **{"grid": {"J1.w": 10.0}, "wrt": "J1.w", "outputs": "u", **o}),
    ),
    "power_flow": (
        options(
            grid=mappings,
            at=values,
            whole=NAMED,
            outputs=mappings,
            variator=values,
            shafts=values,
            ratio=values,
            inputs=mappings,
            side=values,
        ),
        lambda o: pt.power_flow(PLANT, **{"grid": {"J1.w": 10.0}, **o}),
    ),
    "power_flow of a result": (options(at=values, whole=NAMED, outputs=mappings), lambda o: pt.power_flow(RESULT, **o)),
    "power_flow of anything": (st.tuples(values, values), lambda v: pt.power_flow(*v)),
    "energy_audit": (values, pt.energy_audit),
    "schematic": (values, pt.schematic),
    "result": (st.sampled_from(NAMES) | values, RESULT.__getitem__),
    "der": (values, pt.der),
    "schedule": (st.tuples(values, values), lambda v: pt.schedule(*v)),
    "switch": (st.tuples(values, values, values), lambda v: pt.switch(*v)),
    "friction": (st.tuples(values, values, values, values), lambda v: pt.friction(*v)),
    "unilateral": (st.tuples(values, values), lambda v: pt.unilateral(*v)),
    "when": (st.tuples(values, values), lambda v: pt.when(*v)),
    "reinit": (st.tuples(values, values), lambda v: pt.reinit(*v)),
    "connect": (st.tuples(values, values), lambda v: pt.connect(*v)),
    "parameter": (st.tuples(values, values), lambda v: pt.parameter(*v)),
    "gradient": (options(of=WANTED, wrt=NAMED), lambda o: pt.gradient(RESULT, **{"of": "J1.w", "wrt": "J1.J", **o})),
    "gradient of anything": (st.tuples(values, values), lambda v: pt.gradient(*v)),
    "sensitivity": (
        options(signals=NAMED, wrt=NAMED, times=values),
        lambda o: pt.sensitivity(RESULT, **{"signals": "J1.w", "wrt": "J1.J", **o}),
    ),
    "sensitivity of anything": (st.tuples(values, values, values), lambda v: pt.sensitivity(*v)),
    "floquet": (
        options(start=values, period=values),
        lambda o: pt.floquet(RESULT, **{"start": 0.0, "period": 0.1, **o}),
    ),
    "floquet of anything": (values, lambda v: pt.floquet(v, 0.0, 0.1)),
    "objective": (
        st.tuples(st.sampled_from([pt.final, pt.integral, pt.maximum, pt.minimum]), values, values),
        lambda v: pt.gradient(RESULT, v[0](v[1]) * v[2] if v[2] is not None else v[0](v[1]), "J1.J"),
    ),
    "at": (st.tuples(st.sampled_from(NAMES), values), lambda v: pt.gradient(RESULT, pt.at(*v), "J1.J")),
    "squares": (st.tuples(values, values, values), lambda v: pt.gradient(RESULT, pt.squares("J1.w", *v), "J1.J")),
    "experiment": (
        options(times=values, values=mappings, parameters=mappings, starts=mappings, inputs=mappings, sigma=mappings),
        lambda o: pt.Experiment(**{"times": [0.0, 0.1], "values": {"J1.w": [0.0, 0.1]}, **o}),
    ),
    "read_experiment": (values, pt.read_experiment),
    "fit": (
        options(data=values, wrt=NAMED, first=mappings, bounds=mappings, rtol=values, atol=values),
        lambda o: pt.fit(PLANT, **{"data": MEASURED, "wrt": "J1.J", **o}),
    ),
    "fit of anything": (values, lambda v: pt.fit(v, MEASURED, "J1.J")),
    "optimal_control": (
        options(
            minimize=WANTED,
            guess=values,
            inputs=mappings,
            parameters=mappings,
            limits=mappings,
            ends=mappings,
            stop=values,
            smooth=values,
            intervals=values.filter(
                lambda v: (not isinstance(v, float | np.floating) and not isinstance(v, int)) or v < 9
            ),
        ),
        lambda o: pt.optimal_control(
            PLANT,
            **{
                "minimize": pt.integral(lambda m: m.J1.w**2),
                "guess": RESULT,
                "inputs": {"u": (-1.0, 1.0)},
                "intervals": 2,
                **o,
            },
        ),
    ),
    "optimal_control of anything": (values, lambda v: pt.optimal_control(v, "J1.w", RESULT, {"u": (-1.0, 1.0)})),
    "function": (
        options(outputs=NAMED, inputs=NAMED, modes=mappings | st.tuples(values, values)),
        lambda o: PLANT.function(**o),
    ),
    "start": (
        options(
            start=values,
            parameters=mappings,
            starts=mappings,
            guesses=mappings,
            inputs=mappings,
            rtol=values,
            method=values,
        ),
        lambda o: PLANT.start(**o),
    ),
    "step": (
        st.tuples(values.filter(lambda v: not (isinstance(v, float) and 1 < v < math.inf)), mappings),
        lambda v: PLANT.start().step(v[0], **_texts(v[1])),
    ),
    "state of a run": (values, lambda v: setattr(PLANT.start(), "state", v)),
    "signal of a run": (st.sampled_from(NAMES) | values, lambda v: PLANT.start()[v]),
    "power_outputs": (values, pt.power_outputs),
    "plot": (st.lists(st.sampled_from(NAMES) | values, max_size=2), lambda v: RESULT.plot(*v)),
}


def _texts(given: Any) -> dict[str, Any]:
    return given if isinstance(given, dict) and all(isinstance(n, str) for n in given) else {}


def fuzz(name: str, most: int) -> None:
    strategy, call = CALLS[name]

    @given(strategy)
    @settings(WAYS, max_examples=most)
    def check(what: Any) -> None:
        note(repr(what))
        only_refused(lambda: call(what))

    check()


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::RuntimeWarning")
@pytest.mark.parametrize("name", CALLS)
def test_wrong_arguments_are_refused(name: str) -> None:
    fuzz(name, 12)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::RuntimeWarning")
@pytest.mark.parametrize("name", CALLS)
def test_many_wrong_arguments_are_refused(name: str) -> None:
    fuzz(name, 150)
