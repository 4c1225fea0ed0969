"""Seeded faults in measured recordings, diagnosed in isolation.

A baseline model is identified from some of a real instrument's recordings. The remaining recordings are diagnosed with
that baseline frozen: as measured, with one fault seeded into their channels, and with one mechanism removed from the
baseline. Faults and their sizes are drawn from a seed. The names of the cases reveal nothing, and no answer is on disk
while the diagnosis runs.
"""
