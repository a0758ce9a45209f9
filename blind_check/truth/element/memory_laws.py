"""Forces with inner states, by the truth's own equations, per unit of their size.

Hysteresis whose loop does not depend on the rate: Bouc-Wen that softens, hardens or is pinched,
Iwan's sliders in parallel, an elasto-plastic slider, play with friction; LuGre's bristles; Maxwell
branches; and what lies outside every class: a tuned mass, friction that its own heat softens, a
nonlinear spring in series with a dashpot. Hysteresis is changed in form as N(z) = z + d(z), which
keeps it free of rate, play in its flanks, LuGre's friction as a function of the speed.
"""

#: Laws by number.
MEMORY_LAWS = {
    "bouc_wen": 100, "pinched_bouc_wen": 101, "iwan": 102, "elasto_plastic": 103,
    "play_with_friction": 104,
    "lugre": 110,
    "maxwell_branches": 120,
    "tuned_mass": 130, "heated_friction": 131, "spring_and_dashpot": 132,
}  # fmt: skip
