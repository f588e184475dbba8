"""Registration: one topology laid onto a scan.

register         entry points: a neutral face, a frame, or non-rigid ICP
template         a head prepared for registration: surface, smoothness matrices, landmarks
initial_pose     roughly where the head is, from landmarks or by search
pose             head pose: applying, removing and aligning
correspondences  which scan points belong to which points of the surface
closest_points   closest points on triangle meshes
model_fit        identity, expression and pose by Gauss-Newton (VOCA 2019, section 6)
free_offsets     smooth offsets from the model (VOCA 2019, section 6)
nonrigid_icp     the alternative: optimal-step non-rigid ICP (Amberg et al. 2007)
accuracy         distance from the scan, from landmarks, and from the truth
"""
