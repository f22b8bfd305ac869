#!/bin/sh
# run_tests.sh PROGRAM...: runs test programs and scripts, as many at a time as there are cores, or
# JOBS. The last line of each must be "N passed, N failed". Prints one line for each when it ends,
# the last lines of those that failed, and the total; exit status 1 if anything failed.
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
jobs=${JOBS:-$(getconf _NPROCESSORS_ONLN 2> /dev/null || echo 1)}
one='
    out=$1/${2##*/}
    case $2 in
    *.sh) sh "$2" > "$out" 2>&1 ;;
    *) "$2" > "$out" 2>&1 ;;
    esac
    echo $? > "$out.status"
    printf "%-28s %s\n" "${2##*/}" "$(tail -n 1 "$out")"'
printf '%s\n' "$@" | xargs -n 1 -P "$jobs" sh -c "$one" sh "$work"
passed=0
failed=0
for program; do
    out=$work/${program##*/}
    status=$(cat "$out.status")
    set -- $(tail -n 1 "$out")
    if [ "$2" = "passed," ] && [ "$4" = "failed" ] && [ "$1" -ge 0 ] && [ "$3" -ge 0 ]; then
        p=$1 f=$3
        if [ "$status" -ne 0 ] && [ "$f" -eq 0 ]; then f=1; fi
    else
        p=0 f=1
        echo "no result of ${program##*/} (exit status $status)" >> "$out"
    fi
    if [ "$f" -ne 0 ]; then
        echo "-- ${program##*/}:"
        tail -n 25 "$out"
    fi
    passed=$((passed + p))
    failed=$((failed + f))
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
