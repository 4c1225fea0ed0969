"""Which left-out effect, and of which size, errs as the paper's Table I does?

For every effect, strength and condition a rig is made up with the general solver, stiffness and friction of the plain
model are fitted to it as the paper fitted them to its half loop, and the errors that are left are held against the
paper's seven numbers.
"""
