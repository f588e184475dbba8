"""Scans and landmarks in files, before anything is registered.

scan_sequence        a folder of numbered scans with capture.json: what there is to register
scan_file            one .ply or .obj to a Scan, in metres
scan                 Scan, and `checked_scan`: strays and points that are not finite removed
landmarks            the 68 landmarks; landmark_formats reads .ljson and .pts
landmark_detection   landmarks found in renders of a scan, where no file gives them
scan_checks          what is wrong with a folder, before hours are spent on it
"""
