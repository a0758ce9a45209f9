"""Benchmarks: each compares this project with an independent way to the same result, in one run.

A benchmark is a module with a function ``ratios`` that yields :class:`benchmarks.ratio.Ratio`, its
arguments being the sizes of the full comparison, and ``QUICK``, the smaller ones of a quick run.
"""
