#!/bin/sh
# Builds every way in which a user may include and instantiate the headers, and runs a few of the
# programs. Prints the failures and "N passed, N failed". FAST=1: fewer orders and compilers.
set -u
cd "$(dirname "$0")/.."
sh tests/amalgamate.sh > /dev/null || exit 1
T=$(mktemp -d)
trap 'rm -rf "$T"' EXIT
W="-Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror"
passed=0
failed=0
headers="hilbert hxtsort delaunay mesher spr"
upper() { printf '%s' "$1" | tr '[:lower:]' '[:upper:]'; }

check() { # NAME COMMAND...: counts one check
    name=$1
    shift
    if "$@" > "$T/log" 2>&1; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "failed: $name: $*"
        head -n 12 "$T/log"
    fi
}

refused() { ! "$@"; }

compilers=""
command -v gcc > /dev/null && compilers="$compilers gcc-c99 gcc-openmp"
command -v clang > /dev/null && compilers="$compilers clang-c99"
command -v g++ > /dev/null && compilers="$compilers g++-c++11"
command -v clang++ > /dev/null && compilers="$compilers clang++-c++11"
[ -n "$compilers" ] || compilers="cc-c99"
folders=". dist"
every=12 # one in so many orders of the five headers is built in both ways
if [ -n "${FAST:-}" ]; then
    compilers="${compilers%%-*}-c99 ${compilers##* }"
    folders=dist # the headers themselves are built below
    every=24
fi
line() { # the command behind a compiler's name
    case $1 in
    gcc-c99) echo "gcc -std=c99 $W" ;;
    gcc-openmp) echo "gcc -std=gnu99 -fopenmp $W" ;;
    clang-c99) echo "clang -std=c99 $W" ;;
    g++-c++11) echo "g++ -x c++ -std=c++11 $W" ;;
    clang++-c++11) echo "clang++ -x c++ -std=c++11 $W" ;;
    *) echo "cc -std=c99" ;;
    esac
}

# What a program uses of each header, so that the linker has something to find.
use() {
    case $1 in
    hilbert) echo 'const void *use_hilbert(void) { return hilbert_result_string((hilbert_result)0); }' ;;
    hxtsort) echo 'const void *use_hxtsort(void) { return hxtsort_result_string((hxtsort_result)0); }' ;;
    delaunay) echo 'const void *use_delaunay(void) { return delaunay_result_string((delaunay_result)0); }' ;;
    mesher) echo 'const void *use_mesher(void) { return mesher_result_string((mesher_result)0); }' ;;
    spr) echo 'const void *use_spr(void) { return spr_result_string((spr_result)0); }' ;;
    esac
}
main_of() { # a main that calls use_NAME
    echo "const void *use_$1(void); int main(void) { return use_$1() == 0; }"
}

for c in $compilers; do
    cc=$(line "$c")
    for h in $headers; do
        H=$(upper "$h")
        for dir in $folders; do
            printf '#include "%s.h"\nint dummy_;\n' "$h" > "$T/a.c"
            check "$c: $dir/$h.h declared alone" $cc -I$dir -fsyntax-only "$T/a.c"
            { printf '#define %s_IMPLEMENTATION\n#include "%s.h"\n' "$H" "$h"; main_of "$h"; use "$h"; } > "$T/a.c"
            check "$c: $dir/$h.h alone" $cc -I$dir "$T/a.c" -o "$T/a.out" -lm
            check "$c: $dir/$h.h runs" "$T/a.out"
        done
        { printf '#include "%s.h"\n#include "%s.h"\n#define %s_IMPLEMENTATION\n#include "%s.h"\n#include "%s.h"\n' \
            "$h" "$h" "$H" "$h" "$h"; main_of "$h"; use "$h"; } > "$T/a.c"
        check "$c: $h.h declared twice, then implemented, then included again" $cc -I. "$T/a.c" -o "$T/a.out" -lm
        printf '#define %s_IMPLEMENTATION\n#include "%s.h"\n' "$H" "$h" > "$T/b.c"
        { printf '#include "%s.h"\n' "$h"; main_of "$h"; use "$h"; } > "$T/a.c"
        check "$c: $h.h implemented in one file, used in another" $cc -I. "$T/a.c" "$T/b.c" -o "$T/a.out" -lm
        { printf '#define %s_STATIC\n#define %s_IMPLEMENTATION\n#include "%s.h"\n' "$H" "$H" "$h"; main_of "$h"; use "$h"; } > "$T/a.c"
        printf '#define %s_STATIC\n#define %s_IMPLEMENTATION\n#include "%s.h"\nint dummy_;\n' "$H" "$H" "$h" > "$T/b.c"
        check "$c: $h.h, two private copies in one program" $cc -I. "$T/a.c" "$T/b.c" -o "$T/a.out" -lm
    done
    for h in delaunay mesher spr; do
        H=$(upper "$h")
        { printf '#define HILBERT_IMPLEMENTATION\n#include "hilbert.h"\n#define HXTSORT_IMPLEMENTATION\n#include "hxtsort.h"\n'
          [ $h = delaunay ] || printf '#define DELAUNAY_IMPLEMENTATION\n#include "delaunay.h"\n'
          printf 'int dummy_;\n'; } > "$T/b.c"
        { printf '#define %s_IMPLEMENTATION\n#define %s_NO_DEPENDENCIES\n#include "%s.h"\n' "$H" "$H" "$h"; main_of "$h"; use "$h"; } > "$T/a.c"
        check "$c: $h.h, dependencies in another file" $cc -I. "$T/a.c" "$T/b.c" -o "$T/a.out" -lm
    done
    printf '#define MESHIO_IMPLEMENTATION\n#include "examples/meshio.h"\nint main(void) { return 0; }\n' > "$T/a.c"
    check "$c: meshio.h alone" $cc -I. "$T/a.c" -o "$T/a.out" -lm
done

# All five together, implemented, in every order.
orders() { awk 'BEGIN {
    n = split("hilbert hxtsort delaunay mesher spr", h, " ")
    for (a = 1; a <= n; a++) for (b = 1; b <= n; b++) for (c = 1; c <= n; c++)
        for (d = 1; d <= n; d++) for (e = 1; e <= n; e++)
            if (a != b && a != c && a != d && a != e && b != c && b != d && b != e && c != d && c != e && d != e)
                print h[a], h[b], h[c], h[d], h[e]
}'; }
set -- $compilers
first=$(line "$1")
k=0
orders > "$T/orders"
while read -r order; do
    k=$((k + 1))
    [ -n "${FAST:-}" ] && [ $((k % every)) -ne 1 ] && continue
    { for h in $order; do printf '#define %s_IMPLEMENTATION\n#include "%s.h"\n' "$(upper "$h")" "$h"; done
      echo 'int dummy_;'; } > "$T/a.c"
    check "one after the other, in the order $order" $first -I. -fsyntax-only "$T/a.c"
    [ $((k % every)) -ne 1 ] && continue
    { printf '#define HILBERT_IMPLEMENTATION\n#define HXTSORT_IMPLEMENTATION\n#define DELAUNAY_IMPLEMENTATION\n'
      printf '#define MESHER_IMPLEMENTATION\n#define SPR_IMPLEMENTATION\n'
      for h in $order; do printf '#include "%s.h"\n' "$h"; done
      echo 'int dummy_;'; } > "$T/a.c"
    check "all, in the order $order" $first -I. -fsyntax-only "$T/a.c"
done < "$T/orders"

# Handles of 32 bits in one file and of 64 in another must not link.
for pair in delaunay:delaunay_mesh_free mesher:mesher_domain_free spr:spr_improve spr:spr_improve_arrays; do
    h=${pair%:*}
    printf '#define %s_IMPLEMENTATION\n#include "%s.h"\n' "$(upper "$h")" "$h" > "$T/b.c"
    { printf '#include "%s.h"\nint main(void) {\n' "$h"
      echo "void (*volatile use)(void) = (void (*)(void))${pair#*:}; return use == 0; }"; } > "$T/a.c"
    $first -I. -DDELAUNAY_INDEX64 -c "$T/b.c" -o "$T/b.o"
    check "$h.h, handles of 64 bits in both files" $first -I. -DDELAUNAY_INDEX64 "$T/a.c" "$T/b.o" -o "$T/a.out" -lm
    check "$h.h, handles of two widths" refused $first -I. "$T/a.c" "$T/b.o" -o "$T/a.out" -lm
done

# After <windows.h>, whose macros take plain words.
{ printf '#define far\n#define near\n#define small char\n#define interface struct\n#define IN\n#define OUT\n'
  printf '#define min(a, b) ((a) < (b) ? (a) : (b))\n#define max(a, b) ((a) > (b) ? (a) : (b))\n'
  for h in $headers meshio; do
      printf '#define %s_IMPLEMENTATION\n#include "%s.h"\n' "$(upper "$h")" "$h"
  done
  echo 'int dummy_;'; } > "$T/a.c"
check "all, where windows.h was before" $first -I. -Iexamples -fsyntax-only "$T/a.c"

# Nothing exported but the public names, nothing writable.
if command -v nm > /dev/null; then
    for h in $headers; do
        printf '#define %s_IMPLEMENTATION\n#include "%s.h"\n' "$(upper "$h")" "$h" > "$T/a.c"
        $first -I. -c "$T/a.c" -o "$T/a.o" 2> /dev/null
        nm "$T/a.o" | awk '$2 == "T" && $3 !~ /^(hilbert|hxtsort|delaunay|mesher|spr)_[a-z0-9]/ || $2 ~ /^[bBdDC]$/' > "$T/names"
        check "$h.h exports only its names and has no writable globals: $(head -c 200 "$T/names")" test ! -s "$T/names"
    done
fi
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
