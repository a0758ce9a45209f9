"""From a planet carrier's parameters to a diagnosed gap between simulation and measurement.

The folders of the repository are the stages of the method; an installed copy holds them below this
name: ``files``, ``geometry``, ``fe``, ``reduction``, ``simulation``, ``identification``,
``diagnosis``, ``blind_check``, ``workflows``.
"""
