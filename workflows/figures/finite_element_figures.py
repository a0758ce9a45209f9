"""Loads, deflections, mode and pilots of the finite elements.

2012 paper, figures 6, 7, 8, 12 and 13.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

from carrierflex.fe.carrier_curves import UNIT_TORQUE
from carrierflex.fe.load_cases import gear_forces, radial, tangential
from carrierflex.fe.structural_model import carrier_pilot_points
from carrierflex.fe.view import curves_figure
from carrierflex.geometry.dihedral import rotation_about_x
from carrierflex.geometry.parameters import CarrierParameters
from carrierflex.geometry.pins import PAPER_STIFFNESS, pin_angles
from carrierflex.geometry.tet_mesh import TetMesh, boundary_facets
from carrierflex.geometry.view import LIGHTING, skin, surface_patch
from carrierflex.reduction.assembly_modes import AssemblyMode, assembly_modes
from carrierflex.reduction.pin_joints import pin_pilot
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.reduction.shaft_joint import COUPLING, rotating_group
from carrierflex.workflows.figures.scenes import rendered
from carrierflex.workflows.figures.shared_runs import BodyReduction, SharedRuns
from carrierflex.workflows.figures.sketching import (
    CARRIER,
    FORCE,
    INK,
    SENSOR,
    STEEL,
    box,
    disc,
    leader,
    line,
    prepare,
    spring,
    words,
)

#: Seen from upwind, above and to the side.
_FROM_UPWIND = (-1.5, 1.05, 0.75)
_SIDES = ("upwind", "downwind")
_PIN_PARTS = ("upwind", "midspan", "downwind")
#: Pilots that hub and plate hide from there, beside those of the downwind bores.
_HIDDEN = ("upwind_seat", "downwind_seat", "pin_2_upwind")
_CLAMP, _LOAD = "#c8501e", "#2e8b57"
#: Frequencies this close, as a share, are a pair of the carrier's symmetry.
_SAME_FREQUENCY = 1e-4
#: Largest displacement drawn in a mode, as a share of the group's length.
_DRAWN_MODE = 0.09
#: Angle at which the curve of the rim is drawn [rad].
_RIM = np.linspace(0.0, 2.0 * np.pi, 721)


def boundary_conditions(shared: SharedRuns) -> Figure:
    """Clamped shaft end, pins with their force and moment, on the mesh (2012, figure 6)."""
    mesh, carrier = shared.stiff.mesh, shared.parameters.carrier
    points = carrier_pilot_points(carrier)
    # Loads are drawn outside the rim, on the radius of their pin.
    feet, shown = {}, {"clamp": np.array([-carrier.hub_length, 0.195, 0.0])}
    for number, angle in enumerate(pin_angles(shared.parameters.carrier.n_planets), start=1):
        foot = points[f"pin_{number}_midspan"] + 0.22 * radial(float(angle))
        feet[number] = foot
        shown[f"force {number}"] = foot - 0.33 * tangential(float(angle))
        shown[f"moment {number}"] = foot + 0.38 * tangential(float(angle))

    def add(plotter: Any) -> None:
        """Mesh, held face, loaded seats, forces and moments."""
        for elements, colour in ((mesh.bodies["carrier"], CARRIER), (mesh.bodies["pins"], STEEL)):
            plotter.add_mesh(
                skin(mesh, elements, subdivision=0),
                color=colour,
                show_edges=True,
                edge_color="#4a5a6a",
                line_width=0.5,
                **LIGHTING,
            )
        clamped = mesh.points - np.array([1e-3, 0.0, 0.0])
        plotter.add_mesh(
            surface_patch(clamped, mesh.surface("shaft_face")), color=_CLAMP, **LIGHTING
        )
        for number, angle in enumerate(pin_angles(shared.parameters.carrier.n_planets), start=1):
            loaded = surface_patch(mesh.points, mesh.surface(f"pin_{number}_midspan"))
            plotter.add_mesh(loaded, color=_LOAD, **LIGHTING)
            foot, along = feet[number], tangential(float(angle))
            pilot = points[f"pin_{number}_midspan"]
            plotter.add_lines(np.array([pilot, foot]), color=INK, width=2.0)
            plotter.add_arrows(foot, -0.28 * along, color=FORCE)
            # A moment about t: two heads.
            plotter.add_arrows(foot, 0.28 * along, color=SENSOR)
            plotter.add_arrows(foot, 0.33 * along, color=SENSOR)

    scene = rendered(add, shown, (-1.5, 0.75, 0.55))
    figure = Figure(figsize=(10.0, 8.4), layout="constrained")
    axes = figure.subplots()
    scene.show(axes, left=0.06, right=0.06, above=0.08, below=0.14)
    for number in (1, 2, 3):
        words(axes, "$F_{PLC}$", scene.pixels[f"force {number}"], colour=FORCE, size=13.0)
        words(axes, "$M_t$", scene.pixels[f"moment {number}"], colour=SENSOR, size=13.0)
    leader(
        axes,
        "zero displacement",
        scene.pixels["clamp"],
        scene.at("clamp", 0.09, 0.40),
        colour=_CLAMP,
        size=11.0,
    )
    forces = gear_forces(UNIT_TORQUE, shared.parameters.gear, shared.parameters.carrier.n_planets)
    height, width, _ = scene.image.shape
    words(
        axes,
        f"T = 1 kN m: $F_{{PLC}}$ = {forces.F_PLC:.0f} N against the rotation and $M_t$ = "
        f"{forces.M_t:.1f} N m about the tangent, at the pilot of each pin's mid-span (green seat)",
        (0.5 * width, 1.09 * height),
        size=10.0,
    )
    return figure


def deformation_over_plane(shared: SharedRuns) -> Figure:
    """Axial displacement of the upwind face over y and z, both variants (2012, figure 7)."""
    figure = Figure(figsize=(12.5, 5.8), layout="constrained")
    panels = figure.subplots(1, 2)
    for axes, variant, name in (
        (panels[0], shared.stiff, r"$\delta_s$, stiff: pins bonded"),
        (panels[1], shared.flexible, r"$\delta_f$, flexible: pins absent"),
    ):
        _draw_face(axes, variant.mesh, variant.deflection.u, shared.parameters.carrier)
        curve = variant.deflection.curves["both"]
        peaks = curve.peak_angles()
        y, z = -curve.radius * np.sin(peaks), curve.radius * np.cos(peaks)
        axes.plot(
            y * 1e3, z * 1e3, "v", color="black", ms=7, label=f"{len(peaks)} peaks on the rim"
        )
        axes.set_title(name)
        axes.legend(loc="lower right", framealpha=1.0)
    return figure


def _draw_face(
    axes: Axes, mesh: TetMesh, u: NDArray[np.float64], carrier: CarrierParameters
) -> None:
    """Upwind face of plate A, coloured by its axial displacement under 1 kN m."""
    facets = boundary_facets(mesh.tets)
    on_face = (np.abs(mesh.points[facets][..., 0]) < 1e-7).all(axis=1)
    faces = facets[on_face]
    corners = np.concatenate([faces[:, [0, 3, 5]], faces[:, [1, 4, 3]], faces[:, [2, 5, 4]],
                              faces[:, [3, 4, 5]]])  # fmt: skip
    y, z = mesh.points[:, 1] * 1e3, mesh.points[:, 2] * 1e3
    used = np.unique(corners)
    axial = u[:, 0] * 1e6
    rim = used[np.hypot(y[used], z[used]) > 0.9e3 * carrier.sensor_radius]
    limit = float(np.abs(axial[rim]).max())
    image = axes.tripcolor(
        Triangulation(y, z, corners), axial, cmap="RdBu_r", shading="gouraud",
        norm=Normalize(-limit, limit),
    )  # fmt: skip
    R = carrier.sensor_radius * 1e3
    axes.plot(-R * np.sin(_RIM), R * np.cos(_RIM), "--", color=INK, lw=1.0)
    axes.set(aspect="equal", xlabel="$y_{PLC}$ [mm]", ylabel="$z_{PLC}$ [mm]")
    axes.figure.colorbar(
        image, ax=axes, label="axial displacement [µm per kN m]", shrink=0.85, extend="both"
    )


def deflection_curves(shared: SharedRuns) -> Figure:
    """Axial deflection of the rim over the angle, both variants (2012, figure 8)."""
    return curves_figure(
        shared.curves["delta_s"], shared.curves["delta_f"], shared.parameters.carrier.n_planets
    )


def seventh_mode(shared: SharedRuns) -> Figure:
    """First elastic mode of main shaft, carrier and pins, free in space (2012, figure 12)."""
    shapes, mode, pivot = _mode_shapes(shared)
    everything = np.concatenate([points for _, points, _ in shapes])
    length = float(np.ptp(everything, axis=0).max())
    largest = max(float(np.linalg.norm(u, axis=1).max()) for _, _, u in shapes)
    factor = _DRAWN_MODE * length / largest

    def add(plotter: Any) -> None:
        """Bodies in the mode, and at rest as a thin grid."""
        for mesh, points, u in shapes:
            size = np.linalg.norm(u, axis=1) / largest
            surface = skin(mesh, displacement=u, size=size, place=points)
            surface.points = (
                surface.point_data["place"] + factor * surface.point_data["displacement"]
            )
            plotter.add_mesh(
                surface, scalars="size", cmap="viridis", clim=(0.0, 1.0), smooth_shading=True,
                split_sharp_edges=True, copy_mesh=True, show_scalar_bar=False, **LIGHTING,
            )  # fmt: skip
            still = skin(mesh, place=points)
            still.points = still.point_data["place"].copy()
            plotter.add_mesh(still, style="wireframe", color="#9aa5b0", opacity=0.08)

    side = rendered(add, {}, (0.35, -1.0, 0.45), zoom=1.4)
    figure = Figure(figsize=(12.0, 6.8), layout="constrained")
    axes = figure.subplots()
    side.show(axes)
    figure.suptitle(
        f"mode 7 (first elastic one), {mode.frequency_hz:.1f} Hz, {mode.rim_motion}, drawn "
        f"{_DRAWN_MODE:.0%} of the length;\npins turn in their bores by {pivot:.0%} of the hub's "
        "own tilt"
    )
    figure.colorbar(
        ScalarMappable(Normalize(0.0, 1.0), "viridis"), ax=axes, orientation="horizontal",
        label="displacement over the largest", shrink=0.5,
    )  # fmt: skip
    return figure


#: Mesh of a body, its nodes [m] and their displacement in a mode.
BodyShape = tuple[TetMesh, NDArray[np.float64], NDArray[np.float64]]


def _mode_shapes(shared: SharedRuns) -> tuple[list[BodyShape], AssemblyMode, float]:
    """Shapes of main shaft, carrier and pins in the first elastic mode of the free group."""
    carrier, pin, shaft = (shared.bodies[name] for name in ("carrier", "pin", "main_shaft"))
    group = rotating_group(
        carrier.reduction.model, pin.reduction.model, shaft.reduction.model, pin_fit=PAPER_STIFFNESS
    ).model
    mode = _upright(group, assembly_modes(group, 2))
    placed = [_Placed(shaft, 0.0, {}), _Placed(carrier, 0.0, {})]
    for number, angle in enumerate(pin_angles(shared.parameters.carrier.n_planets), start=1):
        names = {f"pin_1_{position}": pin_pilot(number, position) for position in _PIN_PARTS}
        placed.append(_Placed(pin, float(angle), names))
    modal = [i for i, label in enumerate(group.labels) if label.startswith("mode ")]
    shapes = []
    for one in placed:
        n_modes = len(one.body.reduction.modes.omega)
        shapes.append(_shape(one, group, mode.shape, modal[:n_modes]))
        modal = modal[n_modes:]
    return shapes, mode, _pivot(group, mode.shape)


@dataclass(frozen=True)
class _Placed:
    """A body, the angle it is turned to [rad], and its pilots' names in the group."""

    body: BodyReduction
    angle: float
    names: Mapping[str, str]


def _shape(
    one: _Placed, group: ReducedModel, shape: NDArray[np.float64], modal: list[int]
) -> BodyShape:
    """Displacement of a body's nodes from the group's coordinates."""
    R, body = rotation_about_x(one.angle), one.body
    pilots = [
        shape[group.coordinates_of(one.names.get(pilot, pilot))]
        for pilot in body.reduction.model.pilots
    ]
    # In the body's own frame: the basis knows no other.
    turned = [(pilot.reshape(2, 3) @ R).ravel() for pilot in pilots]
    u = (body.reduction.basis @ np.concatenate([*turned, shape[modal]])).reshape(-1, 3)
    return body.mesh, body.mesh.points @ R.T, u @ R.T


def _upright(group: ReducedModel, modes: Sequence[AssemblyMode]) -> AssemblyMode:
    """First mode; of a pair of equal frequency the one that moves the shaft's end along z alone."""
    first, second = modes
    if second.frequency_hz > (1.0 + _SAME_FREQUENCY) * first.frequency_hz:
        return first
    end = group.coordinates_of(COUPLING)
    y = [mode.shape[end[1]] for mode in modes]
    shape = y[1] * first.shape - y[0] * second.shape
    return replace(first, shape=shape * np.sign(shape[end[2]]))


def _pivot(group: ReducedModel, shape: NDArray[np.float64]) -> float:
    def rotation(pilot: str) -> NDArray[np.float64]:
        """Rotation of a pilot in the mode, shape (3,)."""
        return shape[group.coordinates_of(pilot)[3:]]

    turned = [
        float(np.linalg.norm(rotation(pin_pilot(number, side)) - rotation(f"pin_{number}_{side}")))
        for number in (1, 2, 3)
        for side in _SIDES
    ]
    return max(turned) / float(np.linalg.norm(rotation("shaft_face")))


def pilot_nodes(shared: SharedRuns) -> Figure:
    """Pilots of carrier and pins with what they average, and one interface (2012, figure 13)."""
    figure = Figure(figsize=(12.5, 6.6), layout="constrained")
    overview, one = figure.subplots(1, 2, width_ratios=(1.35, 1.0))
    _draw_pilots(overview, shared)
    _draw_interface(one)
    return figure


def _draw_pilots(axes: Axes, shared: SharedRuns) -> None:
    """Carrier with the pilots of bores, face and seats, pin 1 before its bores with its own."""
    # Pilots that stand behind material are hollow.
    mesh, body = shared.flexible.mesh, shared.bodies["pin"]
    points = carrier_pilot_points(shared.parameters.carrier)
    bores = {f"pin_{i}_{side}": points[f"pin_{i}_{side}"] for i in (1, 2, 3) for side in _SIDES}
    others = {name: points[name] for name in ("shaft_face", "upwind_seat", "downwind_seat")}
    out = np.array([-0.6, 0.0, 0.0])
    of_pin = {
        f"{name} of the pin": point + out for name, point in body.reduction.model.pilots.items()
    }

    def add(plotter: Any) -> None:
        """Carrier, its coloured bores, pin 1 drawn out, and what each pilot averages."""
        plotter.add_mesh(
            skin(mesh), color=CARRIER, smooth_shading=True, split_sharp_edges=True, **LIGHTING
        )
        pin = skin(body.mesh)
        pin.points = pin.points + out
        plotter.add_mesh(
            pin, color=STEEL, opacity=0.55, smooth_shading=True, split_sharp_edges=True, **LIGHTING
        )
        for name, point in bores.items():
            plotter.add_mesh(surface_patch(mesh.points, mesh.surface(name)), color=_LOAD)
            _add_spokes(plotter, point, mesh.points[np.unique(mesh.surface(name))])
        for name, point in body.reduction.model.pilots.items():
            surface = body.mesh.points[np.unique(body.mesh.surface(name))]
            _add_spokes(plotter, point + out, surface + out)

    scene = rendered(add, bores | of_pin | others, _FROM_UPWIND)
    scene.show(axes, left=0.16, right=0.16, above=0.10, below=0.10)
    for name, pixel in scene.pixels.items():
        colour = SENSOR if name in others else FORCE
        hidden = name in _HIDDEN or name.endswith("downwind")
        fill = "none" if hidden else colour
        axes.plot(*pixel, "o", mfc=fill, mec=colour if hidden else "white", ms=7, mew=1.4, zorder=9)
    leader(
        axes,
        "pilots of the pin\n(pin 1 drawn out of its bores)",
        scene.pixels["pin_1_upwind of the pin"],
        scene.at("pin_1_upwind of the pin", 0.08, -0.17),
    )
    leader(
        axes,
        "pilot of a bore,\ntwo a pin",
        scene.pixels["pin_3_upwind"],
        scene.at("pin_3_upwind", -0.24, 0.20),
    )
    leader(
        axes,
        "shaft face and bearing seats\n(hollow: behind)",
        scene.pixels["shaft_face"],
        scene.at("shaft_face", 0.02, 0.42),
        colour=SENSOR,
    )


def _add_spokes(plotter: Any, pilot: NDArray[np.float64], nodes: NDArray[np.float64]) -> None:
    """Lines from a pilot to every fourth node that it averages."""
    shown = nodes[::4]
    ends = np.empty((2 * len(shown), 3))
    ends[0::2], ends[1::2] = pilot, shown
    plotter.add_lines(ends, color=FORCE, width=1.5)


def _draw_interface(axes: Axes) -> None:
    """The two pilots of one interface: translations tied, rotations sprung."""
    prepare(axes, (-1.5, 1.5), (-1.6, 1.5), "one interface, section")
    for plate in ((0.75, 1.25), (-1.25, -0.75)):
        box(axes, (-0.4, 0.4), plate, CARRIER)
    box(axes, (-0.9, 1.3), (-0.62, 0.62), STEEL, layer=1.0)
    for x in np.linspace(-0.35, 0.35, 5):
        for z in (-0.75, 0.75):
            line(axes, [(-0.12, 0.0), (float(x), z)], colour=_LOAD)
        for z in (-0.62, 0.62):
            line(axes, [(0.12, 0.0), (float(x), z)], colour=FORCE)
    spring(axes, (-0.12, 0.0), (0.12, 0.0), width=0.14, turns=3)
    disc(axes, (-0.12, 0.0), 0.05, _LOAD, layer=9.0)
    disc(axes, (0.12, 0.0), 0.05, FORCE, layer=9.0)
    leader(axes, "carrier's pilot,\naverages the bore (RBE3)", (-0.12, 0.0), (-0.95, 0.95),
           colour=_LOAD)  # fmt: skip
    leader(axes, "pin's pilot,\naverages the pin's end", (0.12, 0.0), (0.95, 0.95), colour=FORCE)
    words(
        axes,
        "both pilots are at one point (drawn apart): translations tied,\n"
        f"rotations against torsional springs of {PAPER_STIFFNESS:.0e} N m/rad".replace("+0", ""),
        (0.0, -1.45),
    )
