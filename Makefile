# make run: environment, install, demo.   make test: environment with test extras, lint, quick suite.
# make validate: the same checks at full size (hours).   make bench: beside other codes (an hour or two; docs/how-to/benchmark.md).
# make docs: the documentation site in build/docs.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: run test lint unit nojit bounds validate bench docs clean

run: $(VENV)/.installed
	$(BIN)/barchan run avalanche

test: lint $(VENV)/.tested
	$(BIN)/barchan compile & compiling=$$!; NUMBA_DISABLE_JIT=1 $(BIN)/python -m pytest -q -m nojit tests/unit && wait $$compiling
	$(BIN)/python -m pytest -n 2 --dist worksteal tests src examples
	$(BIN)/mpiexec -n 2 $(BIN)/python -m pytest -q -p no:cacheprovider tests/mpi
	NUMBA_BOUNDSCHECK=1 $(BIN)/python -m pytest -n 2 --dist worksteal -m "bounds and not validate" tests/reference tests/unit/test_fuzz_checkpoint.py

lint: $(VENV)/.tested
	$(BIN)/ruff check src tests examples docs

validate: $(VENV)/.tested
	$(BIN)/python -m pytest -m validate tests
	for ranks in 3 4; do $(BIN)/mpiexec -n $$ranks $(BIN)/python -m pytest -q -p no:cacheprovider tests/mpi || exit; done
	$(BIN)/mpiexec -n 8 $(BIN)/python -m pytest -q -p no:cacheprovider tests/mpi

CASES ?= chute dense avalanche gas small dense-1m rebuild
THREADS ?= 1

bench: $(VENV)/.tested
	for case in $(CASES); do $(BIN)/barchan bench $$case --threads $(THREADS) || exit; done

docs: $(VENV)/.documented
	$(BIN)/python -m sphinx -E -W --keep-going docs build/docs

$(VENV)/.made:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "barchan needs Python 3.11 or newer; use make PYTHON=/path/to/python3.11")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	touch $@

$(VENV)/.installed: $(VENV)/.made pyproject.toml
	$(BIN)/python -m pip install --quiet --editable .
	touch $@

$(VENV)/.tested: $(VENV)/.made pyproject.toml
	$(BIN)/python -m pip install --quiet --editable '.[test,docs]'
	touch $@ $(VENV)/.installed $(VENV)/.documented

$(VENV)/.documented: $(VENV)/.installed pyproject.toml
	$(BIN)/python -m pip install --quiet --editable '.[docs]'
	touch $@

clean:
	rm -rf $(VENV) build src/*.egg-info
