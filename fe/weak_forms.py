"""The weak forms of linear elasticity, as scikit-fem reads them.

Find u with ``a(u, v) = l(v)`` for all v, and the modes of ``a(u, v) = ω² m(u, v)``, where
``a(u, v) = ∫ σ(u) : ε(v) dV``, ``m(u, v) = ∫ ρ u · v dV``, ``ε = (∇u + ∇uᵀ) / 2`` and
``σ = λ tr(ε) I + 2 μ ε``. The compiled loops of :mod:`carrierflex.fe.element_kernels` integrate
the same two forms.
"""

from typing import Any

import skfem
from skfem.helpers import ddot, dot, eye, sym_grad, trace


def stiffness_form(lam: float, mu: float) -> skfem.BilinearForm:
    """Strain energy ``a(u, v) = ∫ (λ tr ε(u) I + 2 μ ε(u)) : ε(v) dV``.

    Parameters
    ----------
    lam, mu : float
        Lamé's constants [Pa].
    """

    def a(u: Any, v: Any, w: Any) -> Any:
        strain = sym_grad(u)
        stress = lam * eye(trace(strain), 3) + 2.0 * mu * strain
        return ddot(stress, sym_grad(v))

    return skfem.BilinearForm(a)


def mass_form(rho: float) -> skfem.BilinearForm:
    """Kinetic energy ``m(u, v) = ∫ ρ u · v dV``.

    Parameters
    ----------
    rho : float
        Density [kg/m³].
    """

    def m(u: Any, v: Any, w: Any) -> Any:
        return rho * dot(u, v)

    return skfem.BilinearForm(m)
