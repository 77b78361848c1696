"""The share of a variator in the power flow: the cases of Yu & Beachley's Fig. 8, and the lossless share from the kinematics alone."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from powertrain.compiler.assemble import Compiled
from powertrain.dae.hybrid import HybridDae
from powertrain.errors import ParameterError, suggestion
from powertrain.language.connectors import Connector
from powertrain.language.fields import Variable
from powertrain.language.laws import der
from powertrain.language.symbols import Symbol, column, free_symbols, key
from powertrain.power.circulation import Edge, way
from powertrain.signals import signals_of

VARIATOR_CASES = ("idle", "split", "series", "positive recirculation", "negative recirculation")
IDLE, SPLIT, SERIES, POSITIVE, NEGATIVE = range(5)
_MOST_IMPLICIT = 10


def goes_beside(v: int, edges: Sequence[Edge]) -> bool:
    """Whether power gets from the source (vertex -1) to the sink (-2) without passing the vertex ``v``, or to no sink at all."""
    beside = [k for k, edge in enumerate(edges) if v not in edge]
    return way(edges, beside, {-1}, {-2}) is not None or way(edges, range(len(edges)), {-1}, {-2}) is None


def kinematic_share(compiled: Compiled, ratio: str, shafts: tuple[str, str], ends: Sequence[str]) -> Symbol | None:
    """The lossless share d ln tau/d ln V, by differentiation of the model; tau is the second shaft's speed over the first's, V the ratio.

    By virtual work this is the power through the variator from its input to its output (V = output speed over input speed), divided by the
    power at the first shaft, without losses. The speeds may depend only on V and on a common factor. None if V does not move the ports
    ``ends`` of the variator: a unit that slips or gives way.
    """
    signals = signals_of(compiled)
    V = signals.pick(ratio).expression
    dae = compiled.dae
    first, second = signals.resolve([port_motion(compiled, name) for name in shafts])
    tau = second / first
    symbols = [s for s in free_symbols(V) if key(s) != key(dae.t)]
    if not symbols:
        raise ParameterError(f"the ratio {ratio} cannot change: it is not an input, state or parameter of the model")
    s = column(symbols)
    if not any(_moves(dae, s, motion) for motion in signals.resolve([port_motion(compiled, name) for name in ends])):
        return None
    change = ca.jacobian(tau, s)
    if ca.jacobian_sparsity(tau, dae.z).nnz():
        if dae.z.numel() > _MOST_IMPLICIT:
            raise ParameterError(
                f"the speeds of {' and '.join(shafts)} depend on {dae.z.numel()} implicit unknowns; the share K of a variator "
                f"can be computed with at most {_MOST_IMPLICIT}"
            )
        inner = ca.solve(ca.densify(ca.jacobian(dae.residual, dae.z)), ca.densify(ca.jacobian(dae.residual, s)))
        change = change - ca.mtimes(ca.jacobian(tau, dae.z), inner)
    slope = ca.jacobian(V, s)
    share: Symbol = ca.dot(ca.densify(change), ca.densify(slope)) / ca.sumsqr(ca.densify(slope)) * V / tau
    return share


def _moves(dae: HybridDae, s: Symbol, motion: Symbol) -> bool:
    """Whether a speed depends on ``s``, also through implicit unknowns."""
    implicit = ca.jacobian_sparsity(motion, dae.z).nnz() and ca.jacobian_sparsity(dae.residual, s).nnz()
    return bool(ca.jacobian_sparsity(motion, s).nnz() or implicit)


def port_motion(compiled: Compiled, name: str) -> Symbol:
    """The speed of a port, an expression of the model's variables. ParameterError if there is no such port."""
    port = named_port(compiled, name)
    potential, _ = pair(port)
    if potential is None:
        raise ParameterError(f"the port {name} has no speed; name a flange")
    with signals_of(compiled).source.reading(name):
        return der(potential)


def named_port(compiled: Compiled, name: str) -> Connector:
    """The port of a path."""
    components = signals_of(compiled).source.components
    ports = {c._path: c for c in components if isinstance(c, Connector) and c._path}
    if name not in ports:
        raise ParameterError(f"the model has no port {name}{suggestion(name, ports)}")
    return ports[name]


def pair(port: Connector) -> tuple[Symbol | None, Symbol | None]:
    """The potential and the flow of a port; None if it has several."""
    quantities = [(q.flow, port._symbols[n]) for n, q in port._fields.items() if isinstance(q, Variable)]
    potentials = [s for flow, s in quantities if not flow]
    flows = [s for flow, s in quantities if flow]
    return (potentials[0], flows[0]) if len(potentials) == len(flows) == 1 else (None, None)
