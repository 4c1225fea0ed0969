"""The pipeline's steps, from files to files, one module a step: what Snakemake's scripts and the command line call.

A rule reruns when anything that its step's module imports has changed (`ccmodel.provenance`).
"""
