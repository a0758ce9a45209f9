# Every target installs what it needs first (tools/install.sh) and reinstalls only after a change.
# Another interpreter: make test PYTHON=python3.12     Another result folder: make run OUT=elsewhere
# Tests run in two processes; another number: make test WORKERS=4
PYTHON ?=
OUT := out
WORKERS := 2
BIN := .venv/bin
PACKAGES := geometry fe reduction simulation identification diagnosis workflows
# A file's tests share fixtures and stay in one process. Dense matrices are small: a second thread of algebra only waits.
PYTEST := OMP_NUM_THREADS=1 $(BIN)/pytest --doctest-modules $(PACKAGES) tests \
	--numprocesses $(WORKERS) --dist loadfile --no-loadscope-reorder

MAKEFLAGS += --no-print-directory
unexport PYTHONPATH PYTHONHOME

.PHONY: help install run test lint types tests quick acceptance clean

help:
	@echo "make run     meshes, curves, reduced bodies, simulations and the gap report, written to $(OUT)/"
	@echo "make test    ruff, mypy, doctests and all tests, in two processes (WORKERS=4: in four)"
	@echo "make quick   doctests and tests without the slow ones"
	@echo "make acceptance   the tests that take minutes: coverage of intervals, full blind check"
	@echo "make clean   removes everything the other targets made, .venv included"

install:
	@tools/install.sh $(PYTHON)

run: install
	$(BIN)/carrierflex run --out $(OUT)

# The type checker runs beside the tests.
test: lint
	@$(MAKE) --jobs types tests

lint: install
	$(BIN)/ruff check
	$(BIN)/ruff format --check

types: install
	$(BIN)/mypy

tests: install
	$(PYTEST)

quick: install
	$(PYTEST) -m "not slow and not acceptance"

acceptance: install
	$(PYTEST) -m acceptance
	$(BIN)/carrierflex blind-check --workers 2 --no-keep --out $(OUT)/blind_check

clean:
	rm -rf .venv $(OUT) build *.egg-info .mypy_cache .ruff_cache .pytest_cache
	find $(PACKAGES) tests benchmarks -name __pycache__ -prune -exec rm -rf {} +
