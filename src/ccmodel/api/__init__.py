"""The Python interface: batches, fits, diagnoses and models as objects, and the functions that make them.

Users import its names from `ccmodel`. The command line calls the same functions.
"""
