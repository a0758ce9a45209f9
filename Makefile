# Every target installs what it needs first (tools/install.sh) and reinstalls only after a change.
# Another interpreter: make test PYTHON=python3.12     Another result folder: make run OUT=elsewhere
PYTHON ?=
OUT := out
BIN := .venv/bin
PACKAGES := files geometry fe reduction simulation identification diagnosis workflows
PYTEST := $(BIN)/pytest --doctest-modules $(PACKAGES) tests

MAKEFLAGS += --no-print-directory
unexport PYTHONPATH PYTHONHOME

.PHONY: help install run test quick acceptance clean

help:
	@echo "make run     meshes, curves, reduced bodies, simulations and the gap report, written to $(OUT)/"
	@echo "make test    ruff, mypy, doctests and all tests"
	@echo "make quick   doctests and tests without the slow ones"
	@echo "make acceptance   the tests that take minutes: coverage of intervals, full blind check"
	@echo "make clean   removes everything the other targets made, .venv included"

install:
	@tools/install.sh $(PYTHON)

run: install
	$(BIN)/carrierflex run --out $(OUT)

test: install
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(PYTEST)

quick: install
	$(PYTEST) -m "not slow and not acceptance"

acceptance: install
	$(PYTEST) -m acceptance
	$(BIN)/carrierflex blind-check --workers 2 --no-keep --out $(OUT)/blind_check

clean:
	rm -rf .venv $(OUT) build *.egg-info .mypy_cache .ruff_cache .pytest_cache
	find $(PACKAGES) tests benchmarks -name __pycache__ -prune -exec rm -rf {} +
