# Every target sets up .venv first where it needs it, so each works as the very first command.
SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
BLENDERS := 4.2 5.0
.PHONY: help render test test-slow test-blenders $(BLENDERS:%=test-blender-%) stability lab lint format docs extension clean

PYTHON ?= python3.11
PIP := pip==26.3 # the pip of Python 3.11 is older than dependency groups
run := .venv/bin/python

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1\t\2/p' Makefile | expand -t 22

render: .venv/.complete ## render the sample scenes into out/, as .exr and .png
	mkdir -p out
	$(run) -m addon render sample_scenes/*.blend --output out/

test: .venv/.complete ## run the tests
	$(run) -m pytest --numprocesses auto --maxprocesses 4 --dist worksteal -m "not slow"

test-slow: .venv/.complete ## run the others: whole renders against Cycles, and what takes over 10 s
	$(run) -m pytest -m slow

test-blenders: $(BLENDERS:%=test-blender-%) ## run the tests of the add-on on the Python modules of Blender 4.2 and 5.0 too

$(BLENDERS:%=test-blender-%): export PYTHONPATH = $(CURDIR)/$(<D)
$(BLENDERS:%=test-blender-%): test-blender-%: build/blenders/%/.complete
	@$(run) -c 'import bpy; print("The add-on in Blender", bpy.app.version_string)'
	$(run) -m pytest tests/test_addon_*.py tests/test_sample_scenes.py

stability: .venv/.complete ## try Rooks where methods fail: a table with a verdict for each case
	$(run) -m tests.stability

lint: .venv/.complete ## check style and formatting
	$(run) -m ruff check .
	$(run) -m ruff format --check .

format: .venv/.complete ## repair what lint complains about, where that can be done by itself
	$(run) -m ruff check --fix-only .
	$(run) -m ruff format .

docs: .venv/.complete ## make the pictures, measurements and generated parts of the docs again (a quarter of an hour)
	mkdir -p docs/data
	$(run) -m core patterns --output out/docs/patterns
	$(run) -m core score --json docs/data/score.json
	$(run) -m core figures --output out/docs/figures
	cp out/docs/figures/figures.json docs/data/
	$(run) -m core chart --output out/docs/chart --restart
	cp out/docs/chart/chart.json docs/data/
	$(run) -m tests.stability --output out/docs/stability
	cp out/docs/stability/stability.json docs/data/
	$(run) -m addon render sample_scenes/still_life.blend --samples 256 --output docs/images/still_life.png
	$(run) -m addon render sample_scenes/glossy.blend --samples 256 --output docs/images/glossy.png
	$(run) docs/update.py

lab: .venv/.complete ## make the sampling lab's patterns, scores, figures and charts in out/ (a quarter of an hour)
	$(run) -m core patterns
	$(run) -m core score --json out/score.json
	$(run) -m core figures
	$(run) -m core chart

extension: .venv/.complete ## build the Blender extension into dist/, a zip for each platform
	$(run) .ci/build_extension.py

clean: ## remove everything that make has made, .venv included
	rm -rf .venv out build dist .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# Before .venv on Python's path, so that only bpy is another one.
build/blenders/%/.complete: pyproject.toml .venv/.complete
	@echo "Setting up Blender $*'s Python module in $(@D) (this downloads about 350 MB)"
	@rm -rf $(@D)
	@$(run) -m pip install --quiet --disable-pip-version-check --no-deps --target $(@D) --group blender-$*
	@touch $@

# The stamp is touched last: a set-up that failed half-way is taken up again by the next make.
.venv/.complete: pyproject.toml
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' 2>/dev/null || { \
	  echo "Python 3.11 is missing: '$(PYTHON)' does not run it. Install it, or say where it is: make PYTHON=..." >&2; exit 1; }
	@"$(PYTHON)" -c 'import ensurepip, venv' 2>/dev/null || { \
	  echo "The venv module of Python 3.11 is missing (Debian, Ubuntu: apt-get install python3.11-venv)" >&2; exit 1; }
	@echo "Setting up .venv (the first time this downloads about 500 MB)"
	@"$(PYTHON)" -m venv .venv
	@$(run) -m pip install --quiet --disable-pip-version-check $(PIP)
	@$(run) -m pip install --quiet --disable-pip-version-check --group run --group test
	@$(run) .ci/check_bpy.py
	@touch $@
