# Two commands on a fresh machine: `make optimize` and `make test`. Everything lives in .venv.
PYTHON ?= python3
BIN := .venv/bin

.PHONY: optimize test coverage benchmark lint format docs clean

.venv/.run: pyproject.toml constraints.txt
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "lpc-mdo needs Python 3.11 or later")'
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --constraint constraints.txt torch
	$(BIN)/pip install --quiet --constraint constraints.txt --editable .
	touch $@

.venv/.test: .venv/.run
	$(BIN)/pip install --quiet --constraint constraints.txt --editable '.[test]'
	touch $@

optimize: .venv/.run
	$(BIN)/lpc-mdo optimize --output runs/baseline

test: lint
	OMP_NUM_THREADS=1 $(BIN)/pytest -n 2

.venv/.docs: .venv/.run
	$(BIN)/pip install --quiet --constraint constraints.txt --editable '.[docs]'
	touch $@

docs: .venv/.docs
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

.venv/.bench: .venv/.run
	$(BIN)/pip install --quiet --constraint constraints.txt --editable '.[bench]'
	touch $@

benchmark: .venv/.bench
	$(BIN)/python scripts/benchmark.py

lint: .venv/.test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# Lines that no test reaches; TESTS: some of the files.
coverage: .venv/.test
	OMP_NUM_THREADS=1 $(BIN)/pytest -n 2 --cov $(TESTS)

format: .venv/.test
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean:
	rm -rf .venv runs build *.egg-info
