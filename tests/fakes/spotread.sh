#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# spotread as far as the driver sees it. Options as spotread's are passed over;
# how=WORD says how it behaves, keys=FILE gets every byte pressed as a number.
how=fine keys=/dev/null
for word in "$@"; do
    case "$word" in
    how=*) how=${word#how=} ;;
    keys=*) keys=${word#keys=} ;;
    esac
done
key() { # waits for one; its number is printed into the file
    pressed=$(dd bs=1 count=1 2>/dev/null | od -An -tu1 | tr -d ' \n')
    [ -n "$pressed" ] || exit 0
    echo "$pressed" >>"$keys"
    [ "$pressed" != 113 ] || exit 0
}
spectrum() {
    printf 'Spectrum from 380.000000 to 780.000000 nm in 101 steps\n'
    i=0
    while [ $i -lt "$1" ]; do
        [ $i = 0 ] || printf ', '
        printf '%8.3f' "$i.125"
        i=$((i + 1))
    done
    printf '\n'
}
result() { printf '\n Result is XYZ: 81.250000 85.500000 93.125000, D50 Lab: 93.0 -1.0 -18.0\n'; }
prompt() {
    printf '\nPlace instrument on spot to be measured,\n'
    case "$how" in
    oldprompt) printf 'press any key\n' ;;
    *)
        printf "'h' to toggle high res., 'k' to do a calibration\n"
        printf 'Hit ESC or Q to exit, any other key to take a reading: '
        ;;
    esac
}
[ "$how" != absent ] || { printf 'spotread: Error - Instrument initialisation failed with no device\n'; exit 1; }
[ "$how" != mute ] || { key; exit 0; }
[ -n "$ARGYLL_NOT_INTERACTIVE" ] || exit 9
printf 'Connecting to the instrument ..\nInstrument Type:   i1 Pro\nSerial Number:     EMU12345\nFirmware version:  502\n'
case "$how" in
calibrate | stubborn)
    printf '\nSet instrument sensor to calibration position,\n and then hit any key to continue,\n or hit Esc or Q to abort: '
    key
    [ "$how" != stubborn ] || {
        printf '\n(Sensor should be in surface position)\nSet instrument sensor to calibration position, hit any key: '
        key
    }
    printf '\nCalibration complete\n'
    ;;
esac
count=0
while :; do
    prompt
    key
    count=$((count + 1))
    case "$how-$count" in
    misread-1) printf '\nSpot read failed due to misread (Inconsistent readings)\n' ;;
    saturated-1) printf '\nSpot read failed: Sensor is saturated\n' ;;
    dark-1) printf '\nSpot read failed: Signal level is too low\n' ;;
    pulled-2) printf '\nSpot read failed with Communications failure\n'; exit 1 ;;
    killed-1) kill -9 $$ ;;
    slow-1) sleep 0.4; spectrum 101; result ;;
    cut-1) spectrum 60; result ;;
    garbage-1) printf 'Spectrum from 380 to 780 nm in 101 steps\n  1.0, \033[31mred, 2.0\n'; result ;;
    huge-1) printf 'Spectrum from 380 to 780 nm in 99999 steps\n 1.0\n'; result ;;
    nan-1) printf '\n Result is XYZ: nan nan nan, D50 Lab: nan nan nan\n' ;;
    flood-1) head -c 20000 /dev/zero | tr '\0' x ;;
    colorimeter-*) result ;;
    after-*) result; spectrum 101 ;;
    *) spectrum 101; result ;;
    esac
done
