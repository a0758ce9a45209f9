"""What drives an element, as the force that its equation of motion takes.

``m q'' + R(q, q') = F`` for a mass on the element under a force F. A free decay has F = 0 and a
state to begin with. On a base that moves by u the element feels the relative motion ``q = x - u``:
``m q'' + R(q, q') = -m u''``. Where the mass is not known both are divided by it: m = 1, and every
force is one per mass.
"""

FORCE = "force"
FREE_DECAY = "free_decay"
BASE = "base"
#: Drives under which the deflection is predicted from the force.
BY_FORCE = (FORCE, FREE_DECAY, BASE)
#: Drives under which only forces per mass are known.
PER_MASS = (FREE_DECAY, BASE)
