"""An Ansys archive in the form that releases 13 to 2021 write, two solids of two materials."""

#: A hexahedron and a tetrahedron, degenerate of type 185, on its face; one facet for meshing.
ARCHIVE = """/COM,ANSYS RELEASE 13.0    UP20101012       15:40:03    03/17/2015
/PREP7
ET,       1,185
ET,       2,200
KEYOPT,       2, 1,      6
NBLOCK,6,SOLID,        10,         9
(3i8,6e20.13)
       1       0       0 0.0000000000000E+00
       2       0       0 1.0000000000000E+00
       3       0       0 1.0000000000000E+00 1.0000000000000E+00
       4       0       0 0.0000000000000E+00 1.0000000000000E+00
       5       0       0 0.0000000000000E+00 0.0000000000000E+00 1.0000000000000E+00
       6       0       0 1.0000000000000E+00 0.0000000000000E+00 1.0000000000000E+00
       7       0       0 1.0000000000000E+00 1.0000000000000E+00 1.0000000000000E+00
       8       0       0 0.0000000000000E+00 1.0000000000000E+00 1.0000000000000E+00
      10       0       0 2.5000000000000E-01 2.5000000000000E-01-1.0000000000000E+00
N,R5.3,LOC,       -1,
EBLOCK,19,SOLID,         3,         3
(19i8)
       1       1       1       1       0       0       0       0       8       0       1       1       2       3       4       5       6       7       8
       2       1       1       1       0       0       0       0       8       0       2       1       3       2       2      10      10      10      10
       1       2       1       1       0       0       0       0       4       0       3       1       2       3       4
      -1
CMBLOCK,START   ,NODE,       2  ! users node component definition
(8i10)
         1        -4
CMBLOCK,TIP     ,NODE,       3
(8i10)
         5        -7        10
"""  # noqa: E501 - columns of the format
