# The two commands are `make results` and `make test`; both set up what they need in .venv first.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
CORES ?= 2

.PHONY: help results real data test lint lock clean

help:  ## list the targets
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

# `--require-hashes` refuses whatever is not pinned in requirements.lock; the package itself then needs no download.
$(VENV)/.ready: requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "ccmodel needs Python 3.11 or newer; choose one with: make PYTHON=python3.12 ..." >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

results: $(VENV)/.ready  ## regenerate every figure, table and the report from data/raw
	$(BIN)/snakemake --cores $(CORES)
	@$(BIN)/ccmodel left-out results
	@echo "The report is results/index.html"

real: $(VENV)/.ready  ## run the pipeline on the public da Vinci recordings: make real DATA=path
	@test -n "$(DATA)" || { echo "make real needs DATA=path of the mis-tool-characterization data" >&2; exit 2; }
	@rm -rf results/real/raw  # made here; what an earlier DATA left must not stay among the batches
	$(BIN)/ccmodel import-mis-tool "$(DATA)" --out results/real/raw
	$(BIN)/snakemake --cores $(CORES) --configfile config/real.yaml
	@$(BIN)/ccmodel left-out results/real
	@echo "The report is results/real/index.html"

data: $(VENV)/.ready  ## record data/raw again with the virtual rig
	$(BIN)/virtualrig record config/virtual-rig.yaml --out data/raw

test: $(VENV)/.ready  ## run the tests and the linters
	$(BIN)/python -m pytest
	$(MAKE) --no-print-directory lint

lint: $(VENV)/.ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/lint-imports --no-cache

lock:  ## pin the newest versions that fit pyproject.toml (needs uv)
	uv pip compile pyproject.toml --all-extras --universal --python-version 3.11 --upgrade --generate-hashes \
	  --no-emit-index-url --no-header -o requirements.lock

clean:  ## remove everything the pipeline made
	rm -rf results .snakemake
