# gimp3d. `make help` lists the targets. Local settings go into config.mk (not tracked); every variable set here with ?= can be
# given there, in the environment or on the command line.

-include config.mk

BUILD ?= opt
# What fills the halo: src/parallel/halo_mpi.f90, or halo_coarray.f90, which needs OpenCoarrays.
HALO ?= mpi
halos := mpi coarray
ifeq ($(filter $(HALO),$(halos)),)
$(error HALO=$(HALO): the halo is filled by mpi or coarray)
endif
build := build/$(BUILD)$(if $(filter coarray,$(HALO)),_coarray)
.DEFAULT_GOAL := gimp3d

# ---- compiler and flags -------------------------------------------------------------------------------------------------------

once = $(eval $(1) := $(2))$($(1))
ifeq ($(origin FC),default)
FC := mpifort
endif
# The machine that is built for: that of the build itself, or as the compiler's -march names it (x86-64-v3, for other machines too).
ARCH ?= native

# A table for each compiler: its flags by build, those of the kernels, of free lines, and for the place of module files. Another
# compiler needs a table of the same rows here or in config.mk.
FLAGS_gfortran_opt = -std=f2008 -O3 -march=$(ARCH) -fopenmp-simd -fno-tree-loop-distribute-patterns $(vectors) -g
FLAGS_gfortran_profile = $(FLAGS_gfortran_opt) -fno-omit-frame-pointer -fno-optimize-sibling-calls
FLAGS_gfortran_avx2 = $(FLAGS_gfortran_opt) -mno-avx512f -mprefer-vector-width=256
FLAGS_gfortran_debug = -std=f2008 -g -Og -fcheck=all,no-array-temps -fsanitize=address,undefined -ffpe-trap=invalid,zero,overflow \
   -fbacktrace -Wall -Wextra -Wno-c-binding-type -Wno-unused-dummy-argument
# For `make fuzz`: every branch leaves its mark; afl-fuzz brings the assembler that writes it.
FLAGS_gfortran_fuzz = -std=f2008 -g -O1 -fcheck=all,no-array-temps -B$(AFL)
# Work arrays of the kernels in static memory, where they begin at a cache line: on the stack that is luck, and costs a tenth of a
# step where it fails (no procedure there is entered twice).
FLAGS_gfortran_kernels = -fmax-stack-var-size=4096 -Wno-surprising
FLAGS_gfortran_long_lines = -ffree-line-length-none
FLAGS_gfortran_modules = -J

AFL ?= /usr/lib/afl
FLAGS_EXTRA ?=
vectors := $(if $(filter x86_64,$(shell uname -m)),-mprefer-vector-width=512)
builds := opt debug profile avx2 fuzz
$(if $(filter $(BUILD),$(builds)),,$(error BUILD=$(BUILD): the builds are $(builds)))
# FLAGS_opt=... on the command line or in config.mk stands for the row of the table.
flags = $(strip $(or $(FLAGS_$(BUILD)),$(FLAGS_$(compiler)_$(BUILD))) $(FLAGS_EXTRA) $(if $(filter coarray,$(HALO)),-fcoarray=lib) $(flags_here))

# The compiler behind FC, by its own word (OpenCoarrays' wrapper starts gfortran).
version = $(call once,version,$(shell $(FC) --version 2>/dev/null | head -n 1))
compiler = $(if $(findstring GNU Fortran,$(version))$(findstring OpenCoarrays,$(version)),gfortran,$(firstword $(version)))

# ---- libraries: asked for once, and only when something is compiled -------------------------------------------------------------

multiarch = $(call once,multiarch,$(shell gcc -print-multiarch))
PKG_CONFIG ?= pkg-config
PETSC_FLAGS ?= $(call once,PETSC_FLAGS,$(shell $(PKG_CONFIG) --cflags-only-I PETSc))
PETSC_LIBS ?= $(call once,PETSC_LIBS,$(shell $(PKG_CONFIG) --libs PETSc))
COARRAY_LIBS ?= $(call once,COARRAY_LIBS,$(shell $(PKG_CONFIG) --libs caf-openmpi 2>/dev/null))
# HDF5: where HDF5_INC and HDF5_LIB say, else where pkg-config does, else in Debian's folders.
HDF5_INC ?=
HDF5_LIB ?=
hdf5_flags = $(call once,hdf5_flags,$(or $(HDF5_INC:%=-I%),$(shell $(PKG_CONFIG) --cflags-only-I hdf5-openmpi 2>/dev/null),\
   -I/usr/include/hdf5/openmpi))
hdf5_folders = $(call once,hdf5_folders,$(or $(HDF5_LIB:%=-L%),$(shell $(PKG_CONFIG) --libs-only-L hdf5-openmpi 2>/dev/null),\
   -L/usr/lib/$(multiarch)/hdf5/openmpi))
METIS_INC ?= /usr/include
METIS_LIB ?=
comma := ,
libraries = $(if $(filter fuzz,$(BUILD)),-Wl$(comma)--as-needed) $(hdf5_folders) -lhdf5_fortran -lhdf5 $(METIS_LIB:%=-L%) -lmetis $(PETSC_LIBS) -ldl \
   $(if $(filter coarray,$(HALO)),$(COARRAY_LIBS))
compile = $(FC) $(flags) $(hdf5_flags) $(FLAGS_$(compiler)_modules)$(build)/mod
petsc_compile = $(compile) $(FLAGS_$(compiler)_long_lines) $(PETSC_FLAGS)

# ---- sources --------------------------------------------------------------------------------------------------------------------

main := src/app/gimp3d.f90
sources := $(filter-out $(patsubst %,src/parallel/halo_%.f90,$(filter-out $(HALO),$(halos))),\
   $(sort $(shell find -H src -name '*.f90' -o -name '*.F90')))
test_sources := $(sort $(shell find -H test -name '*.f90' 2>/dev/null))
library_objects := $(patsubst src/%,$(build)/obj/src/%.o,$(basename $(filter-out $(main),$(sources))))
program := $(if $(filter $(main),$(sources)),$(build)/gimp3d)

# Goals that compile nothing need no list of what depends on what.
plain_goals := help clean distclean deps needed venv demo test check test-all bench fuzz effects plans plots hardness hard map study api uninstall report gallery paraview benchmarks error_bar pole_figure solve vumat
ifneq ($(filter-out $(plain_goals),$(or $(MAKECMDGOALS),gimp3d)),)
include $(build)/depends.mk
stale_modules := $(filter-out $(modules:%=$(build)/mod/%.mod),$(wildcard $(build)/mod/*.mod))
$(if $(stale_modules),$(shell rm -f $(stale_modules)))
endif
test_binaries := $(patsubst test/%.f90,$(build)/test/%,$(test_programs))
# TESTS="unit input/run ...": only these suites or tests (all when empty)
TESTS ?=
# a script may run any program of its suite
wanted := $(if $(TESTS),$(TESTS:%=$(build)/test/%) $(TESTS:%=$(build)/test/%/%) \
   $(foreach t,$(TESTS),$(if $(wildcard test/$t.sh),$(build)/test/$(dir $t)%)),%)
chosen_binaries := $(filter $(wanted),$(test_binaries))

# ---- build ----------------------------------------------------------------------------------------------------------------------

.PHONY: gimp3d library tests FORCE
.DELETE_ON_ERROR:
.SUFFIXES:

## gimp3d      build the program (the default); BUILD=opt (default), debug, profile or avx2 (without AVX-512);
##             HALO=coarray: ghosts by coarrays, in place of MPI
gimp3d: library $(program)
ifeq ($(program),)
	@echo "$(main) is not there yet: built $(build)/libgimp3d.a only"
else
	@[ "$$(readlink $@)" = $(program) ] || ln -sfn $(program) $@
endif

library: $(build)/libgimp3d.a

## tests       build the test programs without running them
tests: gimp3d $(chosen_binaries)

$(build)/gimp3d: $(build)/obj/$(main:.f90=.o) $(build)/libgimp3d.a
	@echo "  link     $@"
	@$(FC) $(flags) -o $@ $^ $(libraries)

$(build)/libgimp3d.a: $(library_objects)
	@echo "  archive  $@"
	@rm -f $@ && ar rcs $@ $^

$(build)/test/libtest.a: $(test_objects)
	@mkdir -p $(@D)
	@rm -f $@ && ar rcs $@ $^

$(test_binaries): $(build)/test/%: $(build)/obj/test/%.o $(build)/test/libtest.a $(build)/libgimp3d.a
	@mkdir -p $(@D)
	@$(FC) $(flags) -o $@ $^ $(libraries)

$(build)/obj/%.o: %.f90 $(build)/flags
	@mkdir -p $(@D) $(build)/mod
	@echo "  compile  $<"
	@$(compile) -c -o $@ $<

$(build)/obj/%.o: %.F90 src/parallel/petsc_versions.h $(build)/flags
	@mkdir -p $(@D) $(build)/mod
	@echo "  compile  $<"
	@$(petsc_compile) -c -o $@ $<

$(build)/obj/src/kernels/%.o: private flags_here = $(FLAGS_$(compiler)_kernels)

# A module file that the compiler left alone (its interface is as it was) is older than its object; then nothing that uses it is
# compiled again.
$(build)/mod/%.mod:
	@[ -f $@ ] || { rm -f $<; echo "$@ was missing: type make once more"; exit 1; }

# Written anew when they change, so that what depends on them is built again.
write_if_changed = { cmp -s $(1).new $(1) && rm -f $(1).new || mv $(1).new $(1); }

$(build)/flags: FORCE
	@command -v $(firstword $(FC)) > /dev/null || \
	   { echo "$(firstword $(FC)) is not there; \`make deps\` says what is missing"; exit 1; }
	@[ $(HALO) = mpi ] || [ '$(COARRAY_LIBS)' ] || \
	   { echo "HALO=coarray needs OpenCoarrays for Open MPI: apt-get install libcoarrays-openmpi-dev, or say in config.mk COARRAY_LIBS = ..."; \
	     exit 1; }
	@[ '$(flags)' ] && [ '$(FLAGS_$(compiler)_modules)' ] || { echo "$(FC) starts \"$(version)\", for which there are no flags:" \
	   "gimp3d is built with gfortran, or with a compiler whose FLAGS_$(compiler)_... are set in config.mk as the Makefile sets those of gfortran"; \
	   exit 1; }
	@mkdir -p $(@D)
	@{ echo '$(petsc_compile)'; echo '$(libraries)'; echo '$(version)'; } > $@.new && $(call write_if_changed,$@)

$(build)/depends.mk: FORCE
	@mkdir -p $(@D)
	@awk -v build=$(build) -f tools/depends.awk $(sources) $(test_sources) > $@.new && $(call write_if_changed,$@)

# ---- set-up ---------------------------------------------------------------------------------------------------------------------

.PHONY: deps needed venv help clean distclean

# Only `make deps`, `make demo` and `make test` install anything with apt, where they may; other targets say what is missing. With
# SETUP=no these look only too, and build/venv is not made: PYTHON names a Python then.
SETUP ?= yes

## deps        see that compiler and libraries are there; install them where apt may be used, else say what to type
deps:
	@HDF5_INC='$(HDF5_INC)' HDF5_LIB='$(HDF5_LIB)' METIS_INC='$(METIS_INC)' PYTHON='$(PYTHON)' sh tools/deps

needed:
	@HDF5_INC='$(HDF5_INC)' HDF5_LIB='$(HDF5_LIB)' METIS_INC='$(METIS_INC)' PYTHON='$(PYTHON)' sh tools/deps --look

# PYTHON=path takes a Python that already has what post/pyproject.toml names; without it, one is set up under build/venv.
export PYTHONPATH := $(CURDIR)/post:$(CURDIR)/test/regression:$(CURDIR)/test/stability
post = $(python) -m gimp3d
ifeq ($(PYTHON),)
python := build/venv/bin/python
venv: build/venv/complete
	@:
else
python := $(PYTHON)
venv:
	@:
endif

## venv        the Python packages that post/pyproject.toml names, in build/venv, with the package gimp3d itself
build/venv/complete: post/pyproject.toml
	@[ '$(SETUP)' != no ] || { echo "SETUP=no, and build/venv is not there: say PYTHON=/path/to/python, of a Python that has what $< names"; exit 1; }
	@echo "  venv     build/venv (numpy, scipy, h5py, matplotlib, vtk)"
	@mkdir -p build && rm -rf build/venv
	@python3 -m venv build/venv && build/venv/bin/python -m pip install --quiet --disable-pip-version-check -e post || { \
	   rm -rf build/venv; \
	   echo "The Python packages could not be installed. With a Python that has them (dependencies of $<), type: make PYTHON=/path/to/python ..."; \
	   exit 1; }
	@touch $@

## help        this list
help:
	@echo "make [BUILD=opt|debug|profile|avx2] [TARGET]"
	@sed -n 's/^## /  /p' Makefile

## clean       remove what was compiled
clean:
	rm -rf $(builds:%=build/%) build/*_coarray build/effects build/plans build/api gimp3d

## distclean   remove all that make made: clean, and the Python packages too (results under out/ and config.mk stay)
distclean: clean
	rm -rf build

# ---- install ----------------------------------------------------------------------------------------------------------------------

.PHONY: install uninstall

PREFIX ?= /usr/local
INSTALL ?= install
installed_program = $(DESTDIR)$(PREFIX)/bin/gimp3d
installed_data = $(DESTDIR)$(PREFIX)/share/gimp3d

## install     gimp3d and gimp3d-post to PREFIX/bin (PREFIX=/usr/local), the Python package, scenes and documents to PREFIX/share/gimp3d; DESTDIR for packages
install: gimp3d
	$(INSTALL) -d $(dir $(installed_program))
	$(INSTALL) -m 755 $(program) $(installed_program)
	@for file in README.md CHANGELOG.md CITATION.cff LICENSE post/pyproject.toml post/gimp3d/*.py post/gimp3d/*.css post/gimp3d/*.js \
	   $$(find doc input test/references tools/vumat -name '*.md' -o -name '*.inc' -o -name '*.INC' -o -name '*.f' -o -name '*.c' -o -name '*.png' -o -name '*.nml' -o -name '*.toml' -o -name '*.csv' -o -name '*.json'); do \
	   $(INSTALL) -d "$(installed_data)/$${file%/*}" && $(INSTALL) -m 644 "$$file" "$(installed_data)/$$file" || exit 1; done
	@printf '#!/bin/sh\nPYTHONPATH=%s exec "$${PYTHON:-python3}" -m gimp3d "$$@"\n' '$(PREFIX)/share/gimp3d/post$${PYTHONPATH:+:$$PYTHONPATH}' \
	   > $(installed_program)-post && chmod 755 $(installed_program)-post
	@echo "  install  $(installed_program), $(installed_program)-post, $(installed_data)"

## uninstall   remove what install put under PREFIX
uninstall:
	rm -f $(installed_program) $(installed_program)-post
	rm -rf $(installed_data)

# ---- use ------------------------------------------------------------------------------------------------------------------------

.PHONY: demo test check test-all bench fuzz effects plans plots hardness hard map study api report gallery paraview benchmarks error_bar pole_figure solve vumat

mpi := . test/harness/mpi.sh;
jobs = $(if $(filter -j% --jobserver%,$(MAKEFLAGS)),,-j$(shell nproc 2>/dev/null || echo 1))
look = @$(MAKE) --no-print-directory needed && $(MAKE) --no-print-directory venv
set_up = $(if $(filter no,$(SETUP)),$(look),@$(MAKE) --no-print-directory deps && $(MAKE) --no-print-directory venv)

## demo        everything from nothing: set up, build, press a sphere into a cylinder on 2 ranks, draw the results
demo:
	$(set_up)
	@$(MAKE) --no-print-directory $(jobs) gimp3d
	@mkdir -p out
	@echo 'mpirun -n 2 ./gimp3d < input/demo.nml'
	@$(mpi) mpirun -n 2 ./gimp3d < input/demo.nml
	@$(MAKE) --no-print-directory plots RUN=out/demo \
	   PLOT_OPTIONS="--finite-elements test/references/fem/sphere_hypo_h0.1.csv"
	@echo "The load over depth is in out/demo/load_depth.png, a stress section in out/demo/section.png"

## test        set up, build, run the tests; TESTS="unit input/run ..." runs these suites or tests only (test/run --list names them)
## check       the same
test check:
	$(set_up)
	@$(MAKE) --no-print-directory -k $(jobs) tests
	@BUILD=$(notdir $(build)) PYTHON='$(abspath $(python))' test/run $(TEST_OPTIONS) $(TESTS)

## test-all    the same with the long tests
test-all:
	@$(MAKE) --no-print-directory test TEST_OPTIONS=--all

## fuzz        let a fuzzer make scenes for the reader (needs afl-fuzz); SECONDS=600
fuzz:
	@command -v afl-fuzz > /dev/null || { echo "afl-fuzz is not there: apt-get install afl++"; exit 1; }
	@$(MAKE) --no-print-directory $(jobs) BUILD=fuzz tests TESTS=input
	@test/input/fuzz.sh $(or $(SECONDS),600)

## bench       time the benchmark scenes: the tables of doc/user/performance.md; BENCH="block growth" makes these tables only
bench:
	$(look)
	@$(MAKE) --no-print-directory $(jobs) tests TESTS=performance
	@[ -z '$(filter halo,$(or $(BENCH),halo))' ] || ! $(PKG_CONFIG) --exists caf-openmpi || \
	   $(MAKE) --no-print-directory $(jobs) HALO=coarray build/$(BUILD)_coarray/test/performance/halo
	@$(mpi) $(python) test/performance/bench.py $(build)/bench $(build)/gimp3d $(build)/test/performance $(if $(BENCH),--only $(BENCH)) \
	   $(if $(BEFORE),--before $(BEFORE)) --coarrays build/$(BUILD)_coarray/test/performance \
	   --build '$(version); $(flags).'

## effects     count what effects cost scenes that do not call for them (perf or valgrind); SCENES="cone demo" counts these only
effects:
	@$(MAKE) --no-print-directory needed
	@$(mpi) python3 test/performance/effects.py build/effects $(if $(SCENES),--only $(SCENES))

## plans       what mode='plan' says beside what the scenes of input/ take; PLANS="--ranks 2 --only cone" as test/performance/plans.py has it
plans:
	@$(MAKE) --no-print-directory gimp3d
	@$(mpi) python3 test/performance/plans.py build/plans $(PLANS)

## hard        the gallery of hard cases (doc/user/hard_cases.md) on RANKS=1; CASES="spin crossing" runs these, SIZE=short their short forms
RANKS ?= 1
hard:
	$(look)
	@$(MAKE) --no-print-directory $(jobs) tests TESTS=stability
	@$(mpi) BUILD=$(BUILD) $(python) test/stability/gallery.py $(build)/hard_$(RANKS)$(if $(SIZE),_$(SIZE)) $(build)/gimp3d $(build)/test/stability \
	   --ranks $(RANKS) $(if $(SIZE),--$(SIZE)) $(CASES)

## map         which time steps are stable: the map of doc/user/hard_cases.md, on RANKS=1
map:
	$(look)
	@$(MAKE) --no-print-directory $(jobs) tests TESTS=stability
	@$(mpi) $(python) test/stability/stability_map.py $(build)/map $(build)/test/stability/map --ranks $(RANKS) \
	   --guarded $(build)/test/stability/guard_planted

## plots       RUN=directory: draw load_depth.png, section.png, energy.png from what a run wrote there; tools.xdmf: its tools for
##             ParaView
plots:
	@[ -n "$(RUN)" ] || { echo "Say which run: make plots RUN=out/cone"; exit 1; }
	@$(MAKE) --no-print-directory venv
	@$(post) plots $(PLOT_OPTIONS) "$(RUN)"
	@[ ! -f "$(RUN)/particles.hdf.series" ] || $(post) tool_surface "$(RUN)"

## hardness    RUN=directory: hardness, modulus, pile-up of an indentation (doc/user/hardness.md); TOOL=name, OPTIONS="--beta 1.034"
hardness:
	@[ -n "$(RUN)" ] || { echo "Say which run: make hardness RUN=out/indenter"; exit 1; }
	@$(MAKE) --no-print-directory venv
	@$(post) hardness $(TOOL:%=--tool %) $(OPTIONS) "$(RUN)"

# A user's law is compiled as its owner wrote it: old Fortran, doubles where `vaba_param.inc` says so, lines of up to 132.
vumat_flags_fortran = -O2 -march=$(ARCH) -std=legacy -w -ffixed-line-length-132 -ffree-line-length-none -Itools/vumat
vumat_source = $(if $(filter %.c,$(FILE)),cc -O2 -march=$(ARCH),gfortran $(vumat_flags_fortran))

## vumat       FILE=mylaw.f: mylaw.so, a law for model='vumat', library='./mylaw.so' (doc/developer/vumat.md); mylaw.c for model='c_law'
vumat:
	@[ -f "$(FILE)" ] || { echo "Say which file: make vumat FILE=mylaw.f"; exit 2; }
	@echo "  compile  $(FILE)"
	@$(vumat_source) -fPIC -shared -o "$(basename $(FILE)).so" "$(FILE)"
	@echo "The law is in $(basename $(FILE)).so"

## error_bar   RUNS="directory directory ...": error bars of hardness, modulus, ... from runs on other cells, at other speeds; TOOL=name
error_bar:
	@[ -n "$(RUNS)" ] || { echo 'Say which runs: make error_bar RUNS="out/cone out/cone_coarse"'; exit 2; }
	@$(MAKE) --no-print-directory venv
	@$(post) error_bar $(TOOL:%=--tool %) $(RUNS)

## paraview    RUN=directory: its scene for ParaView (paraview.pvsm) and a picture of that; opened where there is a display.
##             PARAVIEW_OPTIONS=--frames: a picture of every snapshot
paraview:
	@[ -n "$(RUN)" ] || { echo "Say which run: make paraview RUN=out/cone"; exit 1; }
	@command -v pvpython > /dev/null || { echo "ParaView is not there: apt-get install paraview python3-paraview"; exit 1; }
	@$(MAKE) --no-print-directory venv
	@$(post) tool_surface "$(RUN)"
	@$(post) paraview $(PARAVIEW_OPTIONS) "$(RUN)"
	@[ -z "$$DISPLAY" ] || ! command -v paraview > /dev/null || paraview "$(RUN)/paraview.pvsm"

## pole_figure RUN=directory: the texture of its crystals, RUN/pole_figure.png, and how much lies near copper, brass, S, Goss, cube;
##             POLE_OPTIONS="--pole 100 --snapshot 0"
pole_figure:
	@[ -n "$(RUN)" ] || { echo "Say which run: make pole_figure RUN=out/texture"; exit 2; }
	@$(MAKE) --no-print-directory venv
	@$(post) pole_figure $(POLE_OPTIONS) "$(RUN)"

## study       SCENE=input/hertz.nml: what its accuracy costs (doc/user/accuracy_cost.md); QUANTITY=load, BUDGET=300 (s), STUDY_OPTIONS
study:
	@[ -n "$(SCENE)" ] || { echo "Say which scene: make study SCENE=input/hertz.nml QUANTITY=load"; exit 1; }
	$(look)
	@$(MAKE) --no-print-directory $(jobs) tests TESTS=study
	@$(mpi) $(post) study --build $(build) $(QUANTITY:%=--quantity %) $(BUDGET:%=--budget %) $(STUDY_OPTIONS) $(SCENE)

## solve       SCENE=input/hertz.nml QUANTITY=load ERROR=1 BUDGET=600: the cheapest settings that have an error (%), their time and
##             memory first, the run, and the error that was reached (doc/user/accuracy_cost.md); HALF_SPACE=1: a finite body is an
##             error too; SOLVE_OPTIONS
solve:
	@[ -n "$(SCENE)" ] && [ -n "$(ERROR)" ] || { echo "Say which scene and error: make solve SCENE=input/hertz.nml QUANTITY=load ERROR=1"; exit 2; }
	$(look)
	@$(MAKE) --no-print-directory $(jobs)
	@$(mpi) $(post) solve --error $(ERROR) $(QUANTITY:%=--quantity %) $(BUDGET:%=--budget %) \
	   $(if $(filter-out 0,$(HALF_SPACE)),--half-space) \
	   $(if $(filter file,$(origin RANKS)),,--ranks $(RANKS)) $(SOLVE_OPTIONS) $(SCENE)

## report      RUN=directory: one page about a run, complete in itself: RUN/report.html (doc/user/report.md); REPORT_OPTIONS
report:
	@[ -n "$(RUN)" ] || { echo "Say which run: make report RUN=out/cone"; exit 2; }
	@$(MAKE) --no-print-directory venv
	@$(post) report $(REPORT_OPTIONS) "$(RUN)"

## gallery     a page of all shipped scenes with their reports, out/gallery/index.html; SCENES="cone demo" runs these, on RANKS=1
gallery:
	$(look)
	@$(MAKE) --no-print-directory $(jobs) gimp3d
	@$(mpi) $(post) gallery --ranks $(RANKS) $(GALLERY_OPTIONS) $(SCENES)

## benchmarks  the book of benchmarks (doc/user/benchmarks.md): published and exact numbers beside ours, on 2 ranks if RANKS is not
##             said; CASES="B1 B7" these only, GRIDS=coarse (or fine), BENCHMARK_OPTIONS=--list what has been run
benchmarks:
	$(look)
	@$(MAKE) --no-print-directory $(jobs) gimp3d
	@$(mpi) $(post) benchmarks $(if $(filter file,$(origin RANKS)),,--ranks $(RANKS)) $(if $(GRIDS),--grids "$(GRIDS)") \
	   $(BENCHMARK_OPTIONS) $(CASES)

## api         pages of every module, type and procedure, from the comments of src: build/api/index.html
api:
	@$(MAKE) --no-print-directory venv
	@$(python) -c 'import ford' 2>/dev/null || [ -z '$(PYTHON)' ] || { echo "$(PYTHON) has no ford (doc/developer/requirements.txt)"; exit 1; }
	@$(python) -c 'import ford' 2>/dev/null || $(python) -m pip install --quiet --disable-pip-version-check -r doc/developer/requirements.txt
	@$(python) -m ford --quiet doc/developer/ford.md
	@echo "The pages begin at build/api/index.html"
