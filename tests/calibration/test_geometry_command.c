// SPDX-License-Identifier: Apache-2.0
// boothcal tilt and tracker on files alone.
#include "tests/fakes/support.h"

#include <jansson.h>

#include "calibration/commands.h"
#include "calibration/pose_files.h"
#include "config/booth_store.h"
#include "config/geometry.h"
#include "drivers/accelerometer.h"
#include "tests/calibration/command_here.h"
#include "tests/fakes/folder.h"

static const double KEPT_M = 2e-6, KEPT_DEG = 2e-4; // as geometry_rounded says, and the solver

#define BARE                                                                                       \
    "[booth]\nname = lab\n[screen]\nwidth_m = 0.52\nheight_m = 0.325\nwidth_px = 1280\n"           \
    "height_px = 800\n[ceiling]\ncentre_m = 0 0.75 0.05\nwidth_m = 0.9\ndepth_m = 0.6\n"           \
    "[display]\nserial = panel 1\n[calibration]\nstore = store\n"
#define CENTRE "[stand]\ncentre_from_hinge_m = 0 0.2 0.03\n"

static const struct stand STAND = {{0, 0.01, -0.02}, {0.002, 0.21, 0.031}};
static const double TURNED[3] = {2, 1, -3};
static const double TILTS[] = {10, 25, 40, 55};

static struct folder here;
static struct command_here last;

static int open_here(void **state)
{
    (void)state;
    folder_open(&here);
    folder_put(&here, "b.conf", BARE);
    return 0;
}

static int close_here(void **state)
{
    (void)state;
    folder_close(&here);
    return 0;
}

static struct stand_problem poses(void)
{
    static struct stand_problem p;
    p = (struct stand_problem){.screen = {0.52, 0.325, 1280, 800}, .count = 4};
    for (int i = 0; i < 4; i++) {
        struct vec3 g = tilt_gravity_turned(TILTS[i], TURNED);
        struct stand_pose_read *r = &p.poses[i];
        struct vec3 at =
            rigid_apply(stand_pose(&STAND, TILTS[i]), screen_place_at(&p.screen, PLACE_TOP_RIGHT));
        *r = stand_pose_unread();
        r->protractor_deg = TILTS[i];
        r->inclinometer_deg = tilt_of_gravity(g);
        r->lateral = g.x;
        memcpy(r->at[PLACE_TOP_RIGHT], (double[]){at.x, at.y, at.z}, sizeof *r->at);
    }
    return p;
}

static const char *put_poses(const struct stand_problem *p)
{
    const char *path = folder_at(&here, "poses.csv");
    assert_true(poses_save(path, p, NULL));
    return path;
}

// A tracker at (0, 0.4, -0.1) that looks straight ahead.
static const char *put_points(void)
{
    struct held_point points[5];
    for (int i = 0; i < 5; i++) {
        points[i] = (struct held_point){i < 4 ? (i & 1 ? 0.26 : -0.26) : 0,
                                        i < 4 ? (i & 2 ? 0.1 : -0.1) : 0,
                                        i < 4 ? 0.7 : 0.9,
                                        60,
                                        {0, 0, 0}};
        points[i].tracker_m = vec3_sub(held_at(&STAND, &points[i]), (struct vec3){0, 0.4, -0.1});
    }
    const char *path = folder_at(&here, "points.csv");
    assert_true(points_save(path, points, 5, NULL));
    return path;
}

static int run(int (*command)(int, char **), const char *from, const char *file, const char *to,
               const char *where)
{
    const char *words[] = {"--config", folder_at(&here, "b.conf"), from, file, to, where, NULL};
    command_here(&last, command, "x", words);
    return last.code;
}

static void refused(int (*command)(int, char **), const char *from, const char *file,
                    const char *part)
{
    assert_int_equal(run(command, from, file, NULL, NULL), COMMAND_USAGE);
    assert_holds(last.complained, part);
    assert_string_equal(last.said, "");
}

static void poses_of_a_file_give_the_rows_of_the_settings(void **state)
{
    (void)state;
    struct stand_problem p = poses();
    assert_int_equal(run(command_tilt, "--poses", put_poses(&p), NULL, NULL), COMMAND_FINE);
    assert_holds(last.said, "[stand]\nhinge_m = 0 0.01 -0.02\n"
                            "centre_from_hinge_m = 0.002 0.21 0.031\n");
    assert_holds(last.said, "[accelerometer]\nturned_deg = 2 1 -3\n");
    assert_holds(last.said, "4 poses, 24 readings, 12 unknowns");
    // They load as settings.
    char text[8192];
    snprintf(text, sizeof text, BARE "%s", strstr(last.said, "[stand]"));
    struct booth_settings b;
    struct error err = {0};
    if (!booth_load(folder_put(&here, "c.conf", text), NULL, 0, &b, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
    assert_near(b.stand.stand.centre_from_hinge_m[1], 0.21, KEPT_M);
    assert_near(b.accelerometer.turned_deg[2], -3, KEPT_DEG);
}

static void one_file_takes_stand_and_tracker_beside_each_other(void **state)
{
    (void)state;
    struct stand_problem p = poses();
    struct geometry g;
    char out[256];
    snprintf(out, sizeof out, "%s", folder_at(&here, "geometry.ini"));
    folder_put(&here, "b.conf",
               BARE "[stand]\nhinge_m = 0 0.01 -0.02\n"
                    "centre_from_hinge_m = 0.002 0.21 0.031\n");
    assert_int_equal(run(command_tracker, "--points", put_points(), "-o", out), COMMAND_FINE);
    assert_int_equal(run(command_tilt, "--poses", put_poses(&p), "--out", out), COMMAND_FINE);
    assert_true(geometry_load(out, &g, NULL));
    assert_int_equal(g.rows, (1u << STORED_COUNT) - (1u << STORED_HINGE));
    assert_near(g.booth.tracker.place_m[1], 0.4, KEPT_M);
    assert_near(g.booth.tracker.place_m[2], -0.1, KEPT_M);
    assert_near(g.booth.tracker.pitch_deg, 0, KEPT_DEG);
    assert_near(g.booth.stand.stand.hinge_m[2], -0.02, KEPT_M);
    assert_true(g.uncertainty.hinge_m[1] > 1e-4 && g.uncertainty.hinge_m[1] < 0.01);
    assert_true(g.uncertainty.yaw_deg > 0.01);
    assert_int_equal(g.origin.stand_poses, 4);
    assert_int_equal(g.origin.tracker_points, 5);
}

static void the_store_takes_them_and_the_tracker_goes_by_its_stand(void **state)
{
    (void)state;
    struct stand_problem p = poses();
    struct booth_settings b;
    struct booth_calibration c;
    struct error err = {0};
    refused(command_tracker, "--points", put_points(), "boothcal tilt finds it");
    assert_int_equal(run(command_tilt, "--poses", put_poses(&p), "--store", NULL), COMMAND_FINE);
    assert_holds(last.said, "calibration 0001 is in force");
    assert_int_equal(run(command_tracker, "--points", put_points(), "--store", NULL), COMMAND_FINE);
    assert_true(booth_load(folder_at(&here, "b.conf"), NULL, 0, &b, &err));
    assert_true(booth_from_store(&b, 0, &c, &err));
    assert_int_equal(c.number, 2);
    assert_string_equal(c.manifest.note, "tracker fitted");
    assert_near(b.stand.stand.hinge_m[1], 0.01, KEPT_M);
    assert_near(b.tracker.place_m[1], 0.4, KEPT_M);
    folder_put(&here, "b.conf", BARE CENTRE);
    assert_int_equal(run(command_tilt, "--poses", put_poses(&p), "--store", NULL), COMMAND_WARNED);
    assert_holds(last.complained, "take these rows out of them: stand.centre_from_hinge_m");
}

static void sets_that_decide_nothing_end_with_2_and_the_reason(void **state)
{
    (void)state;
    struct stand_problem p = poses();
    p.count = 2;
    refused(command_tilt, "--poses", put_poses(&p), "at least 3");
    refused(command_tilt, "--poses",
            folder_put(&here, "p.csv", "tilt_deg,reading_deg\n30,30.1\n30.5,30.6\n31,31.1\n"),
            "too close together");
    folder_put(&here, "b.conf", BARE CENTRE);
    refused(command_tracker, "--points",
            folder_put(&here, "q.csv",
                       "screen_x_m,screen_y_m,standoff_m,tracker_x_m,tracker_y_m,tracker_z_m\n"
                       "-0.2,0,0.7,-0.2,0,0.7\n0,0,0.7,0,0,0.7\n0.2,0,0.7,0.2,0,0.7\n"),
            "collinear");
}

static void bad_files_and_words_are_refused_by_name(void **state)
{
    (void)state;
    refused(command_tilt, "--poses", folder_at(&here, "none.csv"), "none.csv");
    refused(command_tilt, "--poses", folder_put(&here, "p.csv", "tilt_deg,angle\n1,2\n"),
            "column 2, \"angle\"");
    refused(command_tilt, "--poses", folder_put(&here, "p.csv", "tilt_deg,gravity_x\n1,2\n"),
            "p.csv:2: gravity_x");
    refused(command_tilt, "--at", "10,x", "--at 10,x");
    refused(command_tilt, "--places", "top", "\"top\" is not one of");
    refused(command_tilt, "--tape-u", "0", "--tape-u 0");
    refused(command_tilt, "--posed", "x", "unknown");
    folder_put(&here, "b.conf", BARE CENTRE);
    refused(command_tracker, "--points", folder_put(&here, "q.csv", "screen_x_m\n1\n"),
            "no column screen_y_m");
    refused(command_tracker, "--stand-off", "-1", "--stand-off -1");
    const char *help[] = {"--help", NULL};
    command_here(&last, command_tracker, "tracker", help);
    assert_int_equal(last.code, COMMAND_FINE);
    assert_holds(last.said, "--stand-off");
}

static void poses_are_read_as_they_were_written(void **state)
{
    (void)state;
    static struct stand_problem back;
    struct stand_problem p = poses();
    struct error err = {0};
    assert_true(poses_load(put_poses(&p), &back, &err));
    assert_int_equal(back.count, 4);
    for (int i = 0; i < 4; i++) {
        assert_near(back.poses[i].lateral, p.poses[i].lateral, 0);
        assert_near(back.poses[i].at[PLACE_TOP_RIGHT][2], p.poses[i].at[PLACE_TOP_RIGHT][2], 0);
        assert_true(isnan(back.poses[i].at[PLACE_CENTRE][0]));
    }
    // Gravity in whatever unit.
    folder_put(&here, "g.csv", "tilt_deg,gravity_x,gravity_y,gravity_z\n30,0.3,0,0.4\n");
    assert_true(poses_load(folder_at(&here, "g.csv"), &back, &err));
    assert_near(back.poses[0].lateral, 0.6, 1e-12);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, open_here, close_here)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(poses_of_a_file_give_the_rows_of_the_settings),
        TEST(one_file_takes_stand_and_tracker_beside_each_other),
        TEST(the_store_takes_them_and_the_tracker_goes_by_its_stand),
        TEST(sets_that_decide_nothing_end_with_2_and_the_reason),
        TEST(bad_files_and_words_are_refused_by_name),
        TEST(poses_are_read_as_they_were_written),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
