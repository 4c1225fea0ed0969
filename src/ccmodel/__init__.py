"""Cable-conduit transmissions: recordings beside a distributed model, and the physics behind what differs."""

__version__ = "0.1.0"
