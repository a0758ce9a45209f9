"""All effects of the campaign contract of kind "carrier", in the order of the contract."""

from carrierflex.simulation.carrier.effect import Effect
from carrierflex.simulation.carrier.effects.deflection import DEFLECTION
from carrierflex.simulation.carrier.effects.housing_and_face import HOUSING_AND_FACE
from carrierflex.simulation.carrier.effects.misalignment import MISALIGNMENT
from carrierflex.simulation.carrier.effects.radial_load import RADIAL_LOAD
from carrierflex.simulation.carrier.effects.sensors import SENSORS

CARRIER_EFFECTS: dict[str, Effect] = {
    effect.id: effect
    for effect in (*MISALIGNMENT, *DEFLECTION, *RADIAL_LOAD, *HOUSING_AND_FACE, *SENSORS)
}
