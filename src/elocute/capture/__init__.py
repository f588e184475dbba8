"""Capture: scans or video of a person in, motion of one topology out.

Scans, in the order in which a recording goes through them:

scans               files of scans and landmarks; a landmark detector for scans without them
registration        the head's topology laid onto one scan
sequence_tracking   frame after frame, each from the one before; frame_store keeps them on disk
cleaning            neck, ears and eyes of the registered motion
sequence_report     an HTML page per sequence: errors, worst frames, flagged frames
scans_to_corpus     all of it in one call: folders of scans to a corpus
settings            of `scans_to_corpus` and of the simulated scanner
simulation          scans taken in software, whose truth is known

Video:

video               one face in a video to a Motion of the built-in head (`capture_video`)
video_to_corpus     videos to a corpus

Either way to shapes: `blendshapes` learns a basis of speech from a corpus.
"""
