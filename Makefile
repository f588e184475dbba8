# make demo   a talking head from a shipped speech clip, in out/
# make demo-wild   the second paper's chain, small: capture to recurrent model, in out/wild
# make test   what is tested while one works: minutes
# make test-all   everything that is tested, what takes long too: CI runs this
# make coverage   the same, and how much of each package it ran; slower
# make site   the documentation, in build/site
# All set up their own .venv from a fresh clone; nothing else is needed but Python and make.

PYTHON ?= python3
BIN := .venv/bin
# A worker that crashed is not replaced: xdist would wait for ever.
PYTEST := $(BIN)/python -m pytest -n auto --max-worker-restart=0
SOURCES := pyproject.toml hatch_build.py $(shell find src web/src -type f -not -name '*.pyc' 2>/dev/null)

.PHONY: demo demo-wild test test-all coverage check site clean

demo: .venv/ready-demo
	mkdir -p out
	$(BIN)/elocute animate src/elocute/assets/example.flac \
		-o out/talk.mp4 -o out/talk.glb -o out/talk.html
	@echo "Look at out/talk.mp4, open out/talk.html in a browser, load out/talk.glb anywhere."

demo-wild: .venv/ready-dev
	rm -rf out/wild
	$(BIN)/python -m recipes.demo_wild out/wild

# Compiled once, not by every process that a test starts.
test test-all coverage: export PYTHONDONTWRITEBYTECODE =

test: .venv/ready-dev
	$(PYTEST) --durations=25 -m "not slow"

test-all: .venv/ready-dev
	$(PYTEST) --durations=25

coverage: .venv/ready-dev
	$(PYTEST) --cov --cov-report=
	$(BIN)/python scripts/coverage

check: .venv/ready-dev
	scripts/check

site: .venv/ready-dev
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet
	@echo "Open build/site/index.html"

.venv/ready-demo: $(SOURCES)
	PYTHON=$(PYTHON) scripts/setup demo
	touch $@

.venv/ready-dev: pyproject.toml hatch_build.py $(wildcard web/package*.json)
	PYTHON=$(PYTHON) scripts/setup dev
	touch $@

clean:
	rm -rf .venv out build dist web/node_modules web/lint/node_modules
