// SPDX-License-Identifier: Apache-2.0
#include <stdlib.h>
#include <string.h>

#include "calibration/report_words.h"

static bool save_json(const struct report *r, const char *path, struct error *err)
{
    json_t *all = report_as_json(r);
    char *text = all ? json_dumps(all, JSON_INDENT(1) | JSON_REAL_PRECISION(9)) : NULL;
    json_decref(all);
    bool fine = text ? seal_write(path, text, strlen(text), err)
                     : fail(err, ERROR_DATA, "%s: a figure in it cannot be written", path);
    free(text);
    return fine;
}

static bool say(const struct report *r, enum document_form form, FILE *out, struct error *err)
{
    const struct session_facts *f = r->facts;
    char title[160];
    snprintf(title, sizeof title, "boothd accuracy report: %s", f->booth);
    struct document *d = document_begin(form, title, f->finished, out, err);
    if (!d)
        return false;
    report_words(r, d);
    return document_end(d, err);
}

static bool save_words(const struct report *r, enum document_form form, const char *path,
                       struct error *err)
{
    char *bytes = NULL;
    size_t size;
    FILE *out = open_memstream(&bytes, &size);
    if (!out)
        return fail(err, ERROR_SYSTEM, "out of memory for %s", path);
    bool fine = say(r, form, out, err);
    if (fclose(out) && fine)
        fine = fail(err, ERROR_SYSTEM, "out of memory for %s", path);
    fine = fine && seal_write(path, bytes, size, err);
    free(bytes);
    return fine;
}

bool report_save(const struct report *r, const char *folder, struct error *err)
{
    static const struct {
        enum document_form form;
        const char *name;
    } forms[] = {{DOCUMENT_TEXT, "report.txt"},
                 {DOCUMENT_HTML, "report.html"},
                 {DOCUMENT_PDF, "report.pdf"}};
    char path[1024];
    snprintf(path, sizeof path, "%s/report.json", folder);
    if (!save_json(r, path, err))
        return false;
    for (int i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, forms[i].name);
        if (!save_words(r, forms[i].form, path, err))
            return while_doing(err, "%s", forms[i].name);
    }
    return true;
}
