"""Measured recordings with something put into them, diagnosed where nothing else is in reach.

A model in use is found from some of a real instrument's recordings, as its owner would. Others, which it has not seen,
are diagnosed beside it, with the model held: untouched, with one thing put into their channels, and beside a model that
something was taken out of. What is put in is drawn from a seed; names say nothing of it, and no answer is on disk while
the diagnosis runs.
"""
