// SPDX-License-Identifier: Apache-2.0
// The window as the X server shows it: Xvfb keeps its screen in a file.
#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/render/surface.h"

enum { SCREEN_WIDTH = 400, SCREEN_HEIGHT = 240, XWD_WORDS = 25 };

static struct server {
    pid_t pid;
    char folder[64], file[96];
} server;

static void start_server(int report)
{
    char screen[32], number[16];
    snprintf(screen, sizeof screen, "%dx%dx24", SCREEN_WIDTH, SCREEN_HEIGHT);
    snprintf(number, sizeof number, "%d", report);
    int null = open("/dev/null", O_WRONLY);
    dup2(null, STDERR_FILENO);
    execlp("Xvfb", "Xvfb", "-displayfd", number, "-screen", "0", screen, "-fbdir", server.folder,
           "-nolisten", "tcp", "-noreset", (char *)NULL);
    _exit(127);
}

static int open_server(void **state)
{
    (void)state;
    int report[2];
    char display[16] = ":";
    snprintf(server.folder, sizeof server.folder, "/tmp/boothd-window-XXXXXX");
    if (!mkdtemp(server.folder) || pipe(report) != 0)
        return -1;
    snprintf(server.file, sizeof server.file, "%s/Xvfb_screen0", server.folder);
    server.pid = fork();
    if (server.pid == 0)
        start_server(report[1]);
    close(report[1]);
    ssize_t got, used = 1;
    while ((got = read(report[0], display + used, sizeof display - 1 - used)) > 0) {
        used += got;
        if (display[used - 1] == '\n')
            break;
    }
    close(report[0]);
    if (used < 2)
        return -1;
    display[strcspn(display, "\n")] = 0;
    return setenv("DISPLAY", display, 1);
}

static int close_server(void **state)
{
    (void)state;
    kill(server.pid, SIGTERM);
    waitpid(server.pid, NULL, 0);
    unlink(server.file);
    return rmdir(server.folder);
}

static uint32_t big_endian(const unsigned char *at)
{
    return (uint32_t)at[0] << 24 | (uint32_t)at[1] << 16 | (uint32_t)at[2] << 8 | at[3];
}

// What stands on the X server's screen now, [height][width][3].
static uint8_t *screen_of_server(void)
{
    static unsigned char file[1 << 20];
    FILE *in = fopen(server.file, "rb");
    assert_non_null(in);
    size_t size = fread(file, 1, sizeof file, in);
    fclose(in);
    assert_true(size > 4 * XWD_WORDS);
    uint32_t word[XWD_WORDS];
    for (int i = 0; i < XWD_WORDS; i++)
        word[i] = big_endian(file + 4 * i);
    assert_int_equal(word[4], SCREEN_WIDTH);
    assert_int_equal(word[5], SCREEN_HEIGHT);
    const unsigned char *pixels = file + word[0] + 12 * word[19];
    assert_true(pixels + (size_t)word[12] * SCREEN_HEIGHT <= file + size);
    uint8_t *out = malloc(3 * SCREEN_WIDTH * SCREEN_HEIGHT);
    for (int y = 0; y < SCREEN_HEIGHT; y++)
        for (int x = 0; x < SCREEN_WIDTH; x++)
            for (int c = 0; c < 3; c++)
                out[3 * (y * SCREEN_WIDTH + x) + c] = pixels[y * word[12] + 4 * x + 2 - c];
    return out;
}

static void assert_screen_is(struct renderer *renderer)
{
    struct error err = {0};
    uint8_t *counts = renderer_counts(renderer, &err);
    assert_good(counts, err);
    uint8_t *shown = screen_of_server();
    for (int i = 0; i < 3 * SCREEN_WIDTH * SCREEN_HEIGHT; i++)
        if (shown[i] != counts[i])
            fail_msg("pixel %d, %d: the screen shows %d, the renderer says %d",
                     i / 3 % SCREEN_WIDTH, i / 3 / SCREEN_WIDTH, shown[i], counts[i]);
    free(counts);
    free(shown);
}

static struct renderer *open_window(struct error *err)
{
    struct renderer_options options = {
        .window = true, .width = SCREEN_WIDTH, .height = SCREEN_HEIGHT};
    return renderer_create(&options, err);
}

static void the_screen_shows_exactly_the_counts_when_show_returns(void **state)
{
    (void)state;
    struct surface s;
    struct error err = {0};
    struct renderer *renderer = open_window(&err);
    assert_good(renderer, err);
    surface_init(&s);
    s.scene.screen.width_px = SCREEN_WIDTH;
    s.scene.screen.height_px = SCREEN_HEIGHT;
    s.scene.dither = true;
    for (int i = 0; i < 20; i++) {
        s.scene.level = 0.3 + 0.04 * i;
        surface_tilt(&s, 10 + 4 * i);
        assert_good(renderer_show(renderer, &s.scene, false, NULL, &err), err);
        assert_screen_is(renderer);
        struct scene patch = {
            .kind = SCENE_PATCH, .patch = {i / 20.0, 0.5, 1 - i / 20.0}, .bits = 8};
        assert_good(renderer_show(renderer, &patch, false, NULL, &err), err);
        assert_screen_is(renderer);
        assert_true(renderer_events(renderer, 0));
    }
    renderer_destroy(renderer);
    surface_fini(&s);
}

static void the_picture_is_not_upside_down(void **state)
{
    (void)state;
    struct surface s;
    struct error err = {0};
    struct renderer *renderer = open_window(&err);
    assert_good(renderer, err);
    surface_init(&s);
    s.scene.screen.width_px = SCREEN_WIDTH;
    s.scene.screen.height_px = SCREEN_HEIGHT;
    for (int i = 0; i < 24; i++)
        for (int c = 0; c < 3; c++)
            s.texels[i][c] = i == SURFACE_COLUMNS - 1 ? 0.5f : 0.02f; // top right patch
    assert_good(renderer_show(renderer, &s.scene, false, NULL, &err), err);
    uint8_t *shown = screen_of_server();
    int top_right = shown[3 * (10 * SCREEN_WIDTH + SCREEN_WIDTH - 10) + 1];
    int bottom_right = shown[3 * ((SCREEN_HEIGHT - 10) * SCREEN_WIDTH + SCREEN_WIDTH - 10) + 1];
    assert_true(top_right > bottom_right + 40);
    free(shown);
    renderer_destroy(renderer);
    surface_fini(&s);
}

static void ten_bits_on_an_eight_bit_window_become_eight(void **state)
{
    (void)state;
    struct surface s;
    struct error err = {0};
    struct renderer_options options = {
        .window = true, .width = SCREEN_WIDTH, .height = SCREEN_HEIGHT, .bits = 10};
    struct renderer *renderer = renderer_create(&options, &err);
    assert_good(renderer, err);
    surface_init(&s);
    s.scene.screen.width_px = SCREEN_WIDTH;
    s.scene.screen.height_px = SCREEN_HEIGHT;
    s.scene.bits = 10;
    s.scene.dither = true;
    assert_int_equal(renderer_output(renderer).bits, 8);
    assert_int_equal(renderer_output(renderer).ramp, RAMP_UNKNOWN); // nobody asked for it
    assert_good(renderer_show(renderer, &s.scene, false, NULL, &err), err);
    assert_screen_is(renderer);
    renderer_destroy(renderer);
    surface_fini(&s);
}

static void a_monitor_that_is_not_there_is_named_in_the_refusal(void **state)
{
    (void)state;
    struct error err = {0};
    struct renderer_options options = {.window = true,
                                       .fullscreen = true,
                                       .monitor = "PROOF-1",
                                       .width = SCREEN_WIDTH,
                                       .height = SCREEN_HEIGHT};
    assert_null(renderer_create(&options, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_non_null(strstr(err.text, "PROOF-1"));
}

static void full_screen_on_the_first_monitor_shows_the_same(void **state)
{
    (void)state;
    struct error err = {0};
    struct renderer_options options = {
        .window = true, .fullscreen = true, .width = SCREEN_WIDTH, .height = SCREEN_HEIGHT};
    struct renderer *renderer = renderer_create(&options, &err);
    assert_good(renderer, err);
    print_message("%s\n", renderer_name(renderer));
    assert_non_null(strstr(renderer_name(renderer), "gamma ramp"));
    bool neutral = strstr(renderer_name(renderer), "ramp neutral");
    assert_int_equal(renderer_output(renderer).ramp == RAMP_NEUTRAL, neutral);
    assert_int_not_equal(renderer_output(renderer).ramp, RAMP_NONE);
    struct scene patch = {.kind = SCENE_PATCH, .patch = {0.25, 0.5, 0.75}, .bits = 8};
    assert_good(renderer_show(renderer, &patch, false, NULL, &err), err);
    assert_screen_is(renderer);
    renderer_destroy(renderer);
}

static void a_window_of_another_size_than_the_monitor_is_refused(void **state)
{
    (void)state;
    struct error err = {0};
    struct renderer_options options = {
        .window = true, .fullscreen = true, .width = 1280, .height = 800};
    assert_null(renderer_create(&options, &err));
    print_message("%s\n", err.text);
    assert_int_equal(err.code, ERROR_CONFIG);
}

// The first test: once GLFW has a display it keeps it.
static void without_a_display_the_window_is_refused_in_one_line(void **state)
{
    (void)state;
    struct error err = {0};
    char *kept = strdup(getenv("DISPLAY"));
    unsetenv("DISPLAY");
    assert_null(open_window(&err));
    assert_int_equal(err.code, ERROR_SYSTEM);
    assert_null(strchr(err.text, '\n'));
    setenv("DISPLAY", kept, 1);
    free(kept);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(without_a_display_the_window_is_refused_in_one_line),
        cmocka_unit_test(the_screen_shows_exactly_the_counts_when_show_returns),
        cmocka_unit_test(the_picture_is_not_upside_down),
        cmocka_unit_test(ten_bits_on_an_eight_bit_window_become_eight),
        cmocka_unit_test(full_screen_on_the_first_monitor_shows_the_same),
        cmocka_unit_test(a_window_of_another_size_than_the_monitor_is_refused),
        cmocka_unit_test(a_monitor_that_is_not_there_is_named_in_the_refusal),
    };
    return cmocka_run_group_tests(tests, open_server, close_server);
}
