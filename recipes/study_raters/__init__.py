"""Simulated raters who look at the motion of a study's clips: a trial that was not calibrated.

They find what is late, open, frozen or half as far; they do not rank good models, and their answers
are no evidence of what people see (docs/measurements/study.md#raters-who-look).
"""
