"""Settings of all tests."""

from hypothesis import settings

# The same examples in every run, so that a green run stays green; no deadline, as a first call compiles.
settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")
