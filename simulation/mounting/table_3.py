"""Bushing constants of the 2011 paper (its table 3)."""

from collections.abc import Mapping

#: Table 3 by model: values for
#: :func:`carrierflex.simulation.mounting.parameter_arrays.parameter_array`, SI units. The
#: nonlinear model has no linear damping; its C1 [N s/m³] grows with the square of the deflection
#: and stands under C3, the printed symbol being that of the linear damping. The hydro-dynamic one
#: has no damper beside the fluid branch; table 3 calls its Fy Fep.
TABLE_3: Mapping[str, Mapping[str, float]] = {
    "linear": {"K1": 20.2e6, "C1": 4.83e6, "P_T": 0.119},
    "nonlinear": {
        "K1": 17.6e6,
        "C1": 0.0,
        "K3": 65.05e9,
        "K5": 1.55e15,
        "C3": 1.15e6,
        "P_T": 0.111,
    },
    "hydrodynamic": {
        "K1": 4.3e6,
        "C1": 0.0,
        "K3": -9.98e9,
        "K5": 1.20e15,
        "m": 16.2,
        "c": 5.72e6,
        "k": 46.82e6,
        "Kp": 8.29e6,
        "Fy": 60.06e3,
        "P_T": 0.099,
    },
}
