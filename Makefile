# make run: environment, install, demo.   make test: environment with test extras, lint, quick suite.
# make validate: the same checks at full size (hours).
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: run test lint unit nojit bounds validate clean

run: $(VENV)/.installed
	$(BIN)/barchan run avalanche --out runs/avalanche-$(shell date +%Y%m%d-%H%M%S)

test: lint $(VENV)/.tested
	$(BIN)/barchan compile
	$(BIN)/python -m pytest -n 2 --dist worksteal tests src examples
	NUMBA_DISABLE_JIT=1 $(BIN)/python -m pytest -q -m nojit tests/unit
	NUMBA_BOUNDSCHECK=1 $(BIN)/python -m pytest -q -m bounds tests/reference

lint: $(VENV)/.tested
	$(BIN)/ruff check src tests examples

validate: $(VENV)/.tested
	$(BIN)/python -m pytest -m validate tests

$(VENV)/.made:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "barchan needs Python 3.11 or newer; use make PYTHON=/path/to/python3.11")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	touch $@

$(VENV)/.installed: $(VENV)/.made pyproject.toml
	$(BIN)/python -m pip install --quiet --editable .
	touch $@

$(VENV)/.tested: $(VENV)/.installed pyproject.toml
	$(BIN)/python -m pip install --quiet --editable '.[test]'
	touch $@

clean:
	rm -rf $(VENV) build src/*.egg-info
