// SPDX-License-Identifier: Apache-2.0
#include "calibration/report.h"

#include "files/write.h"

static bool save_json(const struct session_facts *facts, const char *path, struct error *err)
{
    struct whole_file file;
    if (!whole_file_begin(&file, path, err))
        return false;
    json_t *report = report_as_json(facts);
    bool written = report && !json_dumpf(report, file.stream, JSON_INDENT(1) | JSON_REAL_PRECISION(9));
    json_decref(report);
    if (!written) {
        whole_file_abandon(&file);
        return fail(err, ERROR_SYSTEM, "%s: cannot be written", path);
    }
    return whole_file_commit(&file, err);
}

static bool save_html(const struct session_facts *facts, const char *path, struct error *err)
{
    struct whole_file file;
    if (!whole_file_begin(&file, path, err))
        return false;
    if (!report_as_html(facts, file.stream, err)) {
        whole_file_abandon(&file);
        return false;
    }
    return whole_file_commit(&file, err);
}

bool report_save(const struct session_facts *facts, const char *folder, struct error *err)
{
    char path[1024];
    snprintf(path, sizeof path, "%s/report.json", folder);
    if (!save_json(facts, path, err))
        return false;
    snprintf(path, sizeof path, "%s/report.html", folder);
    return save_html(facts, path, err);
}
