"""Accuracy of the model on the recordings of a run, against an accepted baseline and over the project's commits.

`measure` measures a run; `baseline` reads and writes what was accepted; `comparison` decides what is a loss; `history`
keeps the numbers of past commits. `ccmodel accuracy` and the study `ccmodel.studies.baseline` are their two users.
"""
