#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The main job on emulated instruments: boothsim brings up the booth, boothd
# runs against it, boothcal works through a session.
#   demo.sh FOLDER [OPTION...]           results go to FOLDER, options to boothcal session;
#                                        programs come from $BUILD (build)
#   demo.sh --whole FOLDER [OPTION...]   from bare settings: also finds where screen, inclinometer and
#                                        camera are, photographs the ceiling under each lamp, and audits
# LAMP_A, LAMP_D50, LAMP_D65 replace a lamp's spectrum: a CIE name or a file.
set -eu

programs=$(cd "${BUILD:-build}" && pwd)
root=$(cd "$(dirname "$0")/.." && pwd)
lamps="A D50 D65"

spectrum_of() {
    case $1 in
    A) echo "${LAMP_A:-A}" ;;
    D50) echo "${LAMP_D50:-FL8}" ;;
    D65) echo "${LAMP_D65:-FL3.15}" ;;
    esac
}

if [ "$1" = --inside ]; then
    out=$2
    shift 2
    run=$out/run
    daemon=
    trap '[ -z "$daemon" ] || kill "$daemon" 2>/dev/null || :' EXIT
    "$programs/boothd" --config "$run/boothd.conf" 2>"$out/boothd.log" &
    daemon=$!
    tries=0
    until "$programs/boothctl" --socket "$run/boothd.sock" --json status >/dev/null 2>&1 || [ $? = 3 ]; do
        tries=$((tries + 1))
        if [ $tries -gt 100 ] || ! kill -0 "$daemon" 2>/dev/null; then
            echo "demo: boothd did not start; its log:" >&2
            cat "$out/boothd.log" >&2
            exit 1
        fi
        sleep 0.2
    done
    booth="--config $run/boothd.conf --socket $run/boothd.sock --booth $run/boothsim.sock"
    if [ -e "$run/whole" ]; then
        # shellcheck disable=SC2086
        "$programs/boothcal" tilt $booth --store --keep "$out/poses.csv"
        # shellcheck disable=SC2086
        "$programs/boothcal" tracker $booth --store --keep "$out/points.csv"
        set -- "$@" --photographs "$out/photographs"
    else
        set -- "$@" --maps "$run"
    fi
    for lamp in $lamps; do set -- "$@" --lamp "$lamp=$(spectrum_of $lamp)"; done
    status=0
    "$programs/boothcal" session --config "$run/boothd.conf" --socket "$run/boothd.sock" \
        --booth "$run/boothsim.sock" --lamp-drift 5 --out "$out" "$@" || status=$?
    [ $status = 0 ] || [ $status = 3 ] || exit $status
    # The last lamp is still on: does the proof keep to what a lab may ask for?
    verified=0
    "$programs/boothcal" verify --config "$run/boothd.conf" --socket "$run/boothd.sock" \
        --booth "$run/boothsim.sock" --patches 4 --published-mean 2 --published-max 5 \
        --out "$out/verify.json" || verified=$?
    [ $verified = 0 ] || [ $verified = 3 ] || exit $verified
    if [ -e "$run/whole" ]; then
        "$programs/boothcal" audit --lamps "$(ls -d "$run"/store/*/*/current)/lamps" -o "$out/audit.json" ||
            [ $? = 3 ]
        "$programs/boothcal" report --check "$out/report.json" "$out/report.txt" "$out/report.html" \
            "$out/verify.json" "$out/audit.json"
        # shellcheck disable=SC2086
        "$programs/boothcal" history --config "$run/boothd.conf" --verify
    fi
    "$programs/boothctl" --socket "$run/boothd.sock" quit >/dev/null
    wait "$daemon"
    daemon=
    exit $status
fi

whole=
[ "$1" != --whole ] || { whole=yes; shift; }
mkdir -p "$1"
out=$(cd "$1" && pwd)
shift
run=$out/run
rm -rf "$run"
mkdir -p "$run"
# What a technician measures first is not in the settings then.
[ -z "$whole" ] || touch "$run/whole"
measured=${whole:+-e /^hinge_m/d -e /^centre_from_hinge_m/d -e /^place_m/d -e /^pitch_deg/d}
# Lamps and display model come from the store, which the session fills.
# shellcheck disable=SC2086
sed $measured -e '/^folder = lamps$/d' -e 's|^model = display.ini$|serial = emulated panel EMU001|' \
    "$root/config/booths/emulated.conf" >"$run/boothd.conf"
cat >>"$run/boothd.conf" <<END
[calibration]
store = $run/store

[materials]
folder = $root/config/materials

[control]
socket = $run/boothd.sock
END
for lamp in $lamps; do spectra="${spectra:-} --lamp $lamp=$(spectrum_of $lamp)"; done
# shellcheck disable=SC2086
exec "$programs/boothsim" --scenario "$root/simulator/scenarios/booth.ini" --run "$run" $spectra -- \
    "$root/calibration/demo.sh" --inside "$out" "$@"
