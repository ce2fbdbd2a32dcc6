# Everything from nothing but python3 (>= 3.11, with venv), make and git.
BIN := .venv/bin
PYTHON ?= $(shell for p in python3.11 python3 python3.12 python3.13; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet install --constraint constraints.txt

.PHONY: install install-dev demo docs quoted bench validate test test-all test-browser test-wheel coverage lint clean

# What a press needs, and what developers need besides. The stamps are younger than what they were made from, so nothing
# is installed twice.
install: .venv/.installed
install-dev: .venv/.installed-dev

# The build tools come first and from the same pins: pip would otherwise fetch whatever is newest for its isolated build.
.venv/.installed: pyproject.toml constraints.txt
	@test -n "$(PYTHON)" || { echo "finger3d needs Python 3.11 or newer; none found (set PYTHON=/path/to/python3)"; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { echo "$(PYTHON) has no venv module: apt install python3-venv"; exit 1; }
	@test -x $(BIN)/python || $(PYTHON) -m venv .venv
	@echo "installing finger3d and its packages into .venv (once; some minutes, 3 GB)"
	@$(PIP) hatchling editables
	@$(PIP) --no-build-isolation --editable '.[full]'
	@$(BIN)/python -c 'import OCP.gp' 2>/dev/null || { echo "build123d cannot be loaded; it needs libGL and libX11: apt install libgl1"; exit 1; }
	@touch $@

.venv/.installed-dev: .venv/.installed
	@echo "installing what developers need into .venv (once; some minutes, 1 GB)"
	@$(PIP) --no-build-isolation --editable '.[dev]'
	@touch $@

demo: install
	$(BIN)/finger3d press geometries/fig9.toml --out out/demo
	@echo "open out/demo/report.html; pictures:"; ls out/demo/*.png

# Sphinx and its extensions, which only the site needs.
.venv/.docs: .venv/.installed-dev
	@$(PIP) --no-build-isolation --editable '.[docs]'
	@touch $@

# Executes the tutorials; their outputs are kept until they or the package change. Warnings, such as dead links, are errors.
docs: install-dev .venv/.docs
	OMP_NUM_THREADS=1 $(BIN)/python -m sphinx -b html -W --keep-going --quiet docs docs/_build/html
	@echo "open docs/_build/html/index.html"

# Two workers, each on one thread: as many as the smallest machine has cores.
PYTEST := OMP_NUM_THREADS=1 $(BIN)/python -m pytest -q -n 2 --dist worksteal

test: install-dev
	$(PYTEST) -m "not slow and not browser"

test-all: install-dev .venv/.docs
	$(PYTEST)

# Needs /usr/bin/chromium: apt install chromium.
test-browser: install-dev .venv/.docs
	$(BIN)/python -m pytest -q -m browser

# The wheel and the sdist in empty environments outside this folder; takes minutes and pip's packages.
test-wheel: install-dev
	$(BIN)/python -m pytest -q tests/test_wheel.py

# Lines of the package that the quick tests run, child processes included.
coverage: install-dev
	$(PYTEST) -m "not slow and not browser" --cov --cov-report=term:skip-covered

# Tables of README.md and docs/ that commands print.
quoted: install-dev
	$(BIN)/python docs/_quoted.py

# Takes both cores and a quarter of an hour; every row says how busy the machine was.
bench: install-dev
	$(BIN)/python -m validation._bench

# Studies whose results are older than the sources; one: .venv/bin/python -m validation NAME
validate: install-dev
	$(BIN)/python -m validation

lint: install-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

clean:
	rm -rf .venv .coverage out dist build docs/_build docs/_generated docs/tutorials/*.ipynb .pytest_cache .hypothesis .ruff_cache .mypy_cache .import_linter_cache
