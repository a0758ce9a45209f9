"""REXS, the Reusable Engineering EXchange Standard of the FVA: gearboxes of other programs.

A file is a list of components (gears, shafts, bearings) with attributes, and relations that join
them. It is read in any of its three forms, its planetary stage becomes dimensions of the carrier
and a stage case, and results of a run go back into a copy as load cases.

Ids of components, attributes and relations, and the units of attributes, are those of REXS 1.7:
its public description (spec.rexs.info/1.7) and its database of 2024-12-12 (rexs_schema_1.7.xml of
github.com/fva-net/rexs-api-java). Older files name the attributes that the stage reads alike.
"""
