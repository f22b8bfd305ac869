#!/bin/sh
# delaunay.h and hilbert.h with compiler flags that change arithmetic: they must be right with
# contraction to fused multiply-adds, without vector instructions and without OpenMP, and must refuse
# to compile with fast-math or a part of it. CC and TMPDIR can be set.
cd "$(dirname "$0")/.." || exit 1
CC=${CC:-cc}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
passed=0
failed=0

check() { # status text
    if [ "$1" -eq 0 ]; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "failed: $2"
    fi
}

for flags in '-march=native -ffp-contract=fast' '-DDELAUNAY_NO_SIMD -frounding-math'; do
    $CC -O1 $flags -I. -Itests tests/test_weighted.c -o "$work/test" -lm && "$work/test" >"$work/out"
    check $? "$flags: $(tail -n 1 "$work/out")"
done
$CC -O2 -march=native -ffp-contract=fast -I. -Itests tests/test_hilbert.c -o "$work/test" -lm &&
    "$work/test" >"$work/out"
check $? "hilbert.h with fused operations: $(tail -n 1 "$work/out")"
# Without OpenMP the sections run one after the other.
$CC -O1 -I. -Itests tests/test_partition.c -o "$work/test" -lm && "$work/test" >"$work/out"
check $? "without OpenMP: $(tail -n 1 "$work/out")"
# FLT_EVAL_METHOD is 16 where the processor has half precision, and 2 with x87 arithmetic
echo '#include "delaunay.h"' >"$work/plain.c"
for flags in -mavx512fp16 -march=sapphirerapids; do
    $CC -O1 $flags -fsyntax-only -xc /dev/null 2>/dev/null || continue
    $CC -O1 $flags -I. -fsyntax-only "$work/plain.c"
    check $? "$flags is refused"
done
# clang cannot be asked whether it may reorder sums (__ASSOCIATIVE_MATH__)
unsafe=$($CC -funsafe-math-optimizations -dM -E -xc /dev/null 2>/dev/null |
    sed -n 's/.*__ASSOCIATIVE_MATH__.*/-funsafe-math-optimizations/p')
for flags in -ffast-math -Ofast -mfpmath=387 -ffinite-math-only $unsafe; do
    $CC -O1 $flags -fsyntax-only -xc /dev/null 2>/dev/null || continue
    ! $CC -O1 $flags -I. -fsyntax-only "$work/plain.c" 2>/dev/null
    check $? "$flags is accepted"
done
echo '#include "hilbert.h"' >"$work/plain.c"
for flags in -ffast-math -ffinite-math-only $unsafe; do
    ! $CC -O1 $flags -I. -fsyntax-only "$work/plain.c" 2>/dev/null
    check $? "$flags is accepted by hilbert.h"
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
