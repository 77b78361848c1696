"""Ctrl-C ends what it meets, also where CasADi discards the exception."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import casadi as ca
import numpy as np
import pytest
from spin_down import SpinDown

import powertrain as pt
from powertrain.components.rotational import Inertia
from powertrain.interruption import interruptible


@pytest.fixture(autouse=True)
def python_handles_ctrl_c() -> Iterator[None]:
    """In jobs that a shell runs in the background, Ctrl-C is ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


class Interrupted:
    """A value during whose conversion Ctrl-C comes."""

    def __SX__(self) -> ca.SX:
        signal.raise_signal(signal.SIGINT)
        return ca.SX(1.0)


class WrittenMeanwhile(pt.Component):
    """A model whose equations are written while Ctrl-C comes; CasADi says that there is no such operation."""

    inertia: Inertia = Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield self.inertia.flange_b.tau == 0
        with pytest.raises(NotImplementedError):
            ca.vertcat(ca.SX.sym("x"), Interrupted())


def test_compilation_ends_with_the_ctrl_c_that_casadi_discards() -> None:
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        pt.compile(WrittenMeanwhile())
    assert signal.getsignal(signal.SIGINT) is before


def test_what_casadi_makes_of_ctrl_c_is_no_error_of_the_model() -> None:
    with pytest.raises(KeyboardInterrupt), interruptible(), interruptible():
        ca.vertcat(ca.SX.sym("x"), Interrupted())


def test_ctrl_c_arrives_also_where_another_one_is_handled() -> None:
    def discarding() -> None:
        with pytest.raises(NotImplementedError):
            ca.vertcat(ca.SX.sym("x"), Interrupted())

    try:
        raise KeyboardInterrupt("the first one")
    except KeyboardInterrupt:
        with pytest.raises(KeyboardInterrupt):
            interruptible()(discarding)()


def test_an_interruption_keeps_what_it_carries() -> None:
    def carrying() -> None:
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt as error:
            error.add_note("reached")
            raise

    with pytest.raises(KeyboardInterrupt) as raised:
        interruptible()(carrying)()
    assert raised.value.__notes__ == ["reached"]


def test_a_handler_that_only_takes_note_of_ctrl_c_is_left_its_way() -> None:
    noted: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: noted.append(number))
    try:
        for handler in (signal.getsignal(signal.SIGINT), signal.SIG_IGN):
            signal.signal(signal.SIGINT, handler)
            with interruptible():
                signal.raise_signal(signal.SIGINT)
            assert signal.getsignal(signal.SIGINT) is handler
    finally:
        signal.signal(signal.SIGINT, before)
    assert noted == [signal.SIGINT]


def test_other_threads_compile_as_before() -> None:
    with ThreadPoolExecutor(1) as threads:
        run = threads.submit(pt.simulate, SpinDown(), 1.0, starts={"inertia.w": 10.0}).result()
    assert run["inertia.w"][-1] == pytest.approx(10.0 * np.exp(-0.25), rel=1e-4)
    assert threading.current_thread() is threading.main_thread()
