# Every target installs what it needs first (tools/install.sh) and reinstalls only after a change.
# Another interpreter: make test PYTHON=python3.12     Another result folder: make run OUT=elsewhere
# Tests run in two processes; another number: make test WORKERS=3. A process that dies ends the run instead of hanging it.
PYTHON ?=
OUT := out
BASE := debian:12
# Of make bench: names or parts of names, and 1 for small meshes and short records.
ONLY :=
QUICK :=
WORKERS := 2
FUZZ_INPUTS := 2000
BIN := .venv/bin
PACKAGES := files geometry fe reduction simulation identification diagnosis blind_check workflows
# A file's tests share fixtures and stay in one process. Dense matrices are small: a second thread of algebra only waits.
PYTEST := OMP_NUM_THREADS=1 $(BIN)/pytest --doctest-modules carrierflex studies examples validation tests \
	--numprocesses $(WORKERS) --dist loadfile --no-loadscope-reorder --max-worker-restart 0 --durations 20

MAKEFLAGS += --no-print-directory
unexport PYTHONPATH PYTHONHOME
# Where it is set, every process compiles scipy, gmsh and the tests anew: seconds each, and tests start many.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help install run container test lint types tests quick long fuzz acceptance bench performance clean install-development docs docs-test gallery mutants

help:
	@echo "make run     meshes, curves, reduced bodies, simulations and the gap report, written to $(OUT)/"
	@echo "make container   builds a container of a plain system (BASE=debian:13: of another one) and does make run in it"
	@echo "make test    ruff, mypy, doctests and tests, in two processes (WORKERS=4: in four)"
	@echo "make quick   doctests and tests without the slow ones"
	@echo "make long    whole jobs and diagnoses of some seconds each, which 'make test' leaves out: minutes"
	@echo "make acceptance   the tests that take minutes: coverage of intervals, kills, 100000 damaged files, full blind check"
	@echo "make fuzz    2000 damaged files through every reader (FUZZ_INPUTS=20000: more), one table of how they end"
	@echo "make bench   every benchmark beside its peer, one table of ratios, also in $(OUT)/bench.json; QUICK=1 takes minutes,"
	@echo "             ONLY=\"mounting_speed assembly\" chooses by name or part of a name"
	@echo "make performance   the tables of docs/performance.md from $(OUT)/bench.json"
	@echo "make mutants   every operator and reason of the modules that decide, changed one at a time, against their tests: minutes"
	@echo "make docs    the site with commands and Python from their docstrings, in build/site; a link into nothing fails"
	@echo "make docs-test   runs every code block of README and the pages, the notebooks and the tutorials: minutes"
	@echo "make gallery   runs the scripts of docs/gallery and keeps their pictures: minutes"
	@echo "make clean   removes everything the other targets made, .venv included"

install:
	@tools/install.sh $(PYTHON)

# The tools of tests, and what tests and benchmarks compare with: MKL and Exudyn, which have licences of their own.
install-development: install
	@tools/install.sh --development

# The job in a container that holds nothing but a plain system; another one: make container BASE=debian:13
container:
	docker build --build-arg BASE=$(BASE) --tag carrierflex .
	docker run --rm carrierflex

run: install
	$(BIN)/carrierflex run --out $(OUT)

# The type checker runs beside the tests.
test: lint
	@$(MAKE) --jobs types tests

lint: install-development
	$(BIN)/ruff check
	$(BIN)/ruff format --check

types: install-development
	$(BIN)/mypy

tests: install-development
	$(PYTEST)

quick: install-development
	$(PYTEST) -m "not slow and not long and not acceptance and not fuzz and not docs"

long: install-development
	$(PYTEST) -m "long and not docs and not acceptance"

# What README and the pages tell: every code block, the gallery's pictures, the notebooks' cells, the tutorials from end to end.
docs-test: install-development
	OMP_NUM_THREADS=1 $(BIN)/pytest tests/docs -m docs --numprocesses $(WORKERS) --max-worker-restart 0

acceptance: install-development
	$(PYTEST) -m acceptance
	FUZZ_INPUTS=100000 $(BIN)/pytest -m fuzz tests/fuzz
	$(BIN)/carrierflex blind-check --workers 2 --no-keep --out $(OUT)/blind_check

# Every reader with damaged files; another number: make fuzz FUZZ_INPUTS=20000
fuzz: install-development
	FUZZ_INPUTS=$(FUZZ_INPUTS) $(BIN)/pytest -q -m fuzz tests/fuzz

bench: install-development
	$(BIN)/python -m benchmarks $(ONLY) $(if $(filter-out 0,$(QUICK)),--quick) --json $(OUT)/bench.json

performance: install-development
	$(BIN)/python -m benchmarks.page $(OUT)/bench.json

# Needs no network and writes nothing into the repository; the exit code is 1 where a change survives.
mutants: install-development
	OMP_NUM_THREADS=1 $(BIN)/python -P tools/mutate_decisions.py

gallery: install-development
	$(BIN)/python -P tools/make_gallery.py

# mkdocs reads the source and imports nothing of it: an environment of its own, without finite elements.
docs:
	@[ build/docs-venv/installed -nt requirements-docs.lock ] || { rm -rf build/docs-venv && python3 -m venv build/docs-venv \
		&& build/docs-venv/bin/pip install -q --disable-pip-version-check --require-hashes -r requirements-docs.lock \
		&& touch build/docs-venv/installed; }
	NO_MKDOCS_2_WARNING=true build/docs-venv/bin/mkdocs build --quiet
	@echo "site: build/site/index.html"

clean:
	rm -rf .venv $(OUT) build *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find -P carrierflex $(PACKAGES) tests benchmarks studies examples validation -name __pycache__ -prune -exec rm -rf {} +
