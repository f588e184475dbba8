"""Simulated scans, whose truth is known.

scan_simulator   a motion as a folder of scans with truth beside it (`simulate_scans`)
range_scanner    a rounded surface between vertices, and depth cameras around it, by ray casting
"""
