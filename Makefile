# `make run` and `make test` do everything: both set up .venv first, and again after a change of the requirements.
# uv is used where it is installed, venv and pip elsewhere. `make PYTHON=/path/to/python ...` names the interpreter.

VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
DOCS_STAMP := $(VENV)/.docs-installed
UV := $(shell command -v uv 2>/dev/null)
# The first of these that is new enough makes the environment.
PYTHON ?= python3.13 python3.12 python3.11 python3
CAMPAIGN ?= campaigns/almeida_2010.toml
# SLOW=1 adds the tests marked slow.
SLOW ?=
PYTEST_ARGS ?=
BENCH_ARGS ?=
MUTANTS_ARGS ?=
FLOORS_TESTS ?= $(patsubst %,tests/test_%.py,campaign_run campaign_spec case_figures cli closure_kinds compare_page data_files delimited \
  edited_runs mjcf_roundtrip mjcf_setup pinocchio_reference portable recorded reference_closure rendering report_formats \
  report_pictures statements studio_session sweep_run urdf)
# Campaigns whose reports are kept in reports/published.
PUBLISHED := almeida_2010 almeida_2010_as_printed garcia_murillo_2016 mass_models design_sweep control_4rprp almeida_2010_control

# Installs the package: environment, constraints, extra.
install = $(if $(UV),"$(UV)" pip install --quiet --python $(1)/bin/python,$(1)/bin/python -m pip install --quiet --disable-pip-version-check) --constraint $(2) --editable '.[$(3)]'

# What an interpreter must offer: uv brings its own installer, pip comes from the interpreter's ensurepip.
SUITABLE := import sys, $(if $(UV),os,ensurepip, venv); sys.exit(sys.version_info < (3, 11))

.DEFAULT_GOAL := help
.PHONY: help setup run test test-slow test-long test-browser test-floors mutants reports library docs bench lint format clean

help: ## List the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "make %-10s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

setup: $(STAMP) ## Create .venv with the package and its development tools

$(STAMP): pyproject.toml constraints.txt
	@if ! $(BIN)/python -c 'import sys' 2>/dev/null; then \
	  for candidate in $(PYTHON); do \
	    if "$$candidate" -c '$(SUITABLE)' 2>/dev/null; then python="$$candidate"; break; fi; \
	  done; \
	  if [ -z "$$python" ]; then \
	    echo "make: no Python >= 3.11 with venv and ensurepip among: $(PYTHON); install one, or say make PYTHON=/path/to/python" >&2; \
	    exit 1; \
	  fi; \
	  rm -rf $(VENV); \
	  if [ -n "$(UV)" ]; then \
	    "$(UV)" venv --quiet --python "$$("$$python" -c 'import sys; print(sys.executable)')" $(VENV); \
	  else \
	    "$$python" -m venv $(VENV); \
	  fi; \
	fi
	@echo "setting up $(VENV) ($(if $(UV),uv,pip))"
	@$(call install,$(VENV),constraints.txt,dev)
	@touch $@

run: $(STAMP) ## Run the campaign of the 2010 paper (CAMPAIGN=... for another)
	@$(BIN)/workbench run $(CAMPAIGN)

test: lint ## Check style and types, then run the tests (SLOW=1: all of them)
	$(BIN)/pytest -n 2 --dist worksteal $(if $(SLOW),-m "(slow or not slow) and not long") $(PYTEST_ARGS)

test-slow: $(STAMP) ## Run only the tests marked slow
	$(BIN)/pytest -m "slow and not long" $(PYTEST_ARGS)

test-long: $(STAMP) ## Run the tests that take many minutes, by hand: all bad inputs, all commands among planted files
	$(BIN)/pytest -m long $(PYTEST_ARGS)

test-browser: $(STAMP) ## Run the tests that open a report or the studio in Chromium
	$(BIN)/pytest -n 2 -m browser $(PYTEST_ARGS)

# The lowest versions that pyproject.toml allows, in an environment of their own, with machine code of its own; some minutes,
# so not among the other tests. Not all of the fast tests but those that use each dependency; FLOORS_TESTS=tests runs all.
# What old libraries use of newer ones that is to go there some day is theirs: no error here.
test-floors: $(STAMP) ## Run the tests with the lowest versions of all dependencies
	@mkdir -p build && $(BIN)/python tests/floors.py > build/floors.txt
	@if [ ! -d $(VENV)-floors ]; then $(BIN)/python -m venv $(VENV)-floors; fi
	@$(call install,$(VENV)-floors,build/floors.txt,dev)
	NUMBA_CACHE_DIR=$(abspath build/floors-kernels) $(VENV)-floors/bin/pytest -n 2 --dist worksteal -W ignore::DeprecationWarning $(FLOORS_TESTS) $(PYTEST_ARGS)

# Hours where CPU is scarce; what was tried is kept in build/mutants, so that it can be stopped and gone on with.
mutants: $(STAMP) ## Plant small faults in the core modules and see which no test notices (MUTANTS_ARGS=--help)
	PYTHONPATH=tests:src $(BIN)/python -m mutants $(MUTANTS_ARGS)

# Rendered pictures depend on the machine's OpenGL, so those that are kept are used again; remove them to draw new ones.
# A film of a study shows its very runs and is drawn anew.
reports: $(STAMP) ## Rebuild reports/published: only date, machine and timings in their heads differ
	@for name in $(PUBLISHED); do \
	  built=build/reports/$$name; kept=reports/published/$$name; drawn=build/pictures/$$name; \
	  if [ ! -d $$kept/pictures ] && ! grep -qE '^\[(sweep|control)\]' campaigns/$$name.toml; then \
	    $(BIN)/workbench run campaigns/$$name.toml --quick --out $$drawn >/dev/null || exit 1; \
	    if [ -f $$drawn/pictures/film.webp ]; then mkdir -p $$kept; cp -R $$drawn/pictures $$kept/pictures; fi; \
	  fi; \
	  rm -rf $$built; pictures=--no-pictures; \
	  if grep -qE '^\[control\]' campaigns/$$name.toml; then pictures=--pictures; fi; \
	  $(BIN)/workbench run campaigns/$$name.toml $$pictures --out $$built || exit 1; \
	  if [ $$pictures = --pictures ]; then \
	    mkdir -p $$kept; rm -rf $$kept/pictures; cp -R $$built/pictures $$kept || exit 1; \
	  elif [ -d $$kept/pictures ]; then \
	    cp -R $$kept/pictures $$built/pictures && $(BIN)/workbench report $$built >/dev/null || exit 1; \
	  fi; \
	  rm -rf $$kept/report.html $$kept/report.md $$kept/figures; \
	  mkdir -p $$kept; \
	  cp -R $$built/report.html $$built/report.md $$built/figures $$kept || exit 1; \
	done

$(DOCS_STAMP): $(STAMP)
	@echo "setting up $(VENV) for the documentation"
	@$(call install,$(VENV),constraints.txt,docs)
	@touch $@

docs: $(DOCS_STAMP) ## Build the documentation site into build/site/html; warnings and dead links are errors
	@$(BIN)/python -m website

library: $(STAMP) ## Check the library of robots and rebuild examples/library.json and docs/library.md
	$(BIN)/python benchmarks/library.py

bench: $(STAMP) ## Measure speed, as ratios in one run (BENCH_ARGS=--quick to try it); results in benchmarks/results
	$(BIN)/python benchmarks/run.py $(BENCH_ARGS)

lint: $(STAMP) ## Check style and types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy --strict src

format: $(STAMP) ## Put the code into shape
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean: ## Remove .venv, caches and builds
	rm -rf $(VENV) $(VENV)-floors build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find src tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} + 2>/dev/null || true
