"""Sweeps: every combination of some values of a scene's keys, in parallel, resumable; a body is condensed once.

Only a sweep on a cluster needs Dask.
"""
