"""Validation on concealed effects: builds the cases, has each diagnosed in isolation, and scores the results."""
