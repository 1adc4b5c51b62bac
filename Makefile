# Two commands do all the set-up on a machine that has make and python3 with venv (or virtualenv, or uv):
#   make demo   the slice at 15 degrees, into out/
#   make test   the tests, without the slow ones: 10 minutes on two cores; make test-all runs all of them
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# Two processes, whole files in the order in which tests/conftest.py puts them.
TWO := -n 2 --dist loadfile --no-loadscope-reorder

.PHONY: setup environment demo test test-all lint bench docs clean

setup: $(VENV)/.ready

$(VENV)/.ready: pyproject.toml
	@$(BIN)/python -m pip --version >/dev/null 2>&1 || $(MAKE) --no-print-directory environment
	@echo "installing rodatlas into $(VENV) (about a minute, once)"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]'
	@touch $@

# A virtual environment with pip in it. Debian's python3 alone has no ensurepip, and leaves a half-made one behind.
environment:
	@rm -rf $(VENV)
	@$(PYTHON) -m venv $(VENV) >/dev/null 2>&1 \
	|| $(PYTHON) -m virtualenv --quiet $(VENV) 2>/dev/null \
	|| { rm -rf $(VENV); uv venv --quiet --seed --python $(PYTHON) $(VENV) 2>/dev/null; } \
	|| { rm -rf $(VENV); echo "make: $(PYTHON) cannot make a virtual environment;" \
	     "on Debian or Ubuntu: apt-get install python3-venv" >&2; exit 1; }

demo: setup
	$(BIN)/rodatlas slice --angle 15 --out out

test: setup
	$(BIN)/python -m pytest $(TWO) -m "not slow"

test-all: setup
	$(BIN)/python -m pytest $(TWO) --durations=50

lint: setup
	$(BIN)/ruff check src tests benchmarks examples
	$(BIN)/mypy

bench: setup
	$(BIN)/python benchmarks/run.py

docs: setup
	@test -x $(BIN)/sphinx-build || $(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[docs]'
	$(BIN)/sphinx-build -W --keep-going -q -b html docs out/docs
	@echo "out/docs/index.html"

clean:
	rm -rf $(VENV) .venv-bench out
