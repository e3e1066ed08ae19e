// SPDX-License-Identifier: Apache-2.0
#include "drivers/vendor_files.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "files/cgats.h"
#include "files/text.h"
#include "files/write.h"

enum { BYTES_MOST = 1 << 26, PIXELS_MOST = 1 << 16, CELLS_MOST = 5, CELL_BYTES = 64 };

static const double field_slack_nm = 0.51; // field names carry whole nanometres

struct text {
    struct vendor_file *out;
    const char *start, *next, *end; // of the file
    const char *at, *stop;          // of the line
    int line, comma_line, point_line;
    int promised; // rows by the header, 0 = not told
    bool ended;   // the end mark was seen
    struct error *err;
};

const char *vendor_format_name(enum vendor_format format)
{
    static const char *const names[] = {
#define X(name, text) text,
        VENDOR_FORMATS(X)
#undef X
    };
    return names[format];
}

void vendor_file_fini(struct vendor_file *file)
{
    free(file->nm);
    free(file->values);
    free(file->dark);
    free(file->reference);
    free(file->sample);
    *file = (struct vendor_file){0};
}

static bool bad(const struct text *t, const char *what)
{
    char shown[TEXT_SHOWN];
    text_shown(shown, t->at, (size_t)(t->stop - t->at));
    return fail(t->err, ERROR_DATA, "%s:%d: \"%s\" %s", t->out->path, t->line, shown, what);
}

// CR LF, LF, CR and, as OceanView writes once, LF CR end one line.
static bool next_line(struct text *t)
{
    while (t->next < t->end) {
        t->at = t->stop = t->next;
        while (t->stop < t->end && *t->stop != '\n' && *t->stop != '\r')
            t->stop++;
        t->next = t->stop;
        if (t->next < t->end && *t->next++ == '\r' && t->next < t->end && *t->next == '\n')
            t->next++;
        t->line++;
        while (t->at < t->stop && (*t->at == ' ' || *t->at == '\t'))
            t->at++;
        while (t->stop > t->at && (t->stop[-1] == ' ' || t->stop[-1] == '\t'))
            t->stop--;
        if (t->at < t->stop)
            return true;
        if (t->stop > t->start && t->stop < t->end && *t->stop == '\r' && t->stop[-1] == '\n')
            t->line--;
    }
    return false;
}

static bool begins(const struct text *t, const char *with)
{
    size_t n = strlen(with);
    return (size_t)(t->stop - t->at) >= n && !strncasecmp(t->at, with, n);
}

// One number, decimal comma or point; which of them, the whole file decides.
static bool number(struct text *t, const char *text, size_t size, double *value)
{
    char copy[CELL_BYTES];
    if (size >= sizeof copy)
        return false;
    memcpy(copy, text, size);
    char *comma = memchr(copy, ',', size);
    if (comma) {
        *comma = '.';
        t->comma_line = t->comma_line ? t->comma_line : t->line;
    } else if (memchr(copy, '.', size)) {
        t->point_line = t->point_line ? t->point_line : t->line;
    }
    return text_number(copy, size, value) == TEXT_NUMBER;
}

// What follows the colon of a header line, without the "(SERIAL)" behind it.
static void header_value(const struct text *t, const char **from, size_t *size)
{
    const char *colon = memchr(t->at, ':', (size_t)(t->stop - t->at));
    const char *at = colon ? colon + 1 : t->stop, *stop = t->stop;
    while (at < stop && *at == ' ')
        at++;
    for (const char *open = at + 1; open < stop; open++)
        if (*open == '(')
            stop = open;
    while (stop > at && stop[-1] == ' ')
        stop--;
    *from = at;
    *size = (size_t)(stop - at);
}

static bool header_number(struct text *t, double scale, double most, int *out)
{
    const char *from;
    size_t size;
    double value;
    header_value(t, &from, &size);
    if (!number(t, from, size, &value) || !(value >= 0) || value * scale > most)
        return bad(t, "tells no sensible number");
    *out = (int)rint(value * scale);
    return true;
}

static bool header_text(const struct text *t, char out[64])
{
    const char *from;
    size_t size;
    header_value(t, &from, &size);
    if (size > 63)
        size = 63;
    memcpy(out, from, size);
    out[size] = 0;
    return true;
}

static bool header_line(struct text *t)
{
    struct vendor_file *out = t->out;
    const double most_us = 2e9, most = 1e6;
    if (begins(t, "Date:"))
        return header_text(t, out->date);
    if (begins(t, "Spectrometers:") || begins(t, "Spectrometer:"))
        return header_text(t, out->serial);
    if (begins(t, "Integration Time (usec)"))
        return header_number(t, 1, most_us, &out->integration_us);
    if (begins(t, "Integration Time (msec)"))
        return header_number(t, 1e3, most_us, &out->integration_us);
    if (begins(t, "Integration Time (sec)"))
        return header_number(t, 1e6, most_us, &out->integration_us);
    if (begins(t, "Spectra Averaged:") || begins(t, "Scans to average:"))
        return header_number(t, 1, most, &out->averaged);
    if (begins(t, "Boxcar"))
        return header_number(t, 1, most, &out->boxcar);
    if (begins(t, "Number of Pixels in"))
        return header_number(t, 1, PIXELS_MOST, &t->promised);
    return true;
}

static bool make_room(struct text *t, size_t room)
{
    struct vendor_file *out = t->out;
    double **columns[] = {&out->nm, &out->values, &out->dark, &out->reference, &out->sample};
    int count = out->format == VENDOR_JAZ ? 5 : 2;
    if (room > PIXELS_MOST)
        return bad(t, "is one row too many");
    for (int i = 0; i < count; i++) {
        double *more = realloc(*columns[i], room * sizeof *more);
        if (!more)
            return fail(t->err, ERROR_SYSTEM, "%s: out of memory", out->path);
        *columns[i] = more;
    }
    return true;
}

// Decimal commas leave only blanks, tabs and semicolons to part cells.
static bool parts(const struct text *t, char c)
{
    return c == '\t' || c == ' ' || c == ';' ||
           (c == ',' && t->out->format == VENDOR_COLUMNS && !t->comma_line);
}

static bool take_cells(struct text *t, double cells[CELLS_MOST], int wanted)
{
    int count = 0;
    for (const char *at = t->at; at < t->stop; count++) {
        const char *from = at;
        while (at < t->stop && !parts(t, *at))
            at++;
        if (count == wanted)
            return bad(t, "has too many cells");
        if (!number(t, from, (size_t)(at - from), &cells[count]))
            return bad(t, "holds a cell that is no finite number");
        while (at < t->stop && parts(t, *at))
            at++;
    }
    if (count < wanted)
        return bad(t, "has too few cells");
    return !t->comma_line || !t->point_line ||
           fail(t->err, ERROR_DATA,
                "%s:%d: decimal commas (line %d) and points (line %d) in one file", t->out->path,
                t->line, t->comma_line, t->point_line);
}

static bool take_row(struct text *t, size_t *room)
{
    struct vendor_file *out = t->out;
    double cells[CELLS_MOST];
    bool jaz = out->format == VENDOR_JAZ;
    if (!take_cells(t, cells, jaz ? 5 : 2))
        return false;
    if (out->count == *room && !make_room(t, *room = *room ? 2 * *room : 1024))
        return false;
    if (out->count && !(cells[0] > out->nm[out->count - 1]))
        return bad(t, "does not ascend");
    out->nm[out->count] = cells[0];
    out->values[out->count] = cells[jaz ? 4 : 1];
    if (jaz) {
        out->dark[out->count] = cells[1];
        out->reference[out->count] = cells[2];
        out->sample[out->count] = cells[3];
    }
    out->count++;
    return true;
}

static bool take_rows(struct text *t)
{
    size_t room = 0;
    // The header is free text, its decimal separators bind nothing.
    t->comma_line = t->point_line = 0;
    while (next_line(t)) {
        t->ended = begins(t, ">>>>>End");
        if (t->ended)
            break;
        if (*t->at != '#' && !take_row(t, &room))
            return false;
    }
    size_t count = t->out->count, promised = (size_t)t->promised;
    if (count < 2)
        return fail(t->err, ERROR_DATA, "%s:%d: the file ends before its data", t->out->path,
                    t->line);
    if (promised && (count < promised || (t->ended && count != promised)))
        return fail(t->err, ERROR_DATA, "%s:%d: %zu rows where the header promises %d",
                    t->out->path, t->line, count, t->promised);
    return t->ended || t->out->format == VENDOR_OCEANVIEW || t->out->format == VENDOR_COLUMNS ||
           fail(t->err, ERROR_DATA, "%s:%d: the file ends without its end mark", t->out->path,
                t->line);
}

static bool take_header(struct text *t)
{
    do {
        if (begins(t, ">>>>>Begin")) {
            if (t->out->format != VENDOR_JAZ)
                return true;
            return (next_line(t) && begins(t, "W\tD\tR\tS\tP")) ||
                   bad(t, "stands where the columns W D R S P are named");
        }
        if (!header_line(t))
            return false;
    } while (next_line(t));
    return fail(t->err, ERROR_DATA, "%s:%d: the file ends before its data", t->out->path, t->line);
}

// A first line of names is passed over; a first line of numbers is data.
static bool take_columns(struct text *t)
{
    while (*t->at == '#')
        if (!next_line(t))
            return bad(t, "is all there is");
    size_t size = 0;
    while (t->at + size < t->stop && !strchr("\t ;,", t->at[size]))
        size++;
    double value;
    if (text_number(t->at, size, &value) == TEXT_NUMBER) {
        t->next = t->at;
        t->line--;
    }
    return take_rows(t);
}

static bool parse(struct text *t)
{
    if (!next_line(t))
        return fail(t->err, ERROR_DATA, "%s: is empty", t->out->path);
    if (begins(t, "SpectraSuite Data File") || begins(t, "OOIBase32"))
        t->out->format = VENDOR_SPECTRASUITE;
    else if (begins(t, "Jaz Data File"))
        t->out->format = VENDOR_JAZ;
    else if (begins(t, "Data from "))
        t->out->format = VENDOR_OCEANVIEW;
    else if (*t->at && strchr("0123456789.+-#nwNW\"", *t->at))
        t->out->format = VENDOR_COLUMNS;
    else
        return bad(t, "begins no SpectraSuite, OceanView, Jaz, .sp or \"nm, value\" file");
    return t->out->format == VENDOR_COLUMNS ? take_columns(t) : take_header(t) && take_rows(t);
}

bool vendor_file_parse(const char *path, const char *text, size_t size, struct vendor_file *out,
                       struct error *err)
{
    *out = (struct vendor_file){0};
    snprintf(out->path, sizeof out->path, "%s", path);
    struct text t = {.out = out, .start = text, .next = text, .end = text + size, .err = err};
    if (parse(&t))
        return true;
    vendor_file_fini(out);
    return false;
}

// ---- .sp -----------------------------------------------------------------------

static bool sp_header(const struct cgats *file, double *start, double *end, double *norm,
                      struct error *err)
{
    const struct table *t = &file->table;
    double bands;
    if (!cgats_numbers(file, "SPECTRAL_BANDS", &bands, 1, err) ||
        !cgats_numbers(file, "SPECTRAL_START_NM", start, 1, err) ||
        !cgats_numbers(file, "SPECTRAL_END_NM", end, 1, err) ||
        !cgats_numbers(file, "SPECTRAL_NORM", norm, 1, err))
        return false;
    if (t->rows != 1)
        return fail(err, ERROR_DATA, "%s: holds %zu spectra; allowed: one", t->path, t->rows);
    if (!(*norm > 0) || !(*end > *start) || bands < 2)
        return fail(err, ERROR_DATA, "%s: %g bands from %g to %g nm, norm %g, are no spectrum",
                    t->path, bands, *start, *end, *norm);
    return bands <= (double)t->columns ||
           fail(err, ERROR_DATA, "%s:%d: SPECTRAL_BANDS is %g but there are %zu fields", t->path,
                t->lines[0], bands, t->columns);
}

static bool sp_bands(const struct cgats *file, double start, double end, double norm,
                     struct vendor_file *out, struct error *err)
{
    const struct table *t = &file->table;
    double bands = 0;
    cgats_numbers(file, "SPECTRAL_BANDS", &bands, 1, NULL);
    out->nm = calloc(t->columns, sizeof *out->nm);
    out->values = calloc(t->columns, sizeof *out->values);
    if (!out->nm || !out->values)
        return fail(err, ERROR_SYSTEM, "%s: out of memory", t->path);
    for (size_t c = 0; c < t->columns; c++) {
        if (strncmp(t->names[c], "SPEC_", 5) != 0)
            continue;
        double nm = start + (end - start) * (double)out->count / (bands - 1);
        if (fabs(strtod(t->names[c] + 5, NULL) - nm) > field_slack_nm)
            return fail(err, ERROR_DATA, "%s:%d: field %s stands where the header puts %g nm",
                        t->path, t->lines[0], t->names[c], nm);
        out->nm[out->count] = nm;
        out->values[out->count++] = table_at(t, 0, c) / norm;
    }
    return (double)out->count == bands ||
           fail(err, ERROR_DATA, "%s:%d: SPECTRAL_BANDS is %g but there are %zu SPEC_ fields",
                t->path, t->lines[0], bands, out->count);
}

static bool load_sp(const char *path, struct vendor_file *out, struct error *err)
{
    struct cgats file = {0};
    double start, end, norm;
    *out = (struct vendor_file){.format = VENDOR_SP};
    snprintf(out->path, sizeof out->path, "%s", path);
    bool ok = cgats_load_as(path, "SPECT", &file, err) &&
              sp_header(&file, &start, &end, &norm, err) &&
              sp_bands(&file, start, end, norm, out, err);
    const char *created = ok ? cgats_keyword(&file, "CREATED") : NULL;
    snprintf(out->date, sizeof out->date, "%s", created ? created : "");
    cgats_fini(&file);
    if (!ok)
        vendor_file_fini(out);
    return ok;
}

bool vendor_file_load(const char *path, struct vendor_file *out, struct error *err)
{
    *out = (struct vendor_file){0};
    size_t size;
    char *text = file_read(path, BYTES_MOST, &size, err);
    if (!text)
        return false;
    bool sp = size >= 5 && !memcmp(text, "SPECT", 5) && strchr("\r\n \t", text[5]);
    bool ok = sp ? load_sp(path, out, err) : vendor_file_parse(path, text, size, out, err);
    free(text);
    return ok;
}
