"""Constant errors of the gains of force and deflection, as a campaign declares them."""

from dataclasses import dataclass

import numpy as np

#: Words where no gain is declared.
TAKEN_AS_EXACT = "gains taken as exact"
#: A torque 5 % too large on a carrier or mounting is the torque itself on one 5 % softer: where no
#: other load acts, the records of the two are the same.
LOADS_AS_READ = "loads taken as read: stiffness and values per load are off by as much as these"


@dataclass(frozen=True)
class DeclaredGains:
    """Relative standard deviations of the gains of an element's two signals.

    Parameters
    ----------
    force, deflection : float, optional
        Relative standard deviation; None where none is declared: the gain is taken as exact.
    force_is_inertia : bool
        Whether the force is the mass times the measured acceleration (free decay): its gain is then
        that of the deflection.
    """

    force: float | None = None
    deflection: float | None = None
    force_is_inertia: bool = False

    def of(self, powers: tuple[int, int, int]) -> float:
        """Relative standard deviation of a parameter by the gains alone.

        A parameter of the powers ``a`` of force, deflection and time is found ``g_F^a_F g_x^a_x``
        times too large where force and deflection are read ``g_F`` and ``g_x`` times too large:
        ``sqrt((a_F sigma_F)² + (a_x sigma_x)²)``. Time is taken as exact.

        Parameters
        ----------
        powers : tuple of int
            Exponents of force, deflection and time.
        """
        force, deflection, _ = powers
        if self.force_is_inertia:
            force, deflection = 0, force + deflection
        return float(np.hypot(force * (self.force or 0.0), deflection * (self.deflection or 0.0)))

    @property
    def words(self) -> str:
        """What is declared, as a sentence without its full stop."""
        signals = {"deflection": self.deflection}
        if not self.force_is_inertia:
            signals = {"force": self.force, **signals}
        known = [f"{name} {100.0 * std:.3g} %" for name, std in signals.items() if std]
        exact = [name for name, std in signals.items() if not std]
        if not known:
            return TAKEN_AS_EXACT
        text = f"intervals hold the declared standard deviations of gains: {', '.join(known)}"
        return text + (f"; that of the {exact[0]} taken as exact" if exact else "")


#: Nothing is declared.
EXACT_GAINS = DeclaredGains()
