"""An importing tool of the tests, by fmpy."""

import fmpy
import numpy as np


class Tool:
    """The calls of both versions under one name, with the messages that the unit reports."""

    def __init__(self, file, folder):
        self.folder = fmpy.extract(str(file), unzipdir=str(folder))
        self.description = fmpy.read_model_description(self.folder)
        self.version = self.description.fmiVersion[0]
        self.at = {v.name: v.valueReference for v in self.description.modelVariables}
        self.inputs = self._names("input")
        self.outputs = self._names("output")
        self.messages = []

    def _names(self, causality):
        variables = (v for v in self.description.modelVariables if v.causality == causality)
        return [v.name for v in variables if not v.name.endswith("_rate")]

    def instance(self):
        kind = fmpy.fmi2.FMU2Slave if self.version == "2" else fmpy.fmi3.FMU3Slave
        unit = kind(
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="unit",
        )
        if self.version == "2":
            callbacks = fmpy.fmi2.fmi2CallbackFunctions()
            callbacks.logger = fmpy.fmi2.fmi2CallbackLoggerTYPE(
                lambda *call: self.messages.append(call[4].decode())
            )
            unit.instantiate(callbacks=callbacks)
            unit.get, unit.set = unit.getReal, unit.setReal
            unit.get_state, unit.set_state = unit.getFMUstate, unit.setFMUstate
            unit.store, unit.restore = unit.serializeFMUstate, unit.deSerializeFMUstate
        else:
            unit.instantiate(logMessage=lambda *call: self.messages.append(call[3].decode()))
            unit.get, unit.set = unit.getFloat64, unit.setFloat64
            unit.get_state, unit.set_state = unit.getFMUState, unit.setFMUState
            unit.store, unit.restore = unit.serializeFMUState, unit.deserializeFMUState
        return unit

    def started(self, inputs=()):
        """A unit in step mode; without `inputs` with those of its description."""
        unit = self.instance()
        self.begin(unit)
        if len(inputs):
            unit.set(self.references(self.inputs), list(inputs))
        unit.exitInitializationMode()
        return unit

    def begin(self, unit):
        if self.version == "2":
            unit.setupExperiment(startTime=0.0)
            unit.enterInitializationMode()
        else:
            unit.enterInitializationMode(startTime=0.0)

    def references(self, names):
        return [self.at[name] for name in names]

    def read(self, unit):
        return unit.get(self.references(self.outputs))

    def steps(self, unit, time, inputs):
        """Step over `time`, `inputs` linear between its instants; outputs at each."""
        signals = [self.read(unit)]
        for begin, end, now, after in zip(time, time[1:], inputs, inputs[1:], strict=False):
            self.set_inputs(unit, now, (after - now) / (end - begin))
            unit.doStep(begin, end - begin)
            signals.append(self.read(unit))
        return np.array(signals)

    def set_inputs(self, unit, values, rates):
        references = self.references(self.inputs)
        unit.set(references, list(values))
        if self.version == "2":
            unit.setRealInputDerivatives(references, [1] * len(references), list(rates))
        else:
            unit.set(self.references([f"{name}_rate" for name in self.inputs]), list(rates))

    def partials(self, unit, unknowns, knowns):
        """Partial derivatives, one call a known."""
        references, get = self.references(unknowns), unit.getDirectionalDerivative
        rows = [get(references, [self.at[known]], [1.0]) for known in knowns]
        return np.array(rows).T

    def output_derivatives(self, unit):
        get = unit.getRealOutputDerivatives if self.version == "2" else unit.getOutputDerivatives
        return np.array(get(self.references(self.outputs), [1] * len(self.outputs)))

    def partner(self, unit, name, change):
        """State of `unit` with one state variable changed, by its stored bytes."""
        stored = unit.store(unit.get_state())
        value = unit.get(self.references([name]))[0]
        at = stored.index(np.float64(value).tobytes())
        assert stored.count(np.float64(value).tobytes()) <= 2, "the value has to stand out"
        changed = stored[:at] + np.float64(value + change).tobytes() + stored[at + 8 :]
        return unit.restore(changed)


def central(shifted, i, step):
    """Derivative by two central differences without the error of third order."""
    near, far = ((shifted(i, h) - shifted(i, -h)) / (2.0 * h) for h in (step, 2.0 * step))
    return (4.0 * near - far) / 3.0
