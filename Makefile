# Everything runs from an environment that make itself creates, from pinned versions, on a machine
# with nothing but Python and make. After the first installation no target needs the network.
#
#   make first          the environment and one figure with its claims, in a minute or two
#   make figures        the environment, the ledger, every figure at full size, the claims table
#   make gallery        a dozen stills of our own at 1920 x 1080, in gallery/out
#   make test           every test, shapes checked on every call
#   make check          the ledger of equations, proved or corrected
#   make docs           the site, in docs/_build/index.html
#   make compare        the same scenes through Radiance, Mitsuba and this, in docs/kept/peers
#   make fuzz N=100000  nasty scenes, damaged files, killed programs and workers; CASE=... does one again
#
#   make smoke PYTHON=python3.13 VENV=.venv313      the same library on another Python
#   make smoke-lowest                               ... and on the lowest versions that it allows

PYTHON ?= python3
VENV ?= .venv
# Parallel test processes; each one is a JAX, so many cores are not worth as many processes.
WORKERS ?= auto
PYTEST_ARGS ?=
CONSTRAINTS ?= constraints.txt
EXTRAS ?= test,lint,notebooks

BIN := $(VENV)/bin
READY := $(VENV)/.ready
PEERS_READY := $(VENV)/.ready-peers
DOCS_READY := $(VENV)/.ready-docs
PYTEST := $(BIN)/python -m pytest
NOTEBOOKS := $(patsubst notebooks/%.py,notebooks/ipynb/%.ipynb,$(wildcard notebooks/*.py))

# The environment's packages and nothing else: no user site, no inherited search path.
export PYTHONNOUSERSITE := 1
unexport PYTHONPATH
# Modules are compiled when they are first imported, which most of what is installed never is: that
# halves the time of an installation. Later imports find them compiled, whatever the shell says.
unexport PYTHONDONTWRITEBYTECODE
PIP_INSTALL = $(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check -c $(CONSTRAINTS)

.PHONY: help venv first figures figures-quick gallery readme check test smoke smoke-lowest bench compare mutants fuzz lint format notebooks docs clean
.DEFAULT_GOAL := help

help:
	@sed -n 's/^#   //p' Makefile

venv: $(READY)

# The build backend goes in first, pinned like the rest, so that a later change of pyproject.toml
# reinstalls without fetching anything.
$(READY): pyproject.toml $(CONSTRAINTS)
	$(PYTHON) -m venv $(VENV)
	$(PIP_INSTALL) hatchling editables
	$(PIP_INSTALL) --no-build-isolation -e '.[$(EXTRAS)]'
	touch $@

first: $(READY)
	$(BIN)/python -m figures autodiff_fails --quick
	@echo 'The picture is figures/out/autodiff_fails.png. Next: $(BIN)/firstorder scene scene_b --out b.png,'
	@echo 'the scripts in examples/, or $(BIN)/python -m figures --list.'

figures: check
	$(BIN)/python -m figures --jobs 2

figures-quick: $(READY)
	$(BIN)/python -m figures --quick --jobs 2

# Stills of our own for a talk. A killed run goes on where it was.
gallery: $(READY)
	$(BIN)/python -m gallery

# The claims of a full run are kept beside the figures and shown in CLAIMS.md, the README and docs/;
# what the site shows and a build would take too long to measure is kept in docs/kept.
readme: figures
	$(BIN)/python -m figures.claims
	$(BIN)/python -m docs.generate.kept
	$(BIN)/python -m docs.generate.notebook_pictures

check: $(READY)
	$(BIN)/python -m derivations

# What a test compiles runs once: it is compiled without optimisation, in two thirds of the time. By
# themselves the ledger, the figures and the smoke set compile as a user's program does.
test: $(READY)
	XLA_FLAGS="$(XLA_FLAGS) --xla_backend_optimization_level=0" \
	    $(PYTEST) -n $(WORKERS) --maxprocesses 8 --durations 10 $(PYTEST_ARGS)

# The import hook off: what a user runs.
smoke: $(READY)
	SHAPE_CHECKS=off $(PYTEST) -n $(WORKERS) --maxprocesses 8 -m smoke $(PYTEST_ARGS)

# The lowest versions that pyproject.toml allows, in an environment of their own.
smoke-lowest:
	$(MAKE) smoke PYTHON=python3.11 VENV=.venv-lowest CONSTRAINTS=constraints-lowest.txt EXTRAS=test

# Random faults of one token, each tried on the test that mirrors its file (N of them, by SEED).
mutants: $(READY)
	$(BIN)/python -m tests.mutants $(or $(N),60) --seed $(or $(SEED),0)

# Nasty scenes, damaged files, killed programs and workers (N scenes of flatland, by SEED), or one CASE again.
fuzz: $(READY)
	$(BIN)/python -m tests.fuzz $(or $(N),10000) --seed $(or $(SEED),0) $(if $(CASE),--case $(CASE))

# One process, no import hook, and no compilation cache: a first call that is timed must compile.
bench: $(READY)
	FIRSTORDER_CACHE=off SHAPE_CHECKS=off $(PYTEST) benchmarks -p no:xdist \
	    --benchmark-enable $(PYTEST_ARGS)

# Other people's programs go in when they are first compared with. COMPARE="gradients --quick" does a
# part, or all at small sizes.
$(PEERS_READY): $(READY)
	$(PIP_INSTALL) --no-build-isolation -e '.[peers]'
	touch $@

compare: $(PEERS_READY)
	$(BIN)/python -m benchmarks.peers $(COMPARE)

lint: $(READY)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/pyright --pythonpath $(BIN)/python

format: $(READY)
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

notebooks: $(NOTEBOOKS)

notebooks/ipynb/%.ipynb: notebooks/%.py $(READY)
	@mkdir -p $(@D)
	$(BIN)/marimo export ipynb $< --force --output $@

# Sphinx and its theme go in when the site is first built, and not with the rest.
$(DOCS_READY): $(READY)
	$(PIP_INSTALL) --no-build-isolation -e '.[docs]'
	touch $@

docs: $(DOCS_READY)
	$(BIN)/python -m sphinx -W --keep-going --quiet -E -b html docs docs/_build
	$(BIN)/python -m docs.links docs/_build
	$(BIN)/python -m docs.browser docs/_build

clean:
	rm -rf .venv .venv313 .venv-lowest .cache .pytest_cache .ruff_cache .benchmarks .hypothesis
	rm -rf figures/out notebooks/ipynb docs/_build docs/_generated dist
	find . -name __pycache__ -prune -exec rm -rf {} +
