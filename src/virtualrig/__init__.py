"""A simulated rig that records batches: explicit dynamics, independent of the model under test."""
