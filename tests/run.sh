#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Runs cmocka test programs one after the other, those after --together at the
# same time, and counts their tests.
#   run.sh RESULTS PROGRAM... [--together PROGRAM...]
#                                  runs, writes "passed failed skipped" to RESULTS
#   run.sh --total RESULTS...      adds up and prints the closing line
set -u
passed=0
failed=0
skipped=0

closing_line() {
    if [ "$skipped" -gt 0 ]; then
        echo "$passed passed, $failed failed, $skipped skipped"
    else
        echo "$passed passed, $failed failed"
    fi
    [ "$failed" = 0 ]
}

if [ "$1" = --total ]; then
    shift
    for results in "$@"; do
        read -r p f s 2>/dev/null <"$results" || { echo "no $results: its run did not come to its end"; p=0 f=1 s=0; }
        passed=$((passed + p))
        failed=$((failed + f))
        skipped=$((skipped + s))
    done
    closing_line
    exit
fi
results=$1
shift
export ASAN_OPTIONS="${ASAN_OPTIONS:-verify_asan_link_order=0:detect_stack_use_after_return=1}"
export LSAN_OPTIONS="suppressions=$PWD/tests/leaks.txt:print_suppressions=0"

run() {
    timeout 900 "$1" >"$1.log" 2>&1
    echo $? >"$1.status"
}

count() {
    log=$1.log
    read -r status <"$1.status"
    p=$(grep -a -c '^\[       OK \]' "$log")
    s=$(grep -a '^\[  SKIPPED \] [a-z_A-Z]' "$log" | sort -u | wc -l) # named twice
    f=0
    grep -a -i '^skipped' "$log"
    if [ "$status" != 0 ]; then
        f=$(($(grep -a -c '^\[ *RUN' "$log") - p - s))
        [ "$f" -gt 0 ] || f=1
        echo "FAILED $1 (status $status)"
        cat "$log"
    else
        echo "ok $1: $p"
    fi
    passed=$((passed + p))
    failed=$((failed + f))
    skipped=$((skipped + s))
}

while [ $# -gt 0 ] && [ "$1" != --together ]; do
    run "$1"
    count "$1"
    shift
done
[ $# -eq 0 ] || shift
for program in "$@"; do
    run "$program" &
done
wait
for program in "$@"; do
    count "$program"
done
echo "$passed $failed $skipped" >"$results"
closing_line
