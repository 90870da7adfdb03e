# Each target makes the environment it needs: Python 3.11+, make and a package index are enough.
PYTHON ?= python3
BIN := .venv/bin
WORKERS ?= 2
# Processor seconds that a test may take which is not marked slow; those above it run again, alone. The dearest take 12.
BUDGET ?= 20
# Most of the fast tests' time is the compiler's: what takes long is kept in out/programs. test-all runs what users run.
SKIPPED := while-loop-invariant-code-motion,simplify-while-loops
QUICK_TO_COMPILE := --xla_backend_optimization_level=0 --xla_disable_hlo_passes=$(SKIPPED) \
  --xla_cpu_parallel_codegen_split_count=1

.PHONY: run reproduce test test-all bench docs dist audit lock clean

# The main job: a robot described, simulated, designed, and a page of it.
run: .venv/run
	$(BIN)/python examples/designed_swimmer.py

# All studies of the published robots.
reproduce: .venv/run
	$(BIN)/nectosome reproduce --out out --force

test: .venv/dev
	$(BIN)/ruff check src studies tests benchmarks examples packaging docs
	$(BIN)/ruff format --check src studies tests benchmarks examples packaging docs
	$(BIN)/basedpyright
	$(BIN)/lint-imports
	cd studies && ../$(BIN)/lint-imports
	XLA_FLAGS="$(QUICK_TO_COMPILE)" NECTOSOME_CACHE=$(CURDIR)/out/programs $(BIN)/pytest -n $(WORKERS) -m "not slow" --junitxml=out/tests.xml
	XLA_FLAGS="$(QUICK_TO_COMPILE)" $(BIN)/python -m tests.budget out/tests.xml $(BUDGET)

test-all: .venv/dev
	$(BIN)/pytest -n $(WORKERS)

bench: .venv/dev
	$(BIN)/python -m benchmarks

docs: .venv/dev
	$(BIN)/python packaging/schemas.py
	$(BIN)/python docs/make/generate.py
	$(BIN)/mkdocs build --strict

# Wheel and sdist, into dist/: what they hold is checked, and the wheel is installed and used.
dist: .venv/dev
	rm -rf dist
	$(BIN)/python -m build
	$(BIN)/twine check --strict dist/*
	$(BIN)/python packaging/contents.py
	$(BIN)/python packaging/first_use.py

# What is known against the pinned packages; needs a package index that tells.
audit:
	test -x .venv-audit/bin/python || $(PYTHON) -m venv .venv-audit
	.venv-audit/bin/python -m pip install -q pip-audit==2.10.1
	.venv-audit/bin/pip-audit --disable-pip --require-hashes -r requirements/run.lock -r requirements/dev.lock

.venv/run: requirements/run.lock pyproject.toml studies/pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install -q --require-hashes -r requirements/run.lock
	$(BIN)/python -m pip install -q --no-deps -e . -e studies
	$(BIN)/python packaging/schemas.py
	touch $@

.venv/dev: requirements/dev.lock .venv/run
	$(BIN)/python -m pip install -q --no-deps --require-hashes -r requirements/dev.lock
	touch $@

# Maintainers: pins what pyproject.toml allows (needs uv).
lock: # capytaine 3.0 asks for pandas below 3 and works with 3.1, as the tests of panels show
	uv pip compile -q --universal --generate-hashes --no-header pyproject.toml --python-version 3.11 --extra video -o requirements/run.lock
	uv pip compile -q --universal --generate-hashes --no-header pyproject.toml --python-version 3.11 --extra dev -c requirements/run.lock --override requirements/override.txt -o requirements/dev.lock

clean:
	rm -rf .venv .venv-audit dist out site
