"""Names of a node's motions in other programs' matrices."""

#: Names of the components 0 to 5.
COMPONENT_NAMES = ("Tx", "Ty", "Tz", "Rx", "Ry", "Rz")
