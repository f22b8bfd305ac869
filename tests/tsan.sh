#!/bin/sh
# tsan.sh [TEST...]  the parallel tests under the thread sanitizer. Needs clang with libomp, whose
# Archer tool tells the sanitizer of OpenMP's barriers (apt-get install clang libomp-dev); gcc's
# libgomp is not instrumented, and its barriers would be reported as races.
cd "$(dirname "$0")/.." || exit 1
CLANG=${CLANG:-clang}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
[ $# -gt 0 ] || set -- test_delaunay test_extremes test_recover test_refine test_speculate test_spr \
    test_weighted
passed=0
failed=0
for test; do
    if $CLANG -O1 -g -fsanitize=thread -fopenmp -I. -Iexamples -Itests "tests/$test.c" \
        -o "$work/$test" -lm && TSAN_OPTIONS='ignore_noninstrumented_modules=1' OMP_NUM_THREADS=4 \
        "$work/$test" >"$work/out" 2>&1; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        grep -m 5 'SUMMARY\|failed' "$work/out"
    fi
    echo "$test: $(tail -n 1 "$work/out")"
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
