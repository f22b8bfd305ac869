# Needs a C compiler and make. Everything is built into build/.
#
#   make                          the tools: mesh, delaunay, improve; cube, sort_points, sort_pairs
#   make demo                     mesh a part that the tool itself models, write demo.vtu
#   make test                     all tests, about five minutes on two cores
#   make hard                     a thousand surfaces that are hard to recover, each result proved
#   make sanitize                 all tests under the address and undefined-behaviour sanitizers
#   make tsan                     the parallel tests under clang's thread sanitizer
#   make test-models MODELS=DIR   run the tools over a folder of models with an INDEX.tsv
#   make league MODELS=DIR        times and qualities over this folder, with installed rivals
#   make league-table MODELS=DIR  table 7.1 of [Marot 2020] for three of the models, or for PARTS
#   make bench-NAME               build and run bench/NAME.c or .cpp with the arguments ARGS;
#                                 bench-mesh also takes MODELS=DIR
#   make include-test             test every way to include the headers
#   make dist                     standalone headers in dist/
#   make clean
#
# CC, CFLAGS, LDLIBS can be set. OpenMP is used if the compiler supports it; OPENMP= turns it off.

CFLAGS ?= -O3
TESTFLAGS ?= -O1 -Wall -Wextra
LDLIBS ?= -lm
BUILD ?= build
OPENMP ?= $(shell printf 'int main(void){return 0;}' | \
            $(CC) -fopenmp -x c - -o /dev/null 2>/dev/null && echo -fopenmp)
OPENMP := $(OPENMP)

HEADERS := $(wildcard *.h examples/*.h tests/*.h bench/*.h)
TOOLS := $(patsubst examples/%.c,$(BUILD)/%,$(wildcard examples/*.c))
TESTS := $(patsubst tests/%.c,$(BUILD)/%,$(wildcard tests/test_*.c))
SCRIPTS := $(wildcard tests/test_*.sh)
BENCHES := $(patsubst bench/%.c,$(BUILD)/bench_%,$(wildcard bench/*.c)) \
           $(patsubst bench/%.cpp,$(BUILD)/bench_%,$(wildcard bench/*.cpp))

.PHONY: all demo test hard sanitize tsan test-models league league-table include-test dist clean benches
.SECONDARY:

all: $(TOOLS)

benches: $(BENCHES)

$(BUILD):
	mkdir -p $@

# Sections smaller than those that pay, so that the tests have more of them.
SECTIONS = -DDELAUNAY__ITEMS_A_SECTION=1500

$(BUILD)/test_%: tests/test_%.c $(HEADERS) | $(BUILD)
	$(CC) $(TESTFLAGS) $(OPENMP) $(SECTIONS) -I. -Iexamples -Itests $< $(LINKED) -o $@ $(LDLIBS)

# Tests that use only the interface of a header share its implementation, which is compiled once.
$(BUILD)/linked_%.o: %.h $(HEADERS) | $(BUILD)
	$(CC) $(TESTFLAGS) $(OPENMP) $(SECTIONS) -I. \
	  -D$(shell echo $* | tr a-z A-Z)_IMPLEMENTATION -include $< \
	  -x c -c /dev/null -o $@
MESHER_TESTS := $(addprefix $(BUILD)/test_,check divide hard mesher refine)
DELAUNAY_TESTS := $(addprefix $(BUILD)/test_,changing editing extremes partition queries reconnect \
  speculate)
$(MESHER_TESTS): $(BUILD)/linked_mesher.o
$(MESHER_TESTS): LINKED = -DLINKED $(BUILD)/linked_mesher.o
$(DELAUNAY_TESTS): $(BUILD)/linked_delaunay.o
$(DELAUNAY_TESTS): LINKED = -DLINKED $(BUILD)/linked_delaunay.o

$(BUILD)/bench_%: bench/%.c $(HEADERS) | $(BUILD)
	$(CC) $(CFLAGS) $(OPENMP) -I. -Iexamples $< -o $@ $(LDLIBS)

# Ours is compiled with the flags of the README, the rival, if installed, with its best ones.
CGAL ?= $(if $(wildcard /usr/include/CGAL/Delaunay_triangulation_3.h),-DWITH_CGAL)
$(BUILD)/bench_delaunay: bench/delaunay.cpp $(HEADERS) | $(BUILD)
	$(CC) $(CFLAGS) $(OPENMP) -I. -DDELAUNAY_IMPLEMENTATION -include delaunay.h -x c -c /dev/null \
	  -o $(BUILD)/bench_delaunay_ours.o
	$(CXX) -O3 -march=native -frounding-math $(OPENMP) -DBENCH_DELAUNAY_SEPARATE $(CGAL) -I. $< \
	  $(BUILD)/bench_delaunay_ours.o -o $@ $(if $(CGAL),-ltbb -ltbbmalloc -lgmp -lmpfr) $(LDLIBS)

$(BUILD)/bench_%: bench/%.cpp $(HEADERS) | $(BUILD)
	$(CXX) $(CFLAGS) $(OPENMP) -I. $< -o $@ $(LDLIBS)

$(BUILD)/%: examples/%.c $(HEADERS) | $(BUILD)
	$(CC) $(CFLAGS) $(OPENMP) $< -o $@ $(LDLIBS)

demo: $(BUILD)/mesh
	$(BUILD)/mesh --demo -o demo.vtu

# Builds on all cores, unless make was given a number of jobs.
JOBS = $(if $(findstring jobserver,$(MAKEFLAGS))$(filter -j%,$(MAKEFLAGS)),,-j$(shell getconf _NPROCESSORS_ONLN 2>/dev/null || echo 1))
test:
	@$(MAKE) --no-print-directory $(JOBS) $(TOOLS) $(TESTS)
	@BUILD=$(BUILD) sh tests/run_tests.sh $(TESTS) $(SCRIPTS)

hard: $(BUILD)/test_hard
	HARD_CASES=1000 $<

sanitize:
	@$(MAKE) --no-print-directory test BUILD=build/sanitize OPENMP= \
	  TESTFLAGS='-O1 -g -fsanitize=address,undefined -fno-sanitize-recover=undefined' \
	  CFLAGS='-O1 -g -fsanitize=address,undefined -fno-sanitize-recover=undefined'

tsan:
	@sh tests/tsan.sh

test-models: all
	@BUILD=$(BUILD) sh tests/models.sh '$(MODELS)'

league: all
	@BUILD=$(BUILD) sh bench/league.sh '$(MODELS)'

# Rotor, Piston and Rim of [Marot 2020] are not available; these models of the folder replace them.
PARTS ?= a_cad/fandisk.off a_cad/piece_explicit_volume.off a_cad/shoulder.off
league-table: all
	@NATIVE=1 FILES='$(PARTS)' BUILD=$(BUILD) sh bench/league.sh '$(MODELS)' | awk -F, ' \
	  NR == 1 { for (i = 1; i <= NF; i++) c[$$i] = i; next } \
	  $$1 != last { printf "\n%-40s %8s %8s %8s %8s\n", last = $$1, "gamma", "SICN", "min", "max" } \
	  { printf "  %-38s %8.3f %8.3f %8.2f %8.2f\n", $$2, $$c["gamma_min"], $$c["sicn_min"], \
	      $$c["dihedral_min"], $$c["dihedral_max"] }'

bench-mesh: $(BUILD)/bench_mesh
	$< $(ARGS) $(if $(MODELS),$$(find '$(MODELS)' -name '*.off' -o -name '*.stl' -o -name '*.obj' -o -name '*.ply'))

bench-%: $(BUILD)/bench_%
	$< $(ARGS)

include-test: dist
	@sh tests/include_test.sh

dist:
	sh tests/amalgamate.sh

clean:
	rm -rf build dist demo.vtu
