"""The fourteen figures of the 2012 paper on deflections in the planetary stage."""

from carrierflex.workflows.figures.carrier_drawings import (
    frames_and_angles,
    gear_force_drawing,
    sensor_locations,
    tilts,
)
from carrierflex.workflows.figures.finite_element_figures import (
    boundary_conditions,
    deflection_curves,
    deformation_over_plane,
    pilot_nodes,
    seventh_mode,
)
from carrierflex.workflows.figures.identification_figures import (
    deflection_parameters,
    identified_signals,
    measured_and_simulated,
    rigid_parameters,
)
from carrierflex.workflows.figures.paper_figure import PaperFigure, drawing
from carrierflex.workflows.figures.rig_drawings import main_components

_CARRIER = (
    "The carrier's dimensions are this project's (docs/decisions/0001): gear data, centre distance "
    "and sensor radius are published, plate thicknesses were chosen so that mass and rim "
    "deflection agree with what is published."
)
_RECORDS = (
    "The records are simulated by the case <code>stage_order_one</code>, whose kink, bearing and "
    "mounting stiffnesses were searched for order 1 of table 5 (docs/order_one.md): the size of "
    "phi<sub>PLC</sub> is put in, and the rim deflection by a pin fit derived from table 4. "
    "Equations 1 to 8 are not in them. Sensor zeroes and gains are chosen."
)
_STAGE = ("flexible", "stiff", "bodies", "stage")

FIGURES_2012 = (
    PaperFigure(
        "2012", 1, "Naming of the main components",
        "Section of the gearbox with the names of its parts.",
        "A section to scale from the dimensions of <code>geometry/</code> and "
        "<code>simulation/stage/stage_data.py</code>; walls, bearing outlines and the stations "
        "behind the carrier are drawn freely, the parallel shafts turned into the plane.",
        "Names and gear data are the papers'.",
        drawing(main_components),
    ),
    PaperFigure(
        "2012", 2, "Location of the proximity sensors",
        "The carrier with its two machined faces and six sensors: four axial at R<sub>s</sub> = "
        "412 mm, two radial.",
        "The mesh of the carrier (<code>carrierflex mesh</code>), sensors as in "
        "<code>simulation/cases/stage_lc1.toml</code>.",
        f"Angles and radius are printed. {_CARRIER}",
        sensor_locations, ("flexible",),
    ),
    PaperFigure(
        "2012", 3, "Coordinate systems and angles",
        "Frames of housing and carrier, the axes of both tilts, angles to one sensor.",
        "A drawing by the conventions of <code>geometry/</code>: the frame is right-handed with x "
        "downwind, so y points left for who looks along x.",
        "Equations 2 and 3 as printed.",
        drawing(frames_and_angles),
    ),
    PaperFigure(
        "2012", 4, "Misalignment of carrier and housing",
        "Both tilts exaggerated.",
        "A drawing, not to scale.",
        "Nothing is computed.",
        drawing(tilts),
    ),
    PaperFigure(
        "2012", 5, "Calculation of forces",
        "Tangential forces at a planet; pressure and helix angle with normal and axial force.",
        "A drawing to scale in the pitch circles; numbers by <code>fe/load_cases.py</code>.",
        "Equations 4 to 6 and table 3 are the paper's. Equation 5 as printed gives 6 % more axial "
        "force than the usual F<sub>t</sub> tan beta.",
        drawing(gear_force_drawing),
    ),
    PaperFigure(
        "2012", 6, "Boundary conditions of the finite elements",
        "Carrier with pins: upwind end held, force and tilting moment on every pin.",
        "The mesh and the pilots of <code>carrierflex curves</code> (stiff variant).",
        _CARRIER,
        boundary_conditions, ("stiff",),
    ),
    PaperFigure(
        "2012", 7, "Axial deformation over y and z",
        "Deflection patterns of the stiff and the flexible model.",
        "<code>carrierflex curves</code>: static solution under 1 kNm, the upwind face coloured by "
        "its axial displacement; colours end at the largest displacement near the rim.",
        _CARRIER,
        deformation_over_plane, ("stiff", "flexible"),
    ),
    PaperFigure(
        "2012", 8, "Axial deformation over the angle",
        "The same along the rim: six peaks stiff, three flexible.",
        "<code>carrierflex curves</code>.",
        f"{_CARRIER} The number of peaks follows from the carrier's symmetry and was not fitted.",
        deflection_curves, ("stiff", "flexible"),
    ),
    PaperFigure(
        "2012", 9, "Measurements and identified models, LC2",
        "Four axial sensors at half torque with M1 and M2.",
        "<code>carrierflex simulate stage_order_one</code> for the measurement, "
        "<code>carrierflex identify --model m2 --per-run</code> for the models. What both leave is "
        "of order 1: the mounting holds the housing about z and hardly about y, so the rim rocks "
        "about z rather than wobbling round, and a tilt that turns with the carrier takes up only "
        "a part of that.",
        _RECORDS,
        identified_signals, _STAGE,
    ),
    PaperFigure(
        "2012", 10, "Parameters of the rigid-body model",
        "d<sub>x</sub>, theta and phi of housing and carrier by load case, M1 and M2.",
        "As figure 9, with 95 % intervals.",
        _RECORDS,
        rigid_parameters, _STAGE,
    ),
    PaperFigure(
        "2012", 11, "Parameters of the deflection model",
        "Scales rho<sub>s</sub> and rho<sub>f</sub> by load case, M2.",
        "As figure 9. The scales belong to 1 kNm curves: shares of 1, not of the torque.",
        f"{_RECORDS} The pins of the records are neither bonded nor absent but fitted with 1.7e7 "
        "Nm/rad.",
        deflection_parameters, _STAGE,
    ),
    PaperFigure(
        "2012", 12, "Seventh mode of main shaft and carrier",
        "First elastic mode of the free main shaft and carrier; the pins pivot.",
        "<code>carrierflex reduce</code> for the three bodies and <code>carrierflex join</code>: "
        "reduced bodies joined at the pins' six interfaces, modes of the free assembly.",
        f"The interface stiffness of 1e6 Nm/rad is the paper's. {_CARRIER}",
        seventh_mode, ("flexible", "bodies"),
    ),
    PaperFigure(
        "2012", 13, "Pilot nodes on the carrier",
        "Two pilots an interface, tied in translation, with torsional springs; RBE3 to the bores.",
        "Pilots of <code>carrierflex reduce --variant flexible</code>; every fourth of the nodes "
        "that a pilot averages is drawn.",
        "The interface is the paper's. It calls RBE3 rigid; distributing couplings, as here, are "
        "not (docs/couplings.md).",
        pilot_nodes, ("flexible", "bodies"),
    ),
    PaperFigure(
        "2012", 14, "Measured and simulated deflection, LC2",
        "Four axial sensors at half torque, measurement and multibody simulation.",
        "Measured: the record of figure 9. Simulated: <code>stage_paper_lc2</code>, the paper's "
        "own model (planet bearings by rollers, main shaft of finite elements, spur gears), with "
        "the tilt that M1 found.",
        f"{_RECORDS} The simulated stage is another one (bearings, pin fit, shaft, gears), but its "
        "tilt comes from the record, as in the paper. Means are left out: the sensors' zeroes are.",
        measured_and_simulated, _STAGE,
    ),
)  # fmt: skip
