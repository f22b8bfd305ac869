#!/bin/sh
# delaunay.h under flags that change arithmetic: right with contraction to fused multiply-adds and
# without vectors, refused with fast-math. CC and TMPDIR can be set.
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
for flags in -ffast-math -Ofast; do
    echo '#include "delaunay.h"' >"$work/fast.c"
    ! $CC -O1 $flags -I. -fsyntax-only "$work/fast.c" 2>/dev/null
    check $? "$flags is accepted"
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
