"""Which left-out effect, and of which size, gives the errors of the paper's Table I?

For every effect, strength and condition the general solver simulates a rig with that effect. Stiffness and friction of
the paper's model are fitted to it, as the paper fitted them to its half loop. The remaining errors are compared with
the seven numbers of Table I.
"""
