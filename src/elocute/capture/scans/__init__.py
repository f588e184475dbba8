"""Scans and landmarks in files, before anything is registered.

scan_sequence        a folder of numbered scans with capture.json: what there is to register
landmark_detection   landmarks found in renders of a scan, where no file gives them
landmark_page        a page on which they are set by hand
scan_checks          what is wrong with a folder, before hours are spent on it
"""
