"""Registration: one topology laid onto a scan.

register         entry points: a neutral face, a frame, or non-rigid ICP
scan, scan_file  a scan, checked, and the files that hold one
landmarks        the 68 landmarks of a face, and the files that hold them
template         a head prepared for registration: surface, smoothness matrices, landmarks
head_search      roughly where the head is, from landmarks or by search
zero_pose        head pose: applying, removing and aligning
correspondences  which scan points belong to which points of the surface
closest_points   closest points on triangle meshes
model_fit        identity, expression and pose by Gauss-Newton (VOCA 2019, section 6)
free_offsets     smooth offsets from the model (VOCA 2019, section 6); eyes and teeth follow
nonrigid_icp     the alternative: optimal-step non-rigid ICP (Amberg et al. 2007)
accuracy         distance from the scan, from landmarks, and from the truth
"""
