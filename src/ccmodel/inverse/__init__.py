"""The load from the drive side alone, and the drive's motion that makes the load follow a wanted one.

Estimation
----------
Known at each sample are the drive's angle and torque; unknown is the load. The model's state before the sample and the
load's law leave one unknown, the misfit f of that law: a force at the rim of the load pulley (N; a torque in the
general solver), on top of the law or in its place. A step of the solver gives the drive torque T(f) that the model
expects. The estimate is the maximum of the posterior of f, by Newton's method: an iterated extended Kalman filter with
one state. Errors of friction and of the torque sensor's zero last for a whole recording; the filter considers them
without estimating them (Schmidt, Application of state-space methods to navigation problems, Advances in Control Systems
3, 1966). After the run, each uncertain parameter is perturbed by one standard deviation along the same f. If the load
has a law, one linear filter about the run estimates f and all parameters jointly; otherwise they are considered only.
Either covariance gives the intervals.

Where the friction front from the drive has not reached the load, T does not depend on f. The estimate is then the
model's own, its interval widens, and the sample is marked as hidden.

Every value depends on the samples up to its own time alone.
"""
