// SPDX-License-Identifier: Apache-2.0
#include "config/display_file.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "files/ini.h"
#include "files/write.h"

// A line of the file holds a mode along blue.
enum {
    LINES_A_MODE = UNCERTAINTY_SIDE * UNCERTAINTY_SIDE,
    MODE_LINES = UNCERTAINTY_MODES * LINES_A_MODE,
    LINE_NUMBERS = 3 * UNCERTAINTY_SIDE,
    UNCERTAINTY_ROWS = 6,
};

// What the file holds: the model with its curves and its residual node by node.
struct display_file {
    char name[128];
    int kind;
    double matrix[3][4];
    double interaction[3][DISPLAY_TERMS];
    struct lattice residual;
    double nodes[DISPLAY_NODES][3];
    struct display_origin origin;
    struct setting node_rows[DISPLAY_NODES + 1];
    char node_names[DISPLAY_NODES][12];
    struct setting shift_rows[2 + LATTICE_NODES + 1];
    char shift_names[LATTICE_NODES][12];
    struct setting mode_rows[UNCERTAINTY_ROWS + MODE_LINES + 1];
    char mode_names[MODE_LINES][24];
};

#define TEXT(in, field, preset_text, sentence)                                                     \
    {                                                                                              \
        .name = #field, .type = SETTING_TEXT, .offset = SETTING_FIELD(in, field),                  \
        .size = SETTING_SIZE(in, field), .unit = "", .preset = preset_text, .help = sentence       \
    }
#define ROW(label, index)                                                                          \
    {                                                                                              \
        .name = label, .type = SETTING_VECTOR, .offset = index * 4 * sizeof(double), .size = 4,    \
        .least = -1e6, .most = 1e6, .unit = "cd/m2",                                               \
        .help = "Tristimulus value of full red, green, blue and of black."                         \
    }

static const struct setting name_rows[] = {
    TEXT(struct display_file, name, "", "Panel and serial number."),
    {.name = "model",
     .type = SETTING_ENUM,
     .offset = SETTING_FIELD(struct display_file, kind),
     .choices = display_kind_names,
     .unit = "",
     .preset = "day",
     .help = "Three curves and a matrix alone (day), or with channel interaction, or with a "
             "smooth residual."},
    {0},
};

static const struct setting matrix_rows[] = {ROW("X", 0), ROW("Y", 1), ROW("Z", 2), {0}};

#define TERMS(label, index)                                                                        \
    {                                                                                              \
        .name = label, .type = SETTING_VECTOR, .offset = index * DISPLAY_TERMS * sizeof(double),   \
        .size = DISPLAY_TERMS, .least = -1e6, .most = 1e6, .unit = "cd/m2",                        \
        .preset = "0 0 0 0 0 0",                                                                   \
        .help = "Added by what red-green, green-blue, blue-red share, and by red, green, blue at " \
                "middle drive."                                                                    \
    }

static const struct setting interaction_rows[] = {TERMS("X", 0), TERMS("Y", 1), TERMS("Z", 2), {0}};

#define CORNER(field, values, sentence)                                                            \
    {                                                                                              \
        .name = #field, .type = SETTING_VECTOR, .offset = SETTING_FIELD(struct lattice, field),    \
        .size = 3, .least = -1000, .most = 1000, .unit = "", .preset = values, .help = sentence    \
    }

static const struct setting corner_rows[2] = {
    CORNER(least, "0 -100 -100", "L*, a*, b* where the residual's box begins."),
    CORNER(most, "100 100 100", "L*, a*, b* where the residual's box ends."),
};

static const struct setting origin_rows[] = {
    TEXT(struct display_origin, instrument, "", "Instrument that measured."),
    TEXT(struct display_origin, date, "", "When it was measured or fitted."),
    TEXT(struct display_origin, software, "", "Program that fitted."),
    TEXT(struct display_origin, source, "", "File of measured patches."),
    {.name = "patches",
     .type = SETTING_INT,
     .offset = SETTING_FIELD(struct display_origin, patches),
     .least = 0,
     .most = 1e6,
     .unit = "",
     .preset = "0",
     .help = "Patches fitted."},
    {.name = "fit_mean_de00",
     .type = SETTING_DOUBLE,
     .offset = SETTING_FIELD(struct display_origin, fit_mean_de00),
     .least = 0,
     .most = 1000,
     .unit = "",
     .preset = "0",
     .help = "Mean CIEDE2000 over the fitted patches."},
    {.name = "fit_max_de00",
     .type = SETTING_DOUBLE,
     .offset = SETTING_FIELD(struct display_origin, fit_max_de00),
     .least = 0,
     .most = 1000,
     .unit = "",
     .preset = "0",
     .help = "Largest CIEDE2000 over the fitted patches."},
    {0},
};

#define DEVIATION(field, range, value, sentence)                                                   \
    {                                                                                              \
        .name = #field, .type = SETTING_DOUBLE,                                                    \
        .offset = SETTING_FIELD(struct display_uncertainty, field), .least = 0, .most = range,     \
        .unit = "", .preset = value, .help = sentence                                              \
    }

static const struct setting uncertainty_rows[UNCERTAINTY_ROWS] = {
    DEVIATION(smooth_de00, 1000, "0",
              "Standard deviation a CIEDE2000 axis that neighbouring colours share."),
    DEVIATION(length_lab, 1000, "0", "CIELAB units over which they share it."),
    DEVIATION(local_de00, 1000, "0",
              "Standard deviation a CIEDE2000 axis that neighbouring colours do not share."),
    DEVIATION(neutral_de00, 1000, "0", "Likewise, in addition, near the grey axis."),
    DEVIATION(noise_de00, 1000, "0", "Of that, repeatability of one reading; 0 when not known."),
    {.name = "modes",
     .type = SETTING_INT,
     .offset = SETTING_FIELD(struct display_uncertainty, modes),
     .least = 0,
     .most = UNCERTAINTY_MODES,
     .unit = "",
     .preset = "0",
     .help = "Principal modes of the parameters' covariance."},
};

// Names only the modes that there are, or all to read a file.
static void name_modes(struct display_file *file, int modes)
{
    const size_t first = offsetof(struct display_uncertainty, mode);
    memcpy(file->mode_rows, uncertainty_rows, sizeof uncertainty_rows);
    for (int k = 0; k < modes * LINES_A_MODE && k < MODE_LINES; k++) {
        snprintf(file->mode_names[k], sizeof file->mode_names[k], "mode_%02d_%d%d",
                 k / LINES_A_MODE, k / UNCERTAINTY_SIDE % UNCERTAINTY_SIDE, k % UNCERTAINTY_SIDE);
        file->mode_rows[UNCERTAINTY_ROWS + k] = (struct setting){
            .name = file->mode_names[k],
            .type = SETTING_VECTOR,
            .offset = first + LINE_NUMBERS * sizeof(double) * (size_t)k,
            .size = LINE_NUMBERS,
            .least = -1000,
            .most = 1000,
            .unit = "",
            .preset = "0 0 0 0 0 0 0 0 0 0 0 0",
            .help = "L*, a*, b* per standard deviation at a third of red and of green, for "
                    "blue 0, 1/3, 2/3, 1."};
    }
}

static void name_shifts(struct display_file *file)
{
    memcpy(file->shift_rows, corner_rows, sizeof corner_rows);
    for (int x = 0; x < LATTICE_SIDE; x++)
        for (int y = 0; y < LATTICE_SIDE; y++)
            for (int z = 0; z < LATTICE_SIDE; z++) {
                int k = lattice_node(x, y, z);
                snprintf(file->shift_names[k], sizeof file->shift_names[k], "node_%d%d%d", x, y, z);
                file->shift_rows[2 + k] = (struct setting){
                    .name = file->shift_names[k],
                    .type = SETTING_VECTOR,
                    .offset = offsetof(struct lattice, node) + 3 * sizeof(double) * (size_t)k,
                    .size = 3,
                    .least = -1000,
                    .most = 1000,
                    .unit = "",
                    .preset = "0 0 0",
                    .help = "B-spline coefficient of the shift of L*, a*, b*."};
            }
}

static struct display_file *file_create(struct error *err)
{
    struct display_file *file = calloc(1, sizeof *file);
    if (!file) {
        fail(err, ERROR_SYSTEM, "out of memory for a display model");
        return NULL;
    }
    for (int k = 0; k < DISPLAY_NODES; k++) {
        snprintf(file->node_names[k], sizeof file->node_names[k], "node_%04d", k);
        file->node_rows[k] = (struct setting){
            .name = file->node_names[k],
            .type = SETTING_VECTOR,
            .offset = (size_t)k * sizeof file->nodes[0],
            .size = 3,
            .least = 0,
            .most = 1,
            .unit = "",
            .help = "Linear light of red, green and blue at this 1020th of full code."};
    }
    name_shifts(file);
    return file;
}

enum { SECTIONS = 8 };

// Every section, or those that the kind uses and that say something.
static void sections_of(struct display_file *file, bool every,
                        struct settings_section sections[SECTIONS])
{
    const struct display_uncertainty *u = &file->origin.uncertainty;
    bool uncertain = u->modes > 0 || u->smooth_de00 > 0 || u->local_de00 > 0 || u->neutral_de00 > 0;
    int n = 0;
    name_modes(file, every ? UNCERTAINTY_MODES : u->modes);
    sections[n++] = (struct settings_section){"display", name_rows, file};
    sections[n++] = (struct settings_section){"origin", origin_rows, &file->origin};
    sections[n++] = (struct settings_section){"matrix", matrix_rows, file->matrix};
    sections[n++] = (struct settings_section){"curves", file->node_rows, file->nodes};
    if (every || file->kind == DISPLAY_INTERACTION)
        sections[n++] =
            (struct settings_section){"interaction", interaction_rows, file->interaction};
    if (every || file->kind == DISPLAY_RESIDUAL)
        sections[n++] = (struct settings_section){"residual", file->shift_rows, &file->residual};
    if (every || uncertain)
        sections[n++] =
            (struct settings_section){"uncertainty", file->mode_rows, &file->origin.uncertainty};
    sections[n] = (struct settings_section){0};
}

// Other programs' texts may hold what an INI value cannot.
static void make_plain(char *text)
{
    for (char *c = text; *c; c++)
        if (*c < ' ' || *c > '~')
            *c = '?';
    size_t blanks = strspn(text, " ");
    memmove(text, text + blanks, strlen(text + blanks) + 1);
    for (size_t n = strlen(text); n && text[n - 1] == ' '; n--)
        text[n - 1] = 0;
}

bool display_save(const char *path, const struct display_model *model,
                  const struct display_origin *origin, struct error *err)
{
    struct settings_section sections[SECTIONS];
    struct display_file *file = file_create(err);
    if (!file)
        return false;
    memcpy(file->name, model->name, sizeof file->name);
    file->kind = model->kind;
    memcpy(file->matrix, model->matrix, sizeof file->matrix);
    memcpy(file->interaction, model->interaction, sizeof file->interaction);
    file->residual = model->residual;
    for (int k = 0; k < DISPLAY_NODES; k++)
        for (int c = 0; c < 3; c++)
            file->nodes[k][c] = model->curve[c][k];
    file->origin = *origin;
    char *texts[] = {file->name, file->origin.instrument, file->origin.date, file->origin.software,
                     file->origin.source};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        make_plain(texts[i]);
    sections_of(file, false, sections);
    bool saved = ini_save(path, sections, err);
    free(file);
    return saved;
}

static void model_of(const struct display_file *file, struct display_model *model)
{
    memcpy(model->name, file->name, sizeof model->name);
    model->kind = (enum display_kind)file->kind;
    memcpy(model->matrix, file->matrix, sizeof model->matrix);
    memcpy(model->interaction, file->interaction, sizeof model->interaction);
    model->residual = file->residual;
    for (int k = 0; k < DISPLAY_NODES; k++)
        for (int c = 0; c < 3; c++)
            model->curve[c][k] = file->nodes[k][c];
}

// The node that display_model_prepare complains of, or -1.
static int bad_node(const struct display_file *file)
{
    const int last = DISPLAY_NODES - 1;
    for (int c = 0; c < 3; c++) {
        if (file->nodes[0][c] != 0)
            return 0;
        if (file->nodes[last][c] != 1)
            return last;
        for (int k = 1; k <= last; k++)
            if (!(file->nodes[k][c] > file->nodes[k - 1][c]))
                return k;
    }
    return -1;
}

// Line of a key that the file holds, whose keys are all different.
static int line_of_key(const char *path, const char *key)
{
    enum { BYTES_MOST = 1 << 24 };
    size_t size, length = strlen(key);
    char *text = file_read(path, BYTES_MOST, &size, NULL);
    int line = 0;
    bool found = false;
    for (const char *at = text; at && !found; line++) {
        at += strspn(at, " \t");
        found = !strncmp(at, key, length) && at[length + strspn(at + length, " \t")] == '=';
        const char *stop = strchr(at, '\n');
        at = stop ? stop + 1 : NULL;
    }
    free(text);
    return found ? line : 0;
}

// Puts file, line and section before what display_model_prepare said.
static bool blame(const char *path, const struct display_file *file, struct error *err)
{
    struct display_model day = {0};
    int node = bad_node(file);
    const char *key = node < 0 ? matrix_rows[0].name : file->node_names[node];
    const char *section = node < 0 ? "matrix" : "curves";
    model_of(file, &day);
    day.kind = DISPLAY_DAY;
    if (file->kind != DISPLAY_DAY && display_model_prepare(&day, NULL)) {
        key = name_rows[1].name;
        section = display_kind_names[file->kind];
    }
    return while_doing(err, "%s:%d: [%s]", path, line_of_key(path, key), section);
}

bool display_load(const char *path, struct display_model *model, struct display_origin *origin,
                  struct error *err)
{
    struct settings_section sections[SECTIONS];
    struct display_model loaded = {0};
    struct display_file *file = file_create(err);
    if (!file)
        return false;
    sections_of(file, true, sections);
    bool fine = ini_load(path, sections, err);
    model_of(file, &loaded);
    if (fine && !display_model_prepare(&loaded, err))
        fine = blame(path, file, err);
    if (fine) {
        *model = loaded;
        if (origin)
            *origin = file->origin;
    }
    free(file);
    return fine;
}
