"""The mounting model made ready for one sampling interval, stepped over any part of a record."""

from dataclasses import dataclass
from functools import partial
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.force_laws import ForceLaw, first_class
from carrierflex.simulation.mounting.block_records import BlockRecord
from carrierflex.simulation.mounting.equations import Block, mounting_blocks
from carrierflex.simulation.mounting.kernel import (
    DIVERGED,
    DONE,
    NOT_CONVERGED,
    march_linear,
    march_nonlinear,
)
from carrierflex.simulation.mounting.measured_laws.bushing_memory_kernels import (
    moved_every,
    states_of,
)
from carrierflex.simulation.mounting.measured_laws.joined_block import joined_block
from carrierflex.simulation.mounting.parameter_arrays import ParameterArray, check_parameters
from carrierflex.simulation.mounting.propagators import Propagator, propagator
from carrierflex.simulation.mounting.rig import MountingRig

Array = NDArray[np.float64]

#: Largest phase [rad] that the nonlinear part of the stiffness may turn in one step, ``h sqrt(max
#: eig M⁻¹ (K_t - K))``. With 1.2 loads with noise up to 20 Hz are followed to 1e-4
#: (docs/mounting_model.md); beyond pi a step cannot hold half a wave.
_DEFAULT_PHASE, _LARGEST_PHASE = 1.2, np.pi

#: Shares of the largest load at which the stiffness of a user's law is looked at.
_SHARES_OF_LOAD = (0.0, 0.25, 0.5, 0.75, 1.0)

#: Steps in one sampling interval above which the record is too coarsely sampled for the model.
_MOST_SUBSTEPS = 20_000

#: Tolerance of Newton's method within a step, relative to the element forces.
_NEWTON_TOLERANCE = 1e-8


#: Numbers in a vector register; states and probes are filled up with zeros to a multiple, so that
#: few sizes have to be compiled.
_TOGETHER = 4


class DivergedError(ArithmeticError):
    """A run that left the model: time, coordinate, and the signals up to there.

    Parameters
    ----------
    message : str
        What happened, when and where.
    samples : int
        Samples that are good.
    time : float
        Time of the last good sample [s].
    coordinate : str
        Coordinate that diverged first.
    signals : ndarray, shape (samples, 6)
        Signals of the good samples, not zeroed.
    """

    def __init__(
        self, message: str, *, samples: int, time: float, coordinate: str, signals: Array
    ) -> None:
        super().__init__(message)
        self.samples = samples
        self.time = time
        self.coordinate = coordinate
        self.signals = signals

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel between processes: keyword arguments are lost by the default way."""
        known: dict[str, Any] = {
            "samples": self.samples,
            "time": self.time,
            "coordinate": self.coordinate,
            "signals": self.signals,
        }
        return partial(DivergedError, **known), self.args


@dataclass(frozen=True, eq=False)
class MountingModel:
    """Blocks with their propagators for one sampling interval.

    Parameters
    ----------
    blocks : tuple of Block
        Vertical and horizontal; with measured laws in the planes of the bushings one of both.
    propagators : tuple of Propagator
        Of each block, over one substep.
    interval : float
        Sampling interval of the loads [s].
    substeps : int
        Steps in one interval of a nonlinear block.
    """

    blocks: tuple[Block, ...]
    propagators: tuple[Propagator, ...]
    interval: float
    substeps: int


@dataclass(frozen=True, eq=False)
class MarchState:
    """Where a march stands, block by block.

    Parameters
    ----------
    time : float
        Time [s].
    states, memories : tuple of ndarray
        Linear states, and memory of the elements.
    law_states : tuple of ndarray
        States of the parts with a memory of measured laws; empty where a block has none.
    """

    time: float
    states: tuple[Array, ...]
    memories: tuple[Array, ...]
    law_states: tuple[Array, ...]


def mounting_model(
    rig: MountingRig,
    parameters: ParameterArray,
    loads: Array,
    interval: float,
    *,
    step: float | None = None,
    user_law: ForceLaw | None = None,
    tables: Array | None = None,
) -> MountingModel:
    """Equations and propagators for loads sampled every `interval` seconds.

    Parameters
    ----------
    rig : MountingRig
        Geometry and masses.
    parameters : ndarray
        Flat parameter set.
    loads : ndarray, shape (n, 3)
        Loads that the record holds, or their extremes: torque, ntl_y, ntl_z. They decide the step
        of nonlinear bushings.
    interval : float
        Sampling interval [s].
    step : float, optional
        Largest step [s]; without it the nonlinear stiffness turns its phase by at most 1.2 rad a
        step. A linear block is exact at any step.
    user_law : ForceLaw, optional
        Force that a user adds to the radial force of both bushings, in y and in z; continuous.
    tables : ndarray, optional
        Packed measured laws of the bushings, see
        :func:`carrierflex.simulation.mounting.measured_laws.bushing_laws.packed_laws`.

    Returns
    -------
    MountingModel
        Ready to march.

    Raises
    ------
    ValueError
        Where a parameter is out of bounds, or the step is too large for the nonlinear stiffness.
    """
    check_parameters(parameters)
    if not (np.isfinite(interval) and interval > 0.0) or (step is not None and not step > 0.0):
        raise ValueError(
            f"sampling interval {interval} s, step {step} s; expected positive numbers"
        )
    vertical, horizontal = mounting_blocks(rig, parameters, user_law)
    blocks: tuple[Block, ...] = (vertical, horizontal)
    if tables is not None:
        blocks = (joined_block(vertical, horizontal, tables),)
    rate = max(_nonlinear_rate(block, loads) for block in blocks)
    if step is None:
        substeps = max(1, int(np.ceil(interval * rate / _DEFAULT_PHASE)))
    else:
        substeps = max(1, int(np.ceil(interval / step * (1.0 - 1e-9))))
        if interval / substeps * rate > _LARGEST_PHASE:
            raise ValueError(
                f"step {interval / substeps:g} s is too large for the bushings' nonlinear "
                "stiffness under these loads; "
                f"expected at most {_LARGEST_PHASE / rate:.2g} s, {_DEFAULT_PHASE / rate:.2g} s "
                "for full accuracy"
            )
    if substeps > _MOST_SUBSTEPS:
        raise ValueError(
            f"loads sampled every {interval:g} s need {substeps} steps a sample; "
            f"expected at most {_MOST_SUBSTEPS}"
        )
    steps = (interval if block.is_linear else interval / substeps for block in blocks)
    propagators = tuple(propagator(block, h) for block, h in zip(blocks, steps, strict=True))
    return MountingModel(blocks, propagators, interval, substeps)


def _nonlinear_rate(block: Block, loads: Array) -> float:
    """Angular frequency [rad/s] of the stiffness nonlinear elements add at largest deflections."""
    if block.is_linear:
        return 0.0
    flexibility = block.rows @ np.linalg.solve(block.K, block.G)
    deflections = loads @ flexibility.T
    # The built-in laws are stiffest at the largest deflection; where another law is, is not known.
    is_built_in = block.user_law is None and block.tables is None
    shares = (1.0,) if is_built_in else _SHARES_OF_LOAD
    added = [
        block.tangent_stiffness(share * loads[sample]) - block.K
        for sample in {int(np.argmax(np.abs(column))) for column in deflections.T}
        for share in shares
    ]
    return float(
        np.sqrt(max(np.abs(np.linalg.eigvals(np.linalg.solve(block.M, K))).max() for K in added))
    )


def state_at_rest(model: MountingModel, loads: Array, time: float = 0.0) -> MarchState:
    """State of the static equilibrium under the first loads; fluid branches have relaxed.

    Parameters
    ----------
    model : MountingModel
        The model.
    loads : ndarray, shape (3,)
        Torque, ntl_y, ntl_z.
    time : float
        Time [s].

    Returns
    -------
    MarchState
        Where the march begins.
    """
    states, memories = [], []
    for block, matrices in zip(model.blocks, model.propagators, strict=True):
        q, friction = block.static_solution(loads)
        state = np.zeros(len(matrices.end))
        state[: len(q)] = q
        u = block.preload + block.rows @ q
        phi = block.force_at_rest(u) + friction
        states.append(state)
        memories.append(np.stack([friction, u, phi, phi, phi]))
    law_states = tuple(_parts_at_rest(block) for block in model.blocks)
    return MarchState(time, tuple(states), tuple(memories), law_states)


def _parts_at_rest(block: Block) -> Array:
    """States of the parts of a block with a memory, relaxed."""
    return np.zeros(0) if block.tables is None else np.zeros(states_of(block.tables).size)


def first_signals(model: MountingModel, state: MarchState) -> Array:
    """Signals of a state, shape (6,)."""
    outputs = [
        b.output @ x[: len(b.names)] for b, x in zip(model.blocks, state.states, strict=True)
    ]
    return np.asarray(np.sum(outputs, axis=0))


def marched(model: MountingModel, state: MarchState, loads: Array) -> tuple[Array, MarchState]:
    """March over a stretch of a record.

    Parameters
    ----------
    model : MountingModel
        The model.
    state : MarchState
        State at the first sample; not changed.
    loads : ndarray, shape (n, 3)
        Torque, ntl_y, ntl_z at every sample, the first one included.

    Returns
    -------
    signals : ndarray, shape (n, 6)
        Displacements of the sensors from the equilibrium under gravity [m], in the order of
        ``SENSORS``.
    state : MarchState
        State at the last sample.

    Raises
    ------
    DivergedError
        Where a coordinate leaves the model, or Newton's method does not converge.
    """
    signals = np.zeros((len(loads), 6))
    signals[0] = first_signals(model, state)
    states, memories = [x.copy() for x in state.states], [x.copy() for x in state.memories]
    law_states = [x.copy() for x in state.law_states]
    good, stopped = len(loads) - 1, None
    for row, block in enumerate(model.blocks):
        # After one block has stopped, the other one need only come as far: it may have stopped
        # before.
        reached, why = _march_block(
            model,
            row,
            (states[row], memories[row], law_states[row]),
            loads[: good + 1],
            signals,
        )
        if why is not None:
            good, stopped = reached, (block, *why)
    if stopped is not None:
        raise _diverged(*stopped, good, state.time + good * model.interval, signals[: good + 1])
    return signals, MarchState(
        state.time + (len(loads) - 1) * model.interval,
        tuple(states),
        tuple(memories),
        tuple(law_states),
    )


def _march_block(
    model: MountingModel,
    index: int,
    state: tuple[Array, Array, Array],
    loads: Array,
    signals: Array,
) -> tuple[int, tuple[int, int] | None]:
    """March a block, adding to `signals`.

    The last good sample, and coordinate and outcome where it came no further.
    """
    block = model.blocks[index]
    matrices = model.propagators[index]
    x, memory, law_states = state
    if not (loads[:, block.G.any(axis=0)].any() or x.any() or memory.any()):
        # At rest without a load it stays there: a run with vertical loads alone saves a third of
        # its time.
        return len(loads) - 1, None
    if block.is_linear:
        good, coordinate = march_linear(matrices.end, block.output, x, loads, signals)
        return good, None if coordinate < 0 else (coordinate, DIVERGED)
    record = _block_record(block, matrices, x, memory)
    law = block.user_law
    tables = block.tables
    if tables is not None:
        # The march writes states among the laws, and moves parts twice a step.
        tables = moved_every(tables, 0.5 * model.interval / model.substeps)
        states_of(tables)[:] = law_states
    good, coordinate, outcome = march_nonlinear(
        record,
        block.output,
        model.substeps,
        _NEWTON_TOLERANCE,
        loads,
        signals,
        None if law is None else first_class(law.force),
        None if law is None else law.parameters,
        tables,
    )
    x[:], memory[:] = _standing(record, len(x))
    if tables is not None:
        law_states[:] = states_of(tables)
    return good, None if outcome == DONE else (coordinate, outcome)


def _diverged(
    block: Block, coordinate: int, outcome: int, good: int, time: float, signals: Array
) -> DivergedError:
    names = block.names if outcome == NOT_CONVERGED else (block.names[coordinate],)
    what = "the bushing forces did not converge" if outcome == NOT_CONVERGED else "diverged"
    return DivergedError(
        f"{', '.join(names)}: {what} after {time:.6g} s; the signals up to there are kept",
        samples=good + 1,
        time=time,
        coordinate=names[0],
        signals=signals,
    )


def _block_record(block: Block, matrices: Propagator, state: Array, memory: Array) -> BlockRecord:
    """Record of a block, its propagator over one substep, and where it stands."""
    n, n_e = len(state), len(block.weights)
    both = np.vstack([_filled(matrices.probes), _filled(matrices.end[:, : n + 6 + n_e])])
    forces = np.vstack([_filled(matrices.feedback), _filled(matrices.end[:, n + 6 + n_e :])])
    fields = {
        "by_state": _filled(both[:, :n].T),
        "by_load": both[:, n : n + 6].T,
        "by_first_force": both[:, n + 6 :].T,
        "by_force": forces.T,
        "law": block.law,
        "preload": block.preload,
        "loads": np.zeros(6),
        "known": np.zeros(len(both)),
        "probe": np.zeros(len(_filled(matrices.probes))),
        "force": np.zeros(2 * n_e),
        "friction": np.zeros(2 * n_e),
        "work": np.zeros((2 * n_e, 2 * n_e + 1)),
        "state": _filled(state[:, None])[:, 0],
        "friction_before": memory[0],
        "u_before": memory[1],
        "last": memory[[4, 3, 2]],
    }
    record = np.zeros(1, [(name, np.float64, values.shape) for name, values in fields.items()])
    for name, values in fields.items():
        record[name][0] = values
    return cast(BlockRecord, record[0])


def _standing(record: BlockRecord, n: int) -> tuple[Array, Array]:
    """State, shape (n,), and memory, shape (5, n_elements), of a block that has marched."""
    fields = cast(np.void, record)
    memory = np.stack([fields["friction_before"], fields["u_before"], *fields["last"][::-1]])
    return fields["state"][:n].copy(), memory


def _filled(matrix: Array) -> Array:
    """Rows of zeros below, up to a multiple of a vector register."""
    return np.vstack([matrix, np.zeros((-len(matrix) % _TOGETHER, matrix.shape[1]))])
