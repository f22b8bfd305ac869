#!/bin/sh
# tsan.sh [TEST...]: runs the parallel tests under the thread sanitizer. Needs clang with libomp,
# whose Archer tool tells the sanitizer about OpenMP's barriers (apt-get install clang libomp-dev);
# gcc's libgomp is not instrumented, so that false races would be reported. tsan.sh --usable only
# tells by its exit status whether these are installed.
cd "$(dirname "$0")/.." || exit 1
CLANG=${CLANG:-clang}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Compiles FILE.c and runs it; 0 if it ends well and nothing is reported.
under_tsan() { # FILE.c
    $CLANG -O1 -g -fsanitize=thread -fopenmp -DPARALLEL_ONLY -DDELAUNAY__ITEMS_A_SECTION=1500 \
        -I. -Iexamples -Itests "$1" -o "$work/program" -lm &&
        TSAN_OPTIONS='ignore_noninstrumented_modules=1' OMP_NUM_THREADS=4 "$work/program"
}

cat >"$work/barrier.c" <<'END'
static int a[4096], b[4096];
int main(void)
{
    int i;
#pragma omp parallel private(i)
    {
#pragma omp for
        for (i = 0; i < 4096; i++) a[i] = i;
#pragma omp for
        for (i = 0; i < 4096; i++) b[i] = a[4095 - i];
    }
    return b[0] != 4095;
}
END
if ! under_tsan "$work/barrier.c" >"$work/out" 2>&1; then
    echo "no clang whose thread sanitizer knows OpenMP (apt-get install clang libomp-dev)"
    exit 2
fi
[ "${1:-}" != --usable ] || exit 0

[ $# -gt 0 ] || set -- test_delaunay test_extremes test_partition test_recover test_refine \
    test_speculate test_spr test_weighted
passed=0
failed=0
for test; do
    if under_tsan "tests/$test.c" >"$work/out" 2>&1; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        grep -m 5 'SUMMARY\|failed' "$work/out"
    fi
    echo "$test: $(tail -n 1 "$work/out")"
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
