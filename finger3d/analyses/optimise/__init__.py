"""Search for a design: free keys of a scene within bounds, by SciPy's optimisers, for the largest objective.

A body is condensed once and pressed at every mu; gauges are then read from the displacements, so that free keys of
gauges cost no condensation.  Where keys of the body are free as well, the gauges' are searched anew in every body.
"""
