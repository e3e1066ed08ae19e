#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Runs cmocka test programs one after the other and counts their tests.
#   run.sh RESULTS PROGRAM...      runs, writes "passed failed" to RESULTS
#   run.sh --total RESULTS...      adds up and prints the closing line
set -u
if [ "$1" = --total ]; then
    shift
    cat "$@" | { passed=0; failed=0
        while read -r p f; do passed=$((passed + p)); failed=$((failed + f)); done
        echo "$passed passed, $failed failed"
        [ "$failed" = 0 ]; }
    exit
fi
results=$1
shift
passed=0
failed=0
export ASAN_OPTIONS="${ASAN_OPTIONS:-verify_asan_link_order=0:detect_stack_use_after_return=1}"
export LSAN_OPTIONS="suppressions=$PWD/tests/leaks.txt:print_suppressions=0"
for program in "$@"; do
    log=$program.log
    timeout 900 "$program" >"$log" 2>&1
    status=$?
    p=$(grep -c '^\[       OK \]' "$log")
    f=$(grep -c '^\[  FAILED  \] [a-zA-Z_].*[^0-9]$' "$log")
    grep -a -i '^skipped' "$log"
    if [ $status != 0 ]; then
        n=$(grep -c '^\[ *RUN' "$log")
        f=$((n - p))
        [ "$f" -gt 0 ] || f=1
        echo "FAILED $program (status $status)"
        cat "$log"
    else
        echo "ok $program: $p"
        f=0
    fi
    passed=$((passed + p))
    failed=$((failed + f))
done
echo "$passed $failed" >"$results"
echo "$passed passed, $failed failed"
[ "$failed" = 0 ]
