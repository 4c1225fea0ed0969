"""The pipeline's steps before the studies, from files to files, a module for each: ingest, fit, simulate, predict.

Snakemake's scripts and the command line call the same functions. A rule reruns when a module that its step imports has
changed (`ccmodel.provenance`).
"""
