"""From a video of somebody talking to Motion of the built-in head.

frames.py     pictures and their times out of a container
detector.py   a picture to 478 points: MediaPipe's, or any callable like it
track.py      one face over time, on a constant clock, gaps bridged and flagged
points.py     where the 478 points lie on the built-in head
camera.py     projection and head pose
person.py     whose face: identity, camera and what is left between model and detector
fit.py        every frame: pose, jaw, ARKit's shapes and gaze; lips that touch are closed
capture.py    all of it in one call
"""
