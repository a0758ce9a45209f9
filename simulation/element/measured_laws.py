"""What a measured shape of one element may be kept as."""

from carrierflex.simulation.element.memory_laws import MemoryLaw
from carrierflex.simulation.element.surface_laws import SurfaceLaw
from carrierflex.simulation.element.tabulated_laws import TabulatedLaw

MeasuredElementLaw = TabulatedLaw | MemoryLaw | SurfaceLaw
