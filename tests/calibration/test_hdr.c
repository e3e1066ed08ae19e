// SPDX-License-Identifier: Apache-2.0
// Merging exposures whose light is known.
#include "tests/fakes/support.h"

#include "calibration/hdr.h"
#include "tests/calibration/series_here.h"

static const double EXACT = 1e-12;
static const double STEPS16 = 2e-4; // half a count of 65535 where the longest picture has 5 %
static const double STEPS8 = 0.02;  // and of 255 where only one picture sees it

enum { WIDTH = 60, HEIGHT = 40 };

static struct folder folder;

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

static double slope(double x, double y)
{
    return 0.05 * pow(10, 3 * x / WIDTH) + 0.001 * y;
}

static struct series series(int bits)
{
    struct series s = {.folder = &folder,
                       .width = WIDTH,
                       .height = HEIGHT,
                       .channels = 1,
                       .bits = bits,
                       .linear = bits == 16,
                       .light = slope,
                       .count = 5,
                       .seconds = {0.01, 0.04, 0.16, 0.64, 2.56}};
    return s;
}

static void log_response(int bits, struct response *r)
{
    struct error err;
    assert_true(response_linear(bits, r, &err));
    if (bits == 16)
        return;
    for (int z = 0; z < 256; z++) {
        r->exposure[z] = series_exposure(z / 255.0);
        r->slope[z] = (1 + 60 * r->exposure[z]) * log(61) / 60 / 255;
    }
}

static struct hdr merged(const struct series *s)
{
    struct photos p;
    struct response r[3];
    struct hdr h;
    struct error err = {0};
    bool loaded = photos_load(folder_at(s->folder, "list.csv"), &p, &err);
    for (int c = 0; c < 3; c++)
        log_response(s->bits, &r[c]);
    if (!loaded || !hdr_merge(&p, r, &h, &err)) {
        print_error("%s\n", err.text);
        _fail(__FILE__, __LINE__);
    }
    for (int c = 0; c < 3; c++)
        response_fini(&r[c]);
    photos_fini(&p);
    return h;
}

static struct hdr shot(struct series *s)
{
    series_begin(s, "list.csv");
    series_lights(s);
    series_end(s);
    return merged(s);
}

static void the_light_of_every_pixel_comes_out(void **state)
{
    (void)state;
    for (int bits = 8; bits <= 16; bits += 8) {
        struct series s = series(bits);
        struct hdr h = shot(&s);
        for (int i = 0; i < WIDTH * HEIGHT; i++) {
            double light = slope(i % WIDTH, i / WIDTH);
            assert_near(h.light[i], light, (bits == 8 ? STEPS8 : STEPS16) * light);
            assert_int_equal(h.clipped[i], 0);
        }
        for (int i = 0; i < s.count; i++)
            assert_true(fabs(h.off[i]) < STEPS8);
        hdr_fini(&h);
    }
}

// Full after 1/30 s: only the shortest picture sees less, beyond 100 none.
static double bright(double x, double y)
{
    return x < 20 ? 30 : x < 40 ? 300 : 3 + 0 * y;
}

static void what_every_picture_clips_is_marked_and_a_lower_bound(void **state)
{
    (void)state;
    struct series s = series(8);
    s.light = bright;
    struct hdr h = shot(&s);
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        bool clipped = i % WIDTH >= 20 && i % WIDTH < 40;
        assert_int_equal(h.clipped[i], clipped);
        if (clipped)
            assert_true(h.light[i] > 80 && h.light[i] <= 300);
        else
            assert_near(h.light[i], bright(i % WIDTH, 0), STEPS8 * h.light[i]);
    }
    hdr_fini(&h);
}

static double level(double x, double y)
{
    return 0.2 + 0.1 * sin(x / 9) + 0 * y;
}

static void its_uncertainty_is_what_the_noise_does(void **state)
{
    (void)state;
    double noise[2];
    for (int i = 0; i < 2; i++) {
        struct series s = series(8);
        s.light = level;
        s.electrons = i ? 2500 : 10000; // the latter is taken for granted
        struct hdr h = shot(&s);
        double chi2 = 0;
        for (int k = 0; k < WIDTH * HEIGHT; k++)
            chi2 += pow((h.light[k] - level(k % WIDTH, 0)) / h.sigma[k], 2);
        double ratio = sqrt(chi2 / (WIDTH * HEIGHT));
        print_message("noise %.2f of the model; errors %.2f of their uncertainty\n", h.noise,
                      ratio);
        assert_near(ratio, 1, 0.3); // weights are fixed, rounding is not normal
        noise[i] = h.noise;
        hdr_fini(&h);
    }
    assert_near(noise[1] / noise[0], 2, 0.3); // rounding does not grow
}

static double hot(double x, double y)
{
    return x == 30 && y == 20 ? 3 : x == 10 && y == 5 ? 0.5 : 0;
}

static double sensor_dark(double x, double y)
{
    return 0.01 + hot(x, y);
}

static double lit(double x, double y)
{
    return level(x, y) + sensor_dark(x, y);
}

static void dark_pictures_take_off_what_is_no_light_and_tell_hot_pixels(void **state)
{
    (void)state;
    struct series s = series(8);
    s.light = lit;
    series_begin(&s, "list.csv");
    series_lights(&s);
    series_picture(&s, "dark.png", ",dark", 2.56, sensor_dark);
    series_end(&s);
    struct hdr h = merged(&s);
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        assert_near(h.light[i], level(i % WIDTH, 0), STEPS8 * level(i % WIDTH, 0));
    hdr_fini(&h);
}

static double spoilt(double x, double y)
{
    return level(x, y) + hot(x, y);
}

static void without_dark_pictures_pixels_that_stand_alone_are_replaced(void **state)
{
    (void)state;
    struct series s = series(8);
    s.light = spoilt;
    struct hdr h = shot(&s);
    assert_int_equal(h.hot, 2);
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        assert_near(h.light[i], level(i % WIDTH, 0), STEPS8 * level(i % WIDTH, 0));
    hdr_fini(&h);
}

static double falloff(double x, double y)
{
    return 1 - (pow(x - 29.5, 2) + pow(y - 19.5, 2)) / 4000;
}

static double shaded(double x, double y)
{
    return level(x, y) * falloff(x, y);
}

static double flat(double x, double y)
{
    return 0.4 * falloff(x, y);
}

static void flat_pictures_divide_out_the_falloff_of_light(void **state)
{
    (void)state;
    struct series s = series(16);
    s.light = shaded;
    series_begin(&s, "list.csv");
    series_lights(&s);
    series_picture(&s, "flat.png", ",flat", 1, flat);
    series_end(&s);
    struct hdr h = merged(&s);
    double middle = h.light[20 * WIDTH + 30] / level(30, 0);
    assert_near(middle, 1, 0.02); // smoothed, the greatest is 1
    // A mean over 15 x 15 pixels of a parabola is off by 2 x 56 / 3 / 4000, equally all over, but
    // at the edges, where half of it is missing.
    for (int y = 7; y < HEIGHT - 7; y++)
        for (int x = 7; x < WIDTH - 7; x++)
            assert_near(h.light[y * WIDTH + x] / level(x, 0), middle, 0.01);
    hdr_fini(&h);
}

static void a_clipped_flat_picture_is_refused(void **state)
{
    (void)state;
    struct series s = series(8);
    struct photos p;
    struct response r;
    struct hdr h;
    struct error err = {0};
    series_begin(&s, "list.csv");
    series_lights(&s);
    series_picture(&s, "flat.png", ",flat", 10, flat);
    series_end(&s);
    assert_true(photos_load(folder_at(&folder, "list.csv"), &p, &err));
    log_response(8, &r);
    assert_false(hdr_merge(&p, &r, &h, &err));
    assert_holds(err.text, "flat.png");
    response_fini(&r);
    photos_fini(&p);
}

static void a_picture_with_a_wrong_exposure_is_found_out(void **state)
{
    (void)state;
    struct series s = series(8);
    s.light = level;
    series_begin(&s, "list.csv");
    for (int i = 0; i < s.count; i++) {
        char name[32];
        snprintf(name, sizeof name, "light-%d.png", i);
        FILE *list = s.list;
        s.list = NULL;
        series_picture(&s, name, "", s.seconds[i], level);
        s.list = list;
        fprintf(list, "%s,%g\n", name, s.seconds[i] * (i == 3 ? 1.1 : 1));
    }
    series_end(&s);
    struct hdr h = merged(&s);
    for (int i = 0; i < 3; i++)
        assert_true(fabs(h.off[3]) > 2 * fabs(h.off[i]));
    assert_near(h.off[3] - h.off[2], 1 / 1.1 - 1, 0.03);
    hdr_fini(&h);
}

static void colours_are_added_with_their_weights(void **state)
{
    (void)state;
    struct series s = series(16);
    s.channels = 3;
    s.light = level;
    struct hdr h = shot(&s);
    for (int i = 0; i < WIDTH * HEIGHT; i += 7) // blue gets half the light
        assert_near(h.light[i], level(i % WIDTH, 0) * (0.2126 + 0.7152 + 0.0722 / 2), 1e-3);
    hdr_fini(&h);
}

static void smoothing_keeps_what_is_even_and_leaves_out_what_is_not_used(void **state)
{
    (void)state;
    double v[WIDTH * HEIGHT];
    uint8_t used[WIDTH * HEIGHT];
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        v[i] = i == 777 ? 1e6 : 5;
        used[i] = i != 777;
    }
    assert_true(hdr_smooth(v, used, WIDTH, HEIGHT, 3));
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        assert_near(v[i], 5, EXACT);
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        v[i] = i == 20 * WIDTH + 30;
    assert_true(hdr_smooth(v, NULL, WIDTH, HEIGHT, 2));
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        bool near = abs(i % WIDTH - 30) <= 2 && abs(i / WIDTH - 20) <= 2;
        assert_near(v[i], near ? 1 / 25.0 : 0, EXACT);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_light_of_every_pixel_comes_out),
        cmocka_unit_test(what_every_picture_clips_is_marked_and_a_lower_bound),
        cmocka_unit_test(its_uncertainty_is_what_the_noise_does),
        cmocka_unit_test(dark_pictures_take_off_what_is_no_light_and_tell_hot_pixels),
        cmocka_unit_test(without_dark_pictures_pixels_that_stand_alone_are_replaced),
        cmocka_unit_test(flat_pictures_divide_out_the_falloff_of_light),
        cmocka_unit_test(a_clipped_flat_picture_is_refused),
        cmocka_unit_test(a_picture_with_a_wrong_exposure_is_found_out),
        cmocka_unit_test(colours_are_added_with_their_weights),
        cmocka_unit_test(smoothing_keeps_what_is_even_and_leaves_out_what_is_not_used),
    };
    return cmocka_run_group_tests(tests, make, clear);
}
