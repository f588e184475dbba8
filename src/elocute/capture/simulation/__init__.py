"""Simulated scans, whose truth is known.

scan_simulator   a motion as a folder of scans with truth beside it (`simulate_scans`)
smooth_surface   a rounded surface between the vertices of the template
range_scanner    depth cameras around that surface, by ray casting
"""
