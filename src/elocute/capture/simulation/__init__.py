"""Simulated scans, whose truth is known.

scan_simulator   a motion as a folder of scans with truth beside it (`simulate_scans`)
smooth_surface   a rounded surface between the vertices of the template
rich_faces       speakers whose faces no rig spans: own shapes, flesh, habits
range_scanner    depth cameras around that surface, by ray casting
"""
