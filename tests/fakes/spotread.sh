#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# spotread as far as the driver sees it. Options as spotread's are passed over;
# how=WORD says how it behaves, keys=FILE gets every byte pressed as a number.
how=fine keys=/dev/null spectra=no
for word in "$@"; do
    case "$word" in
    -s) spectra=yes ;;
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
failed() { # and waits, its prompt without an end of line
    printf '\n\nSpot read failed due to %s\nHit Esc or Q to give up, any other key to retry:' "$1"
    key
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
if [ "$how" = colorimeter ] && [ $spectra = yes ]; then
    printf 'Need spectral information for custom illuminant or observer\n'
    printf "and instrument doesn't support it\n"
    exit 255
fi
[ "$how" != unfit ] || { printf "Need emissive spot capability\nand instrument doesn't support it\n"; exit 255; }
[ "$how" != colorimeter ] || printf "Setting no-initial calibrate failed with 'Unsupported function' (Success)\n"
[ "$how" != shy ] || { printf 'Good bye\n'; exit 1; }
case "$how" in
uncalibrated)
    printf '\nSet instrument sensor to calibration position,\n and then hit any key to continue: '
    key
    printf "\nCalibration failed with 'Calibration failed' (White reference is out of range)\n"
    printf 'Hit any key to retry, or Esc or Q to abort: '
    key
    ;;
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
    misread-1) failed 'misread (Inconsistent readings)' ;;
    saturated-1) failed 'misread (Sensor is saturated)' ;;
    bright-1) failed 'misread (Light level is too high)' ;;
    specbos-1) failed 'misread (Overexposure)' ;;
    dark-1) failed 'misread (Light level is too low)' ;;
    untold-1) printf '\nSomething else\nHit Esc or Q to give up, any other key to retry:'; key ;;
    turned-1) printf '\nSpot read failed due to the sensor being in the wrong position\n(Cover is on)\n' ;;
    late-1) sleep 0.4; failed 'misread (Inconsistent readings)' ;;
    cable-2) failed 'communication problem.' ;;
    fatal-1) printf "\n\nGot fatal error 'Hardware Failure' (It broke)\n"; exit 0 ;;
    recalibrate-1)
        sleep 0.4
        printf '\nSpot read failed because instruments needs calibration.\n'
        printf 'Set instrument sensor to calibration position,\n and then hit any key to continue: '
        key
        ;;
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
