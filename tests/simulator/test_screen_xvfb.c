// SPDX-License-Identifier: Apache-2.0
#include "simulator/screen_xvfb.h"

#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/clock.h"
#include "simulator/boothsim_children.h"
#include "tests/simulator/cmocka_here.h"

#define ONE_STEP 1e-12 // a code is a quotient of two small integers

static char folder[] = "/tmp/test_screen.XXXXXX";
static char path[64];

static int a_folder(void **state)
{
    (void)state;
    if (!mkdtemp(folder))
        return -1;
    snprintf(path, sizeof path, "%s/Xvfb_screen0", folder);
    return 0;
}

static int no_folder(void **state)
{
    char log[64];
    (void)state;
    snprintf(log, sizeof log, "%s/xvfb.log", folder);
    unlink(log);
    unlink(path);
    return rmdir(folder);
}

struct picture {
    uint32_t header_size, width, height, most_first, bits, line, mask[3], colours, size;
};

static const struct picture deep24 = {
    160, 4, 3, 0, 32, 16, {0xff0000, 0xff00, 0xff}, 7, 160 + 7 * 12 + 3 * 16};

// Header, colours and pixels, all zero but what the picture says.
static unsigned char *picture_begin(const struct picture *p)
{
    unsigned char *bytes = calloc(1, p->size + 1);
    const uint32_t words[25] = {[0] = p->header_size, [1] = 7,           [2] = 2,
                                [4] = p->width,       [5] = p->height,   [7] = p->most_first,
                                [11] = p->bits,       [12] = p->line,    [14] = p->mask[0],
                                [15] = p->mask[1],    [16] = p->mask[2], [19] = p->colours};
    for (uint32_t i = 0; i < 100 && i < p->size; i++)
        bytes[i] = (unsigned char)(words[i / 4] >> (24 - 8 * (i % 4)));
    return bytes;
}

static unsigned char *pixel_of(const struct picture *p, unsigned char *bytes, uint32_t x,
                               uint32_t y)
{
    return bytes + p->header_size + 12 * p->colours + y * p->line + x * p->bits / 8;
}

static void picture_end(const struct picture *p, unsigned char *bytes)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, p->size, file), p->size);
    fclose(file);
    free(bytes);
}

static void expect_pixel(int x, int y, double r, double g, double b)
{
    struct xvfb_screen screen;
    struct error err = {0};
    double code[3];
    if (!xvfb_screen_open(path, &screen, &err))
        fail_msg("%s", err.text);
    xvfb_screen_pixel(&screen, x, y, code);
    xvfb_screen_close(&screen);
    assert_near(code[0], r, ONE_STEP);
    assert_near(code[1], g, ONE_STEP);
    assert_near(code[2], b, ONE_STEP);
}

static void eight_bits_a_channel_are_read_in_their_place(void **state)
{
    (void)state;
    unsigned char *bytes = picture_begin(&deep24);
    memcpy(pixel_of(&deep24, bytes, 3, 2), (unsigned char[4]){51, 102, 255, 0}, 4); // B G R X
    picture_end(&deep24, bytes);
    expect_pixel(3, 2, 1, 0.4, 0.2);
    expect_pixel(2, 2, 0, 0, 0);
    expect_pixel(0, 0, 0, 0, 0);
}

static void ten_bits_a_channel_are_read_by_their_masks(void **state)
{
    (void)state;
    struct picture p = deep24;
    p.mask[0] = 0x3ff00000;
    p.mask[1] = 0xffc00;
    p.mask[2] = 0x3ff;
    unsigned char *bytes = picture_begin(&p);
    uint32_t pixel = 1023u << 20 | 512u << 10 | 1;
    for (int i = 0; i < 4; i++)
        pixel_of(&p, bytes, 1, 1)[i] = (unsigned char)(pixel >> 8 * i);
    picture_end(&p, bytes);
    expect_pixel(1, 1, 1, 512 / 1023.0, 1 / 1023.0);
}

static void the_other_byte_order_is_understood(void **state)
{
    (void)state;
    struct picture p = deep24;
    p.most_first = 1;
    unsigned char *bytes = picture_begin(&p);
    memcpy(pixel_of(&p, bytes, 0, 1), (unsigned char[4]){0, 255, 102, 51}, 4);
    picture_end(&p, bytes);
    expect_pixel(0, 1, 1, 0.4, 0.2);
}

static void sixteen_bits_a_pixel_are_read_by_their_masks(void **state)
{
    (void)state;
    struct picture p = deep24;
    p.bits = 16;
    p.mask[0] = 0xf800;
    p.mask[1] = 0x07e0;
    p.mask[2] = 0x001f;
    unsigned char *bytes = picture_begin(&p);
    memcpy(pixel_of(&p, bytes, 2, 0), (unsigned char[2]){0x1f, 0xf8}, 2);
    picture_end(&p, bytes);
    expect_pixel(2, 0, 1, 0, 1);
}

static void refused(const struct picture *p)
{
    struct xvfb_screen screen = {0};
    struct error err = {0};
    picture_end(p, picture_begin(p));
    assert_false(xvfb_screen_open(path, &screen, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_non_null(strstr(err.text, path));
    assert_null(screen.map);
}

static void files_that_cannot_hold_their_pixels_are_refused(void **state)
{
    (void)state;
    struct picture p = deep24;
    p.size--;
    refused(&p);
    p.size = 99;
    refused(&p);
    p.size = 0;
    refused(&p);
    p = deep24;
    p.line = 15;
    refused(&p);
    p = deep24;
    p.header_size = 0xffffffff;
    refused(&p);
    p = deep24;
    p.colours = 0xffffffff;
    refused(&p);
    p = deep24;
    p.width = 0;
    refused(&p);
    p = deep24;
    p.bits = 8;
    refused(&p);
    p = deep24;
    p.mask[1] = 0;
    refused(&p);
}

static void a_missing_file_is_named(void **state)
{
    (void)state;
    struct xvfb_screen screen;
    struct error err = {0};
    assert_false(xvfb_screen_open("/nowhere/screen", &screen, &err));
    assert_int_equal(err.code, ERROR_SYSTEM);
    assert_non_null(strstr(err.text, "/nowhere/screen"));
}

// ---- a real X server, painted through its own protocol ----------------------

static void send_all(int to, const void *bytes, size_t size)
{
    assert_int_equal(send(to, bytes, size, MSG_NOSIGNAL), size);
}

static void read_all(int from, void *bytes, size_t size)
{
    assert_int_equal(recv(from, bytes, size, MSG_WAITALL), size);
}

static int x_connect(int display, uint32_t *root)
{
    struct sockaddr_un to = {.sun_family = AF_UNIX};
    snprintf(to.sun_path, sizeof to.sun_path, "/tmp/.X11-unix/X%d", display);
    int x = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    assert_int_equal(connect(x, (struct sockaddr *)&to, sizeof to), 0);
    static const uint16_t hello[6] = {'l', 11, 0, 0, 0, 0};
    uint16_t head[4];
    send_all(x, hello, sizeof hello);
    read_all(x, head, sizeof head);
    assert_int_equal(head[0] & 0xff, 1); // success
    size_t size = 4u * head[3];
    unsigned char *setup = malloc(size);
    read_all(x, setup, size);
    uint16_t vendor;
    memcpy(&vendor, setup + 16, sizeof vendor);
    memcpy(root, setup + 32 + (vendor + 3) / 4 * 4 + 8 * setup[21], sizeof *root);
    free(setup);
    return x;
}

static void x_paint(int x, uint32_t root, uint32_t pixel)
{
    const uint32_t back[4] = {2 | 4 << 16, root, 2, pixel}; // ChangeWindowAttributes
    const uint32_t clear[4] = {61 | 4 << 16, root, 0, 0};   // ClearArea, all of it
    const uint32_t ask = 43 | 1 << 16;                      // GetInputFocus: waits for both
    unsigned char answer[32];
    send_all(x, back, sizeof back);
    send_all(x, clear, sizeof clear);
    send_all(x, &ask, sizeof ask);
    read_all(x, answer, sizeof answer);
}

static void paint_and_look(int bits, uint32_t pixel, double r, double g, double b)
{
    struct scenario s;
    struct child xvfb = {0};
    struct error err = {0};
    int display = -1;
    scenario_preset(&s);
    s.screen.width_px = 64;
    s.screen.height_px = 48;
    s.panel.bits = bits;
    unlink(path);
    if (!child_start_xvfb(&s, folder, clock_now_ns() + 60 * NS_PER_S, &xvfb, &display, &err))
        fail_msg("%s", err.text);
    uint32_t root;
    int x = x_connect(display, &root);
    x_paint(x, root, pixel);
    expect_pixel(0, 0, r, g, b);
    expect_pixel(32, 24, r, g, b);
    expect_pixel(63, 47, r, g, b);
    close(x);
    child_stop(&xvfb, clock_now_ns() + 60 * NS_PER_S);
    assert_true(child_has_ended(&xvfb));
}

static void a_real_x_server_is_seen_as_it_is_painted(void **state)
{
    (void)state;
    if (access("/usr/bin/Xvfb", X_OK) < 0) {
        print_message("skipped: no Xvfb here\n");
        skip();
    }
    paint_and_look(8, 0xff6633, 1, 0.4, 0.2);
    paint_and_look(10, 1023u << 20 | 512u << 10 | 1, 1, 512 / 1023.0, 1 / 1023.0);
}

static void an_x_server_that_cannot_start_is_reported_with_its_log(void **state)
{
    (void)state;
    struct scenario s;
    struct child xvfb = {0};
    struct error err = {0};
    int display = -1;
    scenario_preset(&s);
    assert_false(
        child_start_xvfb(&s, "/nowhere", clock_now_ns() + NS_PER_S, &xvfb, &display, &err));
    assert_non_null(strstr(err.text, "/nowhere/xvfb.log"));
    assert_int_equal(display, -1);
}

static void a_command_reports_how_it_ended(void **state)
{
    (void)state;
    static char *const lines[][4] = {{"sh", "-c", "exit 7", NULL},
                                     {"sh", "-c", "test \"$DISPLAY\" = :42", NULL},
                                     {"sh", "-c", "kill -TERM $$", NULL},
                                     {"/nowhere/program", NULL}};
    static const int expected[] = {7, 0, 128 + SIGTERM, 127};
    for (int i = 0; i < 4; i++) {
        struct child child;
        struct error err = {0};
        assert_true(child_start_command((char **)lines[i], 42, &child, &err));
        while (!child_has_ended(&child))
            usleep(1000);
        assert_int_equal(child.status, expected[i]);
    }
}

static void a_command_that_will_not_end_is_killed(void **state)
{
    (void)state;
    char *line[] = {"sh", "-c", "trap '' TERM; while :; do sleep 0.02; done", NULL};
    struct child child;
    struct error err = {0};
    assert_true(child_start_command(line, -1, &child, &err));
    usleep(100000); // lets it set its trap; without it the test passes all the same
    child_stop(&child, clock_now_ns() + NS_PER_S / 10);
    assert_true(child_has_ended(&child));
    assert_true(child.status == 128 + SIGKILL || child.status == 128 + SIGTERM);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(eight_bits_a_channel_are_read_in_their_place),
        cmocka_unit_test(ten_bits_a_channel_are_read_by_their_masks),
        cmocka_unit_test(the_other_byte_order_is_understood),
        cmocka_unit_test(sixteen_bits_a_pixel_are_read_by_their_masks),
        cmocka_unit_test(files_that_cannot_hold_their_pixels_are_refused),
        cmocka_unit_test(a_missing_file_is_named),
        cmocka_unit_test(a_real_x_server_is_seen_as_it_is_painted),
        cmocka_unit_test(an_x_server_that_cannot_start_is_reported_with_its_log),
        cmocka_unit_test(a_command_reports_how_it_ended),
        cmocka_unit_test(a_command_that_will_not_end_is_killed),
    };
    return cmocka_run_group_tests(tests, a_folder, no_folder);
}
