"""A simulated rig to record from: explicit dynamics, independent of the model under test."""
