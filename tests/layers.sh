#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Checks every #include "folder/..." against tests/layers.txt.
set -u
cd "$(dirname "$0")/.." || exit 1
bad=0
for file in $(git ls-files --cached --others --exclude-standard '*.c' '*.h' '*.cpp'); do
    folder=${file%%/*}
    allowed=" $folder $(sed -n "s/^$folder: *//p" tests/layers.txt) "
    for seen in $(sed -n 's|^ *# *include "\([a-z]*\)/.*|\1|p' "$file" | sort -u); do
        case $allowed in
        *" $seen "*) ;;
        *) echo "$file: $folder may not see $seen (tests/layers.txt)" >&2; bad=1 ;;
        esac
    done
done
exit $bad
