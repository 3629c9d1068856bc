# Tools for users: drawing, hardness, studies, users' laws.

.PHONY: demo plots section hardness vumat error_bar paraview movie closeup pole_figure study solve identify report gallery benchmarks api

##@ Use (RUN=out/cone: the directory of a run; the same: gimp3d-post COMMAND RUN)
## demo         from nothing: set up, build, press a sphere, draw the results
# everything from nothing: set up, build, press a sphere into a cylinder on 2 ranks, draw the results
demo:
	$(set_up)
	@$(MAKE) --no-print-directory $(jobs) gimp3d
	@mkdir -p out
	@echo 'mpirun -n 2 ./gimp3d < input/demo.nml'
	@$(mpi) mpirun -n 2 ./gimp3d < input/demo.nml
	@$(MAKE) --no-print-directory plots RUN=out/demo \
	   PLOT_OPTIONS="--finite-elements test/references/fem/sphere_hypo_h0.1.csv"
	@echo "The load over depth is in out/demo/load_depth.png, a stress section in out/demo/section.png"

## plots        RUN: load over depth, section, energies (PLOT_OPTIONS=--help)
# RUN=directory: draw load_depth.png, section.png, energy.png from what a run wrote there; tools.xdmf: its
# tools for ParaView; PLOT_OPTIONS="--finite-elements FILE.csv --no-theory --snapshot FILE.hdf"
plots:
	@[ -n "$(RUN)" ] || [ "$(PLOT_OPTIONS)" = --help ] || { echo "Say which run: make plots RUN=out/cone"; exit 1; }
	@$(MAKE) --no-print-directory venv
	@$(post) plots $(PLOT_OPTIONS) $(if $(RUN),"$(RUN)")
	@[ ! -f "$(RUN)/particles.hdf.series" ] || $(post) tool_surface "$(RUN)"

## section      SCENE: an axisymmetric or plane-strain scene made of a 3D one
# SCENE=input/taylor.nml: that scene given by its section, or what stands against it
section: gimp3d
	@[ -n "$(SCENE)" ] || { echo "Say which scene: make section SCENE=input/taylor.nml"; exit 2; }
	@./gimp3d --section "$(SCENE)"

## hardness     RUN: hardness, modulus, pile-up with uncertainties (hardness.md)
# RUN=directory: hardness, modulus, pile-up of an indentation (doc/user/hardness.md); TOOL=name,
# OPTIONS="--beta 1.034"
hardness:
	@[ -n "$(RUN)" ] || { echo "Say which run: make hardness RUN=out/indenter"; exit 1; }
	@$(MAKE) --no-print-directory venv
	@$(post) hardness $(TOOL:%=--tool %) $(OPTIONS) "$(RUN)"

# A user's law is compiled as its owner wrote it: old Fortran, doubles where `vaba_param.inc` says so, lines of up to 132.
vumat_flags_fortran = -O2 -march=$(ARCH) -std=legacy -w -ffixed-line-length-132 -ffree-line-length-none \
	-fcray-pointer -Itools/vumat
vumat_source = $(if $(filter %.c,$(FILE)),cc -O2 -march=$(ARCH),gfortran $(vumat_flags_fortran))
vumat_utilities = $(if $(filter %.c,$(FILE)),,tools/vumat/utilities.f -Wl$(comma)-z$(comma)muldefs)
comma = ,

### vumat        FILE=mylaw.f (or .c): a user's law, mylaw.so (vumat.md)
# FILE=mylaw.f: mylaw.so, a law for model='vumat', library='./mylaw.so' (doc/developer/vumat.md); mylaw.c for
# model='c_law'
vumat:
	@[ -f "$(FILE)" ] || { echo "Say which file: make vumat FILE=mylaw.f"; exit 2; }
	@echo "  compile  $(FILE)"
	@$(vumat_source) -fPIC -shared -o "$(basename $(FILE)).so" "$(FILE)" $(vumat_utilities)
	@echo "The law is in $(basename $(FILE)).so"

### error_bar    RUNS="out/a out/b": error bars from several runs
# RUNS="directory directory ...": error bars of hardness, modulus, ... from runs on other cells, at other
# speeds; TOOL=name
error_bar:
	@[ -n "$(RUNS)" ] || { echo 'Say which runs: make error_bar RUNS="out/cone out/cone_coarse"'; exit 2; }
	@$(MAKE) --no-print-directory venv
	@$(post) error_bar $(TOOL:%=--tool %) $(RUNS)

## closeup      RUN: a picture of the imprint beside the load over depth
# RUN=directory: closeup.png, the imprint beside the load over depth, with hardness and modulus
closeup:
	@[ -n "$(RUN)" ] || { echo "Say which run: make closeup RUN=out/indenter"; exit 2; }
	@$(MAKE) --no-print-directory venv
	@$(post) closeup $(CLOSEUP_OPTIONS) "$(RUN)"

## movie        RUN: an animation, the section beside the load over depth
# RUN=directory: movie.gif, and movie.mp4 where ffmpeg is there, a frame for each snapshot
movie:
	@[ -n "$(RUN)" ] || { echo "Say which run: make movie RUN=out/cone"; exit 2; }
	@$(MAKE) --no-print-directory venv
	@$(post) movie $(MOVIE_OPTIONS) "$(RUN)"

## paraview     RUN: its scene for ParaView and a picture
# RUN=directory: its scene for ParaView (paraview.pvsm) and a picture of that; opened where there is a
# display. PARAVIEW_OPTIONS=--frames: a picture of every snapshot
paraview:
	@[ -n "$(RUN)" ] || { echo "Say which run: make paraview RUN=out/cone"; exit 1; }
	@command -v pvpython > /dev/null || { echo "ParaView is not there: apt-get install paraview python3-paraview"; exit 1; }
	@$(MAKE) --no-print-directory venv
	@$(post) tool_surface "$(RUN)"
	@$(post) paraview $(PARAVIEW_OPTIONS) "$(RUN)"
	@[ -z "$$DISPLAY" ] || ! command -v paraview > /dev/null || paraview "$(RUN)/paraview.pvsm"

### pole_figure  RUN=out/texture: the texture of its crystals
# RUN=directory: the texture of its crystals, RUN/pole_figure.png, and how much lies near copper, brass, S,
# Goss, cube; POLE_OPTIONS="--pole 100 --snapshot 0"
pole_figure:
	@[ -n "$(RUN)" ] || { echo "Say which run: make pole_figure RUN=out/texture"; exit 2; }
	@$(MAKE) --no-print-directory venv
	@$(post) pole_figure $(POLE_OPTIONS) "$(RUN)"

## study        SCENE=input/hertz.nml: what accuracy costs (accuracy_cost.md)
# SCENE=input/hertz.nml: what its accuracy costs (doc/user/accuracy_cost.md); QUANTITY=load, BUDGET=300 (s),
# STUDY_OPTIONS
study:
	@[ -n "$(SCENE)" ] || { echo "Say which scene: make study SCENE=input/hertz.nml QUANTITY=load"; exit 1; }
	$(look)
	@$(MAKE) --no-print-directory $(jobs) tests TESTS=study
	@$(mpi) $(post) study --build $(build) $(QUANTITY:%=--quantity %) $(BUDGET:%=--budget %) $(STUDY_OPTIONS) $(SCENE)

## solve        SCENE=... ERROR=1: the cheapest settings with an error (%)
# SCENE=input/hertz.nml QUANTITY=load ERROR=1 BUDGET=600: the cheapest settings that have an error (%), their
# time and memory first, the run, and the error that was reached (doc/user/accuracy_cost.md); HALF_SPACE=1: a
# finite body is an error too; SOLVE_OPTIONS
solve:
	@[ -n "$(SCENE)" ] && [ -n "$(ERROR)" ] || { echo "Say which scene and error: make solve SCENE=input/hertz.nml QUANTITY=load ERROR=1"; exit 2; }
	$(look)
	@$(MAKE) --no-print-directory $(jobs)
	@$(mpi) $(post) solve --error $(ERROR) $(QUANTITY:%=--quantity %) $(BUDGET:%=--budget %) \
	   $(if $(filter-out 0,$(HALF_SPACE)),--half-space) \
	   $(if $(filter file,$(origin RANKS)),,--ranks $(RANKS)) $(SOLVE_OPTIONS) $(SCENE)

## identify     DATA=curve.csv TIP=berkovich: the material (identification.md)
# DATA=curve.csv TIP=berkovich: E*, yield stress, exponent with intervals (doc/user/identification.md); IDENTIFY="..."
# more words, as a second DATA and TIP; CORES runs at once
identify:
	@[ -n "$(DATA)$(IDENTIFY)" ] || { echo 'Say which curve: make identify DATA=curve.csv TIP=berkovich'; exit 2; }
	$(look)
	@$(MAKE) --no-print-directory $(jobs) gimp3d
	@$(mpi) $(post) identify $(DATA:%=DATA=%) $(TIP:%=TIP=%) $(CORES:%=CORES=%) $(IDENTIFY)

## report       RUN: one page about it, report.html (report.md)
# RUN=directory: one page about a run, complete in itself: RUN/report.html (doc/user/report.md);
# REPORT_OPTIONS
report:
	@[ -n "$(RUN)" ] || { echo "Say which run: make report RUN=out/cone"; exit 2; }
	@$(MAKE) --no-print-directory venv
	@$(post) report $(REPORT_OPTIONS) "$(RUN)"

### gallery      all shipped scenes with their reports; SCENES="cone demo"
# a page of all shipped scenes with their reports, out/gallery/index.html; SCENES="cone demo" runs these, on
# RANKS=1
gallery:
	$(look)
	@$(MAKE) --no-print-directory $(jobs) gimp3d
	@$(mpi) $(post) gallery --ranks $(RANKS) $(GALLERY_OPTIONS) $(SCENES)

### benchmarks   published and exact numbers beside ours (benchmarks.md)
# the book of benchmarks (doc/user/benchmarks.md): published and exact numbers beside ours, on 2 ranks if
# RANKS is not said; CASES="B1 B7" these only, GRIDS=coarse (or fine), BENCHMARK_OPTIONS=--list what has been
# run
benchmarks:
	$(look)
	@$(MAKE) --no-print-directory $(jobs) gimp3d
	@$(mpi) $(post) benchmarks $(if $(filter file,$(origin RANKS)),,--ranks $(RANKS)) $(if $(GRIDS),--grids "$(GRIDS)") \
	   $(BENCHMARK_OPTIONS) $(CASES)

### api          pages of every module and procedure from the sources
# pages of every module, type and procedure, from the comments of src: build/api/index.html
api:
	@$(MAKE) --no-print-directory venv
	@$(python) -c 'import ford' 2>/dev/null || [ -z '$(PYTHON)' ] || { echo "$(PYTHON) has no ford (doc/developer/requirements.txt)"; exit 1; }
	@$(python) -c 'import ford' 2>/dev/null || $(python) -m pip install --quiet --disable-pip-version-check -r doc/developer/requirements.txt
	@$(python) -m ford --quiet doc/developer/ford.md
	@echo "The pages begin at build/api/index.html"
