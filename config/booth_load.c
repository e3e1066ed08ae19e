// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <string.h>

#include "config/bands_file.h"
#include "config/booth.h"
#include "config/paths.h"
#include "files/ini.h"

void booth_preset(struct booth_settings *booth)
{
    struct booth_tables tables;
    *booth = (struct booth_settings){0};
    booth_tables_init(&tables, booth);
    for (struct settings_section *s = tables.sections; s->name; s++)
        settings_preset(s->rows, booth);
}

// The paths among the settings, so that each is resolved in one place.
struct path_field {
    const char *section, *key;
    char *text;
    size_t size;
};

enum { PATH_FIELDS = 14 };

static void path_fields(struct booth_settings *b, struct path_field out[PATH_FIELDS])
{
    const struct path_field fields[PATH_FIELDS] = {
#define FIELD(section, key, field) {section, key, field, sizeof field}
        FIELD("spectrometer", "calibration", b->spectrometer.options.calibration),
        FIELD("spectrometer", "darks", b->spectrometer.options.darks),
        FIELD("spectrometer", "file", b->spectrometer.options.file),
        FIELD("spectrometer", "reference", b->spectrometer.options.reference),
        FIELD("accelerometer", "port", b->accelerometer.options.port),
        FIELD("radiometer", "port", b->radiometer.options.port),
        FIELD("display", "model", b->display.model),
        FIELD("display", "view", b->display.view),
        FIELD("lamps", "folder", b->lamps.folder),
        FIELD("materials", "folder", b->materials.folder),
        FIELD("materials", "show", b->materials.show),
        FIELD("quality", "bands", b->quality.bands),
        FIELD("calibration", "store", b->calibration.store),
        FIELD("control", "socket", b->control.socket),
#undef FIELD
    };
    memcpy(out, fields, sizeof fields);
}

// "host:port" is no path, nor is a material's bare name or a number of bands.
static bool names_no_path(const struct path_field *field)
{
    if (!strcmp(field->section, "accelerometer"))
        return strchr(field->text, ':') && *field->text != '/';
    if (!strcmp(field->key, "bands"))
        return !field->text[strspn(field->text, "+-0123456789")];
    return !strcmp(field->key, "show") && !strchr(field->text, '/');
}

static bool resolve(struct booth_settings *booth, const char *file, const char *section,
                    const char *key, struct error *err)
{
    struct path_field fields[PATH_FIELDS];
    path_fields(booth, fields);
    for (int i = 0; i < PATH_FIELDS; i++) {
        struct path_field *f = &fields[i];
        if ((section && (strcmp(section, f->section) || strcmp(key, f->key))) || names_no_path(f))
            continue;
        if (!path_beside(file, f->text, f->text, f->size, err) ||
            (*f->text && !path_absolute(f->text, f->text, f->size, err)))
            return while_doing(err, "[%s] %s", f->section, f->key);
    }
    return true;
}

static const struct {
    const char *section, *key;
} STORED[] = {
#define X(name, section, key) {section, key},
    BOOTH_STORED(X)
#undef X
};

const char *booth_stored_name(enum booth_stored row)
{
    static const char *const names[] = {
#define X(name, section, key) section "." key,
        BOOTH_STORED(X)
#undef X
    };
    return (unsigned)row < STORED_COUNT ? names[row] : "";
}

void booth_stored_list(unsigned rows, char *text, size_t size)
{
    size_t used = 0;
    *text = 0;
    for (unsigned i = 0; i < STORED_COUNT && used < size; i++)
        if (rows & 1u << i)
            used += (size_t)snprintf(text + used, size - used, "%s%s", used ? ", " : "",
                                     booth_stored_name(i));
}

// The bit of a setting that the store provides, 0 of any other.
static unsigned stored_bit(const char *section, const char *key)
{
    for (int i = 0; i < STORED_COUNT; i++)
        if (!strcmp(STORED[i].section, section) && !strcmp(STORED[i].key, key))
            return 1u << i;
    return 0;
}

static struct settings_section *section_of(struct booth_tables *tables, const char *name)
{
    for (struct settings_section *s = tables->sections; s->name; s++)
        if (!strcmp(s->name, name))
            return s;
    return NULL;
}

static bool override(struct booth_tables *tables, struct booth_settings *booth, const char *text,
                     struct error *err)
{
    char section[32], key[64];
    int value_at = 0;
    if (sscanf(text, "%31[a-z].%63[a-z0-9_]=%n", section, key, &value_at) != 2 || !value_at)
        return fail(err, ERROR_CONFIG, "\"%s\" is not of the form section.key=value", text);
    struct settings_section *s = section_of(tables, section);
    if (!s)
        return fail(err, ERROR_CONFIG, "%s: there is no section [%s]", text, section);
    if (!settings_set(s->rows, booth, key, text + value_at, err))
        return while_doing(err, "[%s]", section);
    booth->given |= stored_bit(section, key);
    return resolve(booth, NULL, section, key, err);
}

// What the file gives; a row that the store may provide need not be there.
static bool load_file(const char *path, const struct booth_tables *tables,
                      struct booth_settings *booth, struct error *err)
{
    bool given[BOOTH_ROWS_MOST] = {0}, *row_given = given;
    for (const struct settings_section *s = tables->sections; s->name; s++)
        settings_preset(s->rows, booth);
    if (!ini_load_onto(path, tables->sections, given, err))
        return false;
    for (const struct settings_section *s = tables->sections; s->name; s++)
        for (const struct setting *row = s->rows; row->name; row++, row_given++) {
            unsigned bit = stored_bit(s->name, row->name);
            booth->given |= *row_given ? bit : 0;
            *row_given = *row_given || (bit && *booth->calibration.store);
        }
    return ini_complete(path, tables->sections, given, err);
}

// An empty name is none; lamps that neither settings nor store name lie beside the file.
static bool preset_lamps(const char *path, struct booth_settings *b, struct error *err)
{
    if (!*b->display.model)
        b->given &= ~(1u << STORED_MODEL);
    if (!*b->display.view)
        b->given &= ~(1u << STORED_VIEW);
    if (*b->lamps.folder)
        return true;
    b->given &= ~(1u << STORED_LAMPS);
    if (*b->calibration.store)
        return true;
    strcpy(b->lamps.folder, "lamps");
    return resolve(b, path, "lamps", "folder", err);
}

// What no single row can say.
static bool check(const struct booth_settings *b, struct error *err)
{
    struct band_set bands;
    struct error why;
    enum observer observer = b->quality.observer;
    if (observer != OBSERVER_1931_2)
        return fail(err, ERROR_CONFIG,
                    "[quality] observer = %s: display model, radiometer and luminance are in CIE "
                    "1931 2 degrees; allowed: %s",
                    observer_name(observer), observer_name(OBSERVER_1931_2));
    return booth_bands(b, &bands, &why) ||
           fail(err, ERROR_CONFIG, "[quality] bands = %s: %s", b->quality.bands, why.text);
}

bool booth_load(const char *path, const char *const *overrides, int count,
                struct booth_settings *booth, struct error *err)
{
    struct booth_settings loaded = {0};
    struct booth_tables tables;
    booth_tables_init(&tables, &loaded);
    if (!load_file(path, &tables, &loaded, err))
        return false;
    if (!resolve(&loaded, path, NULL, NULL, err))
        return while_doing(err, "%s", path);
    for (int i = 0; i < count; i++)
        if (!override(&tables, &loaded, overrides[i], err))
            return while_doing(err, "--set");
    if (!preset_lamps(path, &loaded, err) || !check(&loaded, err))
        return while_doing(err, "%s", path);
    *booth = loaded;
    return true;
}

void booth_describe(FILE *out)
{
    struct booth_tables tables;
    booth_tables_init(&tables, NULL);
    fputs("# Settings of boothd; see boothd.conf(5). A line that begins with # is at its preset;\n"
          "# the others must be filled in. Relative paths are relative to this file.\n",
          out);
    for (struct settings_section *s = tables.sections; s->name; s++) {
        fputc('\n', out);
        settings_describe(s, out);
    }
}

static void describe_range(const struct setting *row, FILE *out)
{
    switch (row->type) {
    case SETTING_DOUBLE:
    case SETTING_INT:
        fprintf(out, "Range %.9g..%.9g%s%s. ", row->least, row->most, *row->unit ? " " : "",
                row->unit);
        return;
    case SETTING_VECTOR:
        fprintf(out, "%zu numbers, each %.9g..%.9g%s%s. ", row->size, row->least, row->most,
                *row->unit ? " " : "", row->unit);
        return;
    case SETTING_BOOL:
        fputs("yes or no. ", out);
        return;
    case SETTING_ENUM:
        fputs("One of", out);
        for (int i = 0; row->choices[i]; i++)
            fprintf(out, "%s %s", i ? "," : "", row->choices[i]);
        fputs(". ", out);
        return;
    case SETTING_TEXT:
        return;
    }
}

void booth_describe_man(FILE *out)
{
    struct booth_tables tables;
    booth_tables_init(&tables, NULL);
    for (struct settings_section *s = tables.sections; s->name; s++) {
        fprintf(out, ".SS [%s]\n", s->name);
        for (const struct setting *row = s->rows; row->name; row++) {
            fprintf(out, ".TP\n.B %s\n%s ", row->name, row->help);
            describe_range(row, out);
            if (!row->preset)
                fputs("Must be given.\n", out);
            else if (*row->preset)
                fprintf(out, "Preset %s.\n", row->preset);
            else
                fputs("Preset: empty.\n", out);
        }
    }
}

const struct spectrometer_driver *booth_spectrometer(const struct booth_settings *b)
{
    return b->spectrometer.driver ? spectrometer_drivers[b->spectrometer.driver - 1] : NULL;
}

const struct accelerometer_driver *booth_accelerometer(const struct booth_settings *b)
{
    const struct accelerometer_driver *driver =
        b->accelerometer.driver ? accelerometer_drivers[b->accelerometer.driver - 1] : NULL;
    bool there = driver && (driver->portless || *b->accelerometer.options.port);
    return there ? driver : NULL;
}

const struct tracker_driver *booth_tracker(const struct booth_settings *b)
{
    return b->tracker.driver ? tracker_drivers[b->tracker.driver - 1] : NULL;
}

const struct radiometer_driver *booth_radiometer(const struct booth_settings *b)
{
    const struct radiometer_driver *driver =
        b->radiometer.driver ? radiometer_drivers[b->radiometer.driver - 1] : NULL;
    bool there = driver && (driver->portless || *b->radiometer.options.port);
    return there ? driver : NULL;
}

bool booth_bands(const struct booth_settings *booth, struct band_set *out, struct error *err)
{
    return bands_named(booth->quality.bands, out, err);
}

int booth_bits(const struct booth_settings *booth)
{
    return booth->display.bits_choice ? 10 : 8;
}

struct rigid booth_from_tracker(const struct booth_settings *booth)
{
    const double rad = acos(-1) / 180;
    struct mat3 roll = mat3_rotation(2, booth->tracker.roll_deg * rad);
    struct mat3 pitch = mat3_rotation(0, -booth->tracker.pitch_deg * rad);
    struct mat3 yaw = mat3_rotation(1, booth->tracker.yaw_deg * rad);
    const double *at = booth->tracker.place_m;
    return (struct rigid){mat3_mul(yaw, mat3_mul(pitch, roll)), {at[0], at[1], at[2]}};
}

bool booth_socket_default(const char *runtime_dir, char *out, size_t size, struct error *err)
{
    if (!runtime_dir || *runtime_dir != '/')
        return fail(err, ERROR_CONFIG,
                    "no control socket is set and XDG_RUNTIME_DIR names no folder for one");
    if ((size_t)snprintf(out, size, "%s/boothd/boothd.sock", runtime_dir) >= size)
        return fail(err, ERROR_CONFIG, "the path of the control socket in %s is too long",
                    runtime_dir);
    return true;
}

const char *booth_shipped_materials(void)
{
    return BOOTHD_DATADIR "/materials";
}
