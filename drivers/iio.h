// SPDX-License-Identifier: Apache-2.0
// The driver of accelerometers that the Linux kernel knows (Industrial I/O);
// see iio.md. Open to tests: the mount matrix.
#ifndef DRIVERS_IIO_H
#define DRIVERS_IIO_H

#include "drivers/accelerometer.h"

extern const struct accelerometer_driver iio_driver;

// "1, 0, 0; 0, 1, 0; 0, 0, 1" with any blanks, row after row. DATA unless it
// holds nine finite numbers whose rows have length 1 and stand at right angles,
// within 1 %; mirrored sensors exist.
bool iio_mount_matrix(const char *text, struct mat3 *out, struct error *err);

#endif
