"""How does the rim deflect under drive torque? Six peaks with bonded pins, three without pins."""

from pathlib import Path

from fe.carrier_curves import named_curves
from fe.curve_files import write_curves
from fe.deflection_curves import DeflectionCurve
from fe.view import curves_figure
from geometry.carrier_mesh import DEFAULT_SIZE
from geometry.parameter_files import read_parameters
from workflows.carrier_variants import flexible_variant, stiff_variant
from workflows.outputs import plain, prepared_folder, save_figure, save_json, versions
from workflows.progress import Stages


def main(
    *, out: Path, size: float = DEFAULT_SIZE, parameters: Path | None = None, quiet: bool = False
) -> dict[str, DeflectionCurve]:
    """Compute the rim's deflection curves by finite elements.

    Writes deflection_curves.csv (theta_deg; delta_s, delta_f in m per kN m of drive torque; g_s, g_f in m per N on pin 1;
    the radial ones beside them), deflection_curves.png and inputs.json.

    Parameters
    ----------
    out
        Output folder.
    size
        Element edge length [m].
    parameters
        TOML file with the tables [carrier], [pin], [gear], dimensions in metres; what it leaves out keeps its default.
    quiet
        Show no progress.

    Returns
    -------
    dict
        The four curves by name. A good answer has six peaks in delta_s, three in delta_f, and orders 3, 6, 9 ... only.
    """
    stage = read_parameters(parameters)
    prepared_folder(out)
    stages = Stages(3, quiet)
    with stages.stage(f"flexible carrier, elements of {size} m"):
        flexible = flexible_variant(stage, size)
    with stages.stage(f"stiff carrier, elements of {size} m"):
        stiff = stiff_variant(stage, size)
    with stages.stage("files"):
        curves = named_curves(stiff.deflection, flexible.deflection)
        write_curves(out / "deflection_curves.csv", curves)
        save_figure(out / "deflection_curves.png", curves_figure(curves["delta_s"], curves["delta_f"]))
        save_json(out / "inputs.json", {"size": size, "stage": plain(stage), "versions": versions()})
    return curves
