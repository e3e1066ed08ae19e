// SPDX-License-Identifier: Apache-2.0
// A camera's response, found from pictures whose response is known.
#include "tests/fakes/support.h"

#include "calibration/response.h"
#include "tests/calibration/series_here.h"

// Of exposures between codes 20 and 230, with half a code of rounding in 14 400
// readings of several codes each; Debevec's method takes 100.
static const double ROBERTSON = 0.01, DEBEVEC = 0.04;
static const double EXACT = 1e-12;

static struct folder folder;

// Light over five decades, as even as a lamp's glow.
static double glow(double x, double y)
{
    return 0.002 * pow(10, 5 * x / 300) * (1 + 0.1 * sin(y / 40));
}

static int make(void **state)
{
    (void)state;
    folder_open(&folder);
    return 0;
}

static int clear(void **state)
{
    (void)state;
    folder_close(&folder);
    return 0;
}

static struct photos series(const double *seconds, int count, int bits, int channels)
{
    struct series s = {.folder = &folder,
                       .width = 300,
                       .height = 120,
                       .channels = channels,
                       .bits = bits,
                       .light = glow,
                       .electrons = 20000,
                       .count = count};
    struct photos p;
    struct error err = {0};
    memcpy(s.seconds, seconds, (size_t)count * sizeof *seconds);
    series_begin(&s, "list.csv");
    series_lights(&s);
    series_end(&s);
    if (!photos_load(folder_at(&folder, "list.csv"), &p, &err))
        print_error("%s\n", err.text);
    assert_int_equal(p.light_count, count);
    return p;
}

// Largest relative difference, both made equal at code 128.
static double error_of(const struct response *r)
{
    double most = 0, k = r->exposure[128] / series_exposure(128 / 255.0);
    for (int z = 20; z <= 230; z++)
        most = fmax(most, fabs(r->exposure[z] / k / series_exposure(z / 255.0) - 1));
    return most;
}

static void check(const double *seconds, int count)
{
    static const double LIMIT[] = {[HDR_DEBEVEC] = DEBEVEC, [HDR_ROBERTSON] = ROBERTSON};
    struct photos p = series(seconds, count, 8, 1);
    struct response r[2];
    struct error err = {0};
    for (int method = HDR_DEBEVEC; method <= HDR_ROBERTSON; method++) {
        if (!response_find((enum hdr_method)method, &p, 0, &r[method], &err))
            print_error("%s\n", err.text);
        double off = error_of(&r[method]);
        print_message("%d exposures, method %d: off by %.2f %% at most\n", count, method,
                      100 * off);
        assert_true(off < LIMIT[method]);
        assert_near(r[method].exposure[255], 1, 0);
        for (int z = 1; z < 256; z++)
            assert_true(r[method].exposure[z] >= r[method].exposure[z - 1]);
    }
    assert_true(response_difference(&r[0], &r[1]) < DEBEVEC);
    response_fini(&r[0]);
    response_fini(&r[1]);
    photos_fini(&p);
}

static void exposures_in_equal_steps_tell_it(void **state)
{
    (void)state;
    check((double[]){0.01, 0.02, 0.04, 0.08, 0.16, 0.32, 0.64, 1.28, 2.56}, 9);
    check((double[]){0.01, 0.03, 0.09, 0.27, 0.81, 2.43}, 6);
}

static void exposures_in_unequal_steps_tell_it(void **state)
{
    (void)state;
    check((double[]){0.01, 0.016, 0.04, 0.07, 0.2, 0.31, 0.8, 1.5, 2.56}, 9);
}

static void each_channel_has_its_own(void **state)
{
    (void)state;
    struct photos p =
        series((double[]){0.01, 0.02, 0.04, 0.08, 0.16, 0.32, 0.64, 1.28, 2.56}, 9, 8, 3);
    for (int c = 0; c < 3; c++) {
        struct response r;
        struct error err;
        assert_true(response_find(HDR_ROBERTSON, &p, c, &r, &err));
        assert_true(error_of(&r) < ROBERTSON);
        response_fini(&r);
    }
    photos_fini(&p);
}

static void what_cannot_tell_it_is_refused(void **state)
{
    (void)state;
    struct response r = {.codes = 77};
    struct error err;
    struct photos p = series((double[]){0.5, 0.5}, 2, 8, 1);
    assert_false(response_find(HDR_ROBERTSON, &p, 0, &r, &err));
    assert_holds(err.text, "all exposures are equal");
    photos_fini(&p);
    p = series((double[]){0.1, 0.5}, 2, 16, 1);
    assert_false(response_find(HDR_DEBEVEC, &p, 0, &r, &err));
    assert_holds(err.text, "16 bits");
    photos_fini(&p);
    assert_int_equal(r.codes, 77);
}

static void linear_counts_are_proportional(void **state)
{
    (void)state;
    struct response r;
    struct error err;
    for (int bits = 8; bits <= 16; bits += 8) {
        int last = (1 << bits) - 1;
        assert_true(response_linear(bits, &r, &err));
        assert_int_equal(r.codes, last + 1);
        for (int z = 0; z <= last; z += last / 5) {
            assert_near(r.exposure[z], (double)z / last, EXACT);
            assert_near(r.slope[z], 1.0 / last, EXACT);
        }
        response_fini(&r);
    }
}

static void a_response_survives_its_file(void **state)
{
    (void)state;
    struct response a, b;
    struct error err = {0};
    const char *path = folder_at(&folder, "response.csv");
    assert_true(response_linear(8, &a, &err));
    for (int z = 0; z < 256; z++)
        a.exposure[z] = series_exposure(z / 255.0);
    assert_true(response_save(path, &a, &err));
    if (!response_load(path, 8, &b, &err))
        print_error("%s\n", err.text);
    assert_int_equal(b.codes, 256);
    for (int z = 0; z < 256; z++)
        assert_near(b.exposure[z], a.exposure[z] / a.exposure[255], EXACT);
    // The slope of the formula: (1 + 60 E) ln 61 / 60 a full count, 255 codes of them.
    assert_near(b.slope[100], (1 + 60 * b.exposure[100]) * log(61) / 60 / 255, 1e-5);
    response_fini(&a);
    response_fini(&b);
}

static void a_file_that_is_no_response_is_refused(void **state)
{
    (void)state;
    struct response r;
    struct error err;
    const char *path = folder_put(&folder, "short.csv", "code,exposure\n0,0\n1,1\n");
    assert_false(response_load(path, 8, &r, &err));
    assert_holds(err.text, "2 rows");
    char text[8192] = "code,exposure\n";
    for (int z = 0; z < 256; z++)
        snprintf(text + strlen(text), 32, "%d,%g\n", z, z == 100 ? 0.1 : z / 255.0);
    path = folder_put(&folder, "falls.csv", text);
    assert_false(response_load(path, 8, &r, &err));
    assert_holds(err.text, "does not rise at code 100");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exposures_in_equal_steps_tell_it),
        cmocka_unit_test(exposures_in_unequal_steps_tell_it),
        cmocka_unit_test(each_channel_has_its_own),
        cmocka_unit_test(what_cannot_tell_it_is_refused),
        cmocka_unit_test(linear_counts_are_proportional),
        cmocka_unit_test(a_response_survives_its_file),
        cmocka_unit_test(a_file_that_is_no_response_is_refused),
    };
    return cmocka_run_group_tests(tests, make, clear);
}
