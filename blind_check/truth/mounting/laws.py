"""Forces of a bushing by other equations than the library's.

================ ============================================================================
damping          of the deflection: a hyperbolic function whose first term is its square
elasto-plastic   Bouc-Wen with a sharp knee (exponent 10)
Maxwell branch   two branches whose time constants lie 10 % about the named one
warming spring   loses stiffness with time
================ ============================================================================
"""

#: Laws by number; the parameters are p0, p1 and the deflection, speed that shape the other form.
LAWS = {
    "deflection_dependent_damping": 6,
    "elasto_plastic_friction": 11,
    "maxwell_branch": 12,
    "softening_in_time": 13,
}
