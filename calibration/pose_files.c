// SPDX-License-Identifier: Apache-2.0
#include "calibration/pose_files.h"

#include <stdio.h>
#include <string.h>

#include "base/number.h"
#include "files/table.h"
#include "files/write.h"

enum { POSE_COLUMNS = 5 + 3 * PLACE_COUNT, POINT_COLUMNS = 7, NAME = 32 };

static const char *const ANGLES[] = {"tilt_deg", "reading_deg", "gravity_x", "gravity_y",
                                     "gravity_z"};
static const char *const POINTS[] = {"screen_x_m",  "screen_y_m",  "standoff_m", "tracker_x_m",
                                     "tracker_y_m", "tracker_z_m", "tilt_deg"};

static void pose_column(int index, char name[NAME])
{
    int place = (index - 5) / 3;
    if (index < 5)
        snprintf(name, NAME, "%s", ANGLES[index]);
    else
        snprintf(name, NAME, "%s_%c_m", screen_place_name(place), "xyz"[(index - 5) % 3]);
}

static void point_column(int index, char name[NAME])
{
    snprintf(name, NAME, "%s", POINTS[index]);
}

// Where each known name stands in the table, -1 = nowhere.
static bool find_columns(const struct table *t, void (*name_of)(int, char *), int count, int *at,
                         struct error *err)
{
    char name[NAME];
    size_t known = 0;
    for (int i = 0; i < count; i++) {
        name_of(i, name);
        at[i] = table_column(t, name);
        known += at[i] >= 0;
    }
    for (size_t k = 0; k < t->columns && known < t->columns; k++) {
        bool is_known = false;
        for (int i = 0; i < count; i++)
            is_known = is_known || at[i] == (int)k;
        if (!is_known)
            return fail(err, ERROR_DATA, "%s: column %zu, \"%.40s\": is none that is known",
                        t->path, k + 1, t->names[k]);
    }
    return true;
}

static double cell(const struct table *t, size_t row, int column)
{
    return column < 0 ? NAN : table_at(t, row, (size_t)column);
}

// ---- poses of the stand --------------------------------------------------------

// Alone it is a share of the whole already.
static double lateral(const double gravity[3])
{
    bool whole = isfinite(gravity[1]) && isfinite(gravity[2]);
    double length = hypot(hypot(gravity[0], gravity[1]), gravity[2]);
    return whole ? gravity[0] / length : gravity[0];
}

static void take_pose(const struct table *t, size_t row, const int at[POSE_COLUMNS],
                      struct stand_pose_read *out)
{
    double v[POSE_COLUMNS];
    for (int i = 0; i < POSE_COLUMNS; i++)
        v[i] = cell(t, row, at[i]);
    out->protractor_deg = v[0];
    out->inclinometer_deg = v[1];
    out->lateral = lateral(v + 2);
    memcpy(out->at, v + 5, sizeof out->at);
}

bool poses_load(const char *path, struct stand_problem *problem, struct error *err)
{
    struct table t = {0};
    int at[POSE_COLUMNS];
    if (!csv_load(path, &t, err))
        return false;
    bool fine = find_columns(&t, pose_column, POSE_COLUMNS, at, err);
    if (fine && (t.rows < 1 || t.rows > STAND_POSES_MOST))
        fine = fail(err, ERROR_DATA, "%s: %zu poses; 1..%d are allowed", path, t.rows,
                    STAND_POSES_MOST);
    problem->count = fine ? (int)t.rows : problem->count;
    for (size_t i = 0; fine && i < t.rows; i++) {
        take_pose(&t, i, at, &problem->poses[i]);
        if (fabs(problem->poses[i].lateral) > 1)
            fine = fail(err, ERROR_DATA, "%s:%d: gravity_x: without y and z it must be in -1..1",
                        path, t.lines[i]);
    }
    table_fini(&t);
    return fine;
}

static void pose_values(const struct stand_pose_read *p, double v[POSE_COLUMNS])
{
    v[0] = p->protractor_deg;
    v[1] = p->inclinometer_deg;
    v[2] = p->lateral;
    v[3] = v[4] = NAN;
    memcpy(v + 5, p->at, sizeof p->at);
}

static void write_row(FILE *out, const double *v, const bool *used, int count)
{
    char text[NUMBER_TEXT];
    bool any = false;
    for (int i = 0; i < count; i++)
        if (used[i]) {
            fprintf(out, "%s%s", any ? "," : "", number_text(text, v[i]));
            any = true;
        }
    fputc('\n', out);
}

static void write_names(FILE *out, void (*name_of)(int, char *), const bool *used, int count)
{
    char name[NAME];
    bool any = false;
    for (int i = 0; i < count; i++)
        if (used[i]) {
            name_of(i, name);
            fprintf(out, "%s%s", any ? "," : "", name);
            any = true;
        }
    fputc('\n', out);
}

bool poses_save(const char *path, const struct stand_problem *problem, struct error *err)
{
    struct whole_file file;
    double v[POSE_COLUMNS];
    bool used[POSE_COLUMNS] = {0};
    if (!whole_file_begin(&file, path, err))
        return false;
    for (int i = 0; i < problem->count; i++) {
        pose_values(&problem->poses[i], v);
        for (int k = 0; k < POSE_COLUMNS; k++)
            used[k] = used[k] || isfinite(v[k]);
    }
    write_names(file.stream, pose_column, used, POSE_COLUMNS);
    for (int i = 0; i < problem->count; i++) {
        pose_values(&problem->poses[i], v);
        write_row(file.stream, v, used, POSE_COLUMNS);
    }
    return whole_file_commit(&file, err);
}

// ---- points of the tracker ------------------------------------------------------

static bool take_points(const struct table *t, double preset_deg, struct held_point *points,
                        int *count, struct error *err)
{
    int at[POINT_COLUMNS];
    if (!find_columns(t, point_column, POINT_COLUMNS, at, err))
        return false;
    for (int i = 0; i < POINT_COLUMNS - 1; i++)
        if (at[i] < 0)
            return fail(err, ERROR_DATA, "%s: there is no column %s", t->path, POINTS[i]);
    if (t->rows < 1 || t->rows > TRACKER_POINTS_MOST)
        return fail(err, ERROR_DATA, "%s: %zu points; 1..%d are allowed", t->path, t->rows,
                    TRACKER_POINTS_MOST);
    for (size_t i = 0; i < t->rows; i++) {
        double v[POINT_COLUMNS];
        for (int k = 0; k < POINT_COLUMNS; k++)
            v[k] = cell(t, i, at[k]);
        points[i] = (struct held_point){
            v[0], v[1], v[2], at[6] < 0 ? preset_deg : v[6], {v[3], v[4], v[5]}};
    }
    *count = (int)t->rows;
    return true;
}

bool points_load(const char *path, double preset_deg, struct held_point *points, int *count,
                 struct error *err)
{
    struct table t = {0};
    bool fine = csv_load(path, &t, err) && take_points(&t, preset_deg, points, count, err);
    table_fini(&t);
    return fine;
}

bool points_save(const char *path, const struct held_point *points, int count, struct error *err)
{
    static const bool ALL[POINT_COLUMNS] = {true, true, true, true, true, true, true};
    struct whole_file file;
    if (!whole_file_begin(&file, path, err))
        return false;
    write_names(file.stream, point_column, ALL, POINT_COLUMNS);
    for (int i = 0; i < count; i++) {
        const struct held_point *p = &points[i];
        const double v[POINT_COLUMNS] = {p->screen_x_m,  p->screen_y_m,  p->standoff_m,
                                         p->tracker_m.x, p->tracker_m.y, p->tracker_m.z,
                                         p->tilt_deg};
        write_row(file.stream, v, ALL, POINT_COLUMNS);
    }
    return whole_file_commit(&file, err);
}

struct vec3 held_at(const struct stand *stand, const struct held_point *p)
{
    return rigid_apply(stand_pose(stand, p->tilt_deg),
                       (struct vec3){p->screen_x_m, p->screen_y_m, p->standoff_m});
}
