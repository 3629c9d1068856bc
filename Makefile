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

ifeq ($(origin FC),default)
FC := mpifort
endif
vectors := $(if $(filter x86_64,$(shell uname -m)),-mprefer-vector-width=512)

FLAGS_opt ?= -std=f2008 -O3 -march=native -fopenmp-simd -fno-tree-loop-distribute-patterns $(vectors) -g
FLAGS_profile ?= $(FLAGS_opt) -fno-omit-frame-pointer -fno-optimize-sibling-calls
FLAGS_debug ?= -std=f2008 -g -Og -fcheck=all,no-array-temps -fsanitize=address,undefined -ffpe-trap=invalid,zero,overflow -fbacktrace \
               -Wall -Wextra -Wno-c-binding-type
# For `make fuzz`: every branch leaves its mark; afl-fuzz brings the assembler that writes it.
AFL ?= /usr/lib/afl
FLAGS_fuzz ?= -std=f2008 -g -O1 -fcheck=all,no-array-temps -B$(AFL)
FLAGS_avx2 ?= $(FLAGS_opt) -mno-avx512f -mprefer-vector-width=256
FLAGS_EXTRA ?=
ifndef FLAGS_$(BUILD)
$(error BUILD=$(BUILD): the builds are opt, debug, profile, avx2, fuzz)
endif
flags = $(strip $(FLAGS_$(BUILD)) $(FLAGS_EXTRA) $(if $(filter coarray,$(HALO)),-fcoarray=lib) $(flags_here))

# ---- libraries: asked for once, and only when something is compiled -------------------------------------------------------------

once = $(eval $(1) := $(2))$($(1))
multiarch = $(call once,multiarch,$(shell gcc -print-multiarch))
PKG_CONFIG ?= pkg-config
PETSC_FLAGS ?= $(call once,PETSC_FLAGS,$(shell $(PKG_CONFIG) --cflags-only-I PETSc))
PETSC_LIBS ?= $(call once,PETSC_LIBS,$(shell $(PKG_CONFIG) --libs PETSc))
COARRAY_LIBS ?= $(call once,COARRAY_LIBS,$(shell $(PKG_CONFIG) --libs caf-openmpi 2>/dev/null))
HDF5_INC ?= /usr/include/hdf5/openmpi
HDF5_LIB ?= /usr/lib/$(multiarch)/hdf5/openmpi
METIS_INC ?= /usr/include
METIS_LIB ?=
comma := ,
libraries = $(if $(filter fuzz,$(BUILD)),-Wl$(comma)--as-needed) -L$(HDF5_LIB) -lhdf5_fortran -lhdf5 $(METIS_LIB:%=-L%) -lmetis $(PETSC_LIBS) $(if $(filter coarray,$(HALO)),$(COARRAY_LIBS))
compile = $(FC) $(flags) -I$(HDF5_INC) -J$(build)/mod
petsc_compile = $(compile) -ffree-line-length-none $(PETSC_FLAGS)

# ---- sources --------------------------------------------------------------------------------------------------------------------

main := src/app/gimp3d.f90
sources := $(filter-out $(patsubst %,src/parallel/halo_%.f90,$(filter-out $(HALO),$(halos))),\
   $(sort $(shell find src -name '*.f90' -o -name '*.F90')))
test_sources := $(sort $(shell find test -name '*.f90' 2>/dev/null))
library_objects := $(patsubst src/%,$(build)/obj/src/%.o,$(basename $(filter-out $(main),$(sources))))
program := $(if $(filter $(main),$(sources)),$(build)/gimp3d)

# Goals that compile nothing need no list of what depends on what.
plain_goals := help clean clean-all deps venv demo test test-all bench fuzz effects plans plots hard map study
ifneq ($(filter-out $(plain_goals),$(or $(MAKECMDGOALS),gimp3d)),)
include $(build)/depends.mk
stale_modules := $(filter-out $(modules:%=$(build)/mod/%.mod),$(wildcard $(build)/mod/*.mod))
$(if $(stale_modules),$(shell rm -f $(stale_modules)))
endif
test_binaries := $(patsubst test/%.f90,$(build)/test/%,$(test_programs))
# TESTS="unit input/run ...": only these suites or tests (all when empty)
TESTS ?=
wanted := $(if $(TESTS),$(TESTS:%=$(build)/test/%) $(TESTS:%=$(build)/test/%/%),%)
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

$(build)/obj/%.o: %.F90 $(build)/flags
	@mkdir -p $(@D) $(build)/mod
	@echo "  compile  $<"
	@$(petsc_compile) -c -o $@ $<

# Work arrays of the kernels in static memory, where they begin at a cache line: on the stack that is luck, and costs a tenth of a step
# where it fails (gfortran; no procedure there is entered twice).
$(build)/obj/src/kernels/%.o: private flags_here := $(if $(filter gfortran%,$(notdir $(firstword $(FC))))$(filter \
   mpifort,$(FC)),-fmax-stack-var-size=4096 -Wno-surprising)

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
	@mkdir -p $(@D)
	@{ echo '$(petsc_compile)'; echo '$(libraries)'; $(FC) --version | head -n 1; } > $@.new && $(call write_if_changed,$@)

$(build)/depends.mk: FORCE
	@mkdir -p $(@D)
	@awk -v build=$(build) -f tools/depends.awk $(sources) $(test_sources) > $@.new && $(call write_if_changed,$@)

# ---- set-up ---------------------------------------------------------------------------------------------------------------------

.PHONY: deps venv help clean clean-all

## deps        see that compiler and libraries are there; install them where apt may be used, else say what to type
deps:
	@HDF5_INC='$(HDF5_INC)' METIS_INC='$(METIS_INC)' PYTHON='$(PYTHON)' sh tools/deps

# PYTHON=path takes a Python that already has what post/requirements.txt lists; without it, one is set up under build/venv.
ifeq ($(PYTHON),)
python := build/venv/bin/python
venv: build/venv/complete
	@:
else
python := $(PYTHON)
venv:
	@:
endif

## venv        the Python packages of post/requirements.txt, in build/venv
build/venv/complete: post/requirements.txt
	@echo "  venv     build/venv (numpy, h5py, matplotlib, vtk)"
	@mkdir -p build && rm -rf build/venv
	@python3 -m venv build/venv && build/venv/bin/python -m pip install --quiet --disable-pip-version-check -r $< || { \
	   rm -rf build/venv; \
	   echo "The Python packages could not be installed. With a Python that has them ($<), type: make PYTHON=/path/to/python ..."; \
	   exit 1; }
	@touch $@

## help        this list
help:
	@echo "make [BUILD=opt|debug|profile|avx2] [TARGET]"
	@sed -n 's/^## /  /p' Makefile

## clean       remove what was compiled
clean:
	rm -rf build/opt build/debug build/profile build/avx2 build/*_coarray build/effects gimp3d

## clean-all   clean, and the Python packages too (results under out/ stay)
clean-all: clean
	rm -rf build

# ---- use ------------------------------------------------------------------------------------------------------------------------

.PHONY: demo test test-all bench fuzz effects plans plots hard map study

# What mpirun needs in a container, as root, or with more ranks than cores; harmless elsewhere. The tests have theirs in test/harness/mpi.sh.
export OMPI_ALLOW_RUN_AS_ROOT ?= 1
export OMPI_ALLOW_RUN_AS_ROOT_CONFIRM ?= 1
export OMPI_MCA_rmaps_base_oversubscribe ?= 1
export OMPI_MCA_hwloc_base_binding_policy ?= none
export OMPI_MCA_btl_vader_single_copy_mechanism ?= none
ifeq ($(HALO),coarray)
export OMPI_MCA_osc ?= pt2pt
endif
export ASAN_OPTIONS ?= detect_leaks=0

jobs = $(if $(filter -j% --jobserver%,$(MAKEFLAGS)),,-j$(shell nproc 2>/dev/null || echo 1))
set_up = @$(MAKE) --no-print-directory deps && $(MAKE) --no-print-directory venv

## demo        everything from nothing: set up, build, press a sphere into a cylinder on 2 ranks, draw the results
demo:
	$(set_up)
	@$(MAKE) --no-print-directory $(jobs) gimp3d
	@mkdir -p out
	mpirun -n 2 ./gimp3d < input/demo.nml
	@$(MAKE) --no-print-directory plots RUN=out/demo \
	   PLOT_OPTIONS="--finite-elements test/references/fem/sphere_hypo_h0.1.csv"
	@echo "The load over depth is in out/demo/load_depth.png, a stress section in out/demo/section.png"

## test        set up, build, run the tests; TESTS="unit input/run ..." runs these suites or tests only
test:
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

## bench       time the benchmark scenes: the tables of doc/performance.md; BENCH="block growth" makes these tables only
bench:
	$(set_up)
	@$(MAKE) --no-print-directory $(jobs) tests TESTS=performance
	@[ -z '$(filter halo,$(or $(BENCH),halo))' ] || ! $(PKG_CONFIG) --exists caf-openmpi || \
	   $(MAKE) --no-print-directory $(jobs) HALO=coarray build/$(BUILD)_coarray/test/performance/halo
	@$(python) test/performance/bench.py $(build)/bench $(build)/gimp3d $(build)/test/performance $(if $(BENCH),--only $(BENCH)) \
	   $(if $(BEFORE),--before $(BEFORE)) --coarrays build/$(BUILD)_coarray/test/performance \
	   --build '$(shell $(FC) --version 2>/dev/null | head -n 1); $(flags).'

## effects     count what effects cost scenes that do not call for them (perf or valgrind); SCENES="cone demo" counts these only
effects:
	@$(MAKE) --no-print-directory deps
	@python3 test/performance/effects.py build/effects $(if $(SCENES),--only $(SCENES))

## plans       what mode='plan' says beside what the scenes of input/ take; PLANS="--ranks 2 --only cone" as test/performance/plans.py has it
plans:
	@$(MAKE) --no-print-directory gimp3d
	@. test/harness/mpi.sh; python3 test/performance/plans.py build/plans $(PLANS)

## hard        the gallery of hard cases (doc/hard_cases.md) on RANKS=1; CASES="spin crossing" runs these, SIZE=short their short forms
RANKS ?= 1
hard:
	$(set_up)
	@$(MAKE) --no-print-directory $(jobs) tests TESTS=stability
	@BUILD=$(BUILD) $(python) test/stability/gallery.py $(build)/hard_$(RANKS)$(if $(SIZE),_$(SIZE)) $(build)/gimp3d $(build)/test/stability \
	   --ranks $(RANKS) $(if $(SIZE),--$(SIZE)) $(CASES)

## map         which time steps are stable: the map of doc/hard_cases.md, on RANKS=1
map:
	$(set_up)
	@$(MAKE) --no-print-directory $(jobs) tests TESTS=stability
	@$(python) test/stability/stability_map.py $(build)/map $(build)/test/stability/map --ranks $(RANKS) \
	   --guarded $(build)/test/stability/guard_planted

## plots       RUN=directory: draw load_depth.png, section.png, energy.png from what a run wrote there
plots:
	@[ -n "$(RUN)" ] || { echo "Say which run: make plots RUN=out/cone"; exit 1; }
	@$(MAKE) --no-print-directory venv
	@$(python) post/plots.py $(PLOT_OPTIONS) "$(RUN)"

## study       SCENE=input/hertz.nml: what its accuracy costs (doc/accuracy_cost.md); QUANTITY=load, BUDGET=300 (s), STUDY_OPTIONS
study:
	@[ -n "$(SCENE)" ] || { echo "Say which scene: make study SCENE=input/hertz.nml QUANTITY=load"; exit 1; }
	$(set_up)
	@$(MAKE) --no-print-directory $(jobs) tests TESTS=study
	@$(python) post/study.py --build $(build) $(QUANTITY:%=--quantity %) $(BUDGET:%=--budget %) $(STUDY_OPTIONS) $(SCENE)
