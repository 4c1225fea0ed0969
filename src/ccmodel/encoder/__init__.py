"""Reconstruction of the motion that an encoder quantised.

A count observes the angle by an interval of one count (interval censoring). `rest_detection` finds where the drive
rests and estimates its angle within the count there, `smoothing` computes the posterior of a smooth curve under all
intervals, `expectation_propagation` has the kernels of both, and `reconstruction` joins them for a recording.
"""
