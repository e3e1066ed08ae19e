// SPDX-License-Identifier: Apache-2.0
#include "drivers/udev.h"

#include <string.h>

// Stock kernels let everybody read them; some distributions do not.
static const char iio_rule[] =
    "# Accelerometers of the kernel (Industrial I/O)\n"
    "SUBSYSTEM==\"iio\", KERNEL==\"iio:device*\", TEST==\"in_accel_x_raw\", MODE=\"0660\", "
    "GROUP=\"boothd\", TAG+=\"uaccess\", "
    "RUN+=\"/bin/sh -c 'cd %S%p && chgrp boothd in_* && chmod g+r in_*'\"\n";

bool udev_refused(const struct error *err)
{
    return err->code == ERROR_SYSTEM && strstr(err->text, UDEV_RULES_FILE);
}

static void rule(const struct device_id *id, FILE *out)
{
    fprintf(out, "# %s\n", id->name);
    switch (id->bus) {
    case DEVICE_USB:
        fprintf(out,
                "SUBSYSTEM==\"usb\", ENV{DEVTYPE}==\"usb_device\", ATTR{idVendor}==\"%04x\", "
                "ATTR{idProduct}==\"%04x\", MODE=\"0660\", GROUP=\"boothd\", TAG+=\"uaccess\"\n",
                id->vendor, id->product);
        return;
    case DEVICE_BLUETOOTH:
        fprintf(out,
                "SUBSYSTEM==\"hidraw\", KERNELS==\"0005:%04X:%04X.*\", MODE=\"0660\", "
                "GROUP=\"boothd\", TAG+=\"uaccess\"\n",
                id->vendor, id->product);
        return;
    case DEVICE_SERIAL:
        fprintf(out,
                "SUBSYSTEM==\"tty\", ATTRS{idVendor}==\"%04x\", ATTRS{idProduct}==\"%04x\", "
                "TAG+=\"uaccess\"\n",
                id->vendor, id->product);
        return;
    }
}

void udev_rules_print(FILE *out)
{
    const struct device_id *const tables[] = {ocean_ids, wiimote_ids, witmotion_ids};
    fprintf(out, "# " UDEV_RULES_FILE ": who may open the instruments of boothd.\n"
                 "ACTION!=\"add|bind\", GOTO=\"boothd_end\"\n\n");
    for (size_t t = 0; t < sizeof tables / sizeof *tables; t++)
        for (const struct device_id *id = tables[t]; id->name; id++)
            rule(id, out);
    fputs(iio_rule, out);
    fprintf(out, "\nLABEL=\"boothd_end\"\n");
}
