#!/bin/sh
# models.sh FOLDER: runs the tools over a folder of models. Its INDEX.tsv has, separated by tabs,
# the columns "file", "class" and "expect". Surfaces go to mesh, points to delaunay. If "expect" has
# "ok", exit status 0 or 1 with an output passes; if it has "error", exit status 3, 5 or 6 with a
# message and no output; "either" stands for both. Environment: VERIFY names a program that checks
# the results (VERIFY --surface SURFACE MESH, VERIFY --delaunay MESH), CLASS restricts the models to
# one class, LIMIT is the time for a model in seconds (default 60).
BUILD=${BUILD:-build}
LIMIT=${LIMIT:-60}
folder=$1
if [ ! -f "$folder/INDEX.tsv" ]; then
    echo "no INDEX.tsv in '$folder'; use make test-models MODELS=FOLDER" >&2
    exit 2
fi
T=$BUILD/models.tmp
mkdir -p "$T"
trap 'rm -rf "$T"' EXIT
timeout=
command -v timeout > /dev/null && timeout="timeout $LIMIT"
awk -F '\t' 'NR == 1 { for (i = 1; i <= NF; i++) c[$i] = i; next }
             { print $c["file"] "\t" $c["class"] "\t" $c["expect"] }' "$folder/INDEX.tsv" > "$T/list"
passed=0
failed=0
tab=$(printf '\t')
while IFS=$tab read -r file class expect; do
    [ -n "$CLASS" ] && [ "$class" != "$CLASS" ] && continue
    out=$T/out.mesh
    rm -f "$out"
    tool=mesh
    case $file in *.xyz | *.bin | *.node) tool=delaunay ;; esac
    $timeout "$BUILD/$tool" "$folder/$file" -q -o "$out" > /dev/null 2> "$T/err" < /dev/null
    status=$?
    good=0
    case $status in
    0 | 1) case $expect in *ok* | *either*) good=1 ;; esac
        [ -s "$out" ] || good=0
        if [ $good -eq 1 ] && [ -n "$VERIFY" ]; then
            case $tool:$file in
            delaunay:*) "$VERIFY" --delaunay "$out" > "$T/err" 2>&1 || good=0 ;;
            *.off | *.mesh | *.stl | *.obj) "$VERIFY" --surface "$folder/$file" "$out" > "$T/err" 2>&1 || good=0 ;;
            esac
        fi ;;
    3 | 5 | 6) case $expect in *error* | *either*) good=1 ;; esac
        [ -e "$out" ] && good=0
        [ -s "$T/err" ] || good=0 ;;
    esac
    if [ $good -eq 1 ]; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "failed: $file: exit $status, expected $expect: $(tail -n 1 "$T/err" | cut -c 1-150)"
    fi
done < "$T/list"
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
