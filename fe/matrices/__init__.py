"""Matrices of other finite element programs: files in, a structural model out.

Every reader returns the numbers as the file prints them (:mod:`stored_matrix`), with the names of
the degrees of freedom where the format holds them. A triangle is mirrored, nothing else is changed.
"""
