// SPDX-License-Identifier: Apache-2.0
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/udev.h"

#include <cmocka.h>

static char *rules(void)
{
    char *text;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    udev_rules_print(out);
    fclose(out);
    return text;
}

static void every_instrument_has_its_rule(void **state)
{
    (void)state;
    char *text = rules();
    assert_non_null(strstr(text, "ATTR{idVendor}==\"2457\", ATTR{idProduct}==\"101e\""));
    const char *const siblings[] = {"1012", "1016", "1018", "1022", "102a"};
    for (int i = 0; i < 5; i++) {
        char wanted[64];
        snprintf(wanted, sizeof wanted, "ATTR{idProduct}==\"%s\"", siblings[i]);
        assert_non_null(strstr(text, wanted));
    }
    assert_non_null(strstr(text, "KERNELS==\"0005:057E:0306.*\""));
    assert_non_null(strstr(text, "KERNELS==\"0005:057E:0330.*\""));
    assert_non_null(strstr(text, "ATTRS{idVendor}==\"1a86\""));
    assert_non_null(strstr(text, "SUBSYSTEM==\"iio\""));
    free(text);
}

static void rules_apply_at_boot_and_on_replug(void **state)
{
    (void)state;
    char *text = rules();
    assert_non_null(strstr(text, "ACTION!=\"add|bind\", GOTO=\"boothd_end\"\n"));
    assert_non_null(strstr(text, "LABEL=\"boothd_end\"\n"));
    free(text);
}

static void every_rule_lets_the_seat_in_and_serial_lines_keep_their_group(void **state)
{
    (void)state;
    char *text = rules();
    int count = 0;
    for (char *line = strtok(text, "\n"); line; line = strtok(NULL, "\n")) {
        if (strncmp(line, "SUBSYSTEM", 9) != 0)
            continue;
        count++;
        assert_non_null(strstr(line, "TAG+=\"uaccess\""));
        bool serial = strstr(line, "SUBSYSTEM==\"tty\"") != NULL;
        assert_int_equal(strstr(line, "GROUP=\"boothd\"") == NULL, serial);
    }
    assert_true(count >= 6);
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_instrument_has_its_rule),
        cmocka_unit_test(rules_apply_at_boot_and_on_replug),
        cmocka_unit_test(every_rule_lets_the_seat_in_and_serial_lines_keep_their_group),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
