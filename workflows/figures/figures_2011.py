"""The twelve figures of "Modeling of Wind Turbine Gearbox Mounting" (2011)."""

from carrierflex.workflows.figures.bushing_figures import bushing_models, identification_flow
from carrierflex.workflows.figures.mounting_figures import (
    housing_motion,
    load_case,
    roll_of_three_models,
    six_motions,
)
from carrierflex.workflows.figures.paper_figure import PaperFigure, drawing
from carrierflex.workflows.figures.rig_drawings import (
    drive_train_with_loads,
    dynamometer,
    motion_sensors,
    mounted_bushings,
)
from carrierflex.workflows.figures.torsion_figures import torque_over_rotation, torsional_diagram

_RECORD = (
    "The record is simulated: times of section 4, levels from the axes of the paper's figure 6, "
    "nonlinear bushings of table 3."
)
_UNKNOWN = (
    " It also holds what no fitted model knows (unequal bushings, a radial load off the vertical, "
    "an elastic main bearing, gains of two sensors; chosen), so that no fit is perfect."
)
_CASE = "the case <code>mounting_2011</code> at the paper's 3.85 samples a second"

FIGURES_2011 = (
    PaperFigure(
        "2011", 1, "The dynamometer set-up",
        "The rig from the side: dynamometer, coupling, radial and axial load, main bearing, "
        "gearbox on torque arms, generator.",
        "A drawing, not to scale.",
        "Parts and names are the paper's; shapes are free.",
        drawing(dynamometer),
    ),
    PaperFigure(
        "2011", 2, "Main components of main shaft and gearbox",
        "Main shaft and gearbox with their parts, torque, radial load, bushing and the equivalent "
        "mass of the coupling.",
        "A section to scale from the dimensions of <code>geometry/</code> and "
        "<code>simulation/stage/stage_data.py</code>; walls, bearing outlines and the stations "
        "behind the carrier are drawn freely.",
        "The equivalent mass and its arm of 1750 mm are printed; the arm of the radial load is not "
        "and is chosen: 1220 mm in the stage, the hub; with the mass in the mounting's record.",
        drawing(drive_train_with_loads),
    ),
    PaperFigure(
        "2011", 3, "Bushings mounted in the gearbox",
        "The two bushings between torque arms and bedplate.",
        "A drawing, to scale in the bushings' distance of 750 mm from the axis.",
        "The distance is printed (figure 5); the bushing's section is drawn freely.",
        drawing(mounted_bushings),
    ),
    PaperFigure(
        "2011", 4, "The hydro-dynamic bushing; force over deflection of the three laws",
        "Elements of the hydro-dynamic bushing model: elastic, fluid and elasto-plastic force. The "
        "paper shows no force over deflection; it stands beside it here.",
        "Equations 1 to 7 with the constants of table 3, by the laws of "
        "<code>simulation/element/kernels.py</code> under a slow sine. Equation 7 with both yield "
        "limits; equation 6 as spring and damper in series (the mass has no influence).",
        "The constants are the paper's.",
        drawing(bushing_models),
    ),
    PaperFigure(
        "2011", 5, "Locations of the motion sensors",
        "The six sensors on the housing from behind and from the side, with R<sub>x</sub>, "
        "R<sub>y</sub>, R<sub>z</sub>, R<sub>b</sub>, R<sub>yz</sub>.",
        "A drawing from <code>simulation/mounting/rig.py</code>, the matrix T of equation 8 behind "
        "the places.",
        "R<sub>x</sub>, R<sub>y</sub>, R<sub>z</sub> are printed; R<sub>b</sub> and "
        "R<sub>yz</sub> are not and are assumed.",
        drawing(motion_sensors),
    ),
    PaperFigure(
        "2011", 6, "Measured data from the load case",
        "Torque, port and starboard radial load and the six motion sensors over 655 s.",
        f"<code>carrierflex simulate mounting_2011</code>: {_CASE}.",
        f"{_RECORD}{_UNKNOWN} The cylinders' directions (45° to either side of upright) are "
        "assumed.",
        load_case, ("mounting",),
    ),
    PaperFigure(
        "2011", 7, "Data used in the parameter identification",
        "Displacements and rotations of the housing, d = T<sup>-1</sup> s.",
        "The record of figure 6 through equation 10; <code>carrierflex identify CAMPAIGN --model "
        "nonlinear_bushing --housing-motion</code> writes the same of any campaign.",
        "As figure 6.",
        housing_motion, ("mounting",),
    ),
    PaperFigure(
        "2011", 8, "Flow charts of the identification; convergence of the complex method",
        "Main program and subprograms of the complex method. The paper shows no convergence; it "
        "stands beside the charts here.",
        "<code>identification/estimation/complex_method.py</code> on the record of figure 6 and "
        "equation 12, best and worst of the population over the simulations; dotted, what "
        "least squares by gradients reaches (<code>carrierflex identify --compare-complex</code>).",
        "The record as in figure 6; the weights of equation 12 (theta<sub>x</sub> tenfold) are "
        "chosen, the paper says only that theta<sub>x</sub> rules.",
        identification_flow, ("mounting",),
    ),
    PaperFigure(
        "2011", 9, "Comparison of theta_x: test and three bushing models",
        "Roll of the housing: test, nonlinear, linear and hydro-dynamic bushing.",
        "Three models identified from the record of figure 6 by <code>carrierflex identify "
        "--model hydrodynamic_bushing</code>, each simulated with what was found.",
        "The test's bushings are those of table 3 (nonlinear), so the linear model must be the "
        "worst here; in the paper the hydro-dynamic one is, which tells of a search that had not "
        "converged: it contains the nonlinear one.",
        roll_of_three_models, ("mounting",),
    ),
    PaperFigure(
        "2011", 10, "Six motions measured and adapted, nonlinear bushings",
        "Displacements and rotations of the housing, measured (m) and of the model (a).",
        "The nonlinear model of figure 9.",
        "As figure 9. What is left in d<sub>z</sub>, theta<sub>y</sub> and theta<sub>z</sub> is "
        "what the models do not know.",
        six_motions, ("mounting",),
    ),
    PaperFigure(
        "2011", 11, "Torque as function of main shaft rotation",
        "Torque over the rotation of the carrier, housing held and output locked; 27 MNm/rad by "
        "regression.",
        "Static equilibria of the planetary stage under a growing torque, housing and generator "
        "turned back (<code>carrierflex torsion</code>).",
        "The stiffness of the sun shaft and the shaft's diameter were derived from the printed 27 "
        "and 50 MNm/rad: the slopes are put in, that the line is straight is not.",
        torque_over_rotation, ("bodies", "torque_sweep"),
    ),
    PaperFigure(
        "2011", 12, "The torsional drive train",
        "Inertias, stiffnesses and ratios of the simplified drive train.",
        "<code>simulation/mounting/torsional_train.py</code>; frequencies as <code>carrierflex "
        "torsion</code> gives them.",
        "All numbers but the ratios' signs are the paper's; the frequencies are computed.",
        drawing(torsional_diagram),
    ),
)  # fmt: skip
