"""Live speech to programs that listen: sources of sound, targets of frames, and the clock between.

sources     a file at its own pace, standard input, a microphone
sender      frames sent at even times, each as late as was promised; late ones dropped
targets     what frames are sent as, by name: Live Link Face, VMC, iFacialMocap, JSON
"""
