#!/usr/bin/env bash
# Snakemake runs this in a new environment, from the project's root.
set -eu
python -m pip install --require-hashes -r requirements.lock
python -m pip install --no-deps --no-build-isolation .
