# `make demo` and `make test` do all set-up by themselves; `make help` lists the rest.
SHELL := /bin/bash
PYTHON ?=
VENV := .venv
BIN := $(VENV)/bin
# One stamp each, so that set-up is done again only when pyproject.toml changes.
READY := $(VENV)/.ready-demo
READY_DEV := $(VENV)/.ready-dev

.DEFAULT_GOAL := help
.PHONY: help demo test test-all pytest baseline pictures lint mutants format docs site fmus wheel clean clean-kernels clean-amplitudes

help:  ## what there is
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## */  make \1\t/' | expand -t 24

demo: $(READY)  ## the paper's scenarios with three steering systems: scorecard, MCAP files and figures in demo/
	$(BIN)/activesteer reproduce --setting paper --setting literature --figures -o demo

# The quick tests run, which finds their type errors; `make lint` and `make test-all` check the types of all tests.
test: MARK := -m "not slow"
test:  ## lint, types, module borders, every test that is not slow, and the key metrics against their baseline
	$(MAKE) --no-print-directory -j2 $(READY_DEV) pictures
	$(MAKE) --no-print-directory -j2 baseline pytest MARK='$(MARK)' TYPED='activesteer tools'

test-all:  ## the same with the slow tests and the types of the tests
	$(MAKE) --no-print-directory -j2 $(READY_DEV) pictures
	$(MAKE) --no-print-directory -j2 baseline pytest

# A test process for each processor, up to four: each takes about a gigabyte, and more shorten little.
pytest: $(READY_DEV)
	$(BIN)/python -m pytest -n logical --maxprocesses 4 --dist loadgroup --no-loadscope-reorder $(MARK)

# Drivers and browser for tests of pictures, where root and apt-get can install them; else those tests are skipped.
pictures: | $(BIN)/python  # which may need apt-get too
	@tools/install_for_pictures.sh

# After lint, when the tests have compiled the kernels.
baseline: lint
	$(BIN)/python tools/baseline.py

lint: $(READY_DEV)  ## ruff, pyright, import-linter
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright --pythonpath $(BIN)/python $(TYPED)
	$(BIN)/lint-imports --no-logo

mutants: $(READY_DEV)  ## change 300 lines, one at a time, and see which the quick tests notice; hours, resumes where it was
	nice $(BIN)/python tools/mutants.py

format: $(READY_DEV)  ## format the code and mend what ruff can mend
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: $(READY_DEV)  ## build the documentation, in build/docs; a warning is an error
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

site: $(READY_DEV)  ## the same for a server, with search, in build/site; SITE_URL=https://... is where it will stand
	HOSTED=true SITE_URL="$(SITE_URL)" NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet --site-dir build/site

fmus: $(READY)  ## build the example FMUs in build/fmus; needs a C compiler
	$(BIN)/python examples/fmu/build.py build/fmus

wheel: $(READY_DEV)  ## build dist/*.whl
	$(BIN)/python -m build --wheel --no-isolation

clean-kernels:  ## delete the compiled kernels that numba keeps beside the sources
	find activesteer tests \( -name '*.nbi' -o -name '*.nbc' \) -delete

clean-amplitudes:  ## delete the steering amplitudes that were found by driving and are kept for the next run
	rm -rf "$${XDG_CACHE_HOME:-$$HOME/.cache}/activesteer/amplitudes"

clean: clean-kernels clean-amplitudes  ## delete the environment and everything generated
	rm -rf $(VENV) build dist demo .pytest_cache .ruff_cache .import_linter_cache

$(BIN)/python:
	tools/make_environment.sh $(VENV) $(PYTHON)

$(READY): pyproject.toml | $(BIN)/python
	tools/install.sh $(VENV) plot
	@touch $@

$(READY_DEV): pyproject.toml | $(BIN)/python
	tools/install.sh $(VENV) dev
	@touch $(READY) $@
