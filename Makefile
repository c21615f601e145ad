# `make demo` and `make test` set up what they need; see README.md.
PYTHON ?= python3
RUN := .venv/bin/python
SETUP := @$(PYTHON) scripts/setup.py
# Tests start hundreds of processes: what they import is compiled once, whatever is set outside.
export PYTHONDONTWRITEBYTECODE :=
export PYTHONPYCACHEPREFIX := $(CURDIR)/.venv/pycache
PYTEST := NACRE_SCREENSHOTS=$(CURDIR)/out/screenshots $(RUN) -m pytest -n auto --dist loadfile \
  --no-loadscope-reorder --max-worker-restart 0 -q

.PHONY: demo test test-all coverage test-lab test-timed lint bench fuzz site notebooks gallery gallery-sheets gallery-textures
.PHONY: included parity-blender release matrix setup tools lab clean kernel

demo:  ## The main job, start to end; NACRE_DATA=FILE uses a real measurement.
	$(SETUP) demo
	$(RUN) -m nacre demo --output out/demo.png

test: lint tools  ## What lint does, doctests and the tests that are quick.
	$(PYTEST) -m "not slow"

test-all: test  ## All tests of the product: after those of make test, the slow ones.
	$(PYTEST) -m slow

coverage: tools  ## Lines and branches of the product that its tests run; slower than test-all.
	$(PYTEST) --cov=nacre --cov-branch --cov-report=json:out/coverage.json --cov-report=term:skip-covered

test-lab: tools lab  ## The tests of the lab.
	$(PYTEST) lab/tests

test-timed: tools lab  ## The second tier and the lab: what changed since SINCE first, until UNTIL (date +%s).
	$(PYTEST) -p tests.clock --until "$(or $(UNTIL),inf)" --since "$(SINCE)" -m slow tests lab/tests

lint: setup  ## Formatting, lint, types, layers, and the workflows of public CI.
	.venv/bin/ruff format --no-cache --check .
	.venv/bin/ruff check --no-cache .
	.venv/bin/mypy
	PYTHONPATH=lab/src .venv/bin/lint-imports --no-logo
	.venv/bin/zizmor --offline --quiet .github/workflows

bench: lab  ## Speed and quality tables; takes about an hour.
	$(RUN) -m lab.studies.speed.fit
	$(RUN) -m lab.studies.speed.process
	$(RUN) -m lab.studies.speed.cluster
	$(RUN) -m lab.studies.speed.stacked --samples 80000
	$(RUN) -m lab.studies.speed.evaluate
	$(RUN) -m lab.studies.speed.torch_module
	$(RUN) -m lab.studies.speed.export
	$(RUN) -m lab.studies.speed.render --cooperative
	$(RUN) -m lab.studies.speed.fidelity
	$(RUN) -m lab.studies.speed.fidelity --set presets
	$(RUN) -m lab.studies.speed.btf_file
	$(RUN) -m lab.studies.speed.btf_train

fuzz:  ## Ten minutes of damaged files for every reader; FORMATS=MERL SECONDS=60 for less.
	$(SETUP) fuzz
	$(RUN) -m tests.fuzz $(FORMATS) --seconds $(or $(SECONDS),600)

BLENDER := .venv-blender/bin/python

parity-blender: setup  ## Exports to OSL and Blender, and Principled, in Cycles: 1 GB, and Python 3.11.
	@test -x $(BLENDER) || python3.11 -m venv .venv-blender
	@$(BLENDER) -c 'import bpy' 2>/dev/null || $(BLENDER) -m pip install -q 'bpy==5.0.1'
	NACRE_BLENDER_PYTHON=$(CURDIR)/$(BLENDER) $(RUN) -m pytest -q tests/targets tests/standard -k 'osl or blender or principled'

LIBRARY := out/gallery/library

gallery: setup  ## A page of all materials that come with nacre; OPENPBR=1 fits standard forms of all.
	@mkdir -p out
	$(RUN) scripts/gallery.py $(if $(OPENPBR),--openpbr)
	$(RUN) -m nacre view gallery/textures $(LIBRARY) --notice src/nacre/included/NOTICE.txt \
	  --map --title "nacre gallery" -o out/gallery.html

gallery-sheets: setup  ## Pictures of all of them, beside the measurements of NACRE_DATA=FOLDER.
	$(RUN) scripts/gallery_sheets.py $(NACRE_DATA)

SHOWPIECES := tweed leather wood
# Captured from its recipe and encoded: $(1) name, $(2) texels along an edge, $(3) folder, $(4) heights.
define texture
	$(RUN) -m nacre btf capture gallery/recipes/$(1).json --texels $(2) --paths 64 \
	  --directions gallery/recipes/directions.csv --height-map out/gallery/$(1).exr \
	  -o out/gallery/$(1).npz
	$(RUN) -m nacre fit out/gallery/$(1).npz --precision half --no-embed \
	  -o out/gallery/$(1).safetensors
	$(RUN) scripts/gallery_texture.py out/gallery/$(1).safetensors out/gallery/$(1).npz \
	  $(3)/$(1).safetensors $(4)

endef

gallery-textures: setup  ## Capture and encode the gallery's textures: minutes, and 0.8 GB in out/.
	@mkdir -p out/gallery gallery/textures
	$(foreach name,$(SHOWPIECES),$(call texture,$(name),256,gallery/textures,out/gallery/$(name).exr))

included: setup  ## Make the materials that come with nacre anew, of NACRE_DATA=FOLDER.
	@mkdir -p out/gallery
	$(RUN) scripts/included.py "$(NACRE_DATA)"
	$(foreach name,$(SHOWPIECES),$(call texture,$(name),128,src/nacre/included/captured))

kernel: setup  ## Compile the kernel that fits networks in the viewer's page.
	$(RUN) scripts/kernel.py

site:  ## Materials to look at and fit, and behind them docs/ and the API reference, in out/site.
	$(SETUP) docs
	EAGER_IMPORT=1 NO_MKDOCS_2_WARNING=1 $(RUN) -m mkdocs build
	$(RUN) scripts/front.py out/site

notebooks:  ## Run the notebooks of docs/ and keep what their cells give in them: minutes.
	$(SETUP) docs
	$(RUN) scripts/notebooks.py

RELEASE := .venv-release/bin/python

release: $(RELEASE) setup  ## Wheels, source archives, conda's package, the site, in out/release, and their checks.
	$(RELEASE) scripts/release.py

matrix: $(RELEASE) setup  ## The wheels of out/release in many environments; ROWS=3.12 for some of them.
	$(RELEASE) scripts/matrix.py $(ROWS)

$(RELEASE): requirements/release.lock
	$(PYTHON) -m venv .venv-release
	$(RELEASE) -m pip install -q --disable-pip-version-check -r requirements/release.lock
	@touch $(RELEASE)

setup:
	$(SETUP) test

tools:  # what runs exports; tests without theirs are skipped
	$(SETUP) tools

lab:
	$(SETUP) lab

clean:
	rm -rf .venv .venv-blender .venv-release out
