#!/bin/sh
# run_tests.sh PROGRAM...  runs each test program or script; every one ends with the line
# "N passed, N failed". Prints one line for each and the total; exit 1 if anything failed.
passed=0
failed=0
for program; do
    case $program in
    *.sh) output=$(sh "$program" 2>&1) && status=0 || status=$? ;;
    *) output=$("$program" 2>&1) && status=0 || status=$? ;;
    esac
    last=$(printf '%s\n' "$output" | tail -n 1)
    set -- $last
    if [ "$2" = "passed," ] && [ "$4" = "failed" ] && [ "$1" -ge 0 ] && [ "$3" -ge 0 ]; then
        p=$1 f=$3
        if [ "$status" -ne 0 ] && [ "$f" -eq 0 ]; then f=1; fi
    else
        p=0 f=1
        last="no result (exit status $status)"
    fi
    if [ "$f" -ne 0 ]; then printf '%s\n' "$output" | tail -n 25; fi
    printf '%-28s %s\n' "$(basename "$program")" "$last"
    passed=$((passed + p))
    failed=$((failed + f))
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
