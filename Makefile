# The two commands are `make results` and `make test`; both set up what they need in .venv first.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
CORES ?= 2
# The former name of REGRESSORS.
REGRESSORS ?= $(RIVALS)
# Jobs of the pipeline and many tests are processes of their own. Where the environment forbids to write bytecode, each of
# them would compile all libraries from their sources again, which takes three times as long as the imports themselves.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help results real data test short-tests long-tests fuzz docs bench accuracy-gate input-checks \
  diagnosis-settings decision-rules form-errors joint-rigs law-bands outside-rigs past several-effects table-one \
  coverage proof proof-full proof-real slurm-test kills same-bytes load mutants lint lint-types lint-style lock sbom \
  clean

help:  ## list the targets
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

# `--require-hashes` refuses whatever is not pinned in the lock files; the package itself then needs no download.
# Bytecode is compiled when a module is first imported: all of it would take half a minute.
$(VENV)/.ready: requirements.lock pip.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "ccmodel needs Python 3.11 or newer; choose one with: make PYTHON=python3.12 ..." >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r pip.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

# A run that left something out, or whose model is less accurate than accepted, says what, and has failed.
define run_pipeline
	@$(BIN)/python workflow/run.py $(2) $(BIN)/snakemake --cores $(CORES) --configfile $(1) \
	  || { echo "The run did not come to its end; the messages above say why" >&2; exit 1; }
	@echo "The report is $(2)/index.html"
	@status=0; $(BIN)/ccmodel report $(2) || status=1; $(or $(3),true) || status=1; exit $$status
endef

results: $(VENV)/.ready  ## regenerate every figure, table and the report from data/raw; compare with the accepted accuracy
	$(call run_pipeline,config/config.yaml,results,$(BIN)/ccmodel accuracy check results)

real: $(VENV)/.ready  ## run the pipeline on the public da Vinci recordings: make real DATA=path
	@test -n "$(DATA)" || { echo "make real needs DATA=path of the mis-tool-characterization data" >&2; exit 2; }
	@$(BIN)/ccmodel import-mis-tool "$(DATA)" --out results/real/raw || test $$? -eq 1  # 1: files were left out
	$(call run_pipeline,config/real.yaml,results/real)

data: $(VENV)/.ready  ## record data/raw again with the virtual rig
	$(BIN)/virtualrig record config/virtual-rig.yaml --out data/raw --concealed data/concealed.json

# The linters, two processes, run while the first tests wait for one of them to compile the solvers.
test: $(VENV)/.ready  ## run the linters and all tests but the long ones
	$(MAKE) --no-print-directory -j 3 short-tests lint

# One process more than cores: a test of the pipeline often waits for Snakemake. BLAS has one thread in each: with more
# of them the tests take a fifth more of the cores.
short-tests: $(VENV)/.ready
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n $$(($(CORES) + 1)) --dist loadfile --no-loadscope-reorder \
	  -m "not long"

fuzz: $(VENV)/.ready  ## damage batches and files, and run the exact solver, FUZZ times as often as the tests do: docs/trust.md
	FUZZ=$(or $(FUZZ),60) $(BIN)/python -m pytest -n $(CORES) --dist loadfile tests/rig/test_damaged_batches.py \
	  tests/rig/test_damaged_signals.py tests/report/test_damaged_files.py tests/model/test_stated_limits.py

long-tests: $(VENV)/.ready  ## follow tutorial, guides and examples to the letter, run pipeline and rig in many ways: docs/trust.md
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n $$(($(CORES) + 1)) --dist loadfile --no-loadscope-reorder \
	  -m long

# A fresh environment every time: a build that reuses the last one's is silent about pages it does not read again.
docs: $(VENV)/.ready  ## build the documents: results/docs/html/index.html; a warning or a dead link is an error
	$(BIN)/python -m sphinx -n -W --keep-going -E -q -d results/docs/doctrees docs results/docs/html
	@echo "The documents are results/docs/html/index.html"

bench: $(VENV)/.ready  ## measure speed and accuracy: results/bench.json, docs/figures/work-precision.png
	$(BIN)/python benchmarks/bench.py

accuracy-gate: $(VENV)/.ready  ## count false alarms and catches of the comparison with the accepted accuracy: docs/accuracy.md
	$(BIN)/python -m benchmarks.accuracy_gate --cores $(CORES)

input-checks: $(VENV)/.ready  ## count the mistakes in logs and batch files that the checks name: docs/input-checks.md
	$(BIN)/python -m benchmarks.input_mistakes --cores $(CORES)

coverage: $(VENV)/.ready  ## count how often the fits' 90 % intervals hold the truth: docs/coverage.md
	$(BIN)/python benchmarks/interval_coverage.py

diagnosis-settings: $(VENV)/.ready  ## compute again the figures behind the diagnosis's settings: results/diagnosis-settings.csv
	$(BIN)/python -m benchmarks.diagnosis_settings --out results/diagnosis-settings.csv

decision-rules: $(VENV)/.ready  ## compare the decision with that of a checkout in FORMER and with simpler ones: results/decision-rules
	$(BIN)/python -m benchmarks.decision_rules --first 28000 --count 300 --cores $(CORES) --former $(FORMER) --out results/decision-rules

form-errors: $(VENV)/.ready  ## measure what the mechanisms' equations miss on rigs of other forms: results/form-errors.csv
	$(BIN)/python -m benchmarks.form_errors --cores $(CORES) --out results/form-errors.csv

joint-rigs: $(VENV)/.ready  ## diagnose together the studies of rigs that no single study decides: results/joint-rigs.csv
	$(BIN)/python -m benchmarks.joint_rigs --cores $(CORES) --out results/joint-rigs.csv

several-effects: $(VENV)/.ready  ## diagnose rigs with several effects: make several-effects KIND=triple SEED=0 N=20
	$(BIN)/python -m benchmarks.several_effects --kind $(or $(KIND),triple) --seed $(or $(SEED),0) --count $(or $(N),20) \
	  --cores $(CORES) --out results/several-effects

law-bands: $(VENV)/.ready  ## count how often the band of a learned law holds the true one: make law-bands SEED=320000 N=12
	$(BIN)/python -m benchmarks.law_bands --first $(or $(SEED),320000) --count $(or $(N),12) --cores $(CORES) \
	  --out results/law-bands.csv

past: $(VENV)/.ready  ## diagnose cables with a past and fresh ones: make past SEED=0 N=10
	$(BIN)/python -m benchmarks.past --seed $(or $(SEED),0) --count $(or $(N),10) --cores $(CORES) --out results/past

outside-rigs: $(VENV)/.ready  ## diagnose rigs of other forms and constants than the model's: make outside-rigs SEED=0 N=3
	$(BIN)/python -m benchmarks.outside_rigs build results/outside-rigs --seed $(or $(SEED),0) --count $(or $(N),3)
	$(BIN)/python -m benchmarks.outside_rigs diagnose results/outside-rigs/diagnoses results/outside-rigs --cores $(CORES)
	$(BIN)/python -m benchmarks.outside_rigs score results/outside-rigs/diagnoses results/outside-rigs

table-one: $(VENV)/.ready  ## ask which left-out effect errs as the paper's Table I does: results/table-one, docs/figures/table-one.png
	$(BIN)/ccmodel table-one config/table-one.yaml --out results/table-one --figure docs/figures/table-one.png \
	  --cores $(CORES)

proof: $(VENV)/.ready  ## diagnose six cases with concealed effects and score them: results/proof/quick.md
	status=0; $(BIN)/python -m proof quick --out results/proof/quick --cores $(CORES) || status=1; \
	$(BIN)/python -m proof score results/proof/quick --out results/proof/quick.json --page results/proof/quick.md \
	  --figures results/proof/figures --command "make proof" --selection "Six cases with fixed seeds." --strict \
	  || status=1; exit $$status

proof-full: $(VENV)/.ready  ## the full validation, or N of its cases drawn at random: docs/proof.md; resumes an interrupted run
	$(BIN)/python workflow/run.py results/proof \
	  $(BIN)/snakemake --snakefile proof/Snakefile --cores $(CORES) --keep-going $(if $(N)$(REGRESSORS),--config $(if $(N),cases=$(N)) $(if $(REGRESSORS),regressors=true))

proof-real: $(VENV)/.ready  ## seed faults in the public da Vinci recordings and diagnose them: make proof-real DATA=path
	@test -n "$(DATA)" || { echo "make proof-real needs DATA=path of the mis-tool-characterization data" >&2; exit 2; }
	@$(BIN)/ccmodel import-mis-tool "$(DATA)" --out results/real/raw || test $$? -eq 1  # 1: files were left out
	$(BIN)/python -m proof real results/real/raw --out results/proof/real --page docs/real-concealment.md

slurm-test: $(VENV)/.ready  ## run the pipeline and N cases of the proof as jobs of a local Slurm, and as ever; compare
	BATCHES="$(BATCHES)" CASES="$(N)" tests/slurm/run

kills: $(VENV)/.ready  ## kill the pipeline and three commands fifty times, fill their disk, and run them again: docs/trust.md
	$(BIN)/python -m benchmarks.kills --seed $(or $(SEED),0)

same-bytes: $(VENV)/.ready  ## compare runs with other cores, threads, hashes, locale, time zone and folder: docs/trust.md
	$(BIN)/python -m benchmarks.same_bytes

load: $(VENV)/.ready  ## run the pipeline on 10, 100 and 1,000 recordings, and read a log of ten million samples: docs/trust.md
	$(BIN)/python -m benchmarks.load --out results/load

mutants: $(VENV)/.ready  ## run the tests on N wrong operators, numbers and conditions; goes on where it was stopped: docs/trust.md
	$(BIN)/python -m benchmarks.mutants --count $(or $(N),300) --seed $(or $(SEED),0) --out results/mutants-$(or $(SEED),0)

lint: lint-types lint-style

lint-types: $(VENV)/.ready
	$(BIN)/mypy --no-error-summary

lint-style: $(VENV)/.ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check Snakefile proof/Snakefile workflow
	$(BIN)/snakemake --lint
	$(BIN)/snakemake --snakefile proof/Snakefile --lint
	$(BIN)/lint-imports --no-cache

lock:  ## pin the newest versions that fit pyproject.toml (needs uv)
	uv pip compile pyproject.toml --all-extras --universal --python-version 3.11 --upgrade --generate-hashes \
	  --no-emit-index-url --no-header -o requirements.lock

sbom: $(VENV)/.ready  ## list the pinned packages with hashes and licences: sbom.json, docs/dependencies.md
	$(BIN)/python -m benchmarks.sbom

clean:  ## remove everything the pipeline made
	rm -rf results .snakemake
