"""The parametric carrier as a CAD file: STEP in millimetres, as CAD programs write it."""

from pathlib import Path

import gmsh

from carrierflex.files.whole_files import whole_file
from carrierflex.geometry.carrier_solid import carrier_solid
from carrierflex.geometry.half_sector import MeshingError, quiet_geometry
from carrierflex.geometry.parameters import CarrierParameters
from carrierflex.geometry.pins import pin_angles
from carrierflex.geometry.silent_output import silent_stdout


def write_step(carrier: CarrierParameters, path: Path) -> None:
    """Write the whole carrier without pins as one solid.

    Parameters
    ----------
    carrier : CarrierParameters
        Dimensions [m].
    path : Path
        STEP file (.step or .stp), unit millimetre.

    Raises
    ------
    ValueError
        Where the suffix is another.
    MeshingError
        Where OpenCASCADE cannot build or write the solid.
    """
    if path.suffix not in (".step", ".stp"):
        raise ValueError(f"{path}: suffix {path.suffix!r}; expected .step or .stp")
    with whole_file(path) as temporary, quiet_geometry() as geometry:
        # The model's unit; OpenCASCADE writes millimetres and converts.
        gmsh.option.setString("Geometry.OCCTargetUnit", "M")
        try:
            angles = [float(angle) for angle in pin_angles(carrier.n_planets)]
            carrier_solid(geometry, carrier, angles)
            geometry.synchronize()
            with silent_stdout():
                gmsh.write(str(temporary))
        except Exception as error:
            raise MeshingError(
                f"{path}: OpenCASCADE could not write the carrier ({error})"
            ) from error
