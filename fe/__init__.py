"""Finite elements: stiffness and mass, distributing couplings, unit load cases, deflection curves.

Frames, angles and the sign of the torque are those of :mod:`carrierflex.geometry`. Degrees of
freedom of nodes are ordered node by node, x y z within a node, nodes in the order of the mesh;
pilots of rigid couplings follow the nodes. A pilot node has six: translations x y z, then rotations
about x y z.
"""
