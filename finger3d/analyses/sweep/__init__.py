"""Sweeps: every combination of some values of a scene's keys, on Dask workers, resumable; a body is condensed once.

Names are loaded when they are first used: what is swept in one process needs no Dask.
"""
