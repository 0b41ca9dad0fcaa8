# Two commands do all the set-up: `make demo` and `make test`. Nothing is installed outside .venv.
# `make check`, for daily work: lint, types, and the tests of what changed, for 15 s.
PYTHON ?= python3
VENV := .venv
ifeq ($(OS),Windows_NT)
BIN := $(VENV)/Scripts
ACTIVATE := $(VENV)\Scripts\activate
else
BIN := $(VENV)/bin
ACTIVATE := source $(BIN)/activate
endif

# What Python compiles is kept for its next start: the tests start it fifty times.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo check test bench selftest thesis docs dist clean

demo: $(VENV)/runtime
	$(BIN)/twin demo --out demo
	@echo "to use twin in this shell: $(ACTIVATE)"

# Types are one of the tests (tests/test_types.py), so that they take no time of their own. To rewrite
# every assert, for its values, takes eight seconds: what fails is run again, with them.
test: $(VENV)/tests
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/python -m pytest --assert=plain -n 2 --dist loadfile --no-loadscope-reorder -m "not slow" \
		|| { $(BIN)/python -m pytest --last-failed; exit 1; }

check: $(VENV)/tests
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/repo-review --show err .
	$(BIN)/pyrefly check --min-severity error
	$(BIN)/python -m pytest -m "not slow" --changed --seconds 15

bench: $(VENV)/benchmarks
	$(BIN)/python -m benchmarks
	$(BIN)/python -m pytest -n 2 -m slow

# Effects planted in ten machines, two minutes; `python -m benchmarks selftest --help` for more.
selftest: $(VENV)/runtime
	$(BIN)/python -m benchmarks selftest

# The study of the thesis (studies/thesis), in five minutes; its report and numbers into thesis/.
thesis: $(VENV)/runtime
	$(BIN)/python -m studies.thesis --out thesis

# The site, into docs/_build/html; a warning is an error.
docs: $(VENV)/docs
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html

# What is published, into dist/: the wheel and its source; what they bring with them (SBOM), read off
# an empty environment that the wheel was installed into, into build/.
dist:
	rm -rf dist build
	$(PYTHON) -m venv build/tools
	build/tools/bin/python -m pip install --quiet --disable-pip-version-check "pip>=25.1"
	build/tools/bin/python -m pip install --quiet --group dist
	build/tools/bin/python -m build --quiet
	$(PYTHON) -m venv --without-pip build/installed
	build/tools/bin/python -m pip --python build/installed/bin/python install --quiet dist/*.whl
	build/installed/bin/twin --version
	build/tools/bin/cyclonedx-py environment --pyproject pyproject.toml \
		--output-file build/proton-twin.cdx.json build/installed/bin/python

$(VENV)/runtime: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check "pip>=25.1"
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

$(VENV)/tests: $(VENV)/runtime
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --group dev --editable ".[app,fleet,import,live,view]"
	@touch $@

$(VENV)/benchmarks: $(VENV)/tests
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --group bench
	@touch $@

$(VENV)/docs: $(VENV)/runtime
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --group docs
	@touch $@

clean:
	rm -rf $(VENV) docs/_build docs/_generated docs/gallery/effects demo thesis build dist .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
