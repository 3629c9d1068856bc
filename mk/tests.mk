# Tests and measurements.

.PHONY: test check test-all fuzz bench effects plans hard map

##@ Tests (TESTS="unit input/run": these suites or tests)
## check        after each edit: at most 3 minutes on 2 cores
check:
	@$(MAKE) --no-print-directory test TEST_OPTIONS=--check

## test         the default tests: 10 minutes on 2 cores
test:
	$(set_up)
	@$(MAKE) --no-print-directory -k $(jobs) tests
	@BUILD=$(notdir $(build)) PYTHON='$(abspath $(python))' test/run $(TEST_OPTIONS) $(TESTS)

## test-all     the same with the long tests: hours
# the same with the long tests
test-all:
	@$(MAKE) --no-print-directory test TEST_OPTIONS=--all

### fuzz         a fuzzer makes scenes for the reader; SECONDS=600
# let a fuzzer make scenes for the reader (needs afl-fuzz); SECONDS=600
fuzz:
	@command -v afl-fuzz > /dev/null || { echo "afl-fuzz is not there: apt-get install afl++"; exit 1; }
	@$(MAKE) --no-print-directory $(jobs) BUILD=fuzz tests TESTS=input
	@test/input/fuzz.sh $(or $(SECONDS),600)

## A commit is built once, in a tree of its own; a program is taken as it is.
before_tree = $(build)/before/$(shell git rev-parse --short "$(BEFORE)^{commit}" 2>/dev/null)
before = $(if $(BEFORE),$(if $(wildcard $(BEFORE)),$(BEFORE),$(before_tree)/$(build)/gimp3d))

## bench        time the benchmark scenes (performance.md); BENCH="before" BEFORE=a commit
# time the benchmark scenes: the tables of doc/user/performance.md; BENCH="block growth" makes these tables
# only; BENCH=before BEFORE=v0.2.0 times users' scenes beside that commit (or program)
bench:
	$(look)
	@$(MAKE) --no-print-directory $(jobs) tests TESTS=performance
	@[ -z '$(before)' ] || [ -x '$(before)' ] || \
	   { git worktree add --detach $(before_tree) "$(BEFORE)" && $(MAKE) --no-print-directory $(jobs) -C $(before_tree) BUILD=$(BUILD); }
	@[ -z '$(filter halo,$(or $(BENCH),halo))' ] || ! $(PKG_CONFIG) --exists caf-openmpi || \
	   $(MAKE) --no-print-directory $(jobs) HALO=coarray build/$(BUILD)_coarray/test/performance/halo
	@$(mpi) PYTHONPATH=post $(python) test/performance/bench.py $(build)/bench $(build)/gimp3d $(build)/test/performance $(if $(BENCH),--only $(BENCH)) \
	   $(if $(before),--before $(before)) --coarrays build/$(BUILD)_coarray/test/performance \
	   --build '$(version); $(flags).'

### effects      what effects cost scenes without them; SCENES="cone demo"
# count what effects cost scenes that do not call for them (perf or valgrind); SCENES="cone demo" counts these
# only
effects:
	@$(MAKE) --no-print-directory needed
	@$(mpi) PYTHONPATH=post $(python) test/performance/effects.py build/effects $(if $(SCENES),--only $(SCENES))

### plans        plans beside what the scenes take; PLANS="--only cone"
# what mode='plan' says beside what the scenes of input/ take; PLANS="--ranks 2 --only cone" as
# test/performance/plans.py has it
plans:
	@$(MAKE) --no-print-directory gimp3d
	@$(mpi) python3 test/performance/plans.py build/plans $(PLANS)

### hard         the hard cases (hard_cases.md); RANKS=1 CASES="spin" SIZE=short
# the gallery of hard cases (doc/user/hard_cases.md) on RANKS=1; CASES="spin crossing" runs these, SIZE=short
# their short forms
hard:
	$(look)
	@$(MAKE) --no-print-directory $(jobs) tests TESTS=stability
	@$(mpi) BUILD=$(BUILD) $(python) test/stability/gallery.py $(build)/hard_$(RANKS)$(if $(SIZE),_$(SIZE)) $(build)/gimp3d $(build)/test/stability \
	   --ranks $(RANKS) $(if $(SIZE),--$(SIZE)) $(CASES)

### map          which time steps are stable (hard_cases.md)
# which time steps are stable: the map of doc/user/hard_cases.md, on RANKS=1
map:
	$(look)
	@$(MAKE) --no-print-directory $(jobs) tests TESTS=stability
	@$(mpi) $(python) test/stability/stability_map.py $(build)/map $(build)/test/stability/map --ranks $(RANKS) \
	   --guarded $(build)/test/stability/guard_planted

